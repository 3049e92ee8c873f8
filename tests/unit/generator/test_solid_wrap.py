"""Symbols on round faces: closed, of the right volume, at the right height."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.errors import SolidError
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.plane.polygon import signed_area
from generator.polyhedron.development import development
from generator.polyhedron.shapes import cone, cylinder
from generator.printers import printer_named
from generator.solid import body_mesh, emboss_whole, prove_closed, symbol_meshes, triangles, volume
from generator.solid.analytic import bend_problem
from generator.solid.closed import edges_once
from generator.solid.measure import symbol_volume
from generator.solid.wrapped import NUDGE_MM, Knife, strip_of

STYLE = SymbolStyle()
TIERS = outlines(alphabet_named("dense-4"), STYLE)


def layout_on(solid, centres, labels, rotation=0.0):
    """Symbols at places in the development of the side, as a layout has them."""
    none = np.empty(0, np.int64)
    faces = [
        FaceLayout(k, Placement(0, 0, 0.0, 0.0, 0.0), none, none, none, np.empty((0, 2)), 0)
        for k in range(len(solid.faces))
    ]
    carrier = solid.surfaces[0].carrier
    numbers = np.arange(len(labels))
    faces[carrier] = FaceLayout(
        carrier, Placement(0, 0, rotation, 0.0, 0.0), numbers, numbers,
        np.array(labels), np.array(centres, float), 1,
    )  # fmt: skip
    return Layout("faces", STYLE.pitch_mm, tuple(faces))


def mesh_volume(mesh):
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def is_closed(mesh):
    start = mesh.triangles.ravel()
    return edges_once(start, np.roll(mesh.triangles, -1, axis=1).ravel())


SOLIDS = {"cylinder": cylinder(60, 80), "cone": cone(80, 80, 40), "pointed": cone(80, 70)}
CENTRES = [(20.0, 12.0), (27.3, 14.0), (40.0, 30.0), (12.0, 24.5), (33.0, 16.0)]


@pytest.mark.parametrize("kind", SOLIDS)
def test_wrapped_symbols_make_one_closed_part(kind):
    solid = SOLIDS[kind]
    part = emboss_whole(solid, layout_on(solid, CENTRES, [0, 1, 2, 3, 1], 0.3), TIERS, "Part")
    prove_closed(part)
    mesh = triangles(part)
    assert is_closed(mesh)
    assert part.symbols == 5
    assert mesh_volume(mesh) == pytest.approx(volume(part), rel=1e-12)
    # Symbols spread as they rise: by z / r of the width around the face at most.
    body, (symbols,) = body_mesh(part), symbol_meshes(part)
    assert is_closed(body)
    assert is_closed(symbols)
    assert mesh_volume(body) + mesh_volume(symbols) == pytest.approx(volume(part), rel=1e-12)
    flat = sum(symbol_volume(TIERS[label]) for label in (0, 1, 2, 3, 1))
    plain = volume(
        emboss_whole(solid, layout_on(solid, np.empty((0, 2)), np.empty(0, int)), TIERS, "")
    )
    assert flat < volume(part) - plain < flat * (1 + 1.0 / 20)


def test_tops_lie_at_their_height_over_the_facets():
    solid = SOLIDS["cylinder"]
    part = emboss_whole(solid, layout_on(solid, CENTRES, [0, 1, 2, 3, 1]), TIERS, "Part")
    d = development(solid, solid.surfaces[0])
    tops = [facet for facet in part.facets if facet.name.endswith("/top")]
    assert tops
    for facet in tops:
        points = part.vertices[[k for loop in facet.loops for k in loop]]
        points = points + part.T_object_part[:3, 3]
        heights = np.array([(points - T[:3, 3]) @ T[:3, 2] for T in d.T_object_flat])
        level = np.abs(heights - STYLE.height_mm).max(axis=1)
        assert level.min() < 1e-9


@given(st.floats(5.0, 180.0), st.floats(6.0, 70.0), st.floats(-math.pi, math.pi), st.integers(0, 3))
@settings(max_examples=40, deadline=None)
def test_pieces_of_a_symbol_cover_it_wherever_it_stands(x, y, rotation, label):
    strip = strip_of(development(SOLIDS["cylinder"], SOLIDS["cylinder"].surfaces[0]))
    R = np.array([[np.cos(rotation), -np.sin(rotation)], [np.sin(rotation), np.cos(rotation)]])
    centre = np.array([x, y])
    rings = [[ring @ R.T + centre for ring in tier] for tier in TIERS[label].rings]
    cut = Knife(strip, rings, list(TIERS[label].z_mm), centre, "here").cut()
    flat = np.array(cut.flat)
    for pieces, tier in ((cut.feet, rings[0]), (cut.tops, rings[-1])):
        area = sum(signed_area(flat[list(loop)]) for _, loops in pieces for loop in loops)
        length = sum(float(np.hypot(*(ring - np.roll(ring, 1, 0)).T).sum()) for ring in tier)
        wanted = sum(signed_area(ring) for ring in tier)
        assert area == pytest.approx(wanted, abs=2 * NUDGE_MM * length)
    for number, line in enumerate(cut.line):
        if line >= 0:
            assert abs(strip.beside(line, flat[number : number + 1])[0]) < 1e-9


def test_corners_on_a_line_are_moved_off_it():
    solid = SOLIDS["cylinder"]
    d = development(solid, solid.surfaces[0])
    # A symbol upright on a line: edges of its strokes would run along other lines, too.
    on_line = [(float(d.low[k][0]) + 1e-12, 8.0 * k) for k in range(2, 7)]
    part = emboss_whole(solid, layout_on(solid, on_line, [0, 1, 2, 3, 0]), TIERS, "Part")
    prove_closed(part)
    mesh = triangles(part)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    assert is_closed(mesh)
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-9


def test_a_symbol_over_the_seam_is_refused():
    solid = SOLIDS["cylinder"]
    with pytest.raises(SolidError, match="reaches over the side"):
        emboss_whole(solid, layout_on(solid, [(2.0, 30.0)], [0]), TIERS, "Part")
    with pytest.raises(SolidError, match="lies beside its face"):
        emboss_whole(solid, layout_on(solid, [(-2.0, 30.0)], [0]), TIERS, "Part")


def test_a_hole_that_is_too_narrow_is_told():
    printer = printer_named("fdm-0.4")
    convex = development(SOLIDS["cylinder"], SOLIDS["cylinder"].surfaces[0])
    assert bend_problem(convex, TIERS, STYLE, printer) == ""
    hole = dataclasses.replace(convex, bends=-convex.bends)  # the same facets seen from inside
    assert bend_problem(hole, TIERS, STYLE, printer) == ""
    thin = dataclasses.replace(STYLE, stroke_mm=0.82)
    assert "narrows strokes to 0.79 mm" in bend_problem(hole, TIERS, thin, printer)
    high = dataclasses.replace(STYLE, height_mm=31.0)
    assert "meet in its middle" in bend_problem(hole, TIERS, high, printer)
