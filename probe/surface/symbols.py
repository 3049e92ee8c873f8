"""Embossed symbols: their outlines, and their exact height over the face. Thesis 6.1, 6.2.

Strokes (mm, symbol's axes) + stroke width -> rings of edges: every stroke covers the convex hull of
an octagonal nib at its two ends; the outline bounds the union of these hulls. Moved by d,
every edge keeps its direction and its corners stay where neighbouring lines meet, which is
how draft and chamfer shape the sides of a symbol.

Stroke graphs + relief -> `SymbolReliefs`: for each label the edges of its outline. The symbol is
flat on top; every edge of the outline carries one side, and the distance of a point outside
the edge's line gives its height by one profile: draft from the foot up, and at the top a
chamfer of 45 degrees. Corner lines between two sides run straight, so a side is a plane and
no point lies between sides. Symbol's axes: origin at the centre of its cell, x along the
array's columns, y against its rows; z from the face. mm, rad.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.errors import SurfaceError

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Node = tuple[float, float]
Strokes = tuple[tuple[Node, Node], ...]  #: of one symbol: pairs of nodes, in lattice units

SAME_POINT = 1e-9  # share of the size below which points are one and edges are none
OVERLAP = 1e-12  # share of the size by which sides overlap: rounding leaves no gap
FAR_MM = 1e9  # support of an edge that is not there


@dataclass(frozen=True, slots=True)
class Relief:
    """Height and sides of symbols."""

    height_mm: float = 1.0
    stroke_mm: float = 1.4  #: width at the top, before the chamfer
    draft_rad: float = 0.17453292519943295  #: slope of the sides from the vertical
    chamfer_mm: float = 0.0  #: of the top edge, at 45 degrees

    def profile(self) -> tuple[Array, Array]:
        """Return distances outside the stroke's edge, rising, and the heights there, mm."""
        slope = math.tan(self.draft_rad)
        h, c = self.height_mm, self.chamfer_mm
        steps = [(0.0, h)] if c == 0 else [(c * slope - c, h), (c * slope, h - c)]
        if slope > 0:
            steps.append((h * slope, 0.0))
        away, heights = zip(*steps, strict=True)
        return np.array(away), np.array(heights)


