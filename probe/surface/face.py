"""A face of an object: flat, with its symbols, and what lies beyond its edges.

Outline + lattice + surroundings -> Surface in the face frame. Inside the outline the face
is the plane z = 0 with symbols on it; outside, the neighbouring faces fall away (or rise,
at a reflex edge), given as a surface of their own. Thesis 6.3.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.surface.contract import HeightMap
from probe.surface.lattice import Index, LabelAt, LatticeSurface, call_lookup, tile_lookup
from probe.surface.polygon import FaceRegion
from probe.surface.symbols import Relief, Strokes, emboss
from probe.surface.template import template

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class FaceSurface:
    """A flat face; blank without a lattice, endless without an outline."""

    lattice: LatticeSurface | None
    outline: FaceRegion | None = None
    around: HeightMap | None = None  #: neighbouring faces, face frame; None: nothing there

    @property
    def top_mm(self) -> float:
        """The tops of the symbols, or what rises above them beside the face."""
        own = self.lattice.top_mm if self.lattice else 0.0
        return max(own, self.around.top_mm) if self.around else own

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the face, its symbols and its surroundings."""
        if self.outline is None:
            return self._own(points_mm)
        inside = self.outline.contains(points_mm)
        if inside.all():
            heights = self._own(points_mm)
        else:
            heights = np.full(len(points_mm), -np.inf)
            heights[inside] = self._own(points_mm[inside])
        if self.around is not None:
            # Only what leans over the face can be higher than it.
            asked = slice(None) if self.around.top_mm > 0 else np.flatnonzero(~inside)
            heights[asked] = np.maximum(heights[asked], self.around.heights_mm(points_mm[asked]))
        return heights

    def _own(self, points: Array) -> Array:
        return self.lattice.heights_mm(points) if self.lattice else np.zeros(len(points))


def endless_face(
    labels: ArrayLike | Callable[[Index, Index], ArrayLike],
    glyphs: Sequence[Strokes],
    *,
    pitch_mm: float = 7.0,
    unit_mm: float = 1.82,
    relief: Relief | None = None,
) -> FaceSurface:
    """Return an endless face that carries an array.

    Parameters
    ----------
    labels
        (rows, columns) labels, repeated without end; or a function of rows (n,) and columns
        (n,), any whole numbers. Cell (r, c) has its centre at ((c + 1/2) p, -(r + 1/2) p).
    glyphs
        Strokes of each label, between nodes in units of `unit_mm`.
    pitch_mm, unit_mm
        Distance of symbols, and of two nodes, mm.
    relief
        Height, stroke and draft of the symbols.

    Raises
    ------
    SurfaceError
        When the symbols overlap or collapse.
    """
    symbols = emboss(tuple(glyphs), unit_mm, relief or Relief())
    label_at: LabelAt = call_lookup(labels) if callable(labels) else tile_lookup(labels)
    return FaceSurface(LatticeSurface(template(symbols, pitch_mm), label_at))
