"""One run: make the set, touch what is not touched yet, write the report. Resumable.

Folder of a run::

    asked.json               what decides the results, and where the set is
    lab.db, parts/           the set, if it was made from specs
    shards/, times/          a file for a thousand touches, `shards`
    trials.parquet           all touches
    results.json             what the report says, the same on every run
    times.json               CPU times of this run
    report.html
    provenance.json          when, where and how long
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from generator.database.url import normal_url
from recognizer.validation.campaign import (
    Campaign,
    Piece,
    Series,
    pieces_of,
    series_of,
    shards_of,
)
from recognizer.validation.errors import ValidationError
from recognizer.validation.made import LAB, PARTS, make_parts, set_digest
from recognizer.validation.progress import TouchProgress
from recognizer.validation.rows import Row, Time
from recognizer.validation.shards import done_shards, write_shard
from recognizer.validation.work import Touched, Work, Workers, code_digest

ASKED = "asked.json"
FORMAT = 1


@dataclass(frozen=True, slots=True)
class Asked:
    """A run as its folder remembers it."""

    campaign: Campaign
    database: str  #: a SQLite file from the folder of the run, or a URL
    set_digest: str
    code_digest: str
    specs: tuple[str, ...] = ()  #: as they were named

    def work(self, folder: Path) -> Work:
        """Return what the workers get."""
        return Work(
            self.campaign, located(self.database, folder), self.set_digest, self.code_digest
        )

    def work_now(self, folder: Path) -> Work:
        """Return the same for this version, which may be another than that of the touches."""
        return replace(self.work(folder), code_digest=code_digest())


def prepare(
    folder: Path, campaign: Campaign, specs: list[Path], database: str, *, resume: bool
) -> Asked:
    """Make the set if it is not there, and remember what was asked.

    Parameters
    ----------
    folder
        Of the run.
    campaign
        What decides the results.
    specs
        What is made; none: what the database holds.
    database
        Where it is registered; empty: in the folder.
    resume
        Go on with a run that the folder holds.

    Raises
    ------
    ValidationError
        The folder holds another run, or one that is not to be resumed.
    SetError
        The set cannot be made or read.
    """
    known = read_asked(folder) if (folder / ASKED).exists() else None
    if known is not None and not resume:
        raise ValidationError(
            "the folder holds a run already",
            fix="go on with it by --resume, or name another folder with -o",
            place=str(folder),
        )
    if known is not None:  # its set is there: it was made before anything was remembered
        named = remembered(database, folder) if database else known.database
    else:
        named = remembered(database or str(folder / LAB), folder)
        if specs:
            make_parts(specs, folder / PARTS, located(named, folder))
        elif not database:
            raise ValidationError("no set is named", fix="give SPEC.yaml files, or --database URL")
    digest = set_digest(located(named, folder))
    names = tuple(map(str, specs)) if specs or known is None else known.specs
    asked = Asked(campaign, named, digest, code_digest(), names)
    if known is None:
        _remember(asked, folder)
    else:
        _check_same(known, asked, folder)
    return asked


def touch_all(asked: Asked, folder: Path, workers: Workers, progress: TouchProgress) -> None:
    """Touch what is not touched yet, and write every shard as soon as it is whole."""
    for series in series_of(asked.campaign):
        there = done_shards(folder, series)
        left = [shard for shard in range(shards_of(series)) if shard not in there]
        pieces = {shard: list(pieces_of(series, shard)) for shard in left}
        touches = sum(piece.last - piece.first for each in pieces.values() for piece in each)
        progress.begin(series.name, series.touches, series.touches - touches)
        waiting = [piece for each in pieces.values() for piece in each]
        if waiting:
            _gather(workers, asked.work(folder), folder, series, pieces, waiting, progress)


def _gather(
    workers: Workers,
    work: Work,
    folder: Path,
    series: Series,
    pieces: dict[int, list[Piece]],
    waiting: list[Piece],
    progress: TouchProgress,
) -> None:
    shard_at = {piece: shard for shard, each in pieces.items() for piece in each}
    rows: dict[int, list[Row]] = {shard: [] for shard in pieces}
    times: dict[int, list[Time]] = {shard: [] for shard in pieces}
    open_pieces = {shard: len(each) for shard, each in pieces.items()}
    done: Touched
    for done in workers(work, waiting):
        shard = shard_at[done.piece]
        rows[shard] += done.rows
        times[shard] += done.times
        open_pieces[shard] -= 1
        if open_pieces[shard] == 0:
            write_shard(folder, series.name, shard, rows.pop(shard), times.pop(shard))
        progress.add(done.rows)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Hold a folder against other runs while this one works in it.

    Raises
    ------
    ValidationError
        Another run works in it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(descriptor)
        raise ValidationError(
            "another run works in this folder",
            fix="wait for it, or name another folder with -o",
            place=str(folder),
        ) from error
    try:
        yield
    finally:
        os.close(descriptor)


def read_asked(folder: Path) -> Asked:
    """Return what a folder's run was asked.

    Raises
    ------
    ValidationError
        The folder holds no run, or one of another version.
    """
    path = folder / ASKED
    try:
        values = json.loads(path.read_text("utf-8"))
        if values["format"] != FORMAT:
            raise ValidationError(
                f"a run of format {values['format']}, this version reads {FORMAT}",
                fix="start anew in another folder",
                place=str(path),
            )
        given = values["campaign"]
        for name in ("kinds", "levels"):
            given[name] = tuple((key, float(share)) for key, share in given[name])
        return Asked(
            campaign=Campaign(**given),
            database=values["database"],
            set_digest=values["set"],
            code_digest=values["code"],
            specs=tuple(values["specs"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValidationError(
            "no run of validate-set", fix="name the folder that -o named", place=str(folder)
        ) from error


def located(database: str, folder: Path) -> str:
    """Return where a remembered database is."""
    if "://" in database:
        return database
    return str(Path(os.path.normpath(folder.absolute() / database)))


def remembered(database: str, folder: Path) -> str:
    """Return how a folder names a database: a SQLite file from the folder, a server by its URL."""
    url = normal_url(database)
    if url.get_backend_name() != "sqlite" or url.database is None:
        return database
    return Path(os.path.relpath(Path(url.database).absolute(), folder.absolute())).as_posix()


def write_json(path: Path, values: Any) -> None:
    """Write values as JSON, whole or not at all."""
    write_text(path, json.dumps(values, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all."""
    undone = path.with_name(path.name + ".writing")
    undone.write_text(text, "utf-8")
    os.replace(undone, path)


def _remember(asked: Asked, folder: Path) -> None:
    values = {
        "format": FORMAT,
        "campaign": asdict(asked.campaign),
        "database": asked.database,
        "set": asked.set_digest,
        "code": asked.code_digest,
        "specs": list(asked.specs),
    }
    write_json(folder / ASKED, values)


def _check_same(known: Asked, asked: Asked, folder: Path) -> None:
    """See to it that a run goes on as it began."""
    before, now = asdict(known.campaign), asdict(asked.campaign)
    differ = [
        f"{name} {before[name]}, now {now[name]}" for name in now if before[name] != now[name]
    ]
    if known.specs != asked.specs:
        differ.append(f"specs {', '.join(known.specs)}, now {', '.join(asked.specs)}")
    if known.set_digest != asked.set_digest:
        differ.append("another set")
    if known.code_digest != asked.code_digest:
        differ.append("another version of this software")
    if differ:
        raise ValidationError(
            f"the run began otherwise: {'; '.join(differ)}",
            fix="give the same options, or start anew in another folder with -o",
            place=str(folder),
        )
