"""Who does the work: this process, or several on this machine.

A pool that loses a process (out of memory, killed) is made anew and given what is not done,
at most `SharingSettings.losses` times without a batch done between. Workers leave interrupts to the
process that started them, and end when it is gone. `concurrent.futures` gives up when a
process is lost, and dask, which does not, is an extra (`cluster`).
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import active_children, connection, get_context, parent_process
from typing import Any, TypeVar

from recognizer.validation.campaign import Batch
from recognizer.validation.errors import WorkersError
from recognizer.validation.settings import SHARING
from recognizer.validation.work import BatchResult, Work, Workers, touch

Result = TypeVar("Result")


def workers_of(processes: int, cluster: str = "") -> Workers:
    """Return who does the work: a cluster, several processes, or this one."""
    if cluster:
        from recognizer.validation.cluster import on_cluster

        return partial(on_cluster, cluster)
    return in_this_process if processes == 1 else partial(in_processes, processes)


def in_this_process(work: Work, batches: Iterable[Batch]) -> Iterator[BatchResult]:
    """Do one batch after another."""
    for batch in batches:
        yield touch(work, batch)


def in_processes(processes: int, work: Work, batches: Iterable[Batch]) -> Iterator[BatchResult]:
    """Do batches in several processes at a time.

    Raises
    ------
    WorkersError
        Processes were lost again and again.
    """
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
            if lost > SHARING.losses:
                raise WorkersError(
                    f"processes are lost, {SHARING.losses + 1} times in a row",
                    fix="see whether the memory suffices, take a smaller -j, go on with --resume",
                ) from error


def run_pool(
    processes: int, function: Callable[..., Result], calls: Iterable[tuple[Any, ...]]
) -> Iterator[Result]:
    """Yield what calls of a function return, as they are done by several processes at a time.

    Raises
    ------
    BrokenProcessPool
        A process was lost; also what a call raises.
    """
    # Begun anew rather than forked: no open database and no thread is taken over.
    pool = ProcessPoolExecutor(processes, get_context("spawn"), initializer=_prepare_worker)
    try:
        waiting = [pool.submit(function, *call) for call in calls]
        yield from _as_done(waiting)
    except BaseException:
        for process in active_children():
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _as_done(waiting: list[Future[Result]]) -> Iterator[Result]:
    """Yield what is done, as it is done; an interrupt comes through at once."""
    left = set(waiting)
    while left:
        done, left = wait(left, timeout=1.0, return_when=FIRST_COMPLETED)
        for future in done:
            yield future.result()


def _prepare_worker() -> None:
    """Prepare a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = parent_process()
    if parent is not None:
        end: Callable[[], None] = partial(_end_with, parent.sentinel)
        threading.Thread(target=end, daemon=True).start()


def _end_with(sentinel: int) -> None:
    """Leave as soon as the process that started this one is gone."""
    connection.wait([sentinel])
    os._exit(1)
