"""Figures for the backs of panels: digits, capitals, marks and a bar, as stroke graphs.

Nodes on {-1, 0, 1} x {-2 ... 2}, y up. A number that holds a 6 or a 9 is underlined,
because it may be read upside down.
"""

from __future__ import annotations

import unicodedata

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
    Glyph("-", line((-1, 0), (1, 0))),
    Glyph("A", line((-1, -2), (-1, 0), (-1, 1), (0, 2), (1, 1), (1, 0), (1, -2))
          + line((-1, 0), (1, 0))),
    Glyph("B", line((-1, -2), (-1, 2), (0, 2), (1, 1), (0, 0), (-1, 0))
          + line((0, 0), (1, -1), (0, -2), (-1, -2))),
    Glyph("C", line((1, 2), (-1, 2), (-1, -2), (1, -2))),
    Glyph("D", line((-1, -2), (-1, 2), (0, 2), (1, 1), (1, -1), (0, -2), (-1, -2))),
    Glyph("E", line((1, 2), (-1, 2), (-1, -2), (1, -2)) + line((-1, 0), (0, 0))),
    Glyph("G", line((1, 2), (-1, 2), (-1, -2), (1, -2), (1, 0))),
    Glyph("H", line((-1, -2), (-1, 2)) + line((1, -2), (1, 2)) + line((-1, 0), (1, 0))),
    Glyph("I", line((-1, 2), (1, 2)) + line((0, 2), (0, -2)) + line((-1, -2), (1, -2))),
    Glyph("J", line((1, 2), (1, -2), (-1, -2), (-1, -1))),
    Glyph("K", line((-1, -2), (-1, 2)) + line((1, 2), (-1, 0), (1, -2))),
    Glyph("L", line((-1, 2), (-1, -2), (1, -2))),
    Glyph("M", line((-1, -2), (-1, 2), (0, 1), (1, 2), (1, -2))),
    Glyph("N", line((-1, -2), (-1, 2)) + line((-1, 1), (1, -1)) + line((1, -2), (1, 2))),
    Glyph("O", line((-1, -1), (-1, 1), (0, 2), (1, 1), (1, -1), (0, -2), (-1, -1))),
    Glyph("P", line((-1, -2), (-1, 2), (1, 2), (1, 0), (-1, 0))),
    Glyph("Q", line((1, -2), (1, 2), (-1, 2), (-1, 0), (1, 0))),
    Glyph("R", line((-1, -2), (-1, 2), (1, 2), (1, 0), (-1, 0), (1, -2))),
    Glyph("S", line((1, 2), (0, 2), (-1, 1), (1, -1), (0, -2), (-1, -2))),
    Glyph("T", line((-1, 2), (1, 2)) + line((0, 2), (0, -2))),
    Glyph("U", line((-1, 2), (-1, -2), (1, -2), (1, 2))),
    Glyph("V", line((-1, 2), (-1, -1), (0, -2), (1, -1), (1, 2))),
    Glyph("W", line((-1, 2), (-1, -2), (0, -1), (1, -2), (1, 2))),
    Glyph("X", line((-1, 2), (-1, 1), (0, 0), (1, -1), (1, -2))
          + line((-1, -2), (-1, -1), (0, 0), (1, 1), (1, 2))),
    Glyph("Y", line((-1, 2), (-1, 1), (0, 0), (1, 1), (1, 2)) + line((0, 0), (0, -2))),
    Glyph("Z", line((-1, 2), (1, 2), (1, 1), (-1, -1), (-1, -2), (1, -2))),
    Glyph(".", line((0, -2), (0, -1))),
    Glyph("_", line((-1, -2), (1, -2))),
    Glyph("+", line((-1, 0), (0, 0), (1, 0)) + line((0, -1), (0, 0), (0, 1))),
    Glyph("(", line((1, 2), (0, 1), (0, -1), (1, -2))),
    Glyph(")", line((-1, 2), (0, 1), (0, -1), (-1, -2))),
)  # fmt: skip
_NUMBERS = {figure.name: number for number, figure in enumerate(FIGURES)}
BAR = _NUMBERS["-"]


def figures_of(text: str) -> list[int]:
    """Return the numbers in `FIGURES` of a text without spaces."""
    return [_NUMBERS[character] for character in text]


def in_figures(text: str) -> str | None:
    """Return a text in capitals without accents, or None where it holds a letter without figure.

    >>> in_figures("Bügel 12"), in_figures("立方体")
    ('BUGEL 12', None)
    """
    letters = unicodedata.normalize("NFKD", text)
    plain = "".join(c for c in letters if not unicodedata.combining(c)).upper()
    return plain if set(plain) <= {*_NUMBERS, " "} else None


def needs_bar(text: str) -> bool:
    """Whether a text needs a bar below to tell which way up it is."""
    return "6" in text or "9" in text
