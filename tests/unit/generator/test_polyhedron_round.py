"""Cylinder and cone: facets that unroll as the round side does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from generator.errors import ShapeError
from generator.polyhedron.development import development
from generator.polyhedron.shapes import cone, cylinder

SOLIDS = [cylinder(60, 80), cylinder(12, 5), cone(70, 80, 30), cone(60, 60), cone(300, 40, 290)]


def unrolled(solid):
    return development(solid, solid.surfaces[0])


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid.kind)
def test_facets_are_where_the_plane_is_taken_to(solid):
    d = unrolled(solid)
    for k, T in enumerate(d.T_object_flat):
        assert T[:3, :3] @ T[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
        for line in (k, k + 1):
            for point, vertex in zip((d.low[line], d.high[line]), d.vertices[line], strict=True):
                there = T @ [*point, 0.0, 1.0]
                assert there[:3] == pytest.approx(solid.vertices[vertex], abs=1e-9)
        outward = T[:3, 2]
        assert outward @ d.bends[k] == pytest.approx(1.0)
        assert outward @ d.bends[k + 1] == pytest.approx(1.0)


def test_the_side_of_a_cylinder_has_the_width_of_the_round_one():
    d = unrolled(cylinder(60, 80))
    assert d.low[0] == pytest.approx([0, 0])
    assert d.low[-1] == pytest.approx([60 * math.pi, 0], rel=1e-12)
    assert d.high[-1] == pytest.approx([60 * math.pi, 80], rel=1e-12)


@pytest.mark.parametrize(("diameter", "height", "top"), [(70, 80, 30), (60, 60, 0)])
def test_the_side_of_a_cone_has_the_angle_of_the_round_one(diameter, height, top):
    d = unrolled(cone(diameter, height, top))
    first, last = d.high[0] - d.low[0], d.high[-1] - d.low[-1]
    turned = math.atan2(first[0] * last[1] - first[1] * last[0], first @ last) % (2 * math.pi)
    sine = (diameter - top) / 2 / math.hypot((diameter - top) / 2, height)
    assert turned == pytest.approx(2 * math.pi * sine, rel=1e-9)


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: solid.kind)
def test_the_chord_error_is_the_distance_from_the_round_side(solid):
    (surface,) = solid.surfaces
    base = solid.vertices[list(solid.faces[0].loops[0])]
    corners = np.hypot(base[:, 0], base[:, 1])
    middles = np.hypot(*((base + np.roll(base, 1, axis=0)) / 2).T[:2])
    off = max(np.abs(corners - surface.radius_mm).max(), np.abs(middles - surface.radius_mm).max())
    assert off == pytest.approx(surface.chord_error_mm, rel=1e-6)
    assert surface.chord_error_mm <= 0.0201


def test_wrong_lengths_are_refused():
    with pytest.raises(ShapeError, match="top_diameter of 60 mm is not less"):
        cone(60, 60, 60)
    with pytest.raises(ShapeError, match="allowed are 1 to 5000"):
        cylinder(0.5, 60)
