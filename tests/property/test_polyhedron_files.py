"""Files: what is written of a solid is read back as the same solid; garbage is refused."""

import tempfile
from pathlib import Path

import manifold3d
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_shapes import random_convex, random_nonconvex

from generator.errors import ShapeError
from generator.polyhedron import (
    Polyhedron,
    dihedral,
    face_area,
    face_polygon,
    volume,
)
from generator.polyhedron.read import read_shape

SHAPES_FOLDER = Path(__file__).parents[2] / "fixtures" / "shapes"
SEEDS = st.integers(0, 2**32 - 1)
SOLIDS = st.builds(
    lambda make, seed: make(np.random.default_rng(seed)),
    st.sampled_from([random_convex, random_nonconvex]),
    SEEDS,
)


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


@settings(max_examples=4, deadline=None)  # the kernel starts in a process of its own
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
