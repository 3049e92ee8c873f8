"""Figures for edge and face numbers: digits, the letter F, and a bar, as stroke graphs.

Nodes on {-1, 0, 1} x {-2 ... 2}, y up. A number that holds a 6 or a 9 is underlined,
because it may be read upside down.
"""

from __future__ import annotations

from generator.alphabet.known import line
from generator.alphabet.strokes import Glyph

FIGURES: tuple[Glyph, ...] = (
    Glyph("0", line((-1, -2), (1, -2), (1, 2), (-1, 2), (-1, -2))),
    Glyph("1", line((-1, 1), (0, 2), (0, -2))),
    Glyph("2", line((-1, 2), (1, 2), (1, 0), (-1, 0), (-1, -2), (1, -2))),
    Glyph("3", line((-1, 2), (1, 2), (1, -2), (-1, -2)) + line((0, 0), (1, 0))),
    Glyph("4", line((-1, 2), (-1, 0), (1, 0)) + line((1, 2), (1, -2))),
    Glyph("5", line((1, 2), (-1, 2), (-1, 0), (1, 0), (1, -2), (-1, -2))),
    Glyph("6", line((1, 2), (-1, 2), (-1, -2), (1, -2), (1, 0), (-1, 0))),
    Glyph("7", line((-1, 2), (1, 2), (1, 1), (0, 0), (0, -2))),
    Glyph("8", line((-1, 0), (-1, -2), (1, -2), (1, 2), (-1, 2), (-1, 0), (1, 0))),
    Glyph("9", line((-1, -2), (1, -2), (1, 2), (-1, 2), (-1, 0), (1, 0))),
    Glyph("F", line((-1, -2), (-1, 2), (1, 2)) + line((-1, 0), (0, 0))),
    Glyph("bar", line((-1, 0), (1, 0))),
)
BAR = len(FIGURES) - 1


def figures_of(text: str) -> list[int]:
    """Return the numbers in `FIGURES` of a text of digits and F."""
    names = [figure.name for figure in FIGURES]
    return [names.index(character) for character in text]


def needs_bar(text: str) -> bool:
    """Whether a text needs a bar below to tell which way up it is."""
    return "6" in text or "9" in text
