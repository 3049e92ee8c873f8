"""Independent tasks in processes of their own, in order, with progress.

Processes start afresh (spawn), because the libraries for triangles and algebra have threads
that a forked copy would wait for. They end with the process that started them.
"""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed, wait
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from sqlalchemy import Engine

from generator.database.open import open_database
from generator.pipeline.progress import Progress

FEW = 16  # fewer tasks are done in this process, where nobody asked for others

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Task(Generic[Result]):
    """A call that another process can make: a function of a module and plain values."""

    what: str  #: for the progress
    work: Callable[..., Result]
    arguments: tuple[Any, ...]

    def done(self) -> Result:
        """Do it."""
        return self.work(*self.arguments)


ENGINES: dict[str, Engine] = {}  #: the databases that this process has opened, by URL


def engine_of(url: str) -> Engine:
    """Return an open database, opened the first time it is asked for."""
    if url not in ENGINES:
        ENGINES[url] = open_database(url)
    return ENGINES[url]


class Workers:
    """Processes for the tasks of one run, started when there is enough to do; a context.

    `jobs` None: one on each processor that we may use, if tasks are many.
    """

    def __init__(self, jobs: int | None) -> None:
        self._few = 2 if jobs else FEW
        self._jobs = jobs or len(os.sched_getaffinity(0))
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *_: object) -> None:
        while ENGINES:
            ENGINES.popitem()[1].dispose()
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)

    def done(self, tasks: Sequence[Task[Result]], progress: Progress) -> list[Result]:
        """Return the results of independent tasks in their order.

        Raises the error of the first task, in their order, that failed; later ones are left.
        """
        if self._jobs == 1 or len(tasks) < self._few:
            results = []
            for number, task in enumerate(tasks):
                progress(task.what, number / len(tasks))
                results.append(task.done())
            return results
        futures = [self._started().submit(task.done) for task in tasks]
        what = {future: task.what for future, task in zip(futures, tasks, strict=True)}
        for number, future in enumerate(as_completed(futures), 1):
            if future.exception() is not None:
                break
            progress(what[future], number / len(tasks))
        for future in futures:
            future.cancel()
        wait(futures)
        failed = [f for f in futures if not f.cancelled() and f.exception() is not None]
        return [future.result() for future in failed[:1] or futures]

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(
                self._jobs, mp_context=context, initializer=_end_with_parent
            )
        return self._pool


def _end_with_parent() -> None:
    """Leave when the process that started this one has gone, even by a signal."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_wait_for, args=(parent.sentinel,), daemon=True).start()


def _wait_for(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)
