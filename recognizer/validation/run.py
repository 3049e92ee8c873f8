"""One run: make the set, touch what is not touched yet. Resumable.

Folder of a run::

    asked.json               what decides the results, and where the set is (`record`)
    lab.db, parts/           the set, if it was made from specs
    sensor.yaml              the sensor type that it was made for, where it is not the usual one
    shards/, times/          a file for a thousand touches (`shards`)
    trials.parquet           all touches
    results.json             what the report says, the same on every run
    times.json               CPU times of this run
    report.html
    provenance.json          when, where and how long
"""

from __future__ import annotations

import fcntl
import os
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from recognizer.validation.campaign import Campaign, batches_of, series_of, shards_of
from recognizer.validation.encoded_set import LAB, PARTS, make_parts, set_digest
from recognizer.validation.errors import ValidationError
from recognizer.validation.files import write_text
from recognizer.validation.made_kinds import make_for_kinds, refuse_without_specs
from recognizer.validation.progress import TouchProgress
from recognizer.validation.record import (
    RECORD,
    RunRecord,
    absolute_database,
    check_same,
    read_record,
    relative_database,
    write_record,
)
from recognizer.validation.rows import CpuTime, Row
from recognizer.validation.shards import done_shards, write_shard
from recognizer.validation.touch_plan import sensor_of
from recognizer.validation.work import Workers, code_digest

SENSOR = "sensor.yaml"


def prepare_run(
    folder: Path, campaign: Campaign, specs: list[Path], database: str, *, resume: bool
) -> RunRecord:
    """Make the set if it is not there, and write the record of the run.

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
    before = read_record(folder) if (folder / RECORD).exists() else None
    if before is not None and not resume:
        raise ValidationError(
            "the folder holds a run already",
            fix="go on with it by --resume, or name another folder with -o",
            place=str(folder),
        )
    if before is not None:  # its set is there: it was made before the record was written
        name = relative_database(database, folder) if database else before.database
    else:
        name = relative_database(database or str(folder / LAB), folder)
        kinds = [kind for kind, _ in campaign.kinds]
        if specs:
            sensor = _sensor_file(campaign, folder)
            make_parts(specs, folder / PARTS, absolute_database(name, folder), sensor)
        elif database:
            refuse_without_specs(kinds)
        else:
            raise ValidationError("no set is named", fix="give SPEC.yaml files, or --database URL")
        make_for_kinds(folder, absolute_database(name, folder), kinds, campaign.seed)
    digest = set_digest(absolute_database(name, folder))
    names = tuple(map(str, specs)) if specs or before is None else before.specs
    record = RunRecord(campaign, name, digest, code_digest(), names)
    if before is None:
        write_record(record, folder)
    else:
        check_same(before, record, folder)
    return record


def _sensor_file(campaign: Campaign, folder: Path) -> str:
    """Write the type that touches where it is not the usual one; returns its file, or ""."""
    sensor = sensor_of(campaign.sensor_type, campaign.overlay)
    if sensor == SensorType():
        return ""
    write_text(folder / SENSOR, sensor_type_text(sensor))
    return str(folder / SENSOR)


def touch_all(record: RunRecord, folder: Path, workers: Workers, progress: TouchProgress) -> None:
    """Touch what is not touched yet, and write every shard as soon as it is whole."""
    work = record.work(folder)
    for series in series_of(record.campaign):
        done = done_shards(folder, series)
        left = [shard for shard in range(shards_of(series)) if shard not in done]
        shard_of = {batch: shard for shard in left for batch in batches_of(series, shard)}
        touches = sum(batch.last - batch.first for batch in shard_of)
        progress.begin(series.name, series.touches, series.touches - touches)
        missing = Counter(shard_of.values())
        rows: defaultdict[int, list[Row]] = defaultdict(list)
        times: defaultdict[int, list[CpuTime]] = defaultdict(list)
        for result in workers(work, list(shard_of)) if shard_of else ():
            shard = shard_of[result.batch]
            rows[shard] += result.rows
            times[shard] += result.times
            missing[shard] -= 1
            if not missing[shard]:
                write_shard(folder, series.name, shard, rows.pop(shard), times.pop(shard))
            progress.add(result.rows)


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Hold a folder against other runs while this one works in it.

    Raises
    ------
    ValidationError
        Another run works in it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(folder, os.O_RDONLY)
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
