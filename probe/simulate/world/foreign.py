"""Surfaces that no database knows: plain, patterned, rough, and with symbols of nobody.

Everything else than a registered face must be refused, whatever it looks like. Which of these
a campaign draws is the campaign's to name; here they are made, from the style of the symbols
that the lab prints.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.surface.contract import HeightMap
from probe.surface.face import endless_face
from probe.surface.indenters import RoughSurface
from probe.surface.symbols import Relief, Strokes

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Ridges:
    """Straight ridges, flat on top."""

    period_mm: float
    width_mm: float
    angle_rad: float
    height_mm: float = 1.0

    @property
    def top_mm(self) -> float:
        """Height of the ridges."""
        return self.height_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of a ridge, or 0."""
        across = points_mm @ np.array([math.cos(self.angle_rad), math.sin(self.angle_rad)])
        return np.where(across % self.period_mm < self.width_mm, self.height_mm, 0.0)


@dataclass(frozen=True, slots=True)
class Dots:
    """Round dots on a square grid."""

    period_mm: float
    diameter_mm: float
    height_mm: float = 1.0

    @property
    def top_mm(self) -> float:
        """Height of the dots."""
        return self.height_mm

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height of a dot, or 0."""
        away = (points_mm / self.period_mm + 0.5) % 1.0 - 0.5
        inside = np.hypot(away[:, 0], away[:, 1]) * self.period_mm < self.diameter_mm / 2
        return np.where(inside, self.height_mm, 0.0)


def draw_ridges(pitch_mm: float, stroke_mm: float, rng: np.random.Generator) -> HeightMap:
    """Return ridges as wide as strokes, or up to twice that, often at the pitch of the symbols."""
    period = pitch_mm * rng.choice([0.25, 1 / 3, 0.5, 1.0, rng.uniform(0.3, 1.2)])
    width = stroke_mm * rng.uniform(1.0, 2.0)
    return Ridges(max(period, 1.5 * width), width, rng.uniform(0, math.pi))


def draw_dots(pitch_mm: float, rng: np.random.Generator) -> HeightMap:
    """Return dots on a grid, often at a part of the pitch of the symbols."""
    period = pitch_mm * rng.choice([0.5, 1.0, rng.uniform(0.4, 1.2)])
    return Dots(period, period * rng.uniform(0.3, 0.7))


def draw_rough(rng: np.random.Generator) -> HeightMap:
    """Return a random surface."""
    return RoughSurface(int(rng.integers(1 << 31)), rng.uniform(0.1, 0.5), rng.uniform(2.0, 8.0))


def draw_text(
    letters: tuple[Strokes, ...],
    reach: float,
    pitch_mm: float,
    relief: Relief,
    rng: np.random.Generator,
) -> HeightMap:
    """Return lines of letters as high and as thick as the symbols.

    Parameters
    ----------
    letters
        Strokes of each, in lattice units.
    reach
        Lattice unit over pitch.
    pitch_mm, relief
        Of the lab's symbols; letters are .8 to 1.2 of the pitch apart, their strokes no wider
        than they bear.
    """
    pitch = pitch_mm * rng.uniform(0.8, 1.2)
    thin = Relief(relief.height_mm, min(relief.stroke_mm, 0.14 * pitch), relief.draft_rad)
    lines = rng.integers(len(letters), size=(32, 32))
    lines[rng.random(lines.shape) < 0.15] = -1
    return endless_face(lines, letters, pitch_mm=pitch, unit_mm=reach * pitch, relief=thin)
