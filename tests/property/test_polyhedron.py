"""Every solid: links, closure, angles and frames; the same faces back from mesh files."""

import math
import tempfile
from fractions import Fraction
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_shapes import random_convex, random_nonconvex

from generator.errors import ShapeError
from generator.plane.polygon import orientations, side_of_polygon
from generator.polyhedron import (
    dihedral,
    face_area,
    face_frame,
    face_normal,
    face_polygon,
    polyhedron,
    volume,
)
from generator.polyhedron.read import read_shape

SEEDS = st.integers(0, 2**32 - 1)
SOLIDS = st.builds(
    lambda make, seed: make(np.random.default_rng(seed)),
    st.sampled_from([random_convex, random_nonconvex]),
    SEEDS,
)
CONVEX = st.builds(lambda seed: random_convex(np.random.default_rng(seed)), SEEDS)


@settings(max_examples=60, deadline=None)
@given(SOLIDS)
def test_links_are_consistent(solid):
    for k, edge in enumerate(solid.edges):
        for face, before, after, start, end in (
            (edge.left, edge.left_previous, edge.left_next, edge.start, edge.end),
            (edge.right, edge.right_previous, edge.right_next, edge.end, edge.start),
        ):
            b, a = solid.edges[before], solid.edges[after]
            assert start == (b.end if b.left == face else b.start)
            assert end == (a.start if a.left == face else a.end)
            assert k == (b.left_next if b.left == face else b.right_next)
            assert k == (a.left_previous if a.left == face else a.right_previous)
    corners = sum(len(loop) for face in solid.faces for loop in face.loops)
    assert corners == 2 * len(solid.edges)
    assert solid.euler_characteristic == 2 - 2 * solid.genus


@settings(max_examples=60, deadline=None)
@given(SOLIDS)
def test_areas_close_and_faces_are_planar(solid):
    faces = range(len(solid.faces))
    total = sum(face_area(solid, k) * face_normal(solid, k) for k in faces)
    assert np.abs(total).max() < 1e-9  # the vector area of a closed surface is zero
    assert 0.0 < volume(solid) < 240.0**3
    for k in faces:
        inverse = np.linalg.inv(face_frame(solid, k))
        members = [v for loop in solid.faces[k].loops for v in loop]
        local = solid.vertices[members] @ inverse[:3, :3].T + inverse[:3, 3]
        assert np.abs(local[:, 2]).max() < 1e-11
        assert local[:, :2] == pytest.approx(np.concatenate(face_polygon(solid, k)), abs=1e-11)


@settings(max_examples=60, deadline=None)
@given(CONVEX)
def test_convex_solids_have_angles_below_pi_and_the_theorem_of_gauss(solid):
    angles = [dihedral(solid, k) for k in range(len(solid.edges))]
    assert min(angles) > 0.0
    assert max(angles) < math.pi
    # Angle defects over all vertices sum to 4 pi (Descartes).
    corners = sum(math.pi * (len(face.loops[0]) - 2) for face in solid.faces)
    assert 2 * math.pi * len(solid.vertices) - corners == pytest.approx(4 * math.pi)


@settings(max_examples=40, deadline=None)
@given(SOLIDS, SEEDS)
def test_share_of_points_inside_is_the_area(solid, seed):
    rng = np.random.default_rng(seed)
    face = int(rng.integers(len(solid.faces)))
    outer = face_polygon(solid, face)[0]
    low, high = outer.min(axis=0), outer.max(axis=0)
    points = rng.uniform(low, high, size=(4000, 2))
    share = (side_of_polygon(face_polygon(solid, face), points) >= 0).mean()
    expected = face_area(solid, face) / np.prod(high - low)
    assert share == pytest.approx(expected, abs=5 * math.sqrt(0.25 / 4000))
    loops = face_polygon(solid, face)
    assert (side_of_polygon(loops, np.concatenate(loops)) == 0).all()


@settings(max_examples=40, deadline=None)
@given(SOLIDS, SEEDS)
def test_moving_and_turning_changes_nothing_else(solid, seed):
    rng = np.random.default_rng(seed)
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.linalg.det(q)
    moved = solid.vertices @ q.T + rng.uniform(-100, 100, size=3)
    other = polyhedron(solid.kind, moved, solid.faces)
    assert other.edges == solid.edges
    assert other.notes == ()
    assert volume(other) == pytest.approx(volume(solid), rel=1e-11)
    for k in range(len(solid.edges)):
        assert dihedral(other, k) == pytest.approx(dihedral(solid, k), abs=1e-11)


