"""Every solid: links, closure, angles and frames; the same in files; damaged files are refused."""

import math
import tempfile
from fractions import Fraction
from pathlib import Path

import manifold3d
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_shapes import random_convex, random_nonconvex

from generator.errors import ShapeError
from generator.plane.polygon import orientations
from generator.polyhedron import (
    Polyhedron,
    dihedral,
    edge_length,
    face_area,
    face_frame,
    face_normal,
    face_polygon,
    polyhedron,
    side_of_face,
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
    assert all(12.0 < extent < 240.0 for extent in np.ptp(solid.vertices, axis=0))
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
    corners = 0.0
    for k in range(len(solid.faces)):
        corners += math.pi * (len(solid.faces[k].loops[0]) - 2)
    assert 2 * math.pi * len(solid.vertices) - corners == pytest.approx(4 * math.pi)
    # Mean width by Steiner's formula bounds the size: it is additive over edges.
    mean_width = sum(
        edge_length(solid, k) * (math.pi - angle) for k, angle in enumerate(angles)
    ) / (4 * math.pi)  # fmt: skip
    extent = np.ptp(solid.vertices, axis=0)
    assert extent.min() / 2 < mean_width < float(np.linalg.norm(extent))


@settings(max_examples=40, deadline=None)
@given(SOLIDS, SEEDS)
def test_share_of_points_inside_is_the_area(solid, seed):
    rng = np.random.default_rng(seed)
    face = int(rng.integers(len(solid.faces)))
    outer = face_polygon(solid, face)[0]
    low, high = outer.min(axis=0), outer.max(axis=0)
    points = rng.uniform(low, high, size=(4000, 2))
    share = (side_of_face(solid, face, points) >= 0).mean()
    expected = face_area(solid, face) / np.prod(high - low)
    assert share == pytest.approx(expected, abs=5 * math.sqrt(0.25 / 4000))
    assert (side_of_face(solid, face, np.concatenate(face_polygon(solid, face))) == 0).all()


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


SHAPES_FOLDER = Path(__file__).parents[2] / "fixtures" / "shapes"


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


def binary_stl(corners):
    record = np.zeros(
        len(corners), np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("a", "<u2")])
    )
    record["corners"] = corners
    return (
        b"solid of another program".ljust(80)
        + len(corners).to_bytes(4, "little")
        + record.tobytes()
    )


def ascii_stl(corners):
    lines = ["solid part"]
    for corner in corners:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x:e} {y:e} {z:e}" for x, y, z in corner]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid part"]).encode()


def obj(corners):
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners.reshape(-1, 3)]
    lines += [f"f {3 * k + 1} {3 * k + 2} {3 * k + 3}" for k in range(len(corners))]
    return "\n".join(lines).encode()


WRITERS = {".stl": binary_stl, ".STL": ascii_stl, ".obj": obj}


def read(suffix, content):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"part{suffix}"
        path.write_bytes(content)
        return read_shape(path)


def assert_same(solid, back, rel=1e-4):
    assert len(back.vertices) == len(solid.vertices)
    assert len(back.edges) == len(solid.edges)
    assert len(back.faces) == len(solid.faces)
    assert back.genus == solid.genus
    assert volume(back) == pytest.approx(volume(solid), rel=rel)
    areas, found = (
        sorted(face_area(p, k) for k in range(len(p.faces))) for p in (solid, back)
    )  # fmt: skip
    assert found == pytest.approx(areas, rel=rel, abs=0.05)
    loops = [sorted(tuple(map(len, f.loops)) for f in p.faces) for p in (solid, back)]
    assert loops[0] == loops[1]


@settings(max_examples=60, deadline=None)
@given(SOLIDS, SEEDS, st.sampled_from(sorted(WRITERS)), st.sampled_from([0.0, 1000.0]))
def test_meshes_give_the_faces_back(solid, seed, suffix, offset):
    # Edges that are nearly flat are one face for a mesh file.
    assume(all(abs(dihedral(solid, k) - np.pi) > 0.02 for k in range(len(solid.edges))))
    corners = triangles(solid, np.random.default_rng(seed)) + offset
    assert_same(solid, read(suffix, WRITERS[suffix](corners)))


def step_of(solid):
    """STEP text of a solid, by the CAD kernel alone."""
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakePolygon,
        BRepBuilderAPI_MakeSolid,
        BRepBuilderAPI_Sewing,
    )
    from OCP.BRepLib import BRepLib
    from OCP.gp import gp_Pnt
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopoDS import TopoDS

    sewing = BRepBuilderAPI_Sewing(1e-5)
    for face in solid.faces:
        wires = []
        for loop in face.loops:
            polygon = BRepBuilderAPI_MakePolygon()
            for v in loop:
                polygon.Add(gp_Pnt(*map(float, solid.vertices[v])))
            polygon.Close()
            wires.append(polygon.Wire())
        maker = BRepBuilderAPI_MakeFace(wires[0], True)
        for wire in wires[1:]:
            maker.Add(wire)
        sewing.Add(maker.Face())
    sewing.Perform()
    body = BRepBuilderAPI_MakeSolid(TopoDS.Shell_s(sewing.SewedShape())).Solid()
    BRepLib.OrientClosedSolid_s(body)
    writer = STEPControl_Writer()
    writer.Transfer(body, STEPControl_AsIs)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.step"
        writer.Write(str(path))
        return path.read_bytes()


@settings(max_examples=3, deadline=None)  # the kernel starts in a process of its own
@given(SOLIDS)
def test_step_gives_the_faces_back(solid):
    assert_same(solid, read(".step", step_of(solid)), rel=1e-9)


WORDS = ["v", "f", "0", "1", "2", "3", "4", "-1", "1e3", "/", "#", "\n", "solid", "vertex"]
FIXTURES = ["l_bracket.stl", "l_bracket_ascii.stl", "prism.obj", "cube_with_hole.step"]


def survives(suffix, content):
    """A solid or a `ShapeError` with a cause and a way out: nothing else may come."""
    try:
        solid = read(suffix, content)
    except ShapeError as error:
        refusal = error
    else:
        return isinstance(solid, Polyhedron)
    assert refusal.cause
    assert refusal.fix
    assert f"part{suffix}" in refusal.place
    return False


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(FIXTURES), st.floats(0, 1, exclude_max=True))
def test_truncated_files_are_refused(name, share):
    content = (SHAPES_FOLDER / name).read_bytes().rstrip()
    cut = content[: int(share * len(content))]
    whole = survives(Path(name).suffix, cut)
    # Only the free text behind 'endsolid' may be missing.
    assert not whole or len(content) - len(cut) <= 1 or b"endsolid" in cut[-20:]


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(FIXTURES[:3]), st.data())
def test_damaged_meshes_never_crash(name, data):
    content = bytearray((SHAPES_FOLDER / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at] = data.draw(st.integers(0, 255))
    survives(Path(name).suffix, bytes(content))


@settings(max_examples=100, deadline=None)
@given(st.sampled_from([".stl", ".obj", ".step"]), st.binary(max_size=400))
def test_garbage_is_refused(suffix, content):
    assert not survives(suffix, content)


@settings(max_examples=100, deadline=None)
@given(st.lists(st.sampled_from(WORDS), max_size=60))
def test_words_in_any_order_are_refused(words):
    text = " ".join(words).encode()
    assert not survives(".obj", text)
    assert not survives(".stl", b"solid x\n" + text)
