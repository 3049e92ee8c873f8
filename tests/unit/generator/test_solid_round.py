"""Symbols on flat and round faces: closed, of the right volume, or refused; convex pieces."""

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from reference.laid_symbols import filled, is_closed, layout_on_round_face, mesh_volume
from scipy.spatial.transform import Rotation

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.errors import SolidError
from generator.export.robot.model import quaternion, roll_pitch_yaw
from generator.layout.placement import Layout
from generator.plane.polygon import signed_area
from generator.polyhedron.development import development
from generator.polyhedron.shapes import cone, cube, cylinder
from generator.polyhedron.winged import Face
from generator.printers import printer_named
from generator.solid import (
    body_mesh,
    convex,
    emboss_whole,
    prove_closed,
    round_volume,
    symbol_meshes,
    triangles,
    volume,
)
from generator.solid.analytic import analytic_faces, bend_problem
from generator.solid.convex import convex_pieces
from generator.solid.measure import inertia_of, symbol_volume
from generator.solid.wrapped import NUDGE_MM, Knife, strip_of

STYLE = SymbolStyle()
TIERS = outlines(alphabet_named("dense-4"), STYLE)
CYLINDER = cylinder(60, 80)
CENTRES = [(20.0, 12.0), (27.3, 14.0), (40.0, 30.0), (12.0, 24.5), (33.0, 16.0)]
LABELS = [0, 1, 2, 3, 1]


def part_of(solid, centres=(), labels=(), rotation=0.0):
    return emboss_whole(solid, layout_on_round_face(solid, centres, labels, rotation), TIERS, "P")


@pytest.mark.parametrize(
    ("solid", "exact"),
    [
        (CYLINDER, math.pi * 30**2 * 80),
        (cone(80, 80, 40), math.pi * 80 / 3 * (40**2 + 40 * 20 + 20**2)),
        (cone(80, 70), math.pi * 70 / 3 * 40**2),
    ],
    ids=["cylinder", "cone", "pointed"],
)
def test_wrapped_symbols_make_one_closed_part(solid, exact):
    plain, part = part_of(solid), part_of(solid, CENTRES, LABELS, 0.3)
    assert volume(plain) + round_volume(plain) == pytest.approx(exact, rel=1e-9)
    (face,) = plain.analytic
    assert face.closed
    assert face.facets == solid.surfaces[0].facets
    prove_closed(part)
    meshes = [triangles(part), body_mesh(part), *symbol_meshes(part)]
    assert all(map(is_closed, meshes))
    whole, *pieces = map(mesh_volume, meshes)
    assert whole == pytest.approx(volume(part), rel=1e-12)
    assert sum(pieces) == pytest.approx(volume(part), rel=1e-12)
    # Symbols spread as they rise: by z / r of the width around the face at most.
    flat = sum(symbol_volume(TIERS[label]) for label in LABELS)
    assert flat < volume(part) - volume(plain) < flat * (1 + 1.0 / 20)


@given(st.floats(5.0, 180.0), st.floats(6.0, 70.0), st.floats(-math.pi, math.pi), st.integers(0, 3))
@settings(max_examples=40, deadline=None)
def test_pieces_of_a_symbol_cover_it_wherever_it_stands(x, y, rotation, label):
    strip = strip_of(development(CYLINDER, CYLINDER.surfaces[0]))
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
    d = development(CYLINDER, CYLINDER.surfaces[0])
    # A symbol upright on a line: edges of its strokes would run along other lines, too.
    on_line = [(float(d.low[k][0]) + 1e-12, 8.0 * k) for k in range(2, 7)]
    part = part_of(CYLINDER, on_line, [0, 1, 2, 3, 0])
    prove_closed(part)
    mesh = triangles(part)
    assert is_closed(mesh)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-9


def test_a_symbol_over_the_seam_is_refused():
    for x, said in ((2.0, "reaches over the side"), (-2.0, "lies beside its face")):
        with pytest.raises(SolidError, match=said):
            part_of(CYLINDER, [(x, 30.0)], [0])


def test_a_hole_that_is_too_narrow_is_told():
    printer = printer_named("fdm-0.4")
    convex = development(CYLINDER, CYLINDER.surfaces[0])
    hole = dataclasses.replace(convex, bends=-convex.bends)  # the same facets seen from inside
    assert bend_problem(convex, TIERS, STYLE, printer) == ""
    assert bend_problem(hole, TIERS, STYLE, printer) == ""
    for change, said in (({"stroke_mm": 0.82}, "narrows strokes to 0.79 mm"),
                         ({"height_mm": 31.0}, "meet in its middle")):  # fmt: skip
        assert said in bend_problem(hole, TIERS, replace(STYLE, **change), printer)