@dataclass(frozen=True, slots=True, eq=False)
class SymbolReliefs:
    """The symbols of an alphabet by label; shorter outlines are filled up with edges far away."""

    relief: Relief
    rings: tuple[tuple[Ring, ...], ...]  #: per label
    normals: Array  #: (2, labels, k) of the outlines' edges
    supports: Array  #: (labels, k) mm
    spans: Array  #: (4, labels, k): along its edge a side runs from a + b s to c + d s, s outside
    tops: Array  #: (4, labels, k): x, y of the ends of the top's edges, mm

    @property
    def foot_half_mm(self) -> float:
        """Half side of the square about the centre that holds every symbol."""
        foot = float(self.relief.profile()[0][-1])
        return max(float(np.abs(ring.moved(foot)).max()) for rings in self.rings for ring in rings)

    def heights_mm(self, labels: Index, x: Array, y: Array) -> Array:
        """Return the height of a point each (n,) over the face; 0 off the symbol."""
        return self.pieces(labels, x, y)[1]

    def pieces(self, labels: Index, x: Array, y: Array) -> tuple[Index, Array]:
        """Return which planar piece lies over a point each, and its height.

        Pieces are 0 the face, 1 the top, and 2 + k m + i the stretch i of m of the profile
        on the side of edge k.
        """
        eps = OVERLAP * (float(np.abs(self.tops).max()) + self.relief.stroke_mm)
        piece, z = np.zeros(len(x), dtype=np.int64), np.zeros(len(x))
        for label in np.unique(labels).tolist():
            here = np.flatnonzero(labels == label)
            piece[here], z[here] = self._pieces_of(label, x[here], y[here], eps)
        return piece, z

    def _pieces_of(self, label: int, x: Array, y: Array, eps: float) -> tuple[Index, Array]:
        """Return the pieces over points of one symbol, and the heights there."""
        away, heights = self.relief.profile()
        piece, z = np.zeros(len(x), dtype=np.int64), np.zeros(len(x))
        if len(away) > 1:
            nx, ny = self.normals[:, label, :, None]
            s = nx * x + ny * y - self.supports[label, :, None]
            edges, points = np.nonzero((s >= away[0] - eps) & (s <= away[-1] + eps))
            s = s[edges, points]
            t = nx[edges, 0] * y[points] - ny[edges, 0] * x[points]
            a, b, c, d = self.spans[:, label, edges]
            on = (t >= a + b * s - eps) & (t <= c + d * s + eps)
            points, edges, s = points[on], edges[on], s[on]
            side = np.interp(s, away, heights)
            # Of two sides that overlap (a corner, by rounding) the higher one is written last.
            order = np.argsort(side, kind="stable")
            stretch = np.clip(np.searchsorted(away, s) - 1, 0, len(away) - 2)
            piece[points[order]] = (2 + edges * (len(away) - 1) + stretch)[order]
            z[points[order]] = side[order]
        flat = self._in_top(label, x, y)
        piece[flat], z[flat] = 1, self.relief.height_mm
        return piece, z

    def planes(self, label: int) -> Array:
        """Return the (n, 3) coefficients of z = a + b x + c y for the pieces of a label."""
        away, heights = self.relief.profile()
        fall = np.diff(heights) / np.diff(away)
        nx, ny = self.normals[:, label, :, None] * fall
        level = heights[:-1] - (away[:-1] + self.supports[label][:, None]) * fall
        sides = np.stack([level, nx, ny], axis=-1).reshape(-1, 3)
        return np.concatenate([[[0.0, 0.0, 0.0], [self.relief.height_mm, 0.0, 0.0]], sides])

    def _in_top(self, label: int, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether points lie in the top of a symbol, by the parity of crossed edges."""
        x0, y0, x1, y1 = self.tops[:, label, :, None]
        up = y0 <= y
        edges, points = np.nonzero(up != (y1 <= y))
        x0, y0, x1, y1 = self.tops[:, label, edges]
        left = (x1 - x0) * (y[points] - y0) - (y1 - y0) * (x[points] - x0) > 0
        met = points[left == up[edges, points]]
        inside: NDArray[np.bool_] = np.bincount(met, minlength=len(x)) % 2 == 1
        return inside


@lru_cache(maxsize=32)
def emboss(glyphs: tuple[Strokes, ...], unit_mm: float, relief: Relief) -> SymbolReliefs:
    """Return the symbols of an alphabet, whose strokes join nodes in units of `unit_mm`.

    Raises `SurfaceError` when a number is out of range, or draft or chamfer make an edge vanish.
    """
    _check(relief)
    rings = tuple(
        outline(np.array(strokes, dtype=np.float64) * unit_mm, relief.stroke_mm)
        for strokes in glyphs
    )
    edges = [_edges(label, relief) for label in rings]
    most = max(len(columns[0]) for columns in edges)
    packed = np.zeros((11, len(glyphs), most))
    packed[2] = FAR_MM
    for label, columns in enumerate(edges):
        packed[:, label, : len(columns[0])] = columns
    return SymbolReliefs(relief, rings, packed[:2], packed[2], packed[3:7], packed[7:])


def _edges(rings: Sequence[Ring], relief: Relief) -> Array:
    """Return, per edge, normal, support, span of its side, and ends at the top; (11, k)."""
    away = relief.profile()[0]
    columns = []
    for ring in rings:
        starts = ring.moved(0.0)
        ends = np.roll(starts, -1, axis=0)
        tops = ring.moved(float(away[0]))
        along = np.stack([-ring.normals[:, 1], ring.normals[:, 0]], axis=1)
        drift = ring.moved(1.0) - starts  # of a corner, per mm of moving out
        for d in (away[0], away[-1]):
            moved = ring.moved(float(d))
            lengths = np.einsum("ij,ij->i", np.roll(moved, -1, axis=0) - moved, along)
            if lengths.min() <= 0:
                raise SurfaceError(
                    f"draft {math.degrees(relief.draft_rad):.3g} degrees or chamfer "
                    f"{relief.chamfer_mm:g} mm makes an edge of a symbol vanish",
                    fix="take less draft or chamfer, or another stroke width",
                )
        spans = np.stack(
            [
                np.einsum("ij,ij->i", along, starts),
                np.einsum("ij,ij->i", along, drift),
                np.einsum("ij,ij->i", along, ends),
                np.einsum("ij,ij->i", along, np.roll(drift, -1, axis=0)),
            ]
        )
        after = np.roll(tops, -1, axis=0)
        columns.append(np.vstack([ring.normals.T, ring.supports[None], spans, tops.T, after.T]))
    return np.concatenate(columns, axis=1)


def _check(relief: Relief) -> None:
    h, w, c = relief.height_mm, relief.stroke_mm, relief.chamfer_mm
    sizes = 0 < h < math.inf and 0 < w < math.inf and 0 <= c < h
    if not (sizes and 0 <= relief.draft_rad <= math.radians(60)):
        raise SurfaceError(
            f"symbols {h:g} mm high, stroke {w:g} mm, draft "
            f"{math.degrees(relief.draft_rad):g} degrees, chamfer {c:g} mm",
            fix="give height and stroke above 0 mm, draft to 60 degrees, chamfer below the height",
        )


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


Edge = tuple[Array, Array, Array, float]  #: its ends, normal and support


def outline(strokes_mm: ArrayLike, stroke_mm: float) -> tuple[Ring, ...]:
    """Return the rings that bound what a nib covers along strokes (s, 2, 2), mm.

    `stroke_mm` is the distance of two opposite flats of the nib.

    Raises `SurfaceError` for no strokes, a stroke without length, or a width that is not positive.
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
    eps = SAME_POINT * (float(np.abs(strokes).max()) + stroke_mm)
    hulls = [_hull(a, b, stroke_mm / 2) for a, b in strokes]
    return tuple(_rings(_free_edges(hulls, eps), eps))


def _hull(a: Array, b: Array, radius: float) -> Ring:
    """Return the hull of the nib at both ends: the nib's flats, and two sides between them."""
    along = (b - a) / math.hypot(*(b - a))
    nib = radius / math.cos(math.pi / 8)
    half = _TURNS + math.pi / 8
    corners = nib * np.stack([np.cos(half), np.sin(half)], axis=1)
    normals, supports = [*_FLATS], [max(n @ a, n @ b) + radius for n in _FLATS]
    for side in (np.array([along[1], -along[0]]), np.array([-along[1], along[0]])):
        if np.abs(_FLATS - side).max(axis=1).min() > SAME_POINT:
            normals.append(side)
            supports.append(side @ a + (corners @ side).max())
    order = np.argsort([math.atan2(n[1], n[0]) for n in normals])
    return Ring(np.array(normals)[order], np.array(supports)[order])


def _free_edges(hulls: Sequence[Ring], eps: float) -> list[Edge]:
    """Return the parts of all hulls' edges that no other hull covers: ends, normal, support."""
    free = []
    for i, hull in enumerate(hulls):
        corners = hull.moved(0.0)
        ends = np.roll(corners, -1, axis=0)
        for p, q, n, c in zip(corners, ends, hull.normals, hull.supports, strict=True):
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
    p: Array, q: Array, normal: Array, hull: Ring, first: bool, eps: float
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


def _rings(edges: list[Edge], eps: float) -> list[Ring]:
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


def _merge_collinear(chain: list[Edge]) -> Ring:
    """Join neighbours on one line, across the chain's seam too."""
    normals, supports = [edge[2] for edge in chain], [edge[3] for edge in chain]
    kept = [k for k in range(len(chain)) if abs(_turn(normals[k - 1], normals[k])) > SAME_POINT]
    return Ring(np.array([normals[k] for k in kept]), np.array([supports[k] for k in kept]))
