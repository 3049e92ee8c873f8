"""Mitres, insets, numbers and names on backs, and triangles of points on a line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from random_shapes import extruded

from generator.errors import SolidError
from generator.layout.placement import Layout
from generator.plane.polygon import signed_area, triangle_areas
from generator.polyhedron.shapes import box as solid_box
from generator.polyhedron.winged import polyhedron
from generator.printers import PRINTERS
from generator.solid import (
    panels,
    prove_closed,
    symbol_clearance_mm,
    top_inset_mm,
    top_insets_mm,
)
from generator.solid.marks import NameMark, Pen, name_places
from generator.solid.plate import inset, mitre, regular, shared_insets
from generator.solid.triangulate import triangulate_rings, without_slivers

FDM = PRINTERS["fdm-0.4"]
EMPTY = Layout("faces", 7.0, ())
SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


@pytest.mark.parametrize("printer", PRINTERS.values(), ids=lambda p: p.name)
@pytest.mark.parametrize(
    "degrees", [5, 30, 60, 70.53, 89.9, 90, 90.1, 110, 179, 180, 200, 270, 350]
)
def test_sides_print_without_support_inside_the_bisecting_plane(printer, degrees):
    theta = math.radians(degrees)
    slope = 1 / math.tan(theta / 2)
    steepest = math.tan(printer.overhang_max_rad)
    for wall in (1.0, 3.0, 8.0):
        side = mitre(theta, wall, printer)
        assert side.top_mm >= 0.0
        assert side.back_mm - side.top_mm <= (wall - side.land_mm) * steepest + 1e-12
        assert (side.land_mm > 0) == (degrees <= 90)
        depth = np.linspace(0.0, wall, 50)
        share = np.maximum(0.0, depth - side.land_mm) / (wall - side.land_mm)
        stands_back = side.top_mm + share * (side.back_mm - side.top_mm)
        apart = (stands_back - depth * slope) * math.sin(theta / 2)
        assert apart.min() >= 0.07 - 1e-9  # half the gap: never beyond the bisecting plane


def test_mitre_of_a_cube_by_hand():
    # Back edge: 3 mm + gap 0.1. At 45 degrees from there to under the land: 2.8 mm.
    side = mitre(math.pi / 2, 3.0, FDM)
    assert (side.top_mm, side.land_mm, side.back_mm) == pytest.approx((0.3, 0.2, 3.1), rel=1e-12)
    assert top_inset_mm(math.pi / 2, 3.0, FDM) == side.top_mm
    assert top_inset_mm(math.radians(120), 3.0, FDM) == 0.0
    assert top_inset_mm(1.5 * math.pi, 3.0, FDM) == 0.0
    assert mitre(1.5 * math.pi, 3.0, FDM).back_mm == pytest.approx(-2.9)
    assert math.isfinite(top_inset_mm(1e-12, 3.0, FDM))


def test_symbols_keep_apart_at_reflex_edges():
    assert symbol_clearance_mm(math.pi / 2, 1.0) == 0.0
    assert symbol_clearance_mm(1.5 * math.pi, 1.0) == pytest.approx(1.0)
    assert symbol_clearance_mm(math.radians(300), 1.0) == pytest.approx(math.sqrt(3))


def test_inset_moves_each_edge_by_its_own_distance():
    found = inset(SQUARE, np.array([1.0, 2.0, 3.0, -0.5]))
    assert found == pytest.approx(np.array([[-0.5, 1], [8, 1], [8, 7], [-0.5, 7]]), abs=1e-14)
    hole = SQUARE[::-1]  # clockwise: material outside, insets grow it
    assert signed_area(inset(hole, np.ones(4))) == pytest.approx(-144.0)


@pytest.mark.parametrize("bend", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
def test_inset_at_flat_corners_has_its_limit(bend):
    ring = np.array([[0.0, 0.0], [5.0, -bend], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    equal = inset(ring, np.ones(5))
    assert equal[1] == pytest.approx([5.0, 1.0 - bend], abs=1e-6)
    insets = shared_insets(ring, np.array([1.0, 2.0, 1.0, 1.0, 1.0]))
    assert insets.tolist() == [2.0, 2.0, 1.0, 1.0, 1.0]
    assert inset(ring, insets)[1] == pytest.approx([5.0, 2.0 - bend], abs=1e-6)
    assert regular([ring], [inset(ring, insets)], 0.1)


def test_collapsed_and_crossing_insets_are_found():
    def fine(distance):
        return regular([SQUARE], [inset(SQUARE, np.full(4, distance))], 0.1)

    assert fine(4.0)
    assert not fine(4.99)
    assert not fine(6.0)
    hole = np.array([[4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 4.0]])
    rings = [SQUARE, hole]
    for distance, wanted in ((1.9, True), (2.1, False)):
        moved = [inset(ring, np.full(4, distance)) for ring in rings]
        assert regular(rings, moved, 0.1) == wanted


def test_too_thick_walls_name_the_face_and_a_wall_that_fits():
    thin = solid_box([60.0, 60.0, 8.0])
    with pytest.raises(SolidError, match=r"F2: .*set wall to 3.7 mm or less") as caught:
        panels(thin, EMPTY, (), 5.0, FDM)
    assert caught.value.place == "F2"
    assert len(panels(thin, EMPTY, (), 3.7, FDM).parts) == 6
    with pytest.raises(SolidError, match="print it whole"):
        panels(solid_box([60.0, 60.0, 1.0]), EMPTY, (), 3.0, FDM)
    with pytest.raises(SolidError, match="wall nan"):
        panels(thin, EMPTY, (), math.nan, FDM)


def test_collinear_edges_with_different_neighbours():
    # A step on one side of a block: the bottom has two edges in one line.
    flat = [(0, 0), (30, 0), (60, 0), (60, 30), (0, 30)]
    vertices = [(x, y, 0) for x, y in flat]
    vertices += [(0, 0, 30), (30, 0, 30), (60, 8, 30), (60, 30, 30), (0, 30, 30)]
    faces = [
        [0, 4, 3, 2, 1], [5, 6, 9], [6, 8, 9], [6, 7, 8], [0, 1, 6, 5], [1, 2, 7], [1, 7, 6],
        [2, 3, 8, 7], [3, 4, 9, 8], [4, 0, 5, 9],
    ]  # fmt: skip
    solid = polyhedron("polyhedron", np.array(vertices, dtype=float), faces)
    insets = top_insets_mm(solid, 0, 3.0, FDM)[0]
    assert insets[3] == insets[4]
    for part in panels(solid, EMPTY, (), 3.0, FDM).parts:
        prove_closed(part)


def test_points_on_a_line_are_kept_without_flat_triangles():
    outer = np.array([[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 3], [1, 3], [0, 3], [0, 1.0]])
    hole = np.array([[1, 1], [1, 2], [2, 2], [2, 1.0]])
    found = triangulate_rings([outer, hole], np.arange(13), "plate")
    p = np.concatenate([outer, hole])[found]
    u, v = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    areas = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    assert set(found.ravel()) == set(range(13))
    assert areas.min() > 1e-3
    assert areas.sum() == pytest.approx(8.0)
    with pytest.raises(SolidError, match="plate"):
        triangulate_rings([outer, hole + np.array([1.5, 0.0])], np.arange(13), "plate")


TEXTS = [
    # box, what its backs say in the order of faces; the sixth as the first
    ((60.0, 60.0, 60.0), "COURSE BLOCK-12", [["COURSE", "BLOCK-12"]] * 5),
    ((60.0, 60.0, 60.0), "\u7acb", [["K7M"]] * 5),
    ((60.0, 40.0, 20.0), "Bracket-12",
     [["BRACKET-12"], ["K7M"], ["K7M"], ["K7M"], ["K7M"]]),
]  # fmt: skip


@pytest.mark.parametrize(("size", "name", "texts"), TEXTS)
def test_every_back_says_object_and_face_beside_its_edges(size, name, texts):
    made = panels(solid_box(size), EMPTY, (), 3.0, FDM, name=name, code="K7M")
    assert made.warnings == ()
    for face, (part, words) in enumerate(zip(made.parts, texts, strict=False), 1):
        said = [e.names[0].rpartition(" figure")[0] for e in part.embossings]
        assert [text for text in said if text.isdecimal()] == said[:4]
        lines = words if words[-1].endswith(f"F{face}") else [*words, f"F{face}"]
        assert said[4:] == lines


def test_a_code_goes_before_numbers_and_what_finds_no_room_is_told():
    made = panels(solid_box((40.0, 14.0, 14.0)), EMPTY, (), 3.0, FDM, name="Tiny", code="K7M")
    said = [{e.names[0].rpartition(" figure")[0] for e in p.embossings} for p in made.parts]
    assert said[2] == {"8"}  # a back of 8 x 8 mm
    assert "mark by hand" in made.warnings[-1]
    assert made.warnings[-1].count("F") == sum(
        not any("F" in text for text in texts) for texts in said
    )
    larger = panels(solid_box((60.0, 40.0, 12.0)), EMPTY, (), 3.0, FDM, name="Tiny", code="K7M")
    said = [{e.names[0].rpartition(" figure")[0] for e in p.embossings} for p in larger.parts]
    assert all(any("F" in text for text in texts) for texts in said)
    assert [w.split(" the ")[0] for w in larger.warnings] == ["no room for"]


OFF_MM = 5e-7  #: of a point from a line of 10 mm: less than 32 bits hold at 20 mm


def test_a_triangle_thinner_than_stl_holds_is_flipped_away():
    points = np.array([(10.0, 10.0), (15.0, 10.0 - OFF_MM), (20.0, 10.0), (15.0, 15.0)])
    found = without_slivers(points, np.array([[0, 1, 2], [0, 2, 3]]))
    rounded = points.astype(np.float32).astype(float)
    assert triangle_areas(rounded[found]).min() > 1.0
    assert triangle_areas(points[found]).sum() == pytest.approx(25.0 + 5.0 * OFF_MM, rel=1e-12)


def test_backs_of_narrow_legs_bear_a_code():
    legs = [(0, 0), (60, 0), (60, 12), (12, 12), (12, 40), (0, 40)]
    bracket = extruded([np.array(legs, float)], 60.0)  # its ends are the faces 0 and 1
    made = panels(bracket, EMPTY, (), 3.0, FDM, name="Bracket", code="AB12")
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
