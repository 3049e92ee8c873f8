"""Symbols that are worn away, of faces as the database says them and as they were written."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from probe.surface.body import body_of, indexed_triangles, manifold_of
from probe.surface.contract import HeightMap
from probe.surface.face import FaceSurface

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_ASKED = 9  # heights along each edge of a cell


def wear_face(face: FaceSurface, share: float, rng: np.random.Generator) -> FaceSurface:
    """Return a face of which a share of the symbols is worn away."""
    lattice = face.lattice
    if lattice is None:
        return face
    salt = int(rng.integers(1 << 31))
    label_at = lattice.label_at

    def left(rows: Ints, columns: Ints) -> Ints:
        labels = label_at(rows, columns)
        cell = (rows * 73_856_093) ^ (columns * 19_349_663) ^ salt
        drawn = ((cell * 2_654_435_761) % (1 << 32)) / (1 << 32)
        return np.where(drawn < share, -1, labels)

    return replace(face, lattice=replace(lattice, label_at=left))


@dataclass(frozen=True, slots=True, eq=False)
class WornAway:
    """A surface on which some symbols are worn down to the face."""

    surface: HeightMap
    centres_mm: Array  #: (n, 2) of the worn symbols, surface frame
    rotation_rad: float  #: turns the surface's x axis into the array's
    pitch_mm: float
    bases_mm: Array  #: (n,) height of the face about each: 0 as designed, others where it is bowed

    @property
    def top_mm(self) -> float:
        """Height of what is left."""
        return self.surface.top_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the heights, none above the face in the cell of a worn symbol."""
        heights = self.surface.heights_mm(points_mm)
        if len(self.centres_mm) == 0 or len(points_mm) == 0:
            return heights
        c, s = np.cos(self.rotation_rad), np.sin(self.rotation_rad)
        turned = np.array([[c, s], [-s, c]])
        high = np.flatnonzero(heights > self.bases_mm.min())
        reach = (points_mm.min(axis=0) - self.pitch_mm, points_mm.max(axis=0) + self.pitch_mm)
        near = ((self.centres_mm > reach[0]) & (self.centres_mm < reach[1])).all(axis=1)
        x, y = np.abs((points_mm[high, None, :] @ turned - (self.centres_mm @ turned)[near]).T)
        within = (x <= self.pitch_mm / 2) & (y <= self.pitch_mm / 2)
        heights = heights.copy()
        lowest = np.where(within, self.bases_mm[near, None], np.inf).min(axis=0, initial=np.inf)
        heights[high] = np.minimum(heights[high], lowest)
        return heights

    @property
    def solid_mm(self) -> Array | None:
        """Return the body (n, 3, 3) without what stood above the face in these cells."""
        from manifold3d import Manifold, OpType

        body = body_of(self.surface)
        if body is None or len(self.centres_mm) == 0:
            return body
        side, top = self.pitch_mm, self.top_mm
        box = Manifold.cube((side, side, 2 * top)).translate((-side / 2, -side / 2, 0))
        box = box.rotate((0, 0, -math.degrees(self.rotation_rad)))
        places = np.column_stack([self.centres_mm, self.bases_mm]).tolist()
        boxes = [box.translate((x, y, z)) for x, y, z in places]
        gone = Manifold.batch_boolean(boxes, OpType.Add)
        corners, triangles = indexed_triangles(manifold_of(body) - gone)
        return corners[triangles]


def wear_part(
    surface: HeightMap,
    centres_mm: Array,
    rotation_rad: float,
    pitch_mm: float,
    share: float,
    rng: np.random.Generator,
) -> WornAway:
    """Return a surface of which a share of the symbols is worn away.

    Parameters
    ----------
    surface
        Of the face, face frame.
    centres_mm, rotation_rad, pitch_mm
        Where its symbols are: (n, 2) in the face frame, the turn of face x into array x.
    share
        Probability that a symbol is gone.
    rng
        Draws them.
    """
    gone = centres_mm[rng.random(len(centres_mm)) < share]
    bases = _bases(surface, gone, rotation_rad, pitch_mm)
    return WornAway(surface, gone, rotation_rad, pitch_mm, bases)


def _bases(surface: HeightMap, centres_mm: Array, rotation_rad: float, pitch_mm: float) -> Array:
    """Return the height of the face about each symbol (n,): the median along its cell's edge.

    Cells lie wholly on the face but for parts of them, and no symbol reaches their edges.
    """
    along = pitch_mm * np.linspace(-0.5, 0.5, _ASKED)
    side = np.full(_ASKED, pitch_mm / 2)
    sides = [(along, side), (along, -side), (side, along), (-side, along)]
    edge = np.concatenate([np.column_stack(pair) for pair in sides])
    c, s = math.cos(rotation_rad), math.sin(rotation_rad)
    points = centres_mm[:, None] + edge @ np.array([[c, -s], [s, c]])
    heights = surface.heights_mm(points.reshape(-1, 2)).reshape(len(centres_mm), len(edge))
    middle: Array = np.median(heights, axis=1) if len(centres_mm) else np.zeros(0)
    return np.where(np.isfinite(middle), np.round(middle, 6), 0.0)
