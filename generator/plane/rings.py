"""Plane rings: crossings, distances, room. Lengths in any unit; (k, 2) corner arrays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.plane.polygon import points_inside

Ring = NDArray[np.float64]


def keeps_edges(before: Ring, after: Ring, shortest: float) -> bool:
    """Whether every edge of `after` still runs along that of `before`, at least `shortest` long."""
    old = np.roll(before, -1, axis=0) - before
    new = np.roll(after, -1, axis=0) - after
    along = (old * new).sum(axis=1) / np.hypot(old[:, 0], old[:, 1])
    return bool((along >= shortest).all())


def segments(rings: Sequence[Ring]) -> tuple[Ring, Ring, NDArray[np.int64], NDArray[np.int64]]:
    """Return starts, ends, and the numbers of the first and the last corner of all edges."""
    first, last, base = [], [], 0
    for ring in rings:
        index = np.arange(base, base + len(ring))
        first.append(index)
        last.append(np.roll(index, -1))
        base += len(ring)
    points = np.concatenate(rings)
    a, b = np.concatenate(first), np.concatenate(last)
    return points[a], points[b], a, b


def edges_cross(rings: Sequence[Ring]) -> bool:
    """Whether two edges that share no corner meet, touching included, or neighbours fold back."""
    starts, ends, a, b = segments(rings)
    n = len(starts)
    if n > 512:
        return _sweep_crosses(starts, ends, a, b)
    i, j = np.triu_indices(n, 1)
    return _any_meeting(starts, ends, a, b, i, j)


def _sweep_crosses(starts: Ring, ends: Ring, a: NDArray[np.int64], b: NDArray[np.int64]) -> bool:
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
    starts: Ring,
    ends: Ring,
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


def distance(points: Ring, rings: Sequence[Ring]) -> NDArray[np.float64]:
    """Return the distance of each of (n, 2) points to the nearest edge of the rings."""
    starts, ends, _, _ = segments(rings)
    best = np.full(len(points), np.inf)
    for p, q in zip(starts, ends, strict=True):
        u = q - p
        t = np.clip(((points - p) @ u) / max(float(u @ u), np.finfo(float).tiny), 0.0, 1.0)
        gap = points - p - t[:, None] * u
        best = np.minimum(best, np.hypot(gap[:, 0], gap[:, 1]))
    return best


def boxes_inside(centres: Ring, half: ArrayLike, rings: Sequence[Ring]) -> NDArray[np.bool_]:
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


def _doubled_area(p: Ring, q: Ring, r: Ring) -> NDArray[np.float64]:
    """Twice the signed areas of the triangles p, q, r."""
    side: NDArray[np.float64] = (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (
        r[:, 0] - p[:, 0]
    )
    return side
