"""How high an embossed symbol stands over its face, exactly. Thesis 6.1, 6.2.

Stroke graphs + relief -> `SymbolReliefs`: for each label the edges of its outline. The symbol is
flat on top; every edge of the outline carries one side, and how far a point lies outside
the edge's line tells its height by one profile: draft from the foot up, and at the top a
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
from numpy.typing import NDArray

from probe.errors import SurfaceError
from probe.surface.outline import Ring, outline
from probe.surface.settings import SURFACE

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Node = tuple[float, float]
Strokes = tuple[tuple[Node, Node], ...]  #: of one symbol: pairs of nodes, in lattice units


@dataclass(frozen=True, slots=True)
class Relief:
    """How symbols stand on a face."""

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
    """The symbols of an alphabet, in the order of their labels.

    Shorter outlines are filled up with edges far away.
    """

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
        """Return the height of a point each (n,) over the face; 0 beside the symbol."""
        return self.pieces(labels, x, y)[1]

    def pieces(self, labels: Index, x: Array, y: Array) -> tuple[Index, Array]:
        """Return which planar piece lies over a point each, and its height.

        Pieces are 0 the face, 1 the top, and 2 + k m + i the stretch i of m of the profile
        on the side of edge k.
        """
        eps = SURFACE.overlap * (float(np.abs(self.tops).max()) + self.relief.stroke_mm)
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
    """Return the symbols of an alphabet.

    Parameters
    ----------
    glyphs
        Strokes of each label, between nodes in lattice units.
    unit_mm
        Length of one lattice unit, mm.
    relief
        Height, stroke, draft and chamfer.

    Raises
    ------
    SurfaceError
        When a number is out of range, or draft or chamfer make an edge vanish.
    """
    _check(relief)
    rings = tuple(
        outline(np.array(strokes, dtype=np.float64) * unit_mm, relief.stroke_mm)
        for strokes in glyphs
    )
    edges = [_edges(label, relief) for label in rings]
    most = max(len(columns[0]) for columns in edges)
    packed = np.zeros((11, len(glyphs), most))
    packed[2] = SURFACE.far_mm
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
