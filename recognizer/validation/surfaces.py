"""Surfaces that no database knows.

Everything else than a registered face must be refused, whatever it looks like.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet import alphabet_named
from generator.array import profile
from probe.surface.contract import HeightMap
from probe.surface.face import endless
from probe.surface.indenters import FlatPlate, Rough
from probe.surface.symbols import Relief
from recognizer.touch.lab import EmbossedArray

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


def flat_face(_encoding: EmbossedArray, _rng: np.random.Generator) -> HeightMap:
    """Return a flat face."""
    return FlatPlate()


def ridges(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return ridges as wide as strokes, or up to twice that, often at the pitch of the symbols."""
    pitch, stroke = encoding.style.pitch_mm, encoding.style.stroke_mm
    period = pitch * rng.choice([0.25, 1 / 3, 0.5, 1.0, rng.uniform(0.3, 1.2)])
    width = stroke * rng.uniform(1.0, 2.0)
    return Ridges(max(period, 1.5 * width), width, rng.uniform(0, math.pi))


def dots(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return dots on a grid, often at a part of the pitch of the symbols."""
    period = encoding.style.pitch_mm * rng.choice([0.5, 1.0, rng.uniform(0.4, 1.2)])
    return Dots(period, period * rng.uniform(0.3, 0.7))


def rough_face(_encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return a random surface."""
    return Rough(int(rng.integers(1 << 31)), rng.uniform(0.1, 0.5), rng.uniform(2.0, 8.0))


def random_symbols(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return symbols of the same alphabet at the same pitch, drawn at random."""
    return _embossed_surface(encoding, rng.integers(encoding.array.order, size=(64, 64)))


def other_lab(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return another array in the same alphabet, at the same pitch."""
    sizes = (encoding.array.rows, encoding.array.columns)
    names = ("one-touch", "large") if encoding.array.order == 4 else ("thesis",)
    others = [profile(name).array() for name in names]
    array = next((a for a in others if (a.rows, a.columns) != sizes), others[0])
    if (array.rows, array.columns) == sizes or array.order != encoding.array.order:
        return random_symbols(encoding, rng)
    row, column = (int(rng.integers(size)) for size in (array.rows, array.columns))
    rows, columns = np.indices((64, 64))
    return _embossed_surface(
        encoding, array.symbols((rows + row) % array.rows, (columns + column) % array.columns)
    )


def text(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return letters as high and as thick as the symbols."""
    letters = alphabet_named("letters-4")
    style = encoding.style
    pitch = style.pitch_mm * rng.uniform(0.8, 1.2)
    relief = Relief(style.height_mm, min(style.stroke_mm, 0.14 * pitch), style.draft_rad)
    lines = rng.integers(letters.order, size=(32, 32))
    lines[rng.random(lines.shape) < 0.15] = -1
    return endless(
        lines,
        tuple(glyph.strokes for glyph in letters.glyphs),
        pitch_mm=pitch,
        unit_mm=letters.reach * pitch,
        relief=relief,
    )


#: Surfaces of no database.
FOREIGN: dict[str, Callable[[EmbossedArray, np.random.Generator], HeightMap]] = {
    "blank": flat_face,
    "ridges": ridges,
    "dots": dots,
    "rough": rough_face,
    "random symbols": random_symbols,
    "other lab": other_lab,
    "text": text,
}


def _embossed_surface(encoding: EmbossedArray, labels: NDArray[np.int64]) -> HeightMap:
    style, alphabet = encoding.style, encoding.alphabet
    return endless(
        labels,
        tuple(glyph.strokes for glyph in alphabet.glyphs),
        pitch_mm=style.pitch_mm,
        unit_mm=alphabet.reach * style.pitch_mm,
        relief=Relief(style.height_mm, style.stroke_mm, style.draft_rad, style.chamfer_mm),
    )