def test_a_rim_on_several_faces_keeps_its_facets():
    top = CYLINDER.faces[-1].loops[0]
    half = len(top) // 2
    split = [Face("F3", ((*top[: half + 1],),)), Face("F4", ((*top[half:], top[0]),))]
    bent = replace(CYLINDER, faces=(*CYLINDER.faces[:-1], *split))
    (surface,) = bent.surfaces
    assert analytic_faces(bent, {}, TIERS, {surface.carrier: surface.facets}) == ()


def test_flat_symbols_beyond_an_edge_or_on_each_other_and_open_bodies_are_found():
    solid = cube(60.0)
    face = filled(solid, 7.0, 4.0).faces[0]

    def changed(**change):
        return emboss_whole(solid, Layout("faces", 7.0, (replace(face, **change),)), TIERS, "P")

    def with_centres(change):
        centres = face.centres_mm.copy()
        centres[0] += change
        return changed(centres_mm=centres)

    prove_closed(with_centres((0.01, 0.0)))  # off the lattice, but free
    with pytest.raises(SolidError, match="reaches over the edge"):
        prove_closed(with_centres((-4.0, 0.0)))
    with pytest.raises(SolidError, match="overlap"):
        prove_closed(with_centres(face.centres_mm[1] - face.centres_mm[0] + 0.3))
    with pytest.raises(SolidError, match="overlap"):
        triangles(with_centres((-4.0, 0.0)))
    with pytest.raises(SolidError, match="symbol 4 on an alphabet of 4"):
        changed(labels=face.labels + 1)
    plain = emboss_whole(solid, Layout("faces", 7.0, ()), TIERS, "P")
    with pytest.raises(SolidError, match="not closed"):
        prove_closed(replace(plain, facets=plain.facets[:-1]))


def mesh_of(body):
    mesh = body.to_mesh64()
    return np.array(mesh.vert_properties), np.array(mesh.tri_verts, np.int64)


def volumes(found):
    return [inertia_of(points[index]).volume for points, index in found.pieces]


def box(x, y, z, at=(0, 0, 0)):
    return Manifold.cube((x, y, z)).translate(at)


def test_a_ring_is_cut_until_no_piece_stands_out_far(monkeypatch):
    ring = Manifold.cylinder(10, 20, circular_segments=48)
    ring -= Manifold.cylinder(10, 15, circular_segments=48)
    for depth in (2.0, 0.5):
        monkeypatch.setattr(convex, "DEPTH_MM", depth)
        found = convex_pieces(*mesh_of(ring))
        assert found.depth_mm <= depth
        assert ring.volume() < sum(volumes(found)) < ring.volume() * (1 + depth / 5)
    monkeypatch.setattr(convex, "_MOST", 3)
    coarse = convex_pieces(*mesh_of(ring))
    assert 3 <= len(coarse.pieces) <= 4  # the last cut may leave more than two
    assert coarse.depth_mm > 2


def test_slivers_are_left_out_and_open_triangles_refused():
    found = convex_pieces(*mesh_of(box(10, 10, 10) + box(10, 0.01, 3, (0, 10, 0))))
    assert len(convex_pieces(*mesh_of(box(9, 9, 0.01))).pieces) == 1  # never nothing
    assert min(volumes(found)) > 1
    points, index = mesh_of(box(1, 1, 1))
    with pytest.raises(SolidError, match="close no body"):
        convex_pieces(points, index[1:])


def test_inertia_of_a_turned_box_has_products():
    points, index = mesh_of(box(2, 4, 6).rotate((0, 0, 30)))
    turn = Rotation.from_euler("z", 30, degrees=True).as_matrix()
    expected = turn @ np.diag([208.0, 160.0, 80.0]) @ turn.T
    assert np.abs(inertia_of(points[index]).tensor - expected).max() < 1e-9


@pytest.mark.parametrize("pitch", [0.0, 0.4, math.pi / 2, -math.pi / 2, 1.5])
def test_rotations_as_angles_and_quaternions(pitch):
    for roll in (0.0, 0.7, -2.0, math.pi):
        for yaw in (0.0, 1.1, -3.0):
            R = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_matrix()
            again = Rotation.from_euler("xyz", roll_pitch_yaw(R)).as_matrix()
            assert np.abs(again - R).max() < 1e-12
            w, x, y, z = quaternion(R)
            assert w >= 0
            assert np.abs(Rotation.from_quat([x, y, z, w]).as_matrix() - R).max() < 1e-12
