"""Engrave the back of a panel, so that the right panels meet at the right edges.

Texts are rectangles in the facet frame of the back, seen from outside the panel, mm. V-grooves
with 45 degree walls print without support on the bed; every number stands on its edge. All
numbers of a panel have the largest of a few sizes at which all find room, or the smallest, and
then those without room are reported. The name stands in the middle, written out where there is
room, else as a short code; where even that has none, it goes before the numbers.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.figures import BAR, FIGURES, figures_of, needs_bar
from generator.alphabet.outline import Tiers, engrave
from generator.plane.polygon import boxes_inside
from generator.printers import Printer
from generator.solid.part import Embossing, turn

Ring = NDArray[np.float64]

#: Lattice unit of a back's figures, in strokes; the smallest keeps a gap of one stroke.
MARK_SIZES = (2.0, 1.5, 1.25, 1.0)
MARK_DEPTH = 0.4  #: of a figure, over its stroke: a fifth of the stroke is left as a floor
_PLACES = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9)  # of a number along its edge, best first
_NAME_APART = 2.0  # between name and number, in gaps of two figures: they are not read as one
_NAME_ANGLES = 6  # directions of edges, upright ones first, in which a name may be read
_NAME_TRIES = 200  # places of a code that are tried where it takes the room of numbers


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
    axes = _separating_axes(one.angle, one.half, other.angle, other.half, clear)
    return all(abs(float(axis @ between)) < reach for axis, reach in axes)


@lru_cache(maxsize=1024)
def _separating_axes(
    angle: float,
    half: tuple[float, float],
    other_angle: float,
    other_half: tuple[float, float],
    clear: float,
) -> list[tuple[Ring, float]]:
    """Return the axes of two turned rectangles, and the distance of centres that parts them."""
    found = []
    for axis in (*turn(angle).T, *turn(other_angle).T):
        reach = clear
        for box_angle, box_half in ((angle, half), (other_angle, other_half)):
            reach += float(np.abs(axis @ turn(box_angle)) @ np.array(box_half))
        found.append((axis, reach))
    return found


@dataclass(frozen=True, slots=True)
class NameMark:
    """What a panel is called: ways to write it in lines, the best rank first.

    The ways of one rank are equally good: the largest that finds room is taken.
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
        apart = _NAME_APART * pen.clear
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
        if len(angles) == _NAME_ANGLES:
            break
    return angles


def _beside_edges(
    rings: Sequence[Ring], angle: float, half: tuple[float, float], clear: float
) -> Ring:
    """Return centres (k, 2) at which a block stands along an edge: for narrow legs of a back."""
    found = [np.zeros((0, 2))]
    places = np.array(_PLACES)[:, None]
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


def groove_embossing(
    box: TextBox,
    depth: float,
    facet: int,
    T_part_facet: NDArray[np.float64],
    tiers: dict[tuple[int, float], Tiers],
) -> Embossing:
    """Return one text as an embossing: a label for each figure, then the bars."""
    pen = box.pen
    step = 2 * pen.unit + pen.stroke + pen.clear
    letters = [k for k, letter in enumerate(box.text) if letter != " "]
    figures = figures_of(box.text.replace(" ", ""))
    x = (np.array(letters) - (len(box.text) - 1) / 2) * step
    y = np.full(len(figures), pen.stroke if box.bar else 0.0)
    local = np.stack([x, y], axis=1)
    names = [f"{box.text} figure {k + 1}" for k in range(len(figures))]
    if box.bar:
        figures = figures + [BAR] * len(figures)
        low = np.stack([x, np.full(len(x), pen.stroke / 2 - box.half[1])], axis=1)
        local = np.concatenate([local, low])
        names += [f"{box.text} bar {k + 1}" for k in range(len(x))]
    used = sorted(set(figures))
    for figure in used:
        if (figure, pen.unit) not in tiers:
            tiers[figure, pen.unit] = engrave(FIGURES[figure], pen.unit, pen.stroke, depth)
    return Embossing(
        facet=facet,
        face=None,
        T_part_facet=T_part_facet,
        rotation_rad=box.angle,
        centres_mm=box.centre + local @ turn(box.angle).T,
        labels=np.array([used.index(figure) for figure in figures], dtype=np.int64),
        names=tuple(names),
        tiers=tuple(tiers[figure, pen.unit] for figure in used),
    )


