"""Plane geometry, the same for every stage: sides, areas, crossings, distances.

Points are (n, 2) or (n, 3) arrays, mm. A polygon is a tuple of loops: the outer one
counter-clockwise, then holes clockwise; non-convex polygons are welcome.

The sum-of-areas test of thesis 6.3 holds for convex faces alone, and in floating point
it rejects interior points; the sign of an orientation, with an exact evaluation where
rounding could change it, decides here instead.

References
----------
J. R. Shewchuk, Adaptive precision floating-point arithmetic and fast robust geometric
predicates, 1997: the error bound of the filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]

_EPSILON = 2.0**-53
_FILTER = (3.0 + 16.0 * _EPSILON) * _EPSILON  # Shewchuk's ccwerrboundA
_UNDERFLOW = 1e-300  # products below this have lost bits that the filter does not count


def orientations(a: ArrayLike, b: ArrayLike, c: ArrayLike) -> NDArray[np.int8]:
    """Return +1 where a, b, c (..., 2), broadcast together, turn left, -1 right, 0 on one line.

    Exact: in rational arithmetic where rounding could change the sign.
    """
    a, b, c = (np.asarray(p, dtype=np.float64) for p in (a, b, c))
    left = (a[..., 0] - c[..., 0]) * (b[..., 1] - c[..., 1])
    right = (a[..., 1] - c[..., 1]) * (b[..., 0] - c[..., 0])
    sign = np.asarray(np.sign(left - right)).astype(np.int8)
    doubtful = np.abs(left - right) <= _FILTER * (np.abs(left) + np.abs(right)) + _UNDERFLOW
    for k in map(tuple, np.argwhere(doubtful)):
        corners = (np.broadcast_to(p, (*sign.shape, 2))[k].tolist() for p in (a, b, c))
        (ax, ay), (bx, by), (cx, cy) = (map(Fraction, corner) for corner in corners)
        exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
        sign[k] = (exact > 0) - (exact < 0)
    return sign


def side_of_polygon(loops: Sequence[Points], points: ArrayLike) -> NDArray[np.int8]:
    """Return for each point (n, 2): +1 inside, 0 exactly on the boundary, -1 outside; (n,) int8.

    Loops (k, 2), outer loop and holes in any order and direction (even-odd rule). Exact for the
    numbers given.
    """
    p = np.atleast_2d(np.asarray(points, dtype=np.float64))
    px, py = p[:, 0], p[:, 1]
    inside = np.zeros(len(p), dtype=bool)
    boundary = np.zeros(len(p), dtype=bool)
    for loop in loops:
        for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            low, high = (a, b) if a[1] <= b[1] else (b, a)
            near = np.flatnonzero((py >= low[1]) & (py <= high[1]))
            if len(near) == 0:
                continue
            turn = orientations(low, high, p[near])
            x, y = px[near], py[near]
            on_line = (turn == 0) & (x >= min(a[0], b[0])) & (x <= max(a[0], b[0]))
            boundary[near[on_line]] = True
            # The half-open rule counts a vertex once; the ray runs towards -x.
            inside[near[(turn < 0) & (y < high[1])]] ^= True
    side = np.where(inside, 1, -1).astype(np.int8)
    side[boundary] = 0
    return side


def points_inside(points: ArrayLike, loops: Sequence[Points]) -> NDArray[np.bool_]:
    """Whether points (n, 2) lie inside a polygon, its boundary left out; (n,) bool."""
    return side_of_polygon(loops, points) > 0


def area_vector(points: Points) -> Points:
    """Return the vector area of a closed loop in space (Newell): normal times area, (3,) mm^2."""
    d = points - points[0]
    x, y, z = d[:, 0], d[:, 1], d[:, 2]
    p, q = slice(None, -1), slice(1, None)
    return 0.5 * np.array(
        [
            y[p] @ z[q] - z[p] @ y[q],
            z[p] @ x[q] - x[p] @ z[q],
            x[p] @ y[q] - y[p] @ x[q],
        ]
    )


def face_vector(loops: Sequence[Points]) -> Points:
    """Return the vector area of a face, (3,) mm^2: of all its loops, so that holes count off.

    Summed arm by arm, which rounds otherwise than `area_vector`: facets of round faces lie in
    frames of these bits.
    """
    vector: Points = np.zeros(3)
    for loop in loops:
        arms = loop - loop[0]
        vector += np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0) / 2
    return vector


def signed_volume(vertices: Points, faces: Sequence[Sequence[Sequence[int]]]) -> float:
    """Return the volume inside planar faces, mm^3: positive if their loops face outward."""
    rings = [vertices[list(loop)] - vertices[0] for loops in faces for loop in loops]
    return sum(float(area_vector(ring) @ ring[0]) for ring in rings) / 3.0


def signed_area(loop: Points) -> float:
    """Return the area of a plane loop (k, 2), mm^2: positive if it runs counter-clockwise."""
    d = loop - loop[0]
    return 0.5 * float(d[:-1, 0] @ d[1:, 1] - d[:-1, 1] @ d[1:, 0])


def triangle_areas(corners: Points) -> Points:
    """Return the areas (n,) of plane triangles (n, 3, 2): positive counter-clockwise."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas: Points = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return areas


