"""Nets of solids that are known by heart."""

import numpy as np
import pytest

from generator.layout.unfold import overlap, split, triangles_of, unfold
from generator.polyhedron import shapes

SOLIDS = {
    "cube": lambda: shapes.cube(60.0),
    "box": lambda: shapes.box((80.0, 60.0, 12.0)),
    "triangular_prism": lambda: shapes.triangular_prism(60.0, 80.0),
    "tetrahedron": lambda: shapes.tetrahedron(80.0),
    "octahedron": lambda: shapes.octahedron(70.0),
    "dodecahedron": lambda: shapes.dodecahedron(30.0),
    "prism": lambda: shapes.prism(17, 90.0, side=20.0),
    "pyramid": lambda: shapes.pyramid(24, 150.0, side=15.0),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_unfold_in_one_piece(name):
    solid = SOLIDS[name]()
    net = unfold(solid)
    assert len(net.pieces) == 1
    assert sorted(net.pieces[0]) == list(range(len(solid.faces)))
    assert net.parents.count(-1) == 1


def test_splitting_halves_a_piece_along_a_fold():
    net = split(unfold(shapes.cube(60.0)), 0)
    assert sorted(map(len, net.pieces)) in ([2, 4], [3, 3])
    for faces in net.pieces:
        assert [net.parents[face] for face in faces].count(-1) == 1
        assert all(net.parents[face] in (-1, *faces) for face in faces)
    while any(len(faces) > 1 for faces in net.pieces):
        net = split(net, next(k for k, faces in enumerate(net.pieces) if len(faces) > 1))
    assert net.parents == (-1,) * 6


def square(x, y, side=1.0):
    return triangles_of([np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]])])


def test_touching_polygons_do_not_overlap():
    assert not overlap(square(0, 0), square(1, 0), 1e-9)
    assert not overlap(square(0, 0), square(1, 1), 1e-9)
    assert not overlap(square(0, 0), square(5, 5), 1e-9)


def test_overlaps_that_cross_no_edge_are_seen():
    assert overlap(square(0, 0), square(0, 0), 1e-9)
    assert overlap(square(0, 0), square(0.5, 0), 1e-9)
    assert overlap(square(0, 0), square(0.4, 0.4, 0.1), 1e-9)
    assert overlap(square(0, 0), square(1 - 1e-6, 0), 1e-9)


def test_a_square_in_a_hole_or_a_bay_does_not_overlap():
    ring = [
        np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]]),
        np.array([[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]]),
    ]
    assert not overlap(triangles_of(ring), square(1, 1), 1e-9)
    assert overlap(triangles_of(ring), square(1.1, 1), 1e-9)
    bay = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]], dtype=float)
    assert not overlap(triangles_of([bay]), square(1, 1), 1e-9)
    assert overlap(triangles_of([bay]), square(1, 0.9), 1e-9)
