"""Who does the work: this process, several on this machine, or a dask cluster.

Work + Batch -> BatchResult: touch, read, compare, the same anywhere. A worker prepares its reader
once and keeps it; it refuses when it runs other code or sees another set (a shared folder, or
PostgreSQL). A pool that loses a process (out of memory, killed) is made again and given what is not
done; a lost worker of a cluster loses only its batches. Workers leave interrupts to the process
that started them, and end when it is gone. `concurrent.futures` gives up when a process is lost;
dask does not, and is an extra (`cluster`).
"""

from __future__ import annotations

import hashlib
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from multiprocessing import active_children, connection, get_context, parent_process
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from encoded_objects.base.errors import require
from encoded_objects.base.number import needed_number
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.campaign import Batch, Work, reader_with, series_of
from recognizer.validation.encoded_set import set_digest
from recognizer.validation.errors import ValidationError, WorkersError
from recognizer.validation.limits import limit_of
from recognizer.validation.trial import Row, trial

if TYPE_CHECKING:
    from distributed import Client

LOSSES = 3  #: pools in a row that break before they have done anything
CLUSTER_WAIT_S = 20.0  #: for the scheduler, and for its first worker
PACKAGES = ("generator", "decoder", "probe", "recognizer")  #: whose source makes the results

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class BatchResult:
    """A batch that is done."""

    batch: Batch
    rows: tuple[Row, ...]
    times: tuple[Row, ...]  #: of `files.TIME_COLUMNS`
    limits: tuple[Row, ...] = ()  #: of `limits.COLUMNS`, of series that show limits


#: Takes work and batches, yields finished batches in any order.
Workers = Callable[[Work, Iterable[Batch]], Iterator[BatchResult]]


def touch(work: Work, batch: Batch) -> BatchResult:
    """Return the rows of a batch's touches.

    Raises WorkersError: the code or the set is not that of the run.
    """
    series = next(s for s in series_of(work.campaign) if s.name == batch.series)
    reader = reader_with(prepare_reader(work), series.reader)
    rows, times, limits = [], [], []
    for number in range(batch.first, batch.last):
        plan = work.plan(series, number)
        start = time.process_time()
        found = trial(plan, number, reader)
        drawing = time.process_time() - start - found.seconds
        rows.append(found.row())
        times.append({"number": number, "drawing": round(drawing, 6),
                      "reading": round(found.seconds, 6)})  # fmt: skip
        if series.limits:
            limits.append(limit_of(plan, number, reader))
    return BatchResult(batch, tuple(rows), tuple(times), tuple(limits))


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
    return Reader(open_lab(work.database), work.campaign.sensor)


def reader_now(work: Work) -> Reader:
    """Return the reader by this version of the software, which need not be that of the touches."""
    return prepare_reader(replace(work, code_digest=code_digest()))


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


def workers_of(processes: int, cluster: str = "") -> Workers:
    """Return who does the work: a cluster, several processes, or this one.

    Raises ValidationError: a number of processes that is none.
    """
    if fix := needed_number(processes, whole=True, least=1):
        raise ValidationError(repr(processes), fix=fix, place="--jobs")
    if cluster:
        return partial(on_cluster, cluster)
    return in_this_process if processes == 1 else partial(in_processes, processes)


def in_this_process(work: Work, batches: Iterable[Batch]) -> Iterator[BatchResult]:
    """Do one batch after another."""
    for batch in batches:
        yield touch(work, batch)


def in_processes(processes: int, work: Work, batches: Iterable[Batch]) -> Iterator[BatchResult]:
    """Do batches in several processes at a time; `WorkersError` if they are lost repeatedly."""
    left = list(batches)
    lost = 0
    while left:
        before = len(left)
        try:
            for done in run_pool(processes, touch, [(work, batch) for batch in left]):
                left.remove(done.batch)
                yield done
        except BrokenProcessPool as error:
            lost = lost + 1 if len(left) == before else 1
            if lost > LOSSES:
                raise WorkersError(
                    f"processes are lost, {LOSSES + 1} times in a row",
                    fix="see whether the memory suffices, take a smaller -j, go on with --resume",
                ) from error


def run_pool(
    processes: int, function: Callable[..., Result], calls: Iterable[tuple[Any, ...]]
) -> Iterator[Result]:
    """Yield what calls of a function return, as they are done by several processes at a time.

    Raises BrokenProcessPool: a process was lost; also what a call raises.
    """
    # Started fresh rather than forked: no open database and no thread is taken over.
    pool = ProcessPoolExecutor(processes, get_context("spawn"), initializer=_prepare_worker)
    try:
        left = {pool.submit(function, *call) for call in calls}
        while left:  # an interrupt comes through within the timeout
            done, left = wait(left, timeout=1.0, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    except BaseException:
        for process in active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _prepare_worker() -> None:
    """Leave interrupts to the process that started this one, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


def on_cluster(address: str, work: Work, batches: Iterable[Batch]) -> Iterator[BatchResult]:
    """Do batches on the workers of a dask scheduler at `address`, `tcp://host:8786`.

    Raises WorkersError: there is no scheduler or no worker, or they see other code or another set;
    MissingExtraError: dask is not installed.
    """
    client = _connect(address)
    futures: list[Any] = []
    try:
        from distributed import as_completed

        futures += [client.submit(touch, work, batch, pure=False) for batch in batches]
        for future in as_completed(futures, loop=client.loop):
            error = future.exception()
            if error is not None:
                raise _failure(error) from error
            yield future.result()
            future.release()
    finally:
        client.cancel(futures)
        client.close()


def _connect(address: str) -> Client:
    """Return a client of a scheduler that has a worker."""
    require("distributed", extra="cluster", purpose="--cluster")
    from distributed import Client

    fix = f"start one: dask scheduler, and dask worker {address} on every machine"
    try:
        client = Client(address, timeout=CLUSTER_WAIT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkersError("no scheduler answers", fix=fix, place=address) from error
    try:
        client.wait_for_workers(1, timeout=CLUSTER_WAIT_S)
    except TimeoutError as error:
        client.close()
        raise WorkersError("the scheduler has no worker", fix=fix, place=address) from error
    return client


def _failure(error: Any) -> Exception:
    """Return the error of a worker, or of a batch that outlived its workers."""
    if type(error).__name__ == "KilledWorker":
        return WorkersError(
            "several workers were lost at the same touches",
            fix="see the workers' logs and memory, go on with --resume",
        )
    return error if isinstance(error, Exception) else WorkersError(str(error))