def plane_axes(normal: Points, along: Points) -> tuple[Points, Points, Points]:
    """Return unit vectors x, y, z with z along `normal` and x along `along` within the plane."""
    z = normal / np.sqrt(normal @ normal)
    x = along - (along @ z) * z
    x = x / np.sqrt(x @ x)
    y = np.array([z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]])
    return x, y, z


def is_convex(loop: Points) -> bool:
    """Whether a plane loop turns left at every vertex and runs around once; then it is simple."""
    d = np.diff(loop, axis=0, append=loop[:1])
    e = np.roll(d, -1, axis=0)
    turn = np.arctan2(d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0], d[:, 0] * e[:, 0] + d[:, 1] * e[:, 1])
    return bool(turn.min() >= 0.0 and turn.max() < np.pi and abs(turn.sum() - 2 * np.pi) < 1e-6)


def closest_pair(loops: Sequence[Points]) -> tuple[float, int, int]:
    """Return the least distance between two edges that share no vertex, and their numbers.

    Edges are counted through all loops in order; edge k of a loop starts at its vertex k.
    Crossing edges have the distance 0. With no such pair the distance is infinite.
    """
    start, end, number, after = segments(loops)
    best = (np.inf, 0, 0)
    for i, (a, b) in enumerate(zip(start, end, strict=True)):  # a row of pairs at a time
        others = np.flatnonzero((number != i) & (number != after[i]) & (after != i))
        if len(others) == 0:
            continue
        c, d = start[others], end[others]
        gap = np.minimum(_distances(c, a, b), _distances(d, a, b))
        crossing = orientations(a, b, c) * orientations(a, b, d) < 0
        crossing &= orientations(c, d, a) * orientations(c, d, b) < 0
        gap[crossing] = 0.0
        k = int(gap.argmin())
        if gap[k] < best[0]:
            best = (float(gap[k]), min(i, int(others[k])), max(i, int(others[k])))
    return best


def keeps_edges(before: Points, after: Points, shortest: float) -> bool:
    """Whether every edge of `after` runs along that of `before`, at least `shortest` long."""
    old = np.roll(before, -1, axis=0) - before
    new = np.roll(after, -1, axis=0) - after
    along = (old * new).sum(axis=1) / np.hypot(old[:, 0], old[:, 1])
    return bool((along >= shortest).all())


def segments(
    rings: Sequence[Points],
) -> tuple[Points, Points, NDArray[np.int64], NDArray[np.int64]]:
    """Return starts, ends, and the numbers of the first and the last corner of all edges."""
    points = np.concatenate(rings)
    first = np.arange(len(points))
    last = first + 1
    ends = np.cumsum([len(ring) for ring in rings])
    last[ends - 1] = ends - [len(ring) for ring in rings]
    return points, points[last], first, last


