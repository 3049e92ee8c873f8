"""Mitres, insets, numbers and names on backs, and triangles of points on a line."""

from __future__ import annotations

import math

import numpy as np
import pytest
from random_shapes import extruded

from generator.errors import SolidError
from generator.layout.placement import Layout
from generator.plane.polygon import triangle_areas
from generator.polyhedron.shapes import box
from generator.polyhedron.winged import polyhedron
from generator.printers import PRINTERS
from generator.solid import (
    panels,
    prove_closed,
    symbol_clearance_mm,
    top_inset_mm,
    top_insets_mm,
)
from generator.solid.plate import inset, mitre, regular, shared_insets
from generator.solid.triangulate import triangulate_rings, without_slivers

FDM = PRINTERS["fdm-0.4"]
EMPTY = Layout("faces", 7.0, ())
SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


@pytest.mark.parametrize("printer", PRINTERS.values(), ids=lambda p: p.name)
def test_sides_print_without_support_inside_the_bisecting_plane(printer):
    steepest = math.tan(printer.overhang_max_rad)
    for degrees in (5, 30, 60, 70.53, 89.9, 90, 90.1, 110, 179, 180, 200, 270, 350):
        theta = math.radians(degrees)
        for wall in (1.0, 3.0, 8.0):
            side = mitre(theta, wall, printer)
            assert side.top_mm >= 0.0
            assert side.back_mm - side.top_mm <= (wall - side.land_mm) * steepest + 1e-12
            assert (side.land_mm > 0) == (degrees <= 90)
            depth = np.linspace(0.0, wall, 50)
            share = np.maximum(0.0, depth - side.land_mm) / (wall - side.land_mm)
            stands_back = side.top_mm + share * (side.back_mm - side.top_mm)
            apart = (stands_back - depth / math.tan(theta / 2)) * math.sin(theta / 2)
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
    clear = [symbol_clearance_mm(math.radians(angle), 1.0) for angle in (90, 270, 300)]
    assert clear == pytest.approx([0.0, 1.0, math.sqrt(3)])  # symbols apart at reflex edges


@pytest.mark.parametrize("bend", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3])
def test_inset_at_flat_corners_has_its_limit(bend):
    ring = np.array([[0.0, 0.0], [5.0, -bend], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
    assert inset(ring, np.ones(5))[1] == pytest.approx([5.0, 1.0 - bend], abs=1e-6)
    insets = shared_insets(ring, np.array([1.0, 2.0, 1.0, 1.0, 1.0]))
    assert insets.tolist() == [2.0, 2.0, 1.0, 1.0, 1.0]
    assert inset(ring, insets)[1] == pytest.approx([5.0, 2.0 - bend], abs=1e-6)
    assert regular([ring], [inset(ring, insets)], 0.1)


def test_collapsed_and_crossing_insets_are_found():
    hole = np.array([[4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 4.0]])
    for rings, distance, wanted in (
        ([SQUARE], 4.0, True), ([SQUARE], 4.99, False), ([SQUARE], 6.0, False),
        ([SQUARE, hole], 1.9, True), ([SQUARE, hole], 2.1, False),
    ):  # fmt: skip
        moved = [inset(ring, np.full(4, distance)) for ring in rings]
        assert regular(rings, moved, 0.1) == wanted


def test_too_thick_walls_name_the_face_and_a_wall_that_fits():
    thin = box([60.0, 60.0, 8.0])
    with pytest.raises(SolidError, match=r"F2: .*set wall to 3.7 mm or less") as caught:
        panels(thin, EMPTY, (), 5.0, FDM)
    assert caught.value.place == "F2"
    assert len(panels(thin, EMPTY, (), 3.7, FDM).parts) == 6
    with pytest.raises(SolidError, match="print it whole"):
        panels(box([60.0, 60.0, 1.0]), EMPTY, (), 3.0, FDM)
    with pytest.raises(SolidError, match="wall nan"):
        panels(thin, EMPTY, (), math.nan, FDM)
    for gap in (0.0, math.nan):
        with pytest.raises(SolidError, match="set gap to more than 0"):
            panels(thin, EMPTY, (), 3.0, FDM, gap_mm=gap)


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
    areas = triangle_areas(np.concatenate([outer, hole])[found])
    assert set(found.ravel()) == set(range(13))
    assert areas.min() > 1e-3
    assert areas.sum() == pytest.approx(8.0)
    with pytest.raises(SolidError, match="plate"):
        triangulate_rings([outer, hole + np.array([1.5, 0.0])], np.arange(13), "plate")


OFF_MM = 5e-7  #: of a point from a line of 10 mm: less than 32 bits hold at 20 mm


def test_a_triangle_thinner_than_stl_holds_is_flipped_away():
    points = np.array([(10.0, 10.0), (15.0, 10.0 - OFF_MM), (20.0, 10.0), (15.0, 15.0)])
    found = without_slivers(points, np.array([[0, 1, 2], [0, 2, 3]]))
    rounded = points.astype(np.float32).astype(float)
    assert triangle_areas(rounded[found]).min() > 1.0
    assert triangle_areas(points[found]).sum() == pytest.approx(25.0 + 5.0 * OFF_MM, rel=1e-12)


def backs(solid, name, code):
    """Return what stands on each back, and the warnings."""
    made = panels(solid, EMPTY, (), 3.0, FDM, name=name, code=code)
    said = [{e.names[0].rpartition(" figure")[0] for e in part.embossings} for part in made.parts]
    return said, made.warnings


def test_a_code_goes_before_numbers_and_what_finds_no_room_is_told():
    said, warnings = backs(box((40.0, 14.0, 14.0)), "Tiny", "K7M")
    assert said[2] == {"8"}  # a back of 8 x 8 mm
    assert "mark by hand" in warnings[-1]
    unnamed = sum(not any("F" in text for text in texts) for texts in said)
    assert warnings[-1].count("F") == unnamed
    said, warnings = backs(box((60.0, 40.0, 12.0)), "Tiny", "K7M")
    assert all(any("F" in text for text in texts) for texts in said)
    assert [w.split(" the ")[0] for w in warnings] == ["no room for"]
    said, warnings = backs(box((60.0, 60.0, 60.0)), "\u7acb", "K7M")
    assert [texts & {"K7M", f"F{k}"} for k, texts in enumerate(said, 1)] == [
        {"K7M", f"F{k}"} for k in range(1, 7)
    ]


def test_backs_of_narrow_legs_bear_a_code():
    legs = [(0, 0), (60, 0), (60, 12), (12, 12), (12, 40), (0, 40)]
    said, warnings = backs(extruded([np.array(legs, float)], 60.0), "Bracket", "AB12")
    assert not [warning for warning in warnings if "mark by hand" in warning]
    named = [{text.replace(" ", "") for text in texts if "AB12" in text} for texts in said[:2]]
    assert named == [{"AB12F1"}, {"AB12F2"}]  # its ends are the faces 0 and 1
