"""What is engraved on the back of a panel, so that the right panels meet at the right edges.

Back polygon + edge numbers + name -> embossings of V-grooves with 45 degree walls, which print
without support on the bed. Facet frame of the back, seen from outside the panel: mm, every
number stands on its edge. All numbers of a panel have one size: the largest of a few at
which all of them find room, or the smallest, and then those without room are reported. The
name stands in the middle, written out where there is room, else as a short code; where even
that has none, it goes before the numbers.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.figures import needs_bar
from generator.alphabet.outline import Tiers
from generator.printers import Printer
from generator.solid.mark_groove import groove_embossing
from generator.solid.mark_name import NameMark, name_places
from generator.solid.mark_room import Pen, Ring, TextBox, closer_than, has_room
from generator.solid.part import Embossing
from generator.solid.settings import EMBOSS


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

    Parameters
    ----------
    edges
        Numbers of the panel's edges.
    name
        Of the panel.
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
    pens = [Pen(size * stroke, stroke, stroke) for size in EMBOSS.mark_sizes]
    numbers = _place_numbers(edges, rings, pens)
    written = next(name_places(name, rings, pens, numbers), [])
    if not written:  # the name goes first, where it leaves most numbers their room
        most = -1
        code = NameMark(name.ranks[-1:])
        for block in itertools.islice(name_places(code, rings, pens[-1:], ()), EMBOSS.name_tries):
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
        centres = mark.start + np.array(EMBOSS.mark_places)[:, None] * along + lift
        for centre in centres[has_room(centres, angle, half, pen.clear, rings)]:
            box = TextBox(mark.text, centre, angle, half, pen, bar)
            near = any(closer_than(box, other, pen.clear) for other in placed)
            apart = EMBOSS.name_apart * pen.clear
            if not near and not any(closer_than(box, other, apart) for other in taken):
                placed.append(box)
                break
    return placed
