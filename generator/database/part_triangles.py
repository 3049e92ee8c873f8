"""A part's STL file -> its triangles, as they were written."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.read import file_content
from generator.polyhedron.read.settings import MODEL
from generator.polyhedron.read.stl import stl_triangles

LARGEST_BYTES = 84 + 50 * MODEL.most_part_triangles


def part_triangles(file: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Return the triangles of a written part.

    Parameters
    ----------
    file
        STL, binary or ASCII.

    Returns
    -------
    (n, 3, 3) corners, mm, frame of the part; exactly the numbers of the file.

    Raises
    ------
    ShapeError
        The file cannot be read, is no STL, is not as long as it says, holds NaN, no triangle,
        or too many.
    """
    place = str(file)
    content = file_content(Path(file), place, LARGEST_BYTES)
    corners = stl_triangles(content, place, most=MODEL.most_part_triangles, padded=False)
    if not len(corners):
        raise ShapeError("the file holds no triangle", fix="export the part again", place=place)
    return corners
