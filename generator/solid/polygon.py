"""A polygon with holes and islands into triangles, keeping every point, proven by its area."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import triangulate as ear_clipped
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import signed_area, triangle_areas
from generator.solid.settings import EMBOSS

Ring = NDArray[np.float64]
Index = NDArray[np.int64]


def triangulate_rings(
    rings: Sequence[Ring], numbers: Index, name: str, flat: float = EMBOSS.flat
) -> Index:
    """Return the (m, 3) triangles of an area bounded by rings.

    Parameters
    ----------
    rings
        (k, 2) each; the area lies to the left of every edge, so outer loops run
        counter-clockwise, holes clockwise.
    numbers
        (sum of k,) what to call the points, ring after ring.
    name
        Of the facet, for the error.
    flat
        Share of its longest side by which a triangle is flat, and avoided if it can be.

    Raises
    ------
    SolidError
        If the triangles do not cover the area exactly once.
    """
    points = np.concatenate(rings)
    if len(points) == 3:
        found: Index = np.array([[0, 1, 2]])
    elif len(points) == 4 and len(rings) == 1 and _strictly_convex(points):
        found = np.array([[0, 1, 2], [0, 2, 3]])
    else:
        found = _clip_ears(rings, points, flat)
    if not _covers(rings, points, found):
        raise SolidError(
            "its outline, holes or symbols overlap, so it has no triangulation",
            fix="keep symbols inside their face and apart from each other",
            place=name,
        )
    named: Index = numbers[found]
    return named


def _clip_ears(rings: Sequence[Ring], points: Ring, flat: float) -> Index:
    """Return triangles; rings whose points line up are turned until they come out right.

    Ears are clipped from a bridge to each hole, which goes wrong now and then where many holes
    have corners on one line, as the letters of a name do.
    """
    found: Index = np.zeros((0, 3), dtype=np.int64)
    for angle in EMBOSS.clipping_turns_rad:
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = [ring @ R.T for ring in rings] if angle else list(rings)
        # The fast path for convex rings makes triangles of three points on a line.
        found = np.asarray(ear_clipped(turned, allow_convex=False), dtype=np.int64)
        found = without_slivers(points, found, flat)
        if _covers(rings, points, found):
            break
    return found


def _covers(rings: Sequence[Ring], points: Ring, triangles: Index) -> bool:
    """Whether triangles cover the area between rings exactly once."""
    areas = triangle_areas(points[triangles])
    size = float(np.ptp(points, axis=0).max()) ** 2
    wanted = sum(signed_area(ring) for ring in rings)
    if len(triangles) == 0 or areas.min() < -1e-12 * size:
        return False
    return bool(abs(areas.sum() - wanted) <= 1e-9 * size)


def without_slivers(points: Ring, triangles: Index, share: float = EMBOSS.flat) -> Index:
    """Return a triangulation in which triangles of three points on a line are flipped away.

    Such a triangle has its longest side in common with another one; exchanging that side
    for the other diagonal leaves two proper triangles. The outline stays.

    Parameters
    ----------
    points
        (n, 2).
    triangles
        (m, 3), counter-clockwise, flat ones included.
    share
        Of its longest side: a thinner triangle is flat.
    """
    flat = _is_sliver(points, triangles, share)
    if not flat.any():
        return triangles
    faces = [tuple(face) for face in triangles.tolist()]
    holder = {
        (face[k], face[(k + 1) % 3]): number for number, face in enumerate(faces) for k in range(3)
    }
    waiting = np.flatnonzero(flat).tolist()
    for _ in range(10 * len(faces)):
        if not waiting:
            break
        number = waiting.pop()
        face = faces[number]
        if not _is_sliver(points, np.array([face]), share)[0]:
            continue
        sides = [(face[k], face[(k + 1) % 3]) for k in range(3)]
        a, c = max(sides, key=lambda side: float(np.hypot(*(points[side[1]] - points[side[0]]))))
        b = next(corner for corner in face if corner not in (a, c))
        other = holder.get((c, a))
        if other is None:
            continue
        d = next(corner for corner in faces[other] if corner not in (a, c))
        for place, made in ((number, (a, d, b)), (other, (d, c, b))):
            faces[place] = made
            for k in range(3):
                holder[made[k], made[(k + 1) % 3]] = place
        waiting += [number, other]
    return np.array(faces, dtype=np.int64)


def _is_sliver(points: Ring, triangles: Index, share: float) -> NDArray[np.bool_]:
    """Whether triangles are thinner than a share of their longest side."""
    corners = points[triangles]
    u = np.roll(corners, -1, axis=1) - corners
    longest = (u**2).sum(axis=2).max(axis=1)
    twice = u[:, 0, 0] * u[:, 1, 1] - u[:, 0, 1] * u[:, 1, 0]
    thin: NDArray[np.bool_] = np.abs(twice) <= share * longest
    return thin


def _strictly_convex(ring: Ring) -> bool:
    edge = np.roll(ring, -1, axis=0) - ring
    ahead = np.roll(edge, -1, axis=0)
    turn = edge[:, 0] * ahead[:, 1] - edge[:, 1] * ahead[:, 0]
    return bool((turn > 1e-9 * np.hypot(*edge.T) * np.hypot(*ahead.T)).all())
