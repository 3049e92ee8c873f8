"""Round faces as cylinders and cones: which can be, where symbols lie on them, their volume."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from generator.polyhedron.development import development
from generator.polyhedron.shapes import cone, cylinder
from generator.polyhedron.winged import Face
from generator.solid import emboss_whole, round_volume, volume
from generator.solid.analytic import BEND_ERROR_MM, RoundSurfaceMap, analytic_faces, bend_lines
from tests.unit.generator.test_solid_wrap import STYLE, TIERS, layout_on

SOLIDS = {
    "cylinder": (cylinder(60, 80), math.pi * 30**2 * 80),
    "cone": (cone(80, 80, 40), math.pi * 80 / 3 * (40**2 + 40 * 20 + 20**2)),
    "pointed": (cone(80, 70), math.pi * 70 / 3 * 40**2),
}


def plain_face(solid):
    (surface,) = solid.surfaces
    (face,) = analytic_faces(solid, {}, TIERS, {surface.carrier: surface.facets})
    return face, development(solid, surface)


@pytest.mark.parametrize("name", SOLIDS)
def test_volume_of_the_body_is_that_of_the_round_solid(name):
    solid, exact = SOLIDS[name]
    part = emboss_whole(solid, layout_on(solid, [], []), TIERS, name)
    assert volume(part) + round_volume(part) == pytest.approx(exact, rel=1e-9)
    (face,) = part.analytic
    assert face.closed
    assert face.facets == solid.surfaces[0].facets


@pytest.mark.parametrize("name", SOLIDS)
def test_lines_keep_their_length_and_stay_on_the_face(name):
    face, flat = plain_face(SOLIDS[name][0])
    place = RoundSurfaceMap(face, flat)
    starts = np.array([[20.0, 12.0], [33.0, 16.0], [25.0, 20.0]])
    steps = np.array([[4.0, 0.0], [0.0, 3.0], [2.0, -2.5]])
    curves = bend_lines(place, starts, steps, np.zeros(3), np.arange(3))
    t = np.linspace(0.0, 1.0, 401)
    for start, step, curve in zip(starts, steps, curves, strict=True):
        own = np.vstack([curve, place(start + step, np.array(0.0))])
        n = len(own) - 1
        weights = np.array([math.comb(n, k) * t**k * (1 - t) ** (n - k) for k in range(n + 1)])
        points = weights.T @ own
        length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert length == pytest.approx(np.hypot(*step), rel=3e-4)
        off = np.hypot(points[:, 0], points[:, 1]) - face.radius_at(points[:, 2], np.zeros(401))
        assert np.abs(off).max() < 2 * BEND_ERROR_MM


def test_heights_are_distances_from_the_face():
    face, flat = plain_face(SOLIDS["cone"][0])
    place = RoundSurfaceMap(face, flat)
    at = np.array([[30.0, 20.0]])
    foot, top = place(at, np.zeros(1)), place(at, np.ones(1))
    assert np.linalg.norm(top - foot) == pytest.approx(1.0)
    along = place(at + np.array([0.0, 1e-5]), np.zeros(1)) - foot
    assert abs(float((top - foot)[0] @ along[0])) < 1e-9


def test_symbols_on_the_face_stand_where_those_of_the_mesh_do():
    solid, _ = SOLIDS["cylinder"]
    layout = layout_on(solid, [(20.0, 12.0), (40.0, 30.0)], [0, 1], rotation=0.3)
    part = emboss_whole(solid, layout, TIERS, "part")
    (face,) = part.analytic
    T = face.T_part_axis
    strip = {v for k in face.facets for loop in part.facets[k].loops for v in loop}
    vertices = part.vertices[sorted(strip)]
    for symbol in face.symbols:
        assert symbol.z_mm == (0.0, STYLE.height_mm)
        for tier in symbol.rings:
            for edge in tier[0]:
                corner = edge[0] @ T[:3, :3].T + T[:3, 3]
                assert np.linalg.norm(vertices - corner, axis=1).min() < 0.03  # chord error


def test_a_rim_on_several_faces_keeps_its_facets():
    solid = cylinder(60, 80)
    top = solid.faces[-1].loops[0]
    half = len(top) // 2
    split = [Face("F3", ((*top[: half + 1],),)), Face("F4", ((*top[half:], top[0]),))]
    bent = replace(solid, faces=(*solid.faces[:-1], *split))
    (surface,) = bent.surfaces
    assert analytic_faces(bent, {}, TIERS, {surface.carrier: surface.facets}) == ()
