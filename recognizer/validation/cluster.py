"""Who does the work: the workers of a dask cluster, on any number of machines.

Workers must run the same code and see the same database (a shared folder, or PostgreSQL);
they say so if they do not. A worker that is lost loses only the batches that it was at.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from encoded_objects.base.errors import require
from recognizer.validation.campaign import Batch
from recognizer.validation.errors import WorkersError
from recognizer.validation.settings import SHARING
from recognizer.validation.work import BatchResult, Work, touch

if TYPE_CHECKING:
    from distributed import Client


def on_cluster(address: str, work: Work, batches: Iterable[Batch]) -> Iterator[BatchResult]:
    """Do batches on the workers of a scheduler.

    Parameters
    ----------
    address
        Of the scheduler, `tcp://host:8786`.
    work, batches
        What is to be done.

    Raises
    ------
    WorkersError
        There is no scheduler or no worker, or they see other code or another set.
    """
    client = connect(address)
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


def connect(address: str) -> Client:
    """Return a client of a scheduler that has a worker.

    Raises
    ------
    WorkersError
        Nobody answers.
    MissingExtraError
        dask is not installed.
    """
    require("distributed", extra="cluster", purpose="--cluster")
    from distributed import Client

    fix = f"start one: dask scheduler, and dask worker {address} on every machine"
    try:
        client = Client(address, timeout=SHARING.cluster_wait_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkersError("no scheduler answers", fix=fix, place=address) from error
    try:
        client.wait_for_workers(1, timeout=SHARING.cluster_wait_s)
    except TimeoutError as error:
        client.close()
        raise WorkersError("the scheduler has no worker", fix=fix, place=address) from error
    return client


def _failure(error: Any) -> Exception:
    """Return what a worker raised; what became of a batch that outlived its workers."""
    if type(error).__name__ == "KilledWorker":
        return WorkersError(
            "several workers were lost at the same touches",
            fix="see the workers' logs and memory, go on with --resume",
        )
    return error if isinstance(error, Exception) else WorkersError(str(error))
