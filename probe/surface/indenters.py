"""Bodies of simple shape to press on the overlay: what the models are compared on.

Every one stands with its highest level at z = 0 (the rough one has its mean there), its
centre at the origin, and matter on the closed set, so a point on an outline is touched.
Around it the height is `floor_mm`, by default -inf: nothing. Thesis 4.2, figures 4.9, 4.10.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError

Array = NDArray[np.float64]


class _TopAtZero:
    """A surface whose highest point lies at 0."""

    __slots__ = ()
    top_mm = 0.0


@dataclass(frozen=True, slots=True)
class FlatPlate:
    """An endless flat plate."""

    top_mm: float = 0.0

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the same height everywhere."""
        return np.full(len(points_mm), self.top_mm)


@dataclass(frozen=True, slots=True)
class TiltedPlane:
    """A plane that rises along x and y, in a square about the origin; -inf beyond it."""

    slope_x: float = 0.0  #: mm per mm, not an angle
    slope_y: float = 0.0
    half_mm: float = 100.0

    @property
    def top_mm(self) -> float:
        """Height at the highest corner of the square."""
        return self.half_mm * (abs(self.slope_x) + abs(self.slope_y))

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the plane's height."""
        inside = np.abs(points_mm).max(axis=1, initial=0.0) <= self.half_mm
        return np.where(inside, points_mm @ np.array([self.slope_x, self.slope_y]), -math.inf)


@dataclass(frozen=True, slots=True)
class RaisedStrip(_TopAtZero):
    """A straight bar along y, with a flat top."""

    width_mm: float = 2.0
    length_mm: float = math.inf
    floor_mm: float = -math.inf

    def heights_mm(self, points_mm: Array) -> Array:
        """Return 0 on the bar and the floor around it."""
        x, y = np.abs(points_mm).T
        return np.where((x <= self.width_mm / 2) & (y <= self.length_mm / 2), 0.0, self.floor_mm)


@dataclass(frozen=True, slots=True)
class Cross(_TopAtZero):
    """Two bars of equal width, along x and along y, with a flat top."""

    width_mm: float = 2.0
    length_mm: float = 20.0
    floor_mm: float = -math.inf

    def heights_mm(self, points_mm: Array) -> Array:
        """Return 0 on the bars and the floor around them."""
        away = np.abs(points_mm)
        near, far = away.min(axis=1), away.max(axis=1)
        on = (near <= self.width_mm / 2) & (far <= max(self.length_mm, self.width_mm) / 2)
        return np.where(on, 0.0, self.floor_mm)


@dataclass(frozen=True, slots=True)
class Washer(_TopAtZero):
    """A flat ring; a disc when the inner diameter is 0. Thesis figures 4.9 and 4.10."""

    outer_mm: float = 15.0  #: diameter
    inner_mm: float = 7.0  #: diameter
    floor_mm: float = -math.inf

    def heights_mm(self, points_mm: Array) -> Array:
        """Return 0 on the ring and the floor around it."""
        square = np.einsum("ij,ij->i", points_mm, points_mm)
        on = (square <= (self.outer_mm / 2) ** 2) & (square >= (self.inner_mm / 2) ** 2)
        return np.where(on, 0.0, self.floor_mm)


@dataclass(frozen=True, slots=True)
class RoughSurface:
    """A random surface of stated rms height and shortest wave: a sum of plane waves.

    The same seed is the same surface. Wave lengths run over one decade up from the shortest,
    amplitudes grow with the wave length.
    """

    seed: int = 0
    rms_mm: float = 0.1
    shortest_mm: float = 1.0
    waves: int = 48

    def __post_init__(self) -> None:
        if not (self.rms_mm >= 0 and 0 < self.shortest_mm < math.inf and self.waves >= 1):
            raise SurfaceError(
                f"a rough surface of rms {self.rms_mm:g} mm, shortest wave {self.shortest_mm:g} "
                f"mm, {self.waves} waves",
                fix="give rms >= 0, shortest > 0 and at least one wave",
            )

    @property
    def top_mm(self) -> float:
        """Sum of all amplitudes: what the height can never exceed."""
        return float(_waves(self)[2].sum())

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the sum of the waves."""
        vectors, phases, amplitudes = _waves(self)
        at = points_mm @ vectors.T
        at += phases
        heights: Array = np.cos(at, out=at) @ amplitudes
        return heights


@lru_cache(maxsize=16)
def _waves(rough: RoughSurface) -> tuple[Array, Array, Array]:
    """Return wave vectors (n, 2) in rad/mm, phases (n,) and amplitudes (n,) in mm."""
    rng, n = np.random.default_rng(rough.seed), rough.waves
    length = rough.shortest_mm * 10 ** rng.random(n)
    direction = 2 * math.pi * rng.random(n)
    vectors = (2 * math.pi / length)[:, None] * np.stack(
        [np.cos(direction), np.sin(direction)], axis=1
    )
    amplitudes = length * (rough.rms_mm * math.sqrt(2) / math.hypot(*length))
    return vectors, 2 * math.pi * rng.random(n), amplitudes
