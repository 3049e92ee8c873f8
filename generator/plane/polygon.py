"""Plane geometry that cannot be wrong by rounding: orientation, side of a polygon, area.

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

from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

Points = NDArray[np.float64]

_EPSILON = 2.0**-53
_FILTER = (3.0 + 16.0 * _EPSILON) * _EPSILON  # Shewchuk's ccwerrboundA
_UNDERFLOW = 1e-300  # products below this have lost bits that the filter does not count


def orientation(a: ArrayLike, b: ArrayLike, c: ArrayLike) -> int:
    """Return +1 if a, b, c turn left, -1 if they turn right, 0 if they lie on one line; exact."""
    (ax, ay), (bx, by), (cx, cy) = ((float(p[0]), float(p[1])) for p in map(np.asarray, (a, b, c)))
    left, right = (ax - cx) * (by - cy), (ay - cy) * (bx - cx)
    determinant = left - right
    if abs(determinant) > _FILTER * (abs(left) + abs(right)) + _UNDERFLOW:
        return 1 if determinant > 0 else -1
    return _exact_orientation(ax, ay, bx, by, cx, cy)


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
            turn = _orientations(low, high, p[near])
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
    start = np.concatenate(loops)
    end = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])
    following = np.concatenate([np.roll(np.arange(len(loop)), -1) for loop in loops])
    following += np.repeat(np.cumsum([0, *map(len, loops[:-1])]), [len(loop) for loop in loops])
    count = len(start)
    best = (np.inf, 0, 0)
    for i in range(count - 1):  # one row of pairs at a time keeps the memory small
        others = np.arange(i + 1, count)
        others = others[(others != following[i]) & (following[others] != i)]
        if len(others) == 0:
            continue
        gap = _segment_distances(start[i], end[i], start[others], end[others])
        k = int(gap.argmin())
        if gap[k] < best[0]:
            best = (float(gap[k]), i, int(others[k]))
    return best


def _segment_distances(a: Points, b: Points, c: Points, d: Points) -> Points:
    """Distances (n,) between segment a-b and segments c-d (n, 2)."""
    gap = np.minimum(
        np.minimum(_distances(a, c, d), _distances(b, c, d)),
        np.minimum(
            _distances(c, np.broadcast_to(a, c.shape), np.broadcast_to(b, c.shape)),
            _distances(d, np.broadcast_to(a, c.shape), np.broadcast_to(b, c.shape)),
        ),
    )
    crossing = (_orientations(a, b, c) * _orientations(a, b, d) < 0) & (
        _orientations_of(c, d, a) * _orientations_of(c, d, b) < 0
    )
    gap[crossing] = 0.0
    return gap


def _distances(p: Points, a: Points, b: Points) -> Points:
    """Distances (n,) from p, one point or one per segment, to the segments a-b (n, 2)."""
    along = b - a
    length2 = np.einsum("ij,ij->i", along, along)
    t = np.einsum("ij,ij->i", p - a, along) / np.where(length2 > 0, length2, 1.0)
    foot = a + np.clip(t, 0.0, 1.0)[:, None] * along
    gap: Points = np.hypot(*(p - foot).T)
    return gap


def _orientations(a: Points, b: Points, c: Points) -> NDArray[np.int8]:
    """Return the orientations of a, b with each point of c (n, 2)."""
    left = (a[0] - c[:, 0]) * (b[1] - c[:, 1])
    right = (a[1] - c[:, 1]) * (b[0] - c[:, 0])
    return _signs(left, right, lambda k: (*a, *b, *c[k]))


def _orientations_of(a: Points, b: Points, c: Points) -> NDArray[np.int8]:
    """Return the orientations of each pair a, b (n, 2) with the one point c."""
    left = (a[:, 0] - c[0]) * (b[:, 1] - c[1])
    right = (a[:, 1] - c[1]) * (b[:, 0] - c[0])
    return _signs(left, right, lambda k: (*a[k], *b[k], *c))


def _signs(
    left: Points, right: Points, corners: Callable[[int], tuple[float, ...]]
) -> NDArray[np.int8]:
    determinant = left - right
    sign = np.sign(determinant).astype(np.int8)
    doubtful = np.abs(determinant) <= _FILTER * (np.abs(left) + np.abs(right)) + _UNDERFLOW
    for k in np.flatnonzero(doubtful):
        sign[k] = _exact_orientation(*map(float, corners(int(k))))
    return sign


def _exact_orientation(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> int:
    """Orientation in rational arithmetic: every double is a rational number."""
    x, y = Fraction(cx), Fraction(cy)
    determinant = (Fraction(ax) - x) * (Fraction(by) - y) - (Fraction(ay) - y) * (Fraction(bx) - x)
    return (determinant > 0) - (determinant < 0)
