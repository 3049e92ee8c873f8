"""The alphabets that ship, and their plain values.

Nodes lie on {-1, 0, 1} squared, one unit = `reach` x pitch. Ends and vertices of
thesis-2 and of the four-symbol alphabets are those of thesis figures 6.4 and 6.12;
dense-8 has eight different counts of ends, vertices and loops. dense-4, dense-8 and
tactel-4, -8, -16 suit a joint fit of several symbols; thesis-2 and letters-4 also a
skeleton, hence their longer and thinner strokes. tactel-4, -8, -16 come of a search
for letters that tactels tell apart (docs/alphabets.md).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from generator.alphabet.strokes import Glyph, Node, Stroke, check_distinguishable
from generator.errors import AlphabetError


@dataclass(frozen=True, slots=True)
class Alphabet:
    """Symbols 0 ... order - 1 of an array, each with its glyph."""

    name: str
    glyphs: tuple[Glyph, ...]
    reach: float  #: lattice unit over pitch
    stroke_ratio: float  #: default stroke width over pitch

    @property
    def order(self) -> int:
        """Number of symbols."""
        return len(self.glyphs)

    def definition(self) -> dict[str, Any]:
        """Return the plain values (JSON) from which `alphabet_from` makes this alphabet again."""
        return {
            "name": self.name,
            "reach": self.reach,
            "stroke_ratio": self.stroke_ratio,
            "glyphs": [
                {"name": glyph.name, "strokes": [[list(a), list(b)] for a, b in glyph.strokes]}
                for glyph in self.glyphs
            ],
        }


def alphabet_named(name: str) -> Alphabet:
    """Return the alphabet called `name`; raises `AlphabetError` that lists the known ones."""
    try:
        return ALPHABETS[name]
    except KeyError:
        raise AlphabetError(
            f"unknown alphabet '{name}'", fix=f"choose one of {', '.join(ALPHABETS)}"
        ) from None


def alphabet_from(definition: Mapping[str, Any]) -> Alphabet:
    """Return the alphabet that the plain values of `Alphabet.definition` describe, checked.

    Raises `AlphabetError` if a value is missing or no number, a node is off {-1, 0, 1} squared, or
    two symbols look alike after a turn.
    """
    try:
        alphabet = Alphabet(
            str(definition["name"]),
            tuple(
                Glyph(str(g["name"]), tuple((_node(a), _node(b)) for a, b in g["strokes"]))
                for g in definition["glyphs"]
            ),
            float(definition["reach"]),
            float(definition["stroke_ratio"]),
        )
    except (KeyError, TypeError, ValueError) as problem:
        raise AlphabetError(
            f"alphabet definition not understood: {problem!r}",
            fix="give name, reach, stroke_ratio and glyphs with name and strokes",
        ) from None
    place = f"alphabet {alphabet.name}"
    for glyph in alphabet.glyphs:
        if any(max(abs(x), abs(y)) > 1 for stroke in glyph.strokes for x, y in stroke):
            raise AlphabetError(
                f"symbol '{glyph.name}' has a node outside {{-1, 0, 1}} x {{-1, 0, 1}}",
                fix="keep its nodes on the 3 x 3 lattice",
                place=place,
            )
    if not (0 < alphabet.stroke_ratio < 1 and 0 < alphabet.reach < 0.5):
        raise AlphabetError(
            f"reach {alphabet.reach:g} and stroke ratio {alphabet.stroke_ratio:g}",
            fix="set reach between 0 and 0.5, stroke_ratio between 0 and 1",
            place=place,
        )
    if ALPHABETS.get(alphabet.name) != alphabet:  # those were checked, and it takes 20 ms
        check_distinguishable(alphabet.name, alphabet.glyphs)
    return alphabet


def _node(pair: Any) -> Node:
    x, y = pair
    if int(x) != x or int(y) != y:
        raise ValueError(f"node {pair} is not on the integer lattice")
    return int(x), int(y)


def line(*nodes: Node) -> tuple[Stroke, ...]:
    """Return the strokes of a broken line through `nodes`."""
    return tuple(itertools.pairwise(nodes))


_L = line((-1, 1), (-1, -1), (1, -1))

_THESIS_2 = (
    Glyph("0", _L),
    Glyph("1", line((-1, -1), (0, -1), (0, 0), (1, 0)) + line((0, 0), (-1, 1))),
)
_DENSE_4 = (
    Glyph("0", _L),
    Glyph("1", line((1, -1), (-1, -1), (-1, 0), (0, 1)) + line((0, -1), (0, 0))),
    Glyph("A", line((-1, -1), (0, -1), (0, 0), (1, 1)) + line((0, 0), (-1, 0))),
    Glyph("A^2", line((-1, 1), (-1, -1), (1, -1), (1, 1))),
)
_LETTERS_4 = (
    Glyph("0", _L),
    Glyph("1", line((1, 1), (-1, 1), (-1, -1), (1, -1)) + line((-1, 0), (0, 0))),
    Glyph("A", line((1, 1), (-1, 1), (-1, -1)) + line((-1, 0), (0, 0))),
    Glyph("A^2", line((1, 1), (-1, 1), (-1, -1), (1, -1))),
)
_DENSE_8 = (
    Glyph("0", line((0, -1), (-1, -1), (-1, 0), (0, 1), (1, 1))),
    Glyph("1", line((-1, -1), (0, -1), (0, 1), (-1, 1)) + line((0, 0), (1, 0))),
    Glyph("A", line((-1, -1), (0, -1), (0, 0), (-1, 0), (-1, -1)) + line((0, 0), (1, 1))),
    Glyph("A^2", line((-1, 0), (-1, -1), (1, -1), (1, 1))),
    Glyph("A^3", line((0, -1), (-1, -1), (-1, 1)) + line((-1, 0), (1, 0))),
    Glyph(
        "A^4",
        line((1, -1), (-1, -1), (-1, 1)) + line((-1, 0), (0, 0), (0, 1), (1, 1)),
    ),
    Glyph("A^5", line((-1, 1), (-1, -1), (0, -1), (0, 0), (1, 0), (1, 1), (0, 1))),
    Glyph("A^6", line((-1, -1), (0, 0), (1, -1)) + line((0, 0), (-1, 1))),
)

# Letters made for tactels (docs/alphabets.md): `tests/campaigns/alphabets.py --printer fdm-0.4`.
_TACTEL_4 = (
    Glyph("0", line((-1, 0), (-1, -1), (0, -1), (1, 0), (1, 1))),
    Glyph("1", line((-1, 1), (-1, -1), (1, -1))),
    Glyph("A", line((-1, -1), (-1, 0), (0, 1), (1, 0), (1, -1))),
    Glyph("A^2", line((-1, -1), (0, -1), (0, 1))),
)
_TACTEL_8 = (
    Glyph("0", line((-1, 0), (-1, -1), (1, -1)) + line((0, -1), (0, 0))),
    Glyph("1", line((-1, -1), (-1, 0), (0, 1), (1, 1))),
    Glyph("A", line((-1, -1), (0, -1), (1, 0), (0, 1))),
    Glyph("A^2", line((-1, -1), (-1, 1)) + line((-1, 0), (1, 0))),
    Glyph("A^3", line((-1, 1), (-1, -1), (0, -1))),
    Glyph("A^4", line((-1, -1), (-1, 0), (0, 1), (1, 0), (1, -1))),
    Glyph("A^5", line((-1, -1), (0, -1), (0, 0), (-1, 1)) + line((0, 0), (1, 1))),
    Glyph("A^6", line((-1, 0), (0, 0), (0, -1)) + line((0, 0), (0, 1))),
)
_TACTEL_16 = (
    Glyph("0", line((-1, -1), (-1, 0), (0, 0), (1, -1)) + line((0, 0), (1, 1))),
    Glyph("1", line((-1, 0), (-1, -1), (1, -1))),
    Glyph("A", line((-1, -1), (0, 0), (-1, 1)) + line((0, 0), (1, 0))),
    Glyph("A^2", line((-1, -1), (0, -1), (1, 0), (0, 1))),
    Glyph("A^3", line((-1, -1), (-1, 0), (0, 1), (1, 1))),
    Glyph("A^4", line((-1, 0), (0, 0), (0, -1)) + line((0, 0), (0, 1))),
    Glyph("A^5", line((-1, 0), (-1, -1), (0, -1), (1, 0), (1, 1))),
    Glyph("A^6", line((-1, -1), (-1, 0), (0, 0), (0, 1), (-1, 1))),
    Glyph("A^7", line((-1, -1), (-1, 1)) + line((-1, 0), (0, 0), (1, -1))),
    Glyph("A^8", line((-1, 1), (-1, -1), (0, -1), (1, 0))),
    Glyph("A^9", line((0, 1), (-1, 0), (-1, -1), (1, -1))),
    Glyph("A^10", line((-1, -1), (-1, 0), (0, 1), (1, 0), (1, -1))),
    Glyph("A^11", line((0, -1), (-1, -1), (-1, 0), (0, 1), (1, 0))),
    Glyph("A^12", line((-1, -1), (0, -1), (0, 0), (-1, 1)) + line((0, 0), (1, 1))),
    Glyph("A^13", line((-1, -1), (-1, 0), (1, 0)) + line((0, -1), (0, 0))),
    Glyph("A^14", line((-1, 1), (-1, -1), (0, -1))),
)

ALPHABETS: dict[str, Alphabet] = {
    alphabet.name: alphabet
    for alphabet in (
        Alphabet("thesis-2", _THESIS_2, 0.29, 0.14),
        Alphabet("dense-4", _DENSE_4, 0.26, 0.20),
        Alphabet("letters-4", _LETTERS_4, 0.29, 0.14),
        Alphabet("dense-8", _DENSE_8, 0.26, 0.20),
        Alphabet("tactel-4", _TACTEL_4, 0.30, 0.20),
        Alphabet("tactel-8", _TACTEL_8, 0.30, 0.20),
        Alphabet("tactel-16", _TACTEL_16, 0.30, 0.20),
    )
}