@dataclass(frozen=True, slots=True)
class EdgeMark:
    """A number and the line it stands on."""

    text: str  #: digits
    start: Ring  #: (2,) mm
    end: Ring  #: (2,) mm


@dataclass(frozen=True, slots=True)
class BackMarks:
    """What found room on a back."""

    embossings: tuple[Embossing, ...]
    missing: tuple[str, ...]  #: numbers of edges without room
    named: bool  #: whether the name, or its code, found room


def marks_on(
    edges: Sequence[EdgeMark],
    name: NameMark,
    rings: Sequence[Ring],
    facet: int,
    T_part_facet: NDArray[np.float64],
    wall_mm: float,
    printer: Printer,
) -> BackMarks:
    """Return what is engraved on a facet, and what found no room.

    `rings`: (k, 2) loops of the facet in its frame, mm. Grooves take a third of the wall at most.
    """
    stroke = printer.stroke_min_mm
    depth = min(MARK_DEPTH * stroke, wall_mm / 3)
    pens = [Pen(size * stroke, stroke, stroke) for size in MARK_SIZES]
    numbers = _place_numbers(edges, rings, pens)
    written = next(name_places(name, rings, pens, numbers), [])
    if not written:  # the name goes first, where it leaves most numbers their room
        most = -1
        code = NameMark(name.ranks[-1:])
        for block in itertools.islice(name_places(code, rings, pens[-1:], ()), _NAME_TRIES):
            left = _place_edges(edges, rings, pens[-1], block)
            if len(left) > most:
                most, written, numbers = len(left), block, left
            if most == len(edges):
                break
    tiers: dict[tuple[int, float], Tiers] = {}
    done = [box.text for box in numbers]
    return BackMarks(
        tuple(
            groove_embossing(box, depth, facet, T_part_facet, tiers) for box in [*numbers, *written]
        ),
        tuple(edge.text for edge in edges if edge.text not in done),
        bool(written),
    )


def _place_numbers(
    edges: Sequence[EdgeMark], rings: Sequence[Ring], pens: Sequence[Pen]
) -> list[TextBox]:
    """Return places for the numbers of edges, in the largest size at which most find room."""
    best: list[TextBox] = []
    for pen in pens:
        boxes = _place_edges(edges, rings, pen, ())
        if len(boxes) > len(best):
            best = boxes
        if len(boxes) == len(edges):
            break
    return best


def _place_edges(
    edges: Sequence[EdgeMark], rings: Sequence[Ring], pen: Pen, taken: Sequence[TextBox]
) -> list[TextBox]:
    placed: list[TextBox] = []
    for mark in edges:
        bar = needs_bar(mark.text)
        half = pen.half_size(mark.text, bar=bar)
        along = mark.end - mark.start
        axis = along / float(np.hypot(*along))
        angle = math.atan2(axis[1], axis[0])
        lift = (half[1] + pen.clear * (1 + 1e-6)) * np.array([-axis[1], axis[0]])
        centres = mark.start + np.array(_PLACES)[:, None] * along + lift
        for centre in centres[has_room(centres, angle, half, pen.clear, rings)]:
            box = TextBox(mark.text, centre, angle, half, pen, bar)
            near = any(closer_than(box, other, pen.clear) for other in placed)
            apart = _NAME_APART * pen.clear
            if not near and not any(closer_than(box, other, apart) for other in taken):
                placed.append(box)
                break
    return placed