def edges_cross(rings: Sequence[Points]) -> bool:
    """Whether two edges that share no corner meet, touching included, or neighbours fold back."""
    starts, ends, a, b = segments(rings)
    n = len(starts)
    if n > 512:
        return _sweep_crosses(starts, ends, a, b)
    i, j = np.triu_indices(n, 1)
    return _any_meeting(starts, ends, a, b, i, j)


def _sweep_crosses(
    starts: Points, ends: Points, a: NDArray[np.int64], b: NDArray[np.int64]
) -> bool:
    """`edges_cross` for many edges: only pairs whose x ranges overlap."""
    low = np.minimum(starts[:, 0], ends[:, 0])
    high = np.maximum(starts[:, 0], ends[:, 0])
    order = np.argsort(low, kind="stable")
    reach = np.searchsorted(low[order], high[order], side="right")
    for k, stop in enumerate(reach.tolist()):
        others = order[k + 1 : stop]
        if len(others) and _any_meeting(starts, ends, a, b, np.full(len(others), order[k]), others):
            return True
    return False


def _any_meeting(
    starts: Points,
    ends: Points,
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    i: NDArray[np.int64],
    j: NDArray[np.int64],
) -> bool:
    """Whether any of the edge pairs (i, j) meets elsewhere than at a common corner."""
    p, q, r, s = starts[i], ends[i], starts[j], ends[j]
    chained = (b[i] == a[j]) | (b[j] == a[i])
    d1, d2 = _doubled_area(p, q, r), _doubled_area(p, q, s)
    d3, d4 = _doubled_area(r, s, p), _doubled_area(r, s, q)
    apart = (np.minimum(d1, d2) > 0) | (np.maximum(d1, d2) < 0)
    apart |= (np.minimum(d3, d4) > 0) | (np.maximum(d3, d4) < 0)
    boxes = (np.maximum(p, q) < np.minimum(r, s)) | (np.maximum(r, s) < np.minimum(p, q))
    apart |= boxes.any(axis=1)
    if bool((~apart & ~chained).any()):
        return True
    u, v = (q - p)[chained], (s - r)[chained]
    turn = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    dot = (u * v).sum(axis=1)
    size = np.hypot(*u.T) * np.hypot(*v.T)
    return bool(((np.abs(turn) <= 1e-12 * size) & (dot < 0)).any())


def distance(points: Points, rings: Sequence[Points]) -> Points:
    """Return the distance of each of (n, 2) points to the nearest edge of the rings."""
    best = np.full(len(points), np.inf)
    for p, q in zip(*segments(rings)[:2], strict=True):
        best = np.minimum(best, _distances(points, p, q))
    return best


def _distances(points: Points, p: Points, q: Points) -> Points:
    """Return the distances of points (n, 2) from the segment p q."""
    u = q - p
    t = np.clip(((points - p) @ u) / max(float(u @ u), np.finfo(float).tiny), 0.0, 1.0)
    gap = points - p - t[:, None] * u
    away: Points = np.hypot(gap[:, 0], gap[:, 1])
    return away


def boxes_inside(centres: Points, half: ArrayLike, rings: Sequence[Points]) -> NDArray[np.bool_]:
    """Whether boxes along the axes lie inside an area: no edge meets them, centres (n, 2) inside.

    `half`: half sides, one for squares, or two.
    """
    free = points_inside(centres, rings)
    size = np.broadcast_to(np.asarray(half, dtype=np.float64), 2)
    starts, ends, _, _ = segments(rings)
    for p, q in zip(starts, ends, strict=True):
        low, high = np.minimum(p, q) - size, np.maximum(p, q) + size
        near = ((centres >= low) & (centres <= high)).all(axis=1)
        away = np.array([q[1] - p[1], p[0] - q[0]])
        near &= np.abs((centres - p) @ away) <= size @ np.abs(away)
        free &= ~near
    return free


def _doubled_area(p: Points, q: Points, r: Points) -> Points:
    """Twice the signed areas of the triangles p, q, r."""
    a, b = q - p, r - p
    area: Points = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return area
