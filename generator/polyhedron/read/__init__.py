"""Polyhedra from files: STL, OBJ and STEP; cylinders and cones are round faces, the rest is blank.

A mesh file holds triangles or polygons in mm; coplanar ones that hang together become one
face with its holes. A STEP file's own unit is honoured. One body per file.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.foreign import foreign_bytes
from generator.errors import ShapeError
from generator.polyhedron.read.mesh import solid_of_soup
from generator.polyhedron.read.obj import read_obj
from generator.polyhedron.read.soup import Soup
from generator.polyhedron.read.step import read_step
from generator.polyhedron.read.stl import read_stl
from generator.polyhedron.winged import Polyhedron

LARGEST_BYTES = 64 * 2**20  #: of a file: bounds the memory
LARGEST_MM = 1e4  #: of the solid, as of a length in a spec

MESHES: dict[str, Callable[[bytes, str], Soup]] = {".stl": read_stl, ".obj": read_obj}
STEP = (".step", ".stp")


def read_shape(path: str | Path, scale: float = 1.0) -> Polyhedron:
    """Read one solid from a file that ends in .stl (binary or ASCII), .obj, .step or .stp.

    `scale` in [1e-6, 1e6] makes the model larger about its origin; round faces are divided at that
    size. The solid is of kind `file`; its faces F1, F2, ... are in the order in which the file
    first shows them, coordinates mm. Cylinder and cone faces of STEP, and walls of a
    mesh that were divided from rim to rim, are runs of facets, its `surfaces`; other round faces
    are facets that stay `blank`.

    Raises `ShapeError` with file, place, cause and way out: no such file, too large, truncated, not
    closed, several bodies, a mesh of too many faces, larger than 10 m.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    place = str(path)
    if suffix not in (*MESHES, *STEP):
        known = ", ".join((*MESHES, *STEP))
        raise ShapeError(
            f"cannot read a shape from a '{suffix}' file" if suffix else "the file has no suffix",
            fix=f"save it as one of {known}",
            place=place,
        )
    try:
        content = file_content(file, place, LARGEST_BYTES)
        if suffix not in MESHES:
            solid = read_step(content, place, scale)
        else:
            solid = solid_of_soup(MESHES[suffix](content, place), "file", scale)
        check_size(solid.vertices, place)
        return solid
    except ShapeError as error:
        if error.place.startswith(place):
            raise
        where = f"{place}, {error.place}" if error.place else place
        raise ShapeError(error.cause, fix=error.fix, place=where) from None


def check_size(points: NDArray[np.float64], place: str) -> None:
    """Refuse points (n, 3), mm, that are farther from one another than a length in a spec."""
    largest = float(np.ptp(points, axis=0).max())
    if largest > LARGEST_MM:
        raise ShapeError(
            f"the model is {largest / 1000:.3g} m long; {LARGEST_MM / 1000:g} m are allowed",
            fix="check its unit: shape: {file: ..., scale: 0.001} makes it a thousandth",
            place=place,
        )


def file_content(file: Path, place: str, largest: int) -> bytes:
    """Return the bytes of a file, at least one and at most `largest`; `ShapeError` if it cannot."""
    content = foreign_bytes(
        file,
        lambda cause, **rest: ShapeError(cause, **rest | {"place": place}),
        most=largest,
        fix="give the path of a file that you can read",
        large="simplify the model: planar faces need few triangles",
    )
    if not content:
        raise ShapeError("the file is empty", fix="export the model again", place=place)
    return content
