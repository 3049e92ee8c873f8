"""Texts on a back as rectangles: how large they are, and where they find room.

Facet frame of the back, mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.plane.rings import boxes_inside
from generator.solid.emboss import turn

Ring = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pen:
    """Sizes of the figures, mm."""

    unit: float
    stroke: float
    clear: float

    def half_size(self, text: str, *, bar: bool = False) -> tuple[float, float]:
        """Half width and half height of a text, with its bar."""
        width = len(text) * (2 * self.unit + self.stroke) + (len(text) - 1) * self.clear
        height = 4 * self.unit + self.stroke
        return width / 2, (height + (2 * self.stroke if bar else 0.0)) / 2

    def half_block(self, lines: Sequence[str]) -> tuple[float, float]:
        """Half width and half height of several lines."""
        sizes = [self.half_size(line) for line in lines]
        return max(x for x, _ in sizes), sum(y for _, y in sizes) + (len(lines) - 1) * self.gap / 2

    @property
    def gap(self) -> float:
        """Between two lines."""
        return 2 * self.clear


@dataclass(frozen=True, slots=True)
class TextBox:
    """A text's place: centre, direction of reading, half sizes."""

    text: str
    centre: Ring
    angle: float
    half: tuple[float, float]
    pen: Pen
    bar: bool = False  #: below, to tell which way up it is


def has_room(
    centres: Ring, angle: float, half: tuple[float, float], clear: float, rings: Sequence[Ring]
) -> NDArray[np.bool_]:
    """Whether rectangles at `centres` keep clear of all edges and lie inside."""
    R = turn(angle)
    return boxes_inside(centres @ R, np.array(half) + clear, [ring @ R for ring in rings])


def closer_than(one: TextBox, other: TextBox, clear: float) -> bool:
    """Whether two turned rectangles are closer than `clear`, by separating axes."""
    between = other.centre - one.centre
    for angle in (one.angle, other.angle):
        axes = turn(angle)
        for axis in axes.T:
            reach = clear
            for box in (one, other):
                reach += float(np.abs(axis @ turn(box.angle)) @ np.array(box.half))
            if abs(float(axis @ between)) >= reach:
                return False
    return True
