"""What a lab's database adds to decoding: its array, where windows can lie, and whose they are.

URL -> array and registered cells; window -> the places where all its seen cells are registered
(the prior of `likelihood`); place -> object and face. This is the one module of `decoder`
that reads the database; only `decode-window --database` loads it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from decoder.errors import DecoderError
from generator.array import FoldedArray, ProductArray
from generator.array.contract import Labels
from generator.array.lab_key import read_lab_key
from generator.database.cells import faces_at, occupied_cells
from generator.database.lab import lab_key as stored_lab_key
from generator.database.open import open_database
from generator.database.read import list_objects, make_array, read_array, read_object
from generator.database.registered import RegisteredArray
from generator.database.transaction import read_transaction


@dataclass(frozen=True, slots=True)
class Registered:
    """An array and the cells of it that objects hold."""

    url: str
    array_id: int
    array: FoldedArray | ProductArray
    cells: NDArray[np.int64]  #: (n, 2) rows and columns, all different


def read_registered(url: str, profile: str = "", lab_key: str = "") -> Registered:
    """Return the array of a database and its registered cells.

    `profile` says which array where the database holds several, `lab_key` whose; the database's own
    by default. Raises `DatabaseError` if it cannot be read, `DecoderError` if it holds no such
    array, or several and none is named.
    """
    with read_transaction(open_database(url, writable=False)) as connection:
        numbers = sorted({entry.array_id for entry in list_objects(connection)})
        arrays = [read_array(connection, number) for number in numbers]
        key = read_lab_key(lab_key) if lab_key else stored_lab_key(connection)
        named = [one for one in arrays if profile in ("", one.profile)]
        if lab_key or len(named) > 1:
            named = [one for one in named if one.lab_key in ("", key)]
        if len(named) != 1:
            raise _no_array(url, arrays, profile, lab_key, len(named))
        number = named[0].array_id
        array = make_array(connection, number)
        return Registered(url, number, array, np.stack(occupied_cells(connection, number), axis=1))


def _no_array(
    url: str, arrays: Sequence[RegisteredArray], profile: str, lab_key: str, number: int
) -> DecoderError:
    names = {f"{one.profile} (lab {one.lab_key})" if one.lab_key else one.profile for one in arrays}
    asked = f"no array of profile '{profile}'" if profile else f"{number} arrays"
    return DecoderError(
        f"the database holds {asked}{f' of lab {lab_key}' if lab_key else ''}; it holds: "
        f"{', '.join(sorted(names)) or 'none'}",
        fix="name one of them with --profile and --lab-key"
        if arrays
        else "register an object first",
        place=url,
    )


def prior(held: Registered, window: Labels) -> NDArray[np.int64]:
    """Return the places (n, 2) of a window's corner at which all its seen cells are registered."""
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