@settings(max_examples=40, deadline=None)
@given(SOLIDS, SEEDS)
def test_damaged_solids_are_refused_by_name(solid, seed):
    rng = np.random.default_rng(seed)
    face = int(rng.integers(len(solid.faces)))
    rest = [f for k, f in enumerate(solid.faces) if k != face]
    with pytest.raises(ShapeError, match=r"open|4 vertices and 3 faces"):
        polyhedron("polyhedron", solid.vertices, rest)
    turned = list(solid.faces)
    loops = tuple(loop[::-1] for loop in solid.faces[face].loops)
    turned[face] = type(turned[face])(turned[face].name, loops)
    with pytest.raises(ShapeError, match="reverse the order of its vertices") as caught:
        polyhedron("polyhedron", solid.vertices, turned)
    assert turned[face].name in str(caught.value)


@settings(max_examples=30, deadline=None)
@given(SOLIDS, SEEDS, st.integers(3, 5))
def test_rounded_coordinates_become_planar_again(solid, seed, digits):
    scale = 10.0 ** (2 - digits)  # 1e-1 ... 1e-3 of what three decimals leave, 0.0005 mm
    noise = np.random.default_rng(seed).uniform(-5e-4, 5e-4, size=solid.vertices.shape) * scale
    read = polyhedron("polyhedron", solid.vertices + noise, solid.faces)
    assert np.abs(read.vertices - solid.vertices).max() < 0.1
    for k, face in enumerate(read.faces):
        members = [v for loop in face.loops for v in loop]
        height = (read.vertices[members] - read.vertices[members[0]]) @ face_normal(read, k)
        assert np.abs(height).max() < 1e-9


COORDINATES = st.floats(-1000, 1000, allow_subnormal=False)
POINTS = st.tuples(COORDINATES, COORDINATES)


@given(POINTS, POINTS, st.floats(-2, 3), st.integers(-3, 3))
def test_orientation_agrees_with_rational_arithmetic(a, b, t, ulps):
    x = a[0] + t * (b[0] - a[0])
    y = a[1] + t * (b[1] - a[1])
    for _ in range(abs(ulps)):
        y = math.nextafter(y, math.copysign(math.inf, ulps))
    (ax, ay), (bx, by), (cx, cy) = (tuple(map(Fraction, p)) for p in (a, b, (x, y)))
    exact = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    assert orientations(a, b, (x, y)) == (exact > 0) - (exact < 0)


def triangles(solid, rng):
    """Triangles (n, 3, 3) of a solid, some split at inner points and on edges, shuffled."""
    found = []
    for k, face in enumerate(solid.faces):
        ring = solid.vertices[[v for loop in face.loops for v in loop]]
        for t in manifold3d.triangulate(list(face_polygon(solid, k))):
            a, b, c = ring[t]
            if rng.random() < 0.3:
                inner = rng.dirichlet((4, 4, 4)) @ np.array([a, b, c])
                found += [(a, b, inner), (b, c, inner), (c, a, inner)]
            else:
                found.append((a, b, c))
    return np.array(found)[rng.permutation(len(found))]


@settings(max_examples=60, deadline=None)
@given(SOLIDS, SEEDS, st.sampled_from(["stl", "stl_ascii", "obj"]), st.sampled_from([0.0, 1000.0]))
def test_meshes_give_the_faces_back(solid, seed, kind, offset):
    # Edges that are nearly flat are one face for a mesh file.
    assume(all(abs(dihedral(solid, k) - np.pi) > 0.02 for k in range(len(solid.edges))))
    corners = triangles(solid, np.random.default_rng(seed)) + offset
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"part.{kind[:3]}"
        index = np.arange(3 * len(corners)).reshape(-1, 3)
        mesh = trimesh.Trimesh(corners.reshape(-1, 3), index, process=False)
        mesh.export(path, file_type=kind)
        back = read_shape(path)
    assert (len(back.vertices), len(back.edges)) == (len(solid.vertices), len(solid.edges))
    assert back.genus == solid.genus
    assert volume(back) == pytest.approx(volume(solid), rel=1e-4)
    areas, found = (sorted(face_area(p, k) for k in range(len(p.faces))) for p in (solid, back))
    assert found == pytest.approx(areas, rel=1e-4, abs=0.05)
    loops = [sorted(tuple(map(len, f.loops)) for f in p.faces) for p in (solid, back)]
    assert loops[0] == loops[1]
