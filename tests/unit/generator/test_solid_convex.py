"""Convex pieces and inertia, of a ring, of slivers, and of a turned box by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

from generator.errors import SolidError
from generator.export.robot.model import quaternion, roll_pitch_yaw
from generator.solid import convex
from generator.solid.convex import convex_pieces
from generator.solid.measure import inertia_of


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
