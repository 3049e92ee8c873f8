"""Names on backs that have room for them in a leg alone."""

from __future__ import annotations

import numpy as np

from generator.layout.placement import Layout
from generator.polyhedron import polyhedron
from generator.printers import printer_named
from generator.solid import panels
from generator.solid.marks import NameMark, Pen, name_places

LEG_MM = 12.0


def bracket():
    """An L of two legs of 12 mm, 60 mm long."""
    corner = [(0, 0), (60, 0), (60, LEG_MM), (LEG_MM, LEG_MM), (LEG_MM, 40), (0, 40)]
    vertices = [(x, y, z) for z in (0.0, 60.0) for x, y in corner]
    sides = [[k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k] for k in range(6)]
    return polyhedron("bracket", vertices, [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides])


def test_backs_of_narrow_legs_bear_a_code():
    made = panels(
        bracket(), Layout("faces", 5.0, ()), (), 3.0, printer_named("fdm-0.4"),
        name="Bracket", code="AB12",
    )  # fmt: skip
    assert not [warning for warning in made.warnings if "mark by hand" in warning]
    on_ells = [{e.names[0].split(" figure")[0] for e in part.embossings} for part in made.parts[:2]]
    named = [{text.replace(" ", "") for text in texts if "AB12" in text} for texts in on_ells]
    assert named == [{"AB12F1"}, {"AB12F2"}]


def test_a_name_in_a_leg_keeps_clear_of_its_sides():
    ring = np.array([(0.0, 0), (53.8, 0), (53.8, 5.8), (5.8, 5.8), (5.8, 33.8), (0, 33.8)])
    pen = Pen(0.8, 0.8, 0.8)
    block = next(name_places(NameMark((((("AB12 F1"),),),)), [ring], [pen], ()))
    (box,) = block
    assert pen.clear <= box.centre[1] - box.half[1]
    assert box.centre[1] + box.half[1] <= 5.8 - pen.clear


def test_no_room_is_no_place():
    ring = np.array([(0.0, 0), (20, 0), (20, 5.0), (0, 5.0)])
    assert not list(name_places(NameMark(((("AB12 F1",),),)), [ring], [Pen(0.8, 0.8, 0.8)], ()))
