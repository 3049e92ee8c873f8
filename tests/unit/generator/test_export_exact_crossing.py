"""Pairs of triangles that cut, touch or overlap, and the same after turning and scaling."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from generator.export.check import cut_triangles, perhaps_folded, triangles_cross
from generator.polyhedron.shapes import dodecahedron

BASE = ((0, 0, 0), (8, 0, 0), (0, 8, 0))
APART = {
    "above": ((0, 0, 1), (8, 0, 1), (0, 8, 1)),
    "beside in the plane, boxes overlap": ((8, 8, 0), (8, 1, 0), (1, 8, 0)),
    "its plane is crossed outside": ((8, 8, -1), (8, 8, 1), (5, 5, 1)),
    "shares a vertex, rises": ((0, 0, 0), (3, 3, 4), (4, 2, 4)),
    "shares a vertex, in the plane": ((0, 0, 0), (-5, 0, 0), (0, -5, 0)),
    "shares a side, in the plane": ((0, 0, 0), (8, 0, 0), (4, -5, 0)),
    "shares a side, rises steeply": ((0, 0, 0), (8, 0, 0), (2, 2, 1)),
    "sliver beside the side it shares": ((0, 8, 0), (8, 0, 0), (500001, -499992, 0)),
    "without area on the side it shares": ((0, 0, 0), (8, 0, 0), (4, 0, 0)),
    "a segment in the air": ((0, 0, 1), (4, 4, 1), (2, 2, 1)),
}
TOGETHER = {
    "crosses": ((2, 2, -1), (2, 2, 1), (9, 9, 1)),
    "pierced by the base": ((-1, 1, -1), (-1, 1, 1), (5, 1, 0)),
    "a vertex inside the base": ((2, 2, 0), (2, 2, 5), (3, 3, 5)),
    "a vertex on a side": ((4, 0, 0), (4, -5, 0), (5, -5, 3)),
    "a vertex on a side, in the plane": ((4, 0, 0), (2, -5, 0), (6, -5, 0)),
    "a side touches a vertex": ((-3, 3, 0), (3, -3, 0), (-5, -5, 0)),
    "overlaps in the plane": ((1, 1, 0), (9, 1, 0), (1, 9, 0)),
    "lies inside": ((1, 1, 0), (2, 1, 0), (1, 2, 0)),
    "shares a vertex and crosses": ((0, 0, 0), (4, 4, 1), (4, 4, -1)),
    "shares a vertex and overlaps": ((0, 0, 0), (5, 1, 0), (1, 5, 0)),
    "shares a vertex and half a side": ((0, 0, 0), (4, 0, 0), (2, -3, 0)),
    "shares a side, folded over": ((0, 0, 0), (8, 0, 0), (2, 2, 0)),
    "shares a side, folded sliver": ((0, 8, 0), (8, 0, 0), (500000, -499993, 0)),
    "the same": BASE,
    "without area, across": ((1, 1, -1), (1, 1, 1), (1, 1, 0)),
    "a point inside": ((2, 2, 0), (2, 2, 0), (2, 2, 0)),
}


def turned(triangle):
    """Turn by a matrix of integers, which keeps every incidence."""
    M = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]])
    return tuple(tuple((M @ corner + [7, -3, 11]).tolist()) for corner in triangle)


@pytest.mark.parametrize(("cases", "cross"), [(APART, False), (TOGETHER, True)])
def test_more_than_what_is_shared(cases, cross):
    for name, triangle in cases.items():
        for corners in permutations(triangle):
            for one, other in ((BASE, corners), (corners, BASE), (turned(BASE), turned(corners))):
                assert bool(triangles_cross(one, other)) == cross, name


def test_segments_without_area():
    for p, q, r, s, cross in (
        ((0, 0, 0), (4, 4, 4), (0, 4, 2), (4, 0, 2), True),
        ((0, 0, 0), (4, 4, 4), (0, 4, 2), (4, 0, 3), False),
        ((0, 0, 0), (4, 0, 0), (4, 0, 0), (9, 0, 0), False),
        ((0, 0, 0), (4, 0, 0), (3, 0, 0), (9, 0, 0), True),
    ):
        assert bool(triangles_cross((p, q, p), (r, s, r))) == cross


def test_the_least_step_of_a_float_decides():
    base = [[0, 0, 0.1], [1, 0, 0.1], [0, 1, 0.1]]
    for z, cut in ((np.nextafter(0.1, 1), False), (0.1, True), (np.nextafter(0.1, 0), True)):
        other = [[0.25, 0.25, z], [0.25, 0.25, 1], [0.5, 0.25, 1]]
        assert cut_triangles(np.array([base, other]), np.array([0, 1])).tolist() == [cut, cut]


def test_a_slanted_surface_in_single_precision_does_not_cut_itself():
    shape = dodecahedron(40.0)
    points = shape.vertices.astype(np.float32).astype(np.float64)
    faces = np.array(
        [[loop[0], *loop[k : k + 2]] for f in shape.faces for loop in f.loops for k in (1, 2, 3)]
    )
    every = np.arange(len(faces))
    assert not cut_triangles(points[faces], every).any()
    assert len(perhaps_folded(points, faces)) == 0
    points[0] *= -2.0  # a corner pushed through the opposite side
    assert cut_triangles(points[faces], every).sum() >= 9


def test_folded_neighbours_are_found():
    points = np.array([[0, 0, 0], [8, 0, 0], [0, 8, 0], [2, 2, 0], [4, -5, 0], [4, 0, 0]], float)
    for corner, folded in ((3, [0, 1]), (4, []), (5, [0, 1])):
        found = perhaps_folded(points, np.array([[0, 1, 2], [1, 0, corner]]))
        assert found.tolist() == folded
