"""The outline of strokes drawn with an octagonal nib, as lines that can be moved.

Strokes (mm, symbol's axes) + stroke width -> rings of edges. Every stroke covers the convex
hull of the nib at its two ends; the outline bounds the union of these hulls. Moved by d,
every edge keeps its direction and its corners stay where neighbouring lines meet, which is
how draft and chamfer shape the sides of a symbol. Thesis 6.1, 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError
from probe.surface.settings import SURFACE

Array = NDArray[np.float64]

_TURNS = np.arange(8) * (math.pi / 4)
_FLATS = np.round(np.stack([np.cos(_TURNS), np.sin(_TURNS)], axis=1), 17)


@dataclass(frozen=True, slots=True, eq=False)
class Ring:
    """One closed line of edges with the matter on its left: outer ring or hole."""

    normals: Array  #: (k, 2) unit, out of the matter
    supports: Array  #: (k,) mm; edge i lies on normals[i] . x = supports[i]

    def moved(self, distance_mm: float) -> Array:
        """Return the (k, 2) corners with every edge moved out; corner i begins edge i."""
        n, c = self.normals, self.supports + distance_mm
        m, d = np.roll(n, 1, axis=0), np.roll(c, 1)
        turn = m[:, 0] * n[:, 1] - m[:, 1] * n[:, 0]
        x = (d * n[:, 1] - c * m[:, 1]) / turn
        y = (c * m[:, 0] - d * n[:, 0]) / turn
        return np.stack([x, y], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Hull:
    """A convex piece: all that one stroke covers."""

    normals: Array  # (k, 2)
    supports: Array  # (k,)
    corners: Array  # (k, 2); edge i runs from corner i to corner i + 1


def outline(strokes_mm: ArrayLike, stroke_mm: float) -> tuple[Ring, ...]:
    """Return the rings that bound what the nib covers.

    Parameters
    ----------
    strokes_mm
        (s, 2, 2) end points of straight strokes, mm.
    stroke_mm
        Distance of two opposite flats of the nib, mm.

    Raises
    ------
    SurfaceError
        For no strokes, a stroke without length, or a width that is not positive.
    """
    strokes = np.asarray(strokes_mm, dtype=np.float64)
    if strokes.ndim != 3 or strokes.shape[1:] != (2, 2) or not len(strokes):
        raise SurfaceError(
            f"strokes form an array of shape {strokes.shape}",
            fix="give each stroke as two points (x, y)",
        )
    lengths = np.hypot(*(strokes[:, 1] - strokes[:, 0]).T)
    if not (np.isfinite(strokes).all() and 0 < stroke_mm < math.inf and lengths.min() > 0):
        raise SurfaceError(
            f"strokes from {lengths.min():g} mm long, {stroke_mm:g} mm wide",
            fix="give strokes with a length, and a width above 0 mm",
        )
    eps = SURFACE.same_point * (float(np.abs(strokes).max()) + stroke_mm)
    hulls = [_hull(a, b, stroke_mm / 2) for a, b in strokes]
    return tuple(_rings(_free_edges(hulls, eps), eps))


def _hull(a: Array, b: Array, radius: float) -> _Hull:
    """Return the hull of the nib at both ends: the nib's flats, and two sides between them."""
    along = (b - a) / math.hypot(*(b - a))
    nib = radius / math.cos(math.pi / 8)
    half = _TURNS + math.pi / 8
    corners = nib * np.stack([np.cos(half), np.sin(half)], axis=1)
    normals, supports = [*_FLATS], [max(n @ a, n @ b) + radius for n in _FLATS]
    for side in (np.array([along[1], -along[0]]), np.array([-along[1], along[0]])):
        if np.abs(_FLATS - side).max(axis=1).min() > SURFACE.same_point:
            normals.append(side)
            supports.append(side @ a + (corners @ side).max())
    order = np.argsort([math.atan2(n[1], n[0]) for n in normals])
    ring = Ring(np.array(normals)[order], np.array(supports)[order])
    return _Hull(ring.normals, ring.supports, ring.moved(0.0))


def _free_edges(hulls: Sequence[_Hull], eps: float) -> list[tuple[Array, Array, Array, float]]:
    """Return the parts of all hulls' edges that no other hull covers: ends, normal, support."""
    free = []
    for i, hull in enumerate(hulls):
        ends = np.roll(hull.corners, -1, axis=0)
        for p, q, n, c in zip(hull.corners, ends, hull.normals, hull.supports, strict=True):
            left = [(0.0, 1.0)]
            for j, other in enumerate(hulls):
                if j != i:
                    left = _subtract(left, _covered_part(p, q, n, other, j < i, eps))
            size = math.hypot(*(q - p))
            free += [
                (p + s * (q - p), p + t * (q - p), n, c) for s, t in left if (t - s) * size > eps
            ]
    return free


def _covered_part(
    p: Array, q: Array, normal: Array, hull: _Hull, first: bool, eps: float
) -> tuple[float, float]:
    """Return the part of the edge p q inside a hull; (1, 0) for none.

    Where the edge runs along an edge of the hull, only the first of the two stays free.
    """
    low, high = 0.0, 1.0
    for n, c in zip(hull.normals, hull.supports, strict=True):
        f, g = float(n @ p - c), float(n @ q - c)
        if abs(f) <= eps and abs(g) <= eps:
            if float(n @ normal) > 0 and not first:
                return 1.0, 0.0
        elif f >= -eps and g >= -eps:
            return 1.0, 0.0
        elif f > 0:
            low = max(low, f / (f - g))
        elif g > 0:
            high = min(high, f / (f - g))
    return low, high


def _subtract(
    parts: list[tuple[float, float]], cut: tuple[float, float]
) -> list[tuple[float, float]]:
    low, high = cut
    if low >= high:
        return parts
    left = [(s, min(t, low)) for s, t in parts] + [(max(s, high), t) for s, t in parts]
    return [(s, t) for s, t in left if s < t]


def _rings(edges: list[tuple[Array, Array, Array, float]], eps: float) -> list[Ring]:
    """Chain edges end to start; where several start, the sharpest left turn goes on."""
    starts = np.array([p for p, _, _, _ in edges])
    unused = set(range(len(edges)))
    rings = []
    while unused:
        chain = [min(unused)]
        unused.discard(chain[0])
        while True:
            _, end, normal, _ = edges[chain[-1]]
            near = np.flatnonzero(np.abs(starts - end).max(axis=1) <= 100 * eps)
            if chain[0] in near:
                break
            onward = [int(k) for k in near if int(k) in unused]
            if not onward:
                raise SurfaceError(
                    "the strokes' outline does not close",
                    fix="move nodes or the stroke width by a little",
                )
            chain.append(max(onward, key=lambda k: _turn(normal, edges[k][2])))
            unused.discard(chain[-1])
        rings.append(_merge_collinear([edges[k] for k in chain]))
    return rings


def _turn(a: Array, b: Array) -> float:
    """Return the turn from one normal to the next, left positive, rad."""
    return math.atan2(a[0] * b[1] - a[1] * b[0], a @ b)


def _merge_collinear(chain: list[tuple[Array, Array, Array, float]]) -> Ring:
    """Join neighbours on one line, across the chain's seam too."""
    kept = [
        (n, c)
        for (n, c), (m, _) in zip(
            [(n, c) for _, _, n, c in chain],
            [(n, c) for _, _, n, c in chain[-1:] + chain[:-1]],
            strict=True,
        )
        if abs(_turn(m, n)) > SURFACE.same_point
    ]
    return Ring(np.array([n for n, _ in kept]), np.array([c for _, c in kept]))
