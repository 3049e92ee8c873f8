"""Whether triangles of a mesh cut each other, decided in integers.

Float coordinates are whole multiples of a power of two, so scaling makes them integers and
nothing is rounded. A triangle is an intersection of half spaces; cutting another triangle by them
leaves what the two have in common. In a surface that does not cut itself this is the vertex or
the edge that they share, or nothing. Anything more counts: a crossing, an overlap in one plane, a
neighbour folded over, and a mere touch where no vertex is shared. By hand because mesh libraries
decide in floats: pymeshlab reports triangles that only touch.

Sutherland and Hodgman, Reentrant polygon clipping, Communications of the ACM 17 (1974), here in
homogeneous integers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

FOLDED_COS = -0.999  #: between neighbours, from which the exact test looks at them

Vector = tuple[int, int, int]
#: x, y, z and the common denominator, which is positive.
Point = tuple[int, int, int, int]
#: a, b, c, d of a x + b y + c z + d >= 0.
HalfSpace = tuple[int, int, int, int]
Triangle = tuple[Vector, Vector, Vector]


def cut_triangles(corners: NDArray[np.float64], suspects: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (n,) whether the triangles `suspects` (n,) cut or touch another where they may not.

    `corners`: (T, 3, 3) of all triangles, finite, any unit.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = np.zeros(len(suspects), np.bool_)
    for k, number in enumerate(suspects.tolist()):
        near = ((low <= high[number]) & (high >= low[number])).all(axis=1)
        near[number] = False
        one, *others = _in_integers(corners[np.r_[number, np.flatnonzero(near)]])
        found[k] = any(triangles_cross(one, other) for other in others)
    return found


def perhaps_folded(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the triangles (T, 3) that may lie folded over a neighbour, or have no area."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    starts, ends = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((np.maximum(starts, ends), np.minimum(starts, ends)))
    edges = np.sort(np.stack([starts, ends], axis=1), axis=1)[order]
    same = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    one, other = owner[order][same], owner[order][same + 1]
    cosine = (normals[one] * normals[other]).sum(axis=1)
    back = cosine <= FOLDED_COS * lengths[one] * lengths[other]
    return np.unique(np.concatenate([one[back], other[back], np.flatnonzero(lengths == 0)]))


def triangles_cross(one: Triangle, other: Triangle) -> bool:
    """Return whether two triangles have more in common than the vertices they share."""
    shared = sorted(set(one) & set(other))
    if len(shared) == 3:
        return True
    return any(not _on_shared(point, shared) for point in _intersection_points(one, other))


def _in_integers(corners: NDArray[np.float64]) -> list[Triangle]:
    """Return triangles, (T, 3, 3), times the least power of two that makes all integers."""
    ratios = [float(value).as_integer_ratio() for value in corners.ravel()]
    scale = max(denominator for _, denominator in ratios)
    whole = iter([numerator * (scale // denominator) for numerator, denominator in ratios])
    vectors = list(zip(whole, whole, whole, strict=True))
    return [(vectors[k], vectors[k + 1], vectors[k + 2]) for k in range(0, len(vectors), 3)]


def _intersection_points(one: Triangle, other: Triangle) -> list[Point]:
    """Return points whose convex hull is what two triangles have in common."""
    points: list[Point] = [(*corner, 1) for corner in one]
    for a, b, c, d in _half_spaces(other):
        values = [a * x + b * y + c * z + d * w for x, y, z, w in points]
        kept: list[Point] = []
        for k, (point, s) in enumerate(zip(points, values, strict=True)):
            ahead = (k + 1) % len(points)
            t = values[ahead]
            if s >= 0:
                kept.append(point)
            if (s > 0 > t) or (s < 0 < t):
                p, q = (point, points[ahead]) if s > 0 else (points[ahead], point)
                s, t = max(s, t), min(s, t)
                x, y, z, w = (s * v - t * u for u, v in zip(p, q, strict=True))
                kept.append((x, y, z, w))
        points = kept
        if not points:
            break
    return points


def _half_spaces(triangle: Triangle) -> Iterator[HalfSpace]:
    """Yield half spaces whose intersection is the triangle; it may be a segment or a point."""
    a, b, c = triangle
    normal = _cross(_subtract(b, a), _subtract(c, a))
    if any(normal):
        yield from _plane(normal, a)
        for p, q in ((a, b), (b, c), (c, a)):
            yield _half_space_from(_cross(normal, _subtract(q, p)), p)
        return
    start, end = min(triangle), max(triangle)  # on a line the first and last in order
    along = _subtract(end, start)
    for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        across = _cross(along, axis) if any(along) else axis
        if any(across):
            yield from _plane(across, start)
    if any(along):
        yield _half_space_from(along, start)
        yield _half_space_from(_subtract(start, end), end)


def _plane(normal: Vector, point: Vector) -> Iterator[HalfSpace]:
    """Yield the two half spaces whose intersection is a plane."""
    x, y, z = normal
    yield _half_space_from(normal, point)
    yield _half_space_from((-x, -y, -z), point)


def _half_space_from(normal: Vector, point: Vector) -> HalfSpace:
    """Return the half space that begins at a point and lies along its normal."""
    return (*normal, -_dot(normal, point))


def _on_shared(point: Point, shared: Sequence[Vector]) -> bool:
    """Return whether a point lies on the vertex or the segment that two triangles share."""
    if not shared:
        return False
    x, y, z, w = point
    start, end = shared[0], shared[-1]
    arm = (x - w * start[0], y - w * start[1], z - w * start[2])
    along = _subtract(end, start)
    reach = _dot(arm, along)
    if any(_cross(arm, along)) or not 0 <= reach <= w * _dot(along, along):
        return False
    return any(along) or not any(arm)


def _subtract(p: Vector, q: Vector) -> Vector:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _dot(u: Vector, v: Vector) -> int:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _cross(u: Vector, v: Vector) -> Vector:
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )
