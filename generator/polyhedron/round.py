"""Cylinder and cone, as polyhedra whose narrow side facets unroll exactly as the round side does.

Both stand on z = 0 with their axis on z. F1 is the base, F2 the side (its facets go on as F2.2,
F2.3, ... counter-clockwise seen from above, the first in front, y < 0), F3 the top.

The facets are not inscribed: their lines lie so far out that the unrolled side has the width
2 pi r of the round one (a cone: its angle 2 pi sin(half angle)). Lines then stand a little
outside the round side and the middles of facets inside; the greatest distance of both is the
chord error, pi^2 r / (3 N^2) to first order, which sets the number N of facets. Lengths in mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from generator.errors import ShapeError
from generator.polyhedron.developable import Developable
from generator.polyhedron.settings import SOLID
from generator.polyhedron.shapes import check_lengths
from generator.polyhedron.winged import Face, Polyhedron, polyhedron


def cylinder(diameter: float, height: float) -> Polyhedron:
    """Return a cylinder: F1 base, F2 side, F3 top."""
    check_lengths("cylinder", diameter=diameter, height=height)
    radius = diameter / 2.0
    count = _count(radius)
    out = radius * (math.pi / count) / math.sin(math.pi / count)
    error = max(out - radius, radius - out * math.cos(math.pi / count))
    return _solid_of_rings("cylinder", count, (out, 0.0), (out, height), (radius, 0.0, error))


def cone(diameter: float, height: float, top_diameter: float = 0.0) -> Polyhedron:
    """Return a cone, or its lower part up to `top_diameter`: F1 base, F2 side, F3 top."""
    lengths = {"diameter": diameter, "height": height}
    check_lengths("cone", **lengths, **({"top_diameter": top_diameter} if top_diameter else {}))
    if top_diameter >= diameter:
        raise ShapeError(
            f"cone: top_diameter of {top_diameter:g} mm is not less than diameter of "
            f"{diameter:g} mm",
            fix="turn the cone upside down, or write shape: {cylinder: ...}",
        )
    radius, top = diameter / 2.0, top_diameter / 2.0
    count = _count(radius)
    sine = (radius - top) / math.hypot(radius - top, height)
    # Facets around the apex open by 2 pi sine / N each, so their lines lie at this angle.
    leaning = math.asin(math.sin(math.pi * sine / count) / math.sin(math.pi / count))
    apex = radius / math.tan(math.asin(sine))  # height of the tip
    rings = [((apex - z) * math.tan(leaning), z) for z in (0.0, height)]
    if top == 0.0:
        rings[1] = (0.0, height)
    middle = rings[0][0] * math.cos(math.pi / count)
    error = max(rings[0][0] - radius, radius - middle)
    return _solid_of_rings("cone", count, rings[0], rings[1], (radius, math.asin(sine), error))


def _count(radius: float) -> int:
    """Return the number of facets, a multiple of four."""
    wanted = math.pi * math.sqrt(radius / (3.0 * SOLID.chord_error_mm))
    return min(max(4 * math.ceil(wanted / 4.0), SOLID.facets[0]), SOLID.facets[1])


def _solid_of_rings(
    kind: str,
    count: int,
    low: tuple[float, float],
    high: tuple[float, float],
    surface: tuple[float, float, float],
) -> Polyhedron:
    """Return the solid between two rings (radius, z); a ring of radius 0 is one point."""
    radius, half_angle, error = surface
    angles = -math.pi / 2.0 - math.pi / count + 2.0 * math.pi / count * np.arange(count)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    base = np.column_stack([low[0] * circle, np.full(count, low[1])])
    ahead = [*range(1, count), 0]
    if high[0] == 0.0:
        top = np.array([[0.0, 0.0, high[1]]])
        sides: list[tuple[int, ...]] = [(k, ahead[k], count) for k in range(count)]
    else:
        top = np.column_stack([high[0] * circle, np.full(count, high[1])])
        sides = [(k, ahead[k], count + ahead[k], count + k) for k in range(count)]
    faces = [Face("F1", (tuple(range(count))[::-1],))]
    faces += [Face(f"F2.{k + 1}" if k else "F2", (loop,)) for k, loop in enumerate(sides)]
    if high[0] > 0.0:
        faces.append(Face("F3", (tuple(range(count, 2 * count)),)))
    solid = polyhedron(kind, np.concatenate([base, top]), faces)
    facets = tuple(range(1, count + 1))
    side = Developable(kind, facets, radius, half_angle, True, False, error)
    return replace(solid, surfaces=(side,))


ROUND_SHAPES: dict[str, Callable[..., Polyhedron]] = {"cylinder": cylinder, "cone": cone}
