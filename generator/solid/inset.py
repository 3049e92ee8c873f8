"""Inset a face polygon with a distance of its own for every edge.

Rings (mm, outer counter-clockwise, holes clockwise) keep their corners, each on two moved lines,
so that sides between two insets are planar.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import edges_cross, keeps_edges, points_inside, signed_area

Ring = NDArray[np.float64]  #: (k, 2) mm
Insets = NDArray[np.float64]  #: (k,) mm, of edge i from corner i to i + 1

#: Neighbours that turn by less share one inset where theirs would push the corner far.
_FLAT_TURN_RAD = math.radians(15)


def shared_insets(ring: Ring, insets: Insets) -> Insets:
    """Return insets in which nearly parallel neighbours that differ take the larger one.

    Two such lines meet far away, or not at all: their corner would run along the edge by
    (difference / sin of the turn). It may run by an eighth of the shorter edge, no more.
    """
    along, length = _directions(ring)
    before = np.roll(along, 1, axis=0)
    turn = np.arctan2(
        before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0], (before * along).sum(axis=1)
    )
    shorter = np.minimum(length, np.roll(length, 1))
    slack = np.abs(np.sin(turn)) * shorter / 8
    flat = np.abs(turn) < _FLAT_TURN_RAD
    result = insets.astype(np.float64)
    for _ in range(len(ring)):
        previous = np.roll(result, 1)
        joined = flat & (np.abs(result - previous) > slack)
        if not joined.any():
            break
        larger = np.maximum(result, previous)
        raised = np.where(joined, larger, result)
        result = np.maximum(raised, np.where(np.roll(joined, -1), np.roll(larger, -1), raised))
    return result


def inset(ring: Ring, insets: Insets) -> Ring:
    """Return the ring whose edge i has moved to its left, into the material, by insets[i].

    Corner i is where the moved lines i - 1 and i meet: the mean of both insets along the bisector
    and half their difference across it, which has no singularity where the insets are equal.
    """
    along, _ = _directions(ring)
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)  # to the left: inward
    before = np.roll(normal, 1, axis=0)
    cosine = (normal * before).sum(axis=1)
    mean = (insets + np.roll(insets, 1)) / 2
    half = (insets - np.roll(insets, 1)) / 2
    tiny = np.finfo(np.float64).tiny
    # 1 - cosine from the difference itself: no cancellation at flat corners.
    apart = ((normal - before) ** 2).sum(axis=1) / 2
    bisector = mean / np.maximum(1 + cosine, tiny)
    across = np.where(half == 0.0, 0.0, half / np.maximum(apart, tiny))
    moved: Ring = ring + bisector[:, None] * (normal + before) + across[:, None] * (normal - before)
    return moved


def regular(before: Sequence[Ring], after: Sequence[Ring], shortest_mm: float) -> bool:
    """Whether an inset kept every edge, crosses nowhere, and keeps its holes inside."""
    if not all(np.isfinite(ring).all() for ring in after):
        return False
    if not all(keeps_edges(a, b, shortest_mm) for a, b in zip(before, after, strict=True)):
        return False
    if edges_cross(after) or signed_area(after[0]) <= 0:
        return False
    return all(
        signed_area(hole) < 0 and bool(points_inside(hole[:1], after[:1])[0]) for hole in after[1:]
    )


def _directions(ring: Ring) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit vectors along the edges, and their lengths."""
    edge = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(edge[:, 0], edge[:, 1])
    return edge / length[:, None], length
