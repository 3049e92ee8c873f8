"""A solid of build123d or cadquery -> polyhedron, through the kernel that holds it. mm."""

from __future__ import annotations

from typing import Any

from generator.errors import ShapeError
from generator.polyhedron import Polyhedron
from generator.polyhedron.read.kernel import described
from generator.polyhedron.read.step import polyhedron_of

PLACE = "the solid"


def polyhedron_from(solid: Any) -> Polyhedron:
    """Return the polyhedron of a solid.

    Parameters
    ----------
    solid
        A `build123d` part or solid, a `cadquery` workplane, shape or assembly's shape, or a
        kernel shape; it must hold one solid.

    Raises
    ------
    ShapeError
        It holds no solid or several, or the solid has faces that cannot be read.
    """
    return polyhedron_of(described(_kernel_shape(solid)), PLACE, "solid")


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
            f"{type(solid).__name__} is no solid of build123d or cadquery",
            fix="give a part, a solid or a workplane",
            place=PLACE,
        )
    return found
