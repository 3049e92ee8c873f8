"""One run: make the set, touch what is not touched yet. Resumable.

Folder of a run::

    asked.json               what decides the results, and where the set is (`write_record`)
    lab.db, parts/           the set, if it was made from specs
    sensor.yaml              the sensor type that it was made for, where it is not the usual one
    shards/, times/, limits/ a file for a thousand touches (`files`)
    trials.parquet           all touches
    results.json             what the report says, the same on every run
    times.json               CPU times of this run
    report.html
    provenance.json          when, where and how long
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

from encoded_objects.base.errors import exit_code_of_write, without_password
from encoded_objects.base.output import ProgressBar
from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from generator.database.open import normal_url
from recognizer.validation.campaign import PRINTED, Campaign, Work, campaign_from, series_of
from recognizer.validation.encoded_set import (
    LAB,
    PARTS,
    labs_of,
    make_for_kinds,
    make_parts,
    refuse_without_specs,
    set_digest,
)
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import done_shards, write_json, write_shard, write_text
from recognizer.validation.trial import REJECTED, RIGHT, WRONG, Row
from recognizer.validation.workers import Workers, code_digest

RECORD, SENSOR = "asked.json", "sensor.yaml"
PRINTS = "printed.json"  #: which surface of the folder of prints is which face
FORMAT = 2  #: of the record; another one is refused


def read_record(folder: Path) -> Work:
    """Return the work of a folder's run.

    Raises ValidationError: the folder holds no run, or one of another version.
    """
    path = folder / RECORD
    try:
        values = json.loads(path.read_text("utf-8"))
        if values["format"] != FORMAT:
            raise ValidationError(
                f"a run of format {values['format']}, this version reads {FORMAT}",
                fix="start anew in another folder",
                place=str(path),
            )
        campaign = campaign_from(values["campaign"])
        specs = tuple(values["specs"])
        return _work(folder, campaign, values["database"], values["set"], values["code"], specs)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValidationError(
            "no run of validate-set", fix="name the folder that -o named", place=str(folder)
        ) from error


def _work(
    folder: Path, campaign: Campaign, database: str, set_digest: str, code: str,
    specs: tuple[str, ...],
) -> Work:  # fmt: skip
    """Return the work of a run; `database` is a SQLite file from its folder, or a URL."""
    if "://" not in database:
        database = os.path.normpath(folder.absolute() / database)
    labs = labs_of(folder, campaign.kind_names)
    prints = str(folder.absolute() / PRINTS) if campaign.surfaces == PRINTED else ""
    return Work(campaign, database, set_digest, code, labs, prints, specs)


def write_record(work: Work, folder: Path) -> None:
    """Write the record of a run."""
    values = {
        "format": FORMAT,
        "campaign": work.campaign.as_json(),
        "database": relative_database(work.database, folder),
        "set": work.set_digest,
        "code": work.code_digest,
        "specs": list(work.specs),
    }
    write_json(folder / RECORD, values)


def _check_same(before: Work, now: Work, folder: Path) -> None:
    """Raise `ValidationError` if options, specs, the set or this software have changed."""
    old, new = before.campaign.as_json(), now.campaign.as_json()
    differ = [f"{name} {old[name]}, now {new[name]}" for name in new if old[name] != new[name]]
    if before.specs != now.specs:
        differ.append(f"specs {', '.join(before.specs)}, now {', '.join(now.specs)}")
    if before.set_digest != now.set_digest:
        differ.append("another set")
    if before.code_digest != now.code_digest:
        differ.append("another version of this software")
    if differ:
        raise ValidationError(
            f"the run began otherwise: {'; '.join(differ)}",
            fix="give the same options, or start anew in another folder with -o",
            place=str(folder),
        )


def relative_database(database: str, folder: Path) -> str:
    """Return how a record names a database: a file from the folder, a server without password."""
    url = normal_url(database)
    if url.get_backend_name() != "sqlite" or url.database is None:
        return without_password(database, "")
    return Path(os.path.relpath(Path(url.database).absolute(), folder.absolute())).as_posix()


class TouchProgress:
    """Moves a bar by touches; without a bar it counts in silence."""

    def __init__(self, bar: ProgressBar | None = None) -> None:
        self._bar = bar or ProgressBar(None, None)
        self.begin("", 0, 0)

    def begin(self, stage: str, touches: int, done: int) -> None:
        """Begin a stage; touches done before count for the bar, not for the rate."""
        self._touches, self._before, self._new = touches, done, 0
        self._counts = dict.fromkeys((RIGHT, WRONG, REJECTED), 0)
        self._start = time.monotonic()
        self._bar.begin(stage, touches or None, done)

    def step(self, what: str) -> None:
        """Count one more thing that is done in a stage without touches."""
        self._new += 1
        done, _, left = self._state()
        self._bar.show(done, f"{done:,}/{self._touches:,} {what}, {left} left")

    def add(self, rows: Iterable[Row]) -> None:
        """Count some more touches."""
        for row in rows:
            self._counts[row["verdict"]] += 1
            self._new += 1
        done, rate, left = self._state()
        counts = ", ".join(f"{number:,} {name}" for name, number in self._counts.items())
        text = f"{done:,}/{self._touches:,}  {rate:.1f} touches/s, {left} left; {counts}"
        self._bar.show(done, text)

    def _state(self) -> tuple[int, float, timedelta]:
        """Return how many are done, the rate per second, and the time left."""
        done = self._before + self._new
        rate = self._new / max(time.monotonic() - self._start, 1e-3)
        return done, rate, timedelta(seconds=round((self._touches - done) / max(rate, 1e-9)))


def prepare_run(
    folder: Path, campaign: Campaign, specs: list[Path], database: str, *, resume: bool
) -> Work:
    """Make the set if it is not there, and write the record of the run.

    Without specs the set is what the database holds; an empty `database` is one in the folder.

    Raises ValidationError: the folder holds another run, or one that is not to be resumed;
    SetError: the set cannot be made or read.
    """
    before = read_record(folder) if (folder / RECORD).exists() else None
    if before is not None and not resume:
        raise ValidationError(
            "the folder holds a run already",
            fix="go on with it by --resume, or name another folder with -o",
            place=str(folder),
        )
    known = before.database if before else str(folder / LAB)
    name = database or known
    if normal_url(name).get_backend_name() == "sqlite":
        name = relative_database(name, folder)
    names = tuple(map(str, specs)) if specs or before is None else before.specs
    work = _work(folder, campaign, name, "", code_digest(), names)
    if before is None:  # else its set is there: it was made before the record was written
        if specs:
            make_parts(specs, folder / PARTS, work.database, _sensor_file(campaign, folder))
        elif database:
            refuse_without_specs(campaign.kind_names)
        else:
            raise ValidationError("no set is named", fix="give SPEC.yaml files, or --database URL")
        make_for_kinds(folder, work.database, campaign.kind_names, campaign.seed)
    work = replace(work, set_digest=set_digest(work.database))
    if before is None:
        write_record(work, folder)
    else:
        _check_same(before, work, folder)
    return work


def _sensor_file(campaign: Campaign, folder: Path) -> str:
    """Write the type that touches where it is not the usual one; returns its file, or ""."""
    if campaign.sensor == SensorType():
        return ""
    write_text(folder / SENSOR, sensor_type_text(campaign.sensor))
    return str(folder / SENSOR)


def touch_all(work: Work, folder: Path, workers: Workers, progress: TouchProgress) -> None:
    """Touch what is not touched yet, and write every shard as soon as it is whole."""
    for series in series_of(work.campaign):
        left = set(range(series.shards)) - done_shards(folder, series)
        shard_of = {batch: shard for shard in sorted(left) for batch in series.batches(shard)}
        touches = sum(batch.last - batch.first for batch in shard_of)
        progress.begin(series.name, series.touches, series.touches - touches)
        missing = Counter(shard_of.values())
        rows: defaultdict[int, list[Row]] = defaultdict(list)
        times: defaultdict[int, list[Row]] = defaultdict(list)
        limits: defaultdict[int, list[Row]] = defaultdict(list)
        for result in workers(work, list(shard_of)) if shard_of else ():
            shard = shard_of[result.batch]
            rows[shard] += result.rows
            times[shard] += result.times
            limits[shard] += result.limits
            missing[shard] -= 1
            if not missing[shard]:
                found = (each.pop(shard) for each in (rows, times, limits))
                write_shard(folder, series.name, shard, *found)
            progress.add(result.rows)


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Hold a folder against other runs.

    Raises `ValidationError` if one works in it, or if it cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise ValidationError(
            f"the folder cannot be made or written: {error.strerror}",
            fix="name another folder with -o",
            place=str(folder),
            exit_code=exit_code_of_write(error),
        ) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ValidationError(
                "another run works in this folder",
                fix="wait for it, or name another folder with -o",
                place=str(folder),
            ) from error
        yield
    finally:
        os.close(descriptor)
