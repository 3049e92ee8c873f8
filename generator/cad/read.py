"""A solid of build123d, cadquery or trimesh -> polyhedron, mm.

The first two go through the kernel that holds them; of a mesh, coplanar triangles that hang
together become one face and curved regions stay blank, as in an STL file.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from generator.errors import ShapeError
from generator.polyhedron import Polyhedron
from generator.polyhedron.read.kernel import describe_shape
from generator.polyhedron.read.mesh import solid_of_soup
from generator.polyhedron.read.soup import soup_of_triangles
from generator.polyhedron.read.step import polyhedron_of

PLACE = "the solid"


def polyhedron_from(solid: Any) -> Polyhedron:
    """Return the polyhedron of a solid.

    A `build123d` part or solid, a `cadquery` workplane, shape or assembly's shape, a kernel shape,
    or a `trimesh.Trimesh`.

    Raises
    ------
    ShapeError
        It holds no solid or several, or the solid has faces that cannot be read.
    """
    triangles = getattr(solid, "triangles", None)  # of trimesh.Trimesh, (n, 3, 3)
    if isinstance(triangles, np.ndarray):
        return solid_of_soup(soup_of_triangles(np.array(triangles, float), PLACE), "solid")
    return polyhedron_of(describe_shape(_kernel_shape(solid)), PLACE, "solid")


def _kernel_shape(solid: Any) -> Any:
    """Return the kernel's shape behind an object of either library."""
    found = solid
    if callable(getattr(found, "val", None)):  # cadquery.Workplane
        found = found.combine().val() if len(found.vals()) > 1 else found.val()
    if callable(getattr(found, "toCompound", None)):  # cadquery.Assembly
        found = found.toCompound()
    found = getattr(found, "part", found)  # build123d.BuildPart
    found = getattr(found, "wrapped", found)
    if not type(found).__module__.startswith("OCP"):
        raise ShapeError(
            f"{type(solid).__name__} is no solid of build123d, cadquery or trimesh",
            fix="give a part, a solid, a workplane or a trimesh.Trimesh",
            place=PLACE,
        )
    return found
