"""Place and register in one transaction; whoever loses a race does it anew.

Writers take turns (`transaction.py`), so that the cells found free stay free until they are
registered. What is left to lose: a layout made before the turn came, a writer that takes no
turns, a deadlock on the server. The loser's work is undone and done again on the state that
the winner left::

    def placed_and_registered(connection: Connection) -> int:
        taken = occupancy(connection, array)
        return register(connection, ObjectRecord(..., layout=lay_out(..., taken)))

    number = in_turn(engine, placed_and_registered)
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from sqlalchemy import Connection, Engine

from generator.database.transaction import LostRaceError, write_transaction

Result = TypeVar("Result")

TRIES = 8
FIRST_PAUSE_S = 0.02  #: doubled after every lost race, shortened by chance to half at most


def in_turn(
    engine: Engine,
    work: Callable[[Connection], Result],
    *,
    tries: int = TRIES,
    rng: np.random.Generator | None = None,
) -> Result:
    """Return what `work` returns; its transaction is committed then.

    Parameters
    ----------
    work
        Called with the connection of a `write_transaction`; again after each lost race, so that
        it must read the database itself and leave nothing behind that is not undone.
    tries
        How often in all.
    rng
        Lengths of the pauses; left out, the process number is the seed, so that two losers
        do not meet again.

    Raises
    ------
    LostRaceError
        The last of `tries` races was lost, too.
    DatabaseError
        As `write_transaction`.
    """
    chance = np.random.default_rng(os.getpid()) if rng is None else rng
    for number in range(tries - 1):
        try:
            with write_transaction(engine) as connection:
                return work(connection)
        except LostRaceError:
            time.sleep(FIRST_PAUSE_S * 2**number * chance.uniform(0.5, 1.0))
    with write_transaction(engine) as connection:
        return work(connection)
