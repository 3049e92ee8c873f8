"""Written files as what is touched: the STL of a part in the frame of its face.

Database + object + face -> Scene of the file that the database registers, checked by its
sha256. The part is touched alone, as it lies beside the others: beyond the edges of a panel
there is nothing. Thesis 6.3.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Engine

from generator.database.open import normal_url, open_database, part_path
from generator.database.read import read_object
from generator.database.registered import RegisteredObject, RegisteredPart
from generator.database.transaction import read_transaction
from probe.simulate.registered import scene_of_part
from probe.simulate.scene import Scene
from recognizer.validation.errors import SetError

Array = NDArray[np.float64]


def written_surface(database: str, object_name: str, face: str) -> Scene:
    """Return a face as it was written.

    Parameters
    ----------
    database
        `lab.db`, `sqlite:///lab.db` or `postgresql://host/name`.
    object_name, face
        As registered.

    Raises
    ------
    SetError
        The object has no STL part that bears the face, the file is not there, or its bytes
        are not those that were registered.
    DatabaseError
        The database cannot be read, or does not hold the object.
    """
    held = object_of_run(database, object_name)
    part = stl_part(held, face)
    path = part_path(normal_url(database), part.file)
    check_file(path, part)
    return scene_of_part(path, held, part, face)


@lru_cache(maxsize=64)
def object_of_run(database: str, object_name: str) -> RegisteredObject:
    """Return an object of a set, which stays as it is while it is touched (`set_digest`).

    Raises
    ------
    DatabaseError
        The database cannot be read, or does not hold it.
    """
    with read_transaction(_database_of_run(database)) as connection:
        return read_object(connection, object_name)


@lru_cache(maxsize=4)
def _database_of_run(database: str) -> Engine:
    """Return a database that stays open, so that each query is put into words once."""
    return open_database(database, writable=False)


def stl_part(held: RegisteredObject, face: str) -> RegisteredPart:
    """Return the STL part that bears a face: its panel, or the whole body.

    Raises
    ------
    SetError
        When there is none.
    """
    known = [part for part in held.parts if part.format == "stl"]
    for part in known:
        if part.name.endswith(f"-{face}"):
            return part
    if len(known) == 1:
        return known[0]
    raise SetError(
        f"'{held.entry.name}' has no STL part that bears {face}",
        fix="make it again with --format stl, or touch what the database says: --surfaces database",
        place=held.entry.name,
    )


def check_file(path: Path, part: RegisteredPart) -> None:
    """See to it that a file holds the bytes that were registered.

    Raises
    ------
    SetError
        When it is not there, or holds others.
    """
    fix = "make it again with encode-object"
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        cause = f"cannot read the part: {error.strerror}"
        raise SetError(cause, fix=fix, place=str(path)) from error
    if digest != part.sha256:
        cause = "the file is not the one that the database registers"
        raise SetError(cause, fix=fix, place=str(path))
