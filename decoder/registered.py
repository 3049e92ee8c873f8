"""What a lab's database adds to decoding: its array, where windows can lie, and whose they are.

URL -> array and registered cells; window -> the places where all its seen cells are registered
(the prior of `likelihood`); place -> object and face. This is the one module of `decoder`
that reads the database; only `decode-window --database` loads it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from decoder.errors import DecoderError
from generator.array import FoldedArray, ProductArray, array_from
from generator.array.contract import Labels
from generator.database.cells import faces_at, occupied_cells
from generator.database.entries import list_objects
from generator.database.open import open_database
from generator.database.read import read_array, read_object
from generator.database.transaction import read_transaction


@dataclass(frozen=True, slots=True)
class Registered:
    """An array and the cells of it that objects hold."""

    url: str
    array_id: int
    array: FoldedArray | ProductArray
    cells: NDArray[np.int64]  #: (n, 2) rows and columns, all different


def read_registered(url: str, profile: str = "") -> Registered:
    """Return the array of a database and its registered cells.

    Parameters
    ----------
    url
        `lab.db`, `sqlite:///lab.db` or `postgresql://host/name`.
    profile
        Which array, by the profile it was asked for, where the database holds several.

    Raises
    ------
    DatabaseError
        The database cannot be read.
    DecoderError
        It holds no such array, or several and none is named.
    """
    with read_transaction(open_database(url, writable=False)) as connection:
        arrays = {entry.array_id: entry.profile for entry in list_objects(connection)}
        named = [number for number, name in arrays.items() if profile in ("", name)]
        if len(named) != 1:
            kept = ", ".join(sorted(set(arrays.values()))) or "none"
            asked = f"no array of profile '{profile}'" if profile else f"{len(named)} arrays"
            raise DecoderError(
                f"the database holds {asked}; it holds: {kept}",
                fix="name one of them with --profile" if arrays else "register an object first",
                place=url,
            )
        array = array_from(read_array(connection, named[0]).definition)
        return Registered(
            url, named[0], array, np.stack(occupied_cells(connection, named[0]), axis=1)
        )


def prior(held: Registered, window: Labels) -> NDArray[np.int64]:
    """Return the places (n, 2) of a window's corner at which all its seen cells are registered.

    Parameters
    ----------
    window
        (rows, columns) labels, -1 where none is seen.
    """
    rows, columns = np.nonzero(window >= 0)
    if len(rows) == 0:
        return held.cells
    size = np.array([held.array.rows, held.array.columns])
    taken = set(map(tuple, held.cells.tolist()))
    corners: NDArray[np.int64] = (held.cells - np.array([rows[0], columns[0]])) % size
    for step in np.stack([rows, columns], axis=1)[1:]:
        cells = map(tuple, ((corners + step) % size).tolist())
        corners = corners[[cell in taken for cell in cells]]
    return corners


def holder(held: Registered, row: int, column: int) -> tuple[str, str] | None:
    """Return the names of object and face that hold a cell; None where nothing is registered."""
    with read_transaction(open_database(held.url, writable=False)) as connection:
        objects, faces = faces_at(connection, held.array_id, [row], [column])
        for entry in list_objects(connection):
            if entry.object_id == objects[0]:
                return entry.name, read_object(connection, entry.name).faces[int(faces[0])].name
    return None
