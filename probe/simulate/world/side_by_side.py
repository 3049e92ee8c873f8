"""Two objects side by side under one sensor, with a gap and a step between their faces.

Two surfaces, each in its own frame, and where the second lies in the first's -> one surface in
the first's frame. Along the gap there is nothing. mm, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.errors import SurfaceError
from probe.surface.body import body_of, indexed_triangles, manifold_of
from probe.surface.contract import HeightMap
from probe.surface.polygon import FaceRegion

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BesideSettings:
    """How two objects lie beside each other, and where they are touched."""

    gap_mm: float = 2.0  #: between their edges, at most
    step_mm: float = 0.4  #: of the second's face above or below the first's, at most
    reach_mm: float = 9.0  #: the sensor's centre lies on the first, at most so far from its edge
    flush: float = 1e-6  #: of the size: corners this far beyond an edge do not lie beyond it


BESIDE = BesideSettings()


@dataclass(frozen=True, slots=True)
class FramePlace:
    """Where a frame lies in another one: turned about z, then moved."""

    x_mm: float
    y_mm: float
    z_mm: float
    turn_rad: float

    def into(self, points_mm: Array) -> Array:
        """Take points (n, 2) of the outer frame into this one."""
        c, s = math.cos(self.turn_rad), math.sin(self.turn_rad)
        inside: Array = (points_mm - (self.x_mm, self.y_mm)) @ np.array([[c, -s], [s, c]])
        return inside

    def touch_inside(self, touch: Touch) -> Touch:
        """Return a touch of the outer frame as one of this frame."""
        x, y = self.into(np.array([[touch.x_mm, touch.y_mm]]))[0].tolist()
        return replace(touch, x_mm=x, y_mm=y, theta_rad=touch.theta_rad - self.turn_rad)


@dataclass(frozen=True, slots=True, eq=False)
class SideBySide:
    """Two surfaces as one."""

    first: HeightMap
    second: HeightMap
    place: FramePlace  #: of the second's frame in the first's

    @property
    def top_mm(self) -> float:
        """Height of the higher one."""
        return max(self.first.top_mm, self.second.top_mm + self.place.z_mm)

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of the higher one at each point."""
        second = self.second.heights_mm(self.place.into(points_mm)) + self.place.z_mm
        return np.maximum(self.first.heights_mm(points_mm), second)

    @property
    def solid_mm(self) -> Array | None:
        """Return both bodies (n, 3, 3) as one."""
        first, second = body_of(self.first), body_of(self.second)
        if first is None or second is None:
            return None
        c, s = math.cos(self.place.turn_rad), math.sin(self.place.turn_rad)
        turned = second @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        moved = turned + np.array([self.place.x_mm, self.place.y_mm, self.place.z_mm])
        both = manifold_of(first) + manifold_of(moved)
        corners, triangles = indexed_triangles(both)
        return corners[triangles]


def lay_beside(
    first: FaceRegion, second: FaceRegion, rng: np.random.Generator
) -> tuple[FramePlace, Array]:
    """Lay a face beside another one, edge to edge, and draw a place near where they meet.

    Parameters
    ----------
    first, second
        Outlines, each in its own frame.
    rng
        Draws the edges, gap, step and place.

    Returns
    -------
    place
        Of the second's frame in the first's.
    at_mm
        (2,) a place on the first, `BesideSettings.reach_mm` from the edge at most, with the
        second's edge beside it.

    Raises
    ------
    SurfaceError
        A face has no edge beyond which nothing of it lies.
    """
    start, along, outward, length = _outer_edge(first, rng)
    other, other_along, _, other_length = _outer_edge(second, rng)
    gap, step = rng.uniform(0, BESIDE.gap_mm), rng.uniform(-1, 1) * BESIDE.step_mm
    deep, share, other_share = rng.random(3)
    # Edges run the other way round beside each other: the second's outward is the first's inward.
    turn = math.atan2(-along[1], -along[0]) - math.atan2(other_along[1], other_along[0])
    meet = start + share * length * along
    c, s = math.cos(turn), math.sin(turn)
    beside = np.array([[c, -s], [s, c]]) @ (other + other_share * other_length * other_along)
    shift = meet + gap * outward - beside
    at = meet - deep * BESIDE.reach_mm * outward
    if not first.contains(at[None])[0]:
        at = meet - 1e-3 * outward
    place = FramePlace(float(shift[0]), float(shift[1]), step, math.remainder(turn, math.tau))
    return place, at


def _outer_edge(region: FaceRegion, rng: np.random.Generator) -> tuple[Array, Array, Array, float]:
    """Draw an edge beyond which nothing of a face lies: start, direction, outward, length."""
    along = region.ends - region.starts
    lengths = np.hypot(*along.T)
    along = along / lengths[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    beyond = (outward @ region.starts.T).max(axis=1) - (outward * region.starts).sum(axis=1)
    outer = np.flatnonzero(beyond <= BESIDE.flush * lengths.max())
    if len(outer) == 0:
        raise SurfaceError(
            "a face has no edge beside which another one could lie",
            fix="take faces with a straight outer edge",
        )
    chosen = int(rng.choice(outer, p=lengths[outer] / lengths[outer].sum()))
    return region.starts[chosen], along[chosen], outward[chosen], float(lengths[chosen])
