"""A written part's file -> its triangles, and the surface that they are."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.errors import EncodedObjectsError
from generator.database.part_file import part_triangles
from probe.errors import SurfaceError
from probe.surface.mesh import MeshSurface, mesh


def written_triangles(file: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Return the corners (n, 3, 3) of a part's triangles, mm, frame of the part.

    Raises
    ------
    SurfaceError
        The file cannot be read, is no STL, is cut short, too large, empty, or holds NaN.
    """
    try:
        return part_triangles(file)
    except EncodedObjectsError as error:
        raise SurfaceError(error.cause, fix=error.fix, place=error.place) from error


def part_mesh(file: str | os.PathLike[str], T_surface_part: ArrayLike | None = None) -> MeshSurface:
    """Return the height field of a written part.

    Parameters
    ----------
    file
        STL.
    T_surface_part
        (4, 4) from the part's frame to the surface frame, whose z axis points at the
        sensor; without it, the part as it lies in the file.

    Raises
    ------
    SurfaceError
        When the file is no STL or nothing of it can be seen along -z.
    """
    return mesh(written_triangles(file), T_surface_part, place=str(file))
