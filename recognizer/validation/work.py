"""What a worker does with a batch: touch, read, compare. The same anywhere.

Work + Batch -> BatchResult. A worker prepares its reader once and keeps it; it refuses when it
runs other code or sees another set than the one that asked.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.campaign import Batch, Campaign, plan_of, reader_with, series_of
from recognizer.validation.encoded_set import set_digest
from recognizer.validation.errors import WorkersError
from recognizer.validation.rows import CpuTime, Row, row_of, symbols_in_view
from recognizer.validation.touch_plan import sensor_of
from recognizer.validation.trial import trial

PACKAGES = ("generator", "decoder", "probe", "recognizer")


@dataclass(frozen=True, slots=True)
class Work:
    """What all batches share."""

    campaign: Campaign
    database: str  #: as the workers find it
    set_digest: str
    code_digest: str
    labs: tuple[str, ...] = ()  #: databases of other labs, as the workers find them
    prints: str = ""  #: listing of the printed surfaces, as the workers find it; empty: none


@dataclass(frozen=True, slots=True)
class BatchResult:
    """A batch that is done."""

    batch: Batch
    rows: tuple[Row, ...]
    times: tuple[CpuTime, ...]


#: Takes work and batches, yields what is done in any order. `workers`, `cluster`.
Workers = Callable[[Work, Iterable[Batch]], Iterator[BatchResult]]


def touch(work: Work, batch: Batch) -> BatchResult:
    """Return what became of the touches of a batch.

    Raises
    ------
    WorkersError
        The code or the set is not the one that was asked for.
    """
    reader = prepare_reader(work)
    series = next(s for s in series_of(work.campaign) if s.name == batch.series)
    reading = reader_with(reader, series.reader)
    rows, times = [], []
    for number in range(batch.first, batch.last):
        kind, plan = plan_of(work.campaign, series, work.database, number, work.labs, work.prints)
        start = time.process_time()
        found = trial(plan, number, reading)
        spent = time.process_time() - start
        seen = symbols_in_view(reader.lab, reader.sensor, found)
        rows.append(row_of(found, kind, seen))
        times.append(CpuTime(number, round(spent - found.seconds, 6), round(found.seconds, 6)))
    return BatchResult(batch, tuple(rows), tuple(times))


@lru_cache(maxsize=1)
def prepare_reader(work: Work) -> Reader:
    """Return the reader of a campaign; checks that it is of the same code and set."""
    if work.code_digest != code_digest():
        raise WorkersError(
            "a worker runs another version of this software",
            fix="install the same version on all machines",
        )
    if work.set_digest != set_digest(work.database):
        raise WorkersError(
            f"a worker sees another set under {work.database}",
            fix="let all machines share the folder, or give a PostgreSQL database",
        )
    return Reader(
        open_lab(work.database), sensor_of(work.campaign.sensor_type, work.campaign.overlay)
    )


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Return the sha256 of the source of all packages."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for package in PACKAGES:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode() + b"\0")
            digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()
