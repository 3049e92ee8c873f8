"""A cylinder or cone face between two circles -> the run of facets that stands for it.

The outline must be circles, a straight line, circles, a straight line (all around the axis the
two lines are one seam), or of a cone up to its tip circles and two lines; and both circles must
be divided at the same angles. Lengths in mm, angles in rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

import numpy as np

from generator.polyhedron.read.settings import MODEL


def run_of(
    face: Any, kind: str, wires: list[list[tuple[Any, list[int]]]], points: list[Any]
) -> tuple[list[list[int]], dict[str, Any]] | None:
    """Return the facets of a cylinder or cone between two circles; None for any other outline."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    if len(wires) != 1:
        return None
    surface = BRepAdaptor_Surface(face)
    shape = surface.Cylinder() if kind == "cylinder" else surface.Cone()
    axis = shape.Axis()
    origin = np.array([axis.Location().X(), axis.Location().Y(), axis.Location().Z()])
    ahead = np.array([axis.Direction().X(), axis.Direction().Y(), axis.Direction().Z()])
    where = np.array(points)
    sides = [_Side.of(numbers, where[numbers] - origin, ahead) for _, numbers in wires[0]]
    chains = _two_chains(sides)
    if chains is None:
        return None
    low, high = chains
    angles = [_angles(where[chain] - origin, ahead) for chain in (low, high) if len(chain) > 1]
    if len(angles) == 2 and (
        len(low) != len(high) or np.abs(angles[0] - angles[1]).max() > math.radians(0.01)
    ):
        return None
    pairs = list(zip(low, high if len(high) > 1 else high * len(low), strict=True))
    loops = [[a, b, d, c] if c != d else [a, b, c] for (a, c), (b, d) in pairwise(pairs)]
    chosen = where[[*low, *high]] - origin
    reach = np.linalg.norm(chosen - (chosen @ ahead)[:, None] * ahead, axis=1).max()
    turn = float(np.abs(np.diff(angles[0])).max())
    corners = where[loops[0]] - origin
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    middle = corners[:2].mean(axis=0)
    return loops, {
        "kind": kind,
        "radius_mm": float(reach),
        "half_angle_rad": abs(float(shape.SemiAngle())) if kind == "cone" else 0.0,
        "closed": low[0] == low[-1],
        "concave": bool(normal @ (middle - (middle @ ahead) * ahead) < 0.0),
        "chord_error_mm": float(reach * (1.0 - math.cos(turn / 2.0))),
    }


@dataclass(frozen=True, slots=True)
class _Side:
    """One edge of a round face."""

    kind: str  #: circle, line, other
    numbers: list[int]  #: its points, in order around the face

    @classmethod
    def of(cls, numbers: list[int], place: Any, ahead: Any) -> _Side:
        """Return what an edge is; `place` (k, 3) from a point of the axis along `ahead`."""
        height = place @ ahead
        radial = place - height[:, None] * ahead
        radius = np.linalg.norm(radial, axis=1)
        slack = MODEL.same * max(1.0, float(np.abs(place).max()))
        if len(numbers) > 2 and np.ptp(height) <= slack and np.ptp(radius) <= slack:
            return cls("circle", numbers)
        if len(numbers) == 2 and _is_upright(radial, radius):
            return cls("line", numbers)
        return cls("other", numbers)


def _is_upright(radial: Any, radius: Any) -> bool:
    """Whether both ends of a straight edge lie on one side of the axis; the tip counts."""
    if radius.min() <= MODEL.same * radius.max():
        return True
    cosine = float(radial[0] @ radial[1]) / float(radius[0] * radius[1])
    return cosine > 1.0 - 1e-9


def _two_chains(sides: list[_Side]) -> tuple[list[int], list[int]] | None:
    """Return the points below and above, both to the right; None for another outline.

    The outline is circles, a line, circles, a line; or, of a cone up to its tip, circles and two
    lines.
    """
    starts = [
        k for k, side in enumerate(sides) if side.kind == "circle" and sides[k - 1].kind == "line"
    ]
    if not starts:
        return None
    sides = sides[starts[0] :] + sides[: starts[0]]
    runs = [(kind, list(same)) for kind, same in groupby(sides, key=lambda side: side.kind)]
    shape = [kind if kind == "circle" else f"{len(same)} {kind}" for kind, same in runs]
    below = _join_chains([side.numbers for side in runs[0][1]])
    if shape == ["circle", "1 line", "circle", "1 line"]:
        return below, _join_chains([side.numbers for side in runs[2][1]])[::-1]
    if shape == ["circle", "2 line"]:
        return below, [runs[1][1][0].numbers[-1]]
    return None


def _join_chains(chains: list[list[int]]) -> list[int]:
    """Return chains that follow each other as one."""
    return [*(number for chain in chains for number in chain[:-1]), chains[-1][-1]]


def _angles(place: Any, ahead: Any) -> Any:
    """Return the angles of points about the axis, without jumps."""
    radial = place - (place @ ahead)[:, None] * ahead
    x = radial[0] / np.linalg.norm(radial[0])
    y = np.cross(ahead, x)
    return np.unwrap(np.arctan2(radial @ y, radial @ x))
