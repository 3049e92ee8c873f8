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


@pytest.mark.parametrize("name", APART)
def test_nothing_or_what_is_shared(name: str) -> None:
    for corners in permutations(APART[name]):
        for one, other in ((BASE, corners), (corners, BASE), (turned(BASE), turned(corners))):
            assert not triangles_cross(one, other)


@pytest.mark.parametrize("name", TOGETHER)
def test_more_than_what_is_shared(name: str) -> None:
    for corners in permutations(TOGETHER[name]):
        for one, other in ((BASE, corners), (corners, BASE), (turned(BASE), turned(corners))):
            assert triangles_cross(one, other)


def test_segments_and_points_without_area() -> None:
    def segment(p, q):
        return (p, q, p)

    assert triangles_cross(segment((0, 0, 0), (4, 4, 4)), segment((0, 4, 2), (4, 0, 2)))
    assert not triangles_cross(segment((0, 0, 0), (4, 4, 4)), segment((0, 4, 2), (4, 0, 3)))
    assert not triangles_cross(segment((0, 0, 0), (4, 0, 0)), segment((4, 0, 0), (9, 0, 0)))
    assert triangles_cross(segment((0, 0, 0), (4, 0, 0)), segment((3, 0, 0), (9, 0, 0)))


def test_the_least_step_of_a_float_decides() -> None:
    base = [[0, 0, 0.1], [1, 0, 0.1], [0, 1, 0.1]]
    for dz, cut in ((np.inf, False), (0.0, True), (-np.inf, True)):
        z = 0.1 if dz == 0.0 else float(np.nextafter(0.1, dz))
        other = [[0.25, 0.25, z], [0.25, 0.25, 1], [0.5, 0.25, 1]]
        found = cut_triangles(np.array([base, other]), np.array([0, 1]))
        assert found.tolist() == [cut, cut]


def test_a_slanted_surface_in_single_precision_does_not_cut_itself() -> None:
    shape = dodecahedron(40.0)
    points = shape.vertices.astype(np.float32).astype(np.float64)
    fans = [[loop[0], *loop[k : k + 2]] for f in shape.faces for loop in f.loops for k in (1, 2, 3)]
    faces = np.array(fans)
    every = np.arange(len(faces))
    assert not cut_triangles(points[faces], every).any()
    assert len(perhaps_folded(points, faces)) == 0
    inward = points.copy()
    inward[0] *= -2.0  # a corner pushed through the opposite side
    assert cut_triangles(inward[faces], every).sum() >= 9


def test_folded_neighbours_are_found() -> None:
    points = np.array([[0, 0, 0], [8, 0, 0], [0, 8, 0], [2, 2, 0], [4, -5, 0], [4, 0, 0]], float)
    assert perhaps_folded(points, np.array([[0, 1, 2], [1, 0, 3]])).tolist() == [0, 1]
    assert perhaps_folded(points, np.array([[0, 1, 2], [1, 0, 4]])).tolist() == []
    assert perhaps_folded(points, np.array([[0, 1, 2], [1, 0, 5]])).tolist() == [0, 1]
