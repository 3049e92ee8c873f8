"""The name of a panel on its back: ways to write it, and places for it, best first."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from generator.solid.emboss import turn
from generator.solid.mark_room import Pen, Ring, TextBox, closer_than, has_room
from generator.solid.settings import EMBOSS


@dataclass(frozen=True, slots=True)
class NameMark:
    """What a panel is called: ways to write it in lines, the best ways first.

    The ways of one rank are as good as each other: the largest that finds room is taken.
    """

    ranks: tuple[tuple[tuple[str, ...], ...], ...]

    @classmethod
    def of(cls, name: str | None, code: str, face: str) -> NameMark:
        """Return the mark of a face: the object's name in capitals, or its code."""
        ranks: list[tuple[tuple[str, ...], ...]] = []
        if name is not None:
            ranks.append(((name, face), (f"{name} {face}",), *_broken(name, face)))
        if code:
            ranks.append(((code, face), (f"{code} {face}",), (f"{code}{face}",)))
        return cls((*ranks,) if ranks else (((face,),),))


def name_places(
    name: NameMark, rings: Sequence[Ring], pens: Sequence[Pen], taken: Sequence[TextBox]
) -> Iterator[list[TextBox]]:
    """Yield the lines of a name where they find room: best rank, largest size, middle first."""
    middles = _middles((rings[0].min(axis=0) + rings[0].max(axis=0)) / 2, rings)
    angles = _angles(rings)
    for ways, pen in itertools.product(name.ranks, pens):
        apart = EMBOSS.name_apart * pen.clear
        for angle, lines in itertools.product(angles, ways):
            half = pen.half_block(lines)
            centres = np.concatenate([middles, _beside_edges(rings, angle, half, pen.clear)])
            for centre in centres[has_room(centres, angle, half, pen.clear, rings)]:
                block = TextBox("", centre, angle, half, pen)
                if not any(closer_than(block, other, apart) for other in taken):
                    yield _lines_of(block, lines)


def _angles(rings: Sequence[Ring]) -> list[float]:
    """Return directions to read a name in: upright ones first, then those of the longest edges."""
    sides = np.concatenate([np.roll(ring, -1, axis=0) - ring for ring in rings])
    lengths = np.round(np.hypot(*sides.T), 6)
    angles = [0.0, math.pi / 2]
    for side in sides[np.argsort(-lengths, kind="stable")]:
        slant = math.atan2(side[1], side[0])
        if min(abs(math.remainder(slant - angle, math.pi)) for angle in angles) > 1e-6:
            angles.append(slant)
        if len(angles) == EMBOSS.name_angles:
            break
    return angles


def _beside_edges(
    rings: Sequence[Ring], angle: float, half: tuple[float, float], clear: float
) -> Ring:
    """Return centres (k, 2) at which a block stands along an edge: for narrow legs of a back."""
    found = [np.zeros((0, 2))]
    places = np.array(EMBOSS.mark_places)[:, None]
    for ring in rings:
        sides = np.roll(ring, -1, axis=0) - ring
        slants = np.arctan2(sides[:, 1], sides[:, 0]) - angle
        for start, side, slant in zip(ring, sides, slants.tolist(), strict=True):
            if abs(math.remainder(slant, math.pi)) < 1e-6:
                inward = np.array([-side[1], side[0]]) / np.hypot(*side)
                found.append(start + places * side + (half[1] + clear * (1 + 1e-6)) * inward)
    return np.concatenate(found)


def _broken(name: str, face: str) -> list[tuple[str, ...]]:
    """Return a name broken into two or three lines at spaces and dashes, its face below.

    A number stays with the word before it: it may be that of a copy.
    """
    words = re.split(r" (?!\d)|(?<=-)(?!\d)", name)
    found: list[tuple[str, ...]] = []
    for count in range(2, min(3, len(words)) + 1):
        lines = [words[k * len(words) // count : (k + 1) * len(words) // count]
                 for k in range(count)]  # fmt: skip
        found.append((*(" ".join(line).replace("- ", "-") for line in lines), face))
    return found


def _lines_of(block: TextBox, lines: Sequence[str]) -> list[TextBox]:
    """Return the lines of a block, from the top."""
    pen, up = block.pen, turn(block.angle)[:, 1]
    top = block.half[1]
    found = []
    for line in lines:
        half = pen.half_size(line)
        found.append(TextBox(line, block.centre + (top - half[1]) * up, block.angle, half, pen))
        top -= 2 * half[1] + pen.gap
    return found


def _middles(centre: Ring, rings: Sequence[Ring]) -> Ring:
    """Return points to try for the name: the middle of the back, then a grid by distance."""
    low, high = rings[0].min(axis=0), rings[0].max(axis=0)
    shares = np.linspace(0.1, 0.9, 9)
    grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2) * (high - low) + low
    order = np.argsort(np.round(((grid - centre) ** 2).sum(axis=1), 9), kind="stable")
    return np.concatenate([centre[None], grid[order]])
