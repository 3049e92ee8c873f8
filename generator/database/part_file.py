"""Whether the files that the database names are there, and still what was written."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.foreign import open_regular
from generator.errors import ShapeError
from generator.polyhedron.read import check_size, file_content
from generator.polyhedron.read.stl import MOST_PART_TRIANGLES, stl_triangles

if TYPE_CHECKING:
    from sqlalchemy import URL

    from generator.database.registered import RegisteredPart


@dataclass(frozen=True, slots=True)
class PartState:
    """A part's file, as it is now."""

    part: RegisteredPart
    path: Path
    state: str  #: ok, missing, changed, or unreadable


def part_state(url: URL, part: RegisteredPart) -> PartState:
    """Compare a part's file with the SHA-256 under which it is registered."""
    from generator.database.open import part_path  # a part alone needs no database library

    path = part_path(url, part.file)
    try:
        with open_regular(path) as file:
            same = hashlib.file_digest(file, "sha256").hexdigest() == part.sha256
        state = "ok" if same else "changed"
    except (FileNotFoundError, NotADirectoryError):
        state = "missing"
    except OSError:
        state = "unreadable"
    return PartState(part, path, state)


LARGEST_BYTES = 84 + 50 * MOST_PART_TRIANGLES


def part_triangles(file: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Return the triangles (n, 3, 3) of a written part (STL), mm, frame of the part; exact.

    Raises
    ------
    ShapeError
        The file cannot be read, is no STL, is not as long as it says, holds NaN, no triangle,
        or too many, or is larger than 10 m.
    """
    place = str(file)
    content = file_content(Path(file), place, LARGEST_BYTES)
    corners = stl_triangles(content, place, most=MOST_PART_TRIANGLES, padded=False)
    if not len(corners):
        raise ShapeError("the file holds no triangle", fix="export the part again", place=place)
    check_size(corners.reshape(-1, 3), place)
    return corners
