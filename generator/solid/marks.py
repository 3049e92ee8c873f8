"""Numbers engraved on the back of a panel, so that a box of panels can be assembled.

Back polygon + edge numbers -> embossings of V-grooves with 45 degree walls, which print
without support on the bed. Facet frame of the back, seen from outside the panel: mm, every
number stands on its edge. All numbers of a panel have one size: the largest of a few at
which all of them find room, or the smallest, and then those without room are reported.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.figures import BAR, FIGURES, figures_of, needs_bar
from generator.alphabet.outline import Tiers, engrave
from generator.plane.rings import boxes_inside
from generator.printers import Printer
from generator.solid.emboss import turn
from generator.solid.part import Embossing
from generator.solid.settings import EMBOSS

Ring = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BackMark:
    """A number and the line it stands on; `end` equal to `start` means the middle of the face."""

    text: str  #: digits, or F and digits
    start: Ring  #: (2,) mm
    end: Ring  #: (2,) mm


@dataclass(frozen=True, slots=True)
class _Pen:
    """Sizes of the figures, mm."""

    unit: float
    stroke: float
    clear: float

    def half_size(self, text: str) -> tuple[float, float]:
        """Half width and half height of a text with its bar."""
        width = len(text) * (2 * self.unit + self.stroke) + (len(text) - 1) * self.clear
        height = 4 * self.unit + self.stroke
        return width / 2, (height + (2 * self.stroke if needs_bar(text) else 0.0)) / 2


@dataclass(frozen=True, slots=True)
class _Box:
    """A text's place: centre, direction of reading, half sizes."""

    text: str
    centre: Ring
    angle: float
    half: tuple[float, float]


def marks_on(
    marks: Sequence[BackMark],
    rings: Sequence[Ring],
    facet: int,
    T_part_facet: NDArray[np.float64],
    wall_mm: float,
    printer: Printer,
) -> tuple[tuple[Embossing, ...], tuple[str, ...]]:
    """Return the numbers engraved on a facet, and the texts that found no room.

    Parameters
    ----------
    marks
        In order of importance.
    rings
        (k, 2) loops of the facet in its frame, mm.
    facet, T_part_facet
        Number and frame of the facet.
    wall_mm
        Thickness of the panel; grooves take a third of it at most.
    printer
        Gives the stroke.
    """
    stroke = printer.stroke_min_mm
    depth = min(EMBOSS.mark_depth * stroke, wall_mm / 3)
    best: list[_Box] = []
    pen = _Pen(EMBOSS.mark_sizes[-1] * stroke, stroke, stroke)
    edges = [mark for mark in marks if (mark.start != mark.end).any()]
    for size in EMBOSS.mark_sizes:
        trial = _Pen(size * stroke, stroke, stroke)
        boxes = _place_marks(edges, rings, trial)
        if len(boxes) > len(best) or not edges:
            best, pen = boxes, trial
        if len(boxes) == len(edges):
            break
    middle = [mark for mark in marks if (mark.start == mark.end).all()]
    best = best + _place_marks(middle, rings, pen, best)
    done = [box.text for box in best]
    missing = [mark.text for mark in marks if mark.text not in done]
    tiers: dict[int, Tiers] = {}
    return (
        tuple(_mark_embossing(box, pen, depth, facet, T_part_facet, tiers) for box in best),
        tuple(missing),
    )


def _place_marks(
    marks: Sequence[BackMark], rings: Sequence[Ring], pen: _Pen, taken: Sequence[_Box] = ()
) -> list[_Box]:
    """Return places for the marks that find room beside those already taken."""
    placed: list[_Box] = []
    for mark in marks:
        half = pen.half_size(mark.text)
        along = mark.end - mark.start
        length = float(np.hypot(*along))
        if length > 0:
            axis = along / length
            inward = np.array([-axis[1], axis[0]])
            angle = math.atan2(axis[1], axis[0])
            lift = (half[1] + pen.clear * (1 + 1e-6)) * inward
            centres = mark.start + np.array(EMBOSS.mark_places)[:, None] * along + lift
        else:
            angle = 0.0
            centres = _middles(mark.start, rings)
        for centre in centres[_has_room(centres, angle, half, pen.clear, rings)]:
            box = _Box(mark.text, centre, angle, half)
            if not any(_closer_than(box, other, pen.clear) for other in [*taken, *placed]):
                placed.append(box)
                break
    return placed


def _middles(centre: Ring, rings: Sequence[Ring]) -> Ring:
    """Return points to try for the face's own number: its middle, then a grid by distance."""
    low, high = rings[0].min(axis=0), rings[0].max(axis=0)
    shares = np.linspace(0.1, 0.9, 9)
    grid = np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2) * (high - low) + low
    order = np.argsort(np.round(((grid - centre) ** 2).sum(axis=1), 9), kind="stable")
    return np.concatenate([centre[None], grid[order]])


def _has_room(
    centres: Ring, angle: float, half: tuple[float, float], clear: float, rings: Sequence[Ring]
) -> NDArray[np.bool_]:
    """Whether rectangles at `centres` keep clear of all edges and lie inside."""
    R = turn(angle)
    return boxes_inside(centres @ R, np.array(half) + clear, [ring @ R for ring in rings])


def _closer_than(one: _Box, other: _Box, clear: float) -> bool:
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


def _mark_embossing(
    box: _Box,
    pen: _Pen,
    depth: float,
    facet: int,
    T_part_facet: NDArray[np.float64],
    tiers: dict[int, Tiers],
) -> Embossing:
    """Return one text as an embossing: a label for each figure, then the bars."""
    step = 2 * pen.unit + pen.stroke + pen.clear
    figures = figures_of(box.text)
    bars = needs_bar(box.text)
    x = (np.arange(len(figures)) - (len(figures) - 1) / 2) * step
    y = np.full(len(figures), pen.stroke if bars else 0.0)
    local = np.stack([x, y], axis=1)
    names = [f"{box.text} figure {k + 1}" for k in range(len(figures))]
    if bars:
        figures = figures + [BAR] * len(figures)
        low = np.stack([x, np.full(len(x), pen.stroke / 2 - box.half[1])], axis=1)
        local = np.concatenate([local, low])
        names += [f"{box.text} bar {k + 1}" for k in range(len(x))]
    used = sorted(set(figures))
    for figure in used:
        if figure not in tiers:
            tiers[figure] = engrave(FIGURES[figure], pen.unit, pen.stroke, depth)
    return Embossing(
        facet=facet,
        face=None,
        T_part_facet=T_part_facet,
        rotation_rad=box.angle,
        centres_mm=box.centre + local @ turn(box.angle).T,
        labels=np.array([used.index(figure) for figure in figures], dtype=np.int64),
        names=tuple(names),
        tiers=tuple(tiers[figure] for figure in used),
    )
