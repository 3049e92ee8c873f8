"""Face frames, areas, angles and the side of a face: also where rounding bites."""

import math
from fractions import Fraction

import numpy as np
import pytest

from generator.plane.polygon import side_of_polygon
from generator.polyhedron import (
    SHAPES,
    Face,
    Polyhedron,
    dihedral,
    face_area,
    face_frame,
    face_polygon,
    polyhedron,
    side_of_face,
)
from generator.polyhedron.winged import winged_edges

L_PROFILE = [(0, 0), (80, 0), (80, 20), (20, 20), (20, 60), (0, 60)]


def extruded(profile, height):
    n = len(profile)
    vertices = [(x, y, z) for z in (0, height) for x, y in profile]
    sides = [(k, (k + 1) % n, (k + 1) % n + n, k + n) for k in range(n)]
    faces = [tuple(range(n - 1, -1, -1)), *sides, tuple(range(n, 2 * n))]
    return polyhedron("polyhedron", vertices, faces)


def unchecked(vertices, faces):
    """A polyhedron too thin for the checks, to reach the limits of the formulas."""
    named = tuple(Face(f"F{k + 1}", (face,)) for k, face in enumerate(faces))
    edges = winged_edges([face.loops for face in named])
    return Polyhedron("polyhedron", np.array(vertices, dtype=float), named, edges)


@pytest.mark.parametrize("name", ["cube", "tetrahedron", "dodecahedron"])
def test_frame_has_its_origin_at_the_first_vertex_and_x_along_the_first_edge(name):
    solid = SHAPES[name](side=60)
    for k, face in enumerate(solid.faces):
        T = face_frame(solid, k)
        assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0, abs=1e-14)
        (polygon,) = face_polygon(solid, k)
        corners = np.column_stack([polygon, np.zeros(len(polygon)), np.ones(len(polygon))])
        assert (corners @ T.T)[:, :3] == pytest.approx(
            solid.vertices[list(face.loops[0])], abs=1e-12
        )
        assert polygon[0].tolist() == [0.0, 0.0]
        assert polygon[1] == pytest.approx([60.0, 0.0], abs=1e-12)
        centre = solid.vertices.mean(axis=0) - T[:3, 3]
        assert centre @ T[:3, 2] < 0  # z looks outward


def test_l_block_angles_and_areas():
    solid = extruded(L_PROFILE, 40)
    angles = sorted(round(math.degrees(dihedral(solid, k)), 9) for k in range(len(solid.edges)))
    assert angles == [90.0] * 17 + [270.0]
    assert face_area(solid, 7) == pytest.approx(80 * 20 + 20 * 40)
    points = [(10, 10), (50, 50), (20, 20), (79, 19), (10, 60), (10, 61)]
    assert side_of_face(solid, 7, points).tolist() == [1, -1, 0, 1, 0, -1]


def test_side_of_a_face_with_a_hole():
    outer = [(0, 0), (60, 0), (60, 60), (0, 60)]
    loops = [np.array(outer, float), np.array([(20, 20), (20, 40), (40, 40), (40, 20)], float)]
    points = [(30, 30), (10, 10), (20, 30), (60, 60), (20, 20), (70, 20), (30, 20), (50, 20)]
    assert side_of_polygon(loops, points).tolist() == [-1, 1, 0, 0, 0, -1, 0, 1]


@pytest.mark.parametrize("alpha", [1e-15, 1e-12, 1e-9, 1e-8, 1e-4, 0.1, 1.0, 3.0])
def test_knife_edges_and_nearly_flat_edges_keep_their_angle(alpha):
    # Numerics, case 9: a wedge with the angle alpha at its edge 0-1, by the ends' exact sine.
    for angle in (alpha, math.pi - alpha):
        far = (30 * math.cos(angle), 30 * math.sin(angle))
        vertices = [(0, 0, 0), (60, 0, 0), (30, 30, 0), (30, *far)]
        wedge = unchecked(vertices, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
        edge = next(k for k, e in enumerate(wedge.edges) if {e.start, e.end} == {0, 1})
        expected = math.atan2(far[1], far[0])
        assert dihedral(wedge, edge) == pytest.approx(expected, rel=4e-15)


@pytest.mark.parametrize("depth", [-1e-9, 1e-9, -1e-3, 1e-3])
def test_reflex_angle_lies_above_pi(depth):
    # A ridge (or a valley) of the given height over a span of 60 mm.
    profile = [(0, 0), (60, 0), (60, 40), (30, 40 + depth), (0, 40)]
    n = 5
    vertices = [(x, y, z) for z in (0, 40) for x, y in profile]
    sides = [(k, (k + 1) % n, (k + 1) % n + n, k + n) for k in range(n)]
    solid = unchecked(vertices, [tuple(range(n - 1, -1, -1)), *sides, tuple(range(n, 2 * n))])
    edge = next(k for k, e in enumerate(solid.edges) if {e.start, e.end} == {3, 8})
    exact = (40 + depth) - 40  # what is left of the depth in double precision
    assert dihedral(solid, edge) - math.pi == pytest.approx(-2 * math.atan2(exact, 30), abs=1e-15)


def test_sliver_far_from_the_origin_is_exact():
    # Numerics, case 8: 80 x 0.008 mm at 1000 mm, turned; the oracle is rational arithmetic.
    turn = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]])
    sliver = np.array([(0, 0), (80, 0), (80, 0.008), (0, 0.008)]) @ turn.T + 1000.0
    rng = np.random.default_rng(9)
    points = rng.uniform((-1, -0.008), (81, 0.016), size=(400, 2)) @ turn.T + 1000.0
    corners = [tuple(map(Fraction, map(float, corner))) for corner in sliver]

    def left(p, a, b):
        return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

    exact = []
    for point in points:
        p = tuple(map(Fraction, map(float, point)))
        turns = [left(p, a, b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
        exact.append(1 if min(turns) > 0 else 0 if min(turns) == 0 else -1)
    assert side_of_polygon([sliver], points).tolist() == exact
    assert 100 < exact.count(1) < 200
