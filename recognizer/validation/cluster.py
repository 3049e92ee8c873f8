"""Who does the work: the workers of a dask cluster, on any number of machines.

Workers must run the same code and see the same database (a shared folder, or PostgreSQL);
they say so if they do not. A worker that is lost loses only the pieces that it was at.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from recognizer.validation.campaign import Piece
from recognizer.validation.errors import WorkersError
from recognizer.validation.work import Touched, Work, touch

if TYPE_CHECKING:
    from distributed import Client

WAIT_S = 20.0  #: for the scheduler, and for its first worker


def on_cluster(address: str, work: Work, pieces: Iterable[Piece]) -> Iterator[Touched]:
    """Do pieces on the workers of a scheduler.

    Parameters
    ----------
    address
        Of the scheduler, `tcp://host:8786`.
    work, pieces
        What is to be done.

    Raises
    ------
    WorkersError
        There is no scheduler or no worker, or they see other code or another set.
    """
    client = connected(address)
    futures: list[Any] = []
    try:
        from distributed import as_completed

        futures += [client.submit(touch, work, piece, pure=False) for piece in pieces]
        for future in as_completed(futures, loop=client.loop):
            error = future.exception()
            if error is not None:
                raise _told(error) from error
            yield future.result()
            future.release()
    finally:
        client.cancel(futures)
        client.close()


def connected(address: str) -> Client:
    """Return a client of a scheduler that has a worker.

    Raises
    ------
    WorkersError
        The extra is not installed, or nobody answers.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise WorkersError(
            "a cluster needs dask", fix="pip install 'encoded-objects[cluster]'"
        ) from error
    fix = f"start one: dask scheduler, and dask worker {address} on every machine"
    try:
        client = Client(address, timeout=WAIT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise WorkersError("no scheduler answers", fix=fix, place=address) from error
    try:
        client.wait_for_workers(1, timeout=WAIT_S)
    except TimeoutError as error:
        client.close()
        raise WorkersError("the scheduler has no worker", fix=fix, place=address) from error
    return client


def _told(error: Any) -> Exception:
    """Return what a worker raised; what became of a piece that outlived its workers."""
    if type(error).__name__ == "KilledWorker":
        return WorkersError(
            "several workers were lost at the same piece",
            fix="see the workers' logs and memory, go on with --resume",
        )
    return error if isinstance(error, Exception) else WorkersError(str(error))
