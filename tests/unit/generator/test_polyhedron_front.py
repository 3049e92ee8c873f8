"""Faces that the solid itself covers: slots, overhangs, lids."""

from __future__ import annotations

import numpy as np
import pytest

from generator.plane.polygon import signed_area
from generator.polyhedron import SHAPES, face_frame, face_normal, polyhedron
from generator.polyhedron.front import covered_parts


def extruded(profile, depth=40.0):
    """A prism over a profile (x, z), along y."""
    n = len(profile)
    points = [(x, y, z) for y in (0.0, depth) for x, z in profile]
    sides = [(k, (k + 1) % n, (k + 1) % n + n, k + n) for k in range(n)]
    return polyhedron("polyhedron", points, [range(n)[::-1], range(n, 2 * n), *sides])


def covered(solid, distance):
    """Normals (rounded) of covered faces -> covered area and its extent in the object frame."""
    found = covered_parts(solid, range(len(solid.faces)), distance)
    return {
        tuple(np.round(face_normal(solid, face)).astype(int) + 0): (
            -sum(signed_area(loop) for loop in loops),
            in_object(solid, face, np.concatenate(loops)),
        )
        for face, loops in found.items()
    }


def in_object(solid, face, points):
    T = face_frame(solid, face)
    moved = np.column_stack([points, 0 * points[:, 0]]) @ T[:3, :3].T + T[:3, 3]
    return moved.min(axis=0), moved.max(axis=0)


C = [(0, 0), (60, 0), (60, 20), (20, 20), (20, 22), (50, 22), (50, 42), (0, 42)]  # a slot of 2 mm


@pytest.mark.parametrize("shape", ["cube", "tetrahedron", "dodecahedron"])
def test_convex_solids_cover_nothing(shape):
    assert covered(SHAPES[shape](side=40), 1000.0) == {}


def test_walls_of_a_slot_cover_each_other_where_both_are():
    found = covered(extruded(C), 2.8)
    assert sorted(found) == [(0, 0, -1), (0, 0, 1)]
    for area, (low, high) in found.values():
        assert area == pytest.approx(30 * 40)
        assert (low[0], high[0]) == pytest.approx((20, 50))


def test_a_neighbour_across_a_reflex_edge_is_no_cover():
    bracket = extruded([(0, 0), (60, 0), (60, 20), (20, 20), (20, 60), (0, 60)])
    assert covered(bracket, 1000.0) == {}


def test_a_slanted_overhang_covers_as_far_as_it_is_near():
    # Its lower side rises by 1 mm in 10 from 1 mm above the floor, at x = 20.
    slanted = [(0, 0), (60, 0), (60, 20), (20, 20), (20, 21), (60, 25), (60, 40), (0, 40)]
    found = covered(extruded(slanted), 3.0)
    area, (low, high) = found[0, 0, 1]
    assert (low[0], high[0]) == pytest.approx((20, 40))
    assert area == pytest.approx(20 * 40)
