"""Symbols on round faces: closed, of the right volume and height, as cylinders and cones too."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference.laid_symbols import is_closed, layout_on_round_face, mesh_volume

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.errors import SolidError
from generator.plane.polygon import signed_area
from generator.polyhedron.development import development
from generator.polyhedron.shapes import cone, cylinder
from generator.polyhedron.winged import Face
from generator.printers import printer_named
from generator.solid import (
    body_mesh,
    emboss_whole,
    prove_closed,
    round_volume,
    symbol_meshes,
    triangles,
    volume,
)
from generator.solid.analytic import (
    analytic_faces,
    bend_problem,
)
from generator.solid.measure import symbol_volume
from generator.solid.wrapped import NUDGE_MM, Knife, strip_of

STYLE = SymbolStyle()
TIERS = outlines(alphabet_named("dense-4"), STYLE)


SOLIDS = {"cylinder": cylinder(60, 80), "cone": cone(80, 80, 40), "pointed": cone(80, 70)}
EXACT_MM3 = {
    "cylinder": math.pi * 30**2 * 80,
    "cone": math.pi * 80 / 3 * (40**2 + 40 * 20 + 20**2),
    "pointed": math.pi * 70 / 3 * 40**2,
}
CENTRES = [(20.0, 12.0), (27.3, 14.0), (40.0, 30.0), (12.0, 24.5), (33.0, 16.0)]


@pytest.mark.parametrize("kind", SOLIDS)
def test_wrapped_symbols_make_one_closed_part(kind):
    solid = SOLIDS[kind]
    layout = layout_on_round_face(solid, CENTRES, [0, 1, 2, 3, 1], 0.3)
    part = emboss_whole(solid, layout, TIERS, "Part")
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
    plain = volume(emboss_whole(solid, layout_on_round_face(solid, [], []), TIERS, ""))
    assert flat < volume(part) - plain < flat * (1 + 1.0 / 20)


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
            assert abs(strip.across(line, flat[number : number + 1])[0]) < 1e-9


def test_corners_on_a_line_are_moved_off_it():
    solid = SOLIDS["cylinder"]
    d = development(solid, solid.surfaces[0])
    # A symbol upright on a line: edges of its strokes would run along other lines, too.
    on_line = [(float(d.low[k][0]) + 1e-12, 8.0 * k) for k in range(2, 7)]
    part = emboss_whole(solid, layout_on_round_face(solid, on_line, [0, 1, 2, 3, 0]), TIERS, "Part")
    prove_closed(part)
    mesh = triangles(part)
    assert is_closed(mesh)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-9


def test_a_symbol_over_the_seam_is_refused():
    solid = SOLIDS["cylinder"]
    with pytest.raises(SolidError, match="reaches over the side"):
        emboss_whole(solid, layout_on_round_face(solid, [(2.0, 30.0)], [0]), TIERS, "Part")
    with pytest.raises(SolidError, match="lies beside its face"):
        emboss_whole(solid, layout_on_round_face(solid, [(-2.0, 30.0)], [0]), TIERS, "Part")


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


@pytest.mark.parametrize("name", SOLIDS)
def test_volume_of_the_body_is_that_of_the_round_solid(name):
    solid = SOLIDS[name]
    part = emboss_whole(solid, layout_on_round_face(solid, [], []), TIERS, name)
    assert volume(part) + round_volume(part) == pytest.approx(EXACT_MM3[name], rel=1e-9)
    (face,) = part.analytic
    assert face.closed
    assert face.facets == solid.surfaces[0].facets


def test_a_rim_on_several_faces_keeps_its_facets():
    solid = cylinder(60, 80)
    top = solid.faces[-1].loops[0]
    half = len(top) // 2
    split = [Face("F3", ((*top[: half + 1],),)), Face("F4", ((*top[half:], top[0]),))]
    bent = replace(solid, faces=(*solid.faces[:-1], *split))
    (surface,) = bent.surfaces
    assert analytic_faces(bent, {}, TIERS, {surface.carrier: surface.facets}) == ()
