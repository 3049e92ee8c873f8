"""Files of other programs: what they hold, and what is said of those that hold no solid."""

import itertools
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from generator.errors import ShapeError
from generator.plane.polygon import signed_area
from generator.polyhedron import SHAPES, volume
from generator.polyhedron.development import development
from generator.polyhedron.frame import face_area
from generator.polyhedron.read import merge, read_shape

SHAPES_FOLDER = Path(__file__).parents[3] / "fixtures" / "shapes"
HEXAGON = 1.5 * 3**0.5 * 12**2

TETRAHEDRON = "v 0 0 0\nv 60 0 0\nv 0 60 0\nv 0 0 60\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def refused(path):
    with pytest.raises(ShapeError) as caught:
        read_shape(path)
    return caught.value


@pytest.fixture
def written(tmp_path):
    """Write a file of a name with a text, bytes, or triangles (of an STL file)."""

    def write(name, content):
        if isinstance(content, str):
            content = content.encode()
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else binary_stl(content))
        return path

    return write


def binary_stl(triangles):
    records = [struct.pack("<12fH", 0, 0, 0, *np.ravel(t), 0) for t in triangles]
    head = b"solid of another program".ljust(80)
    return head + struct.pack("<I", len(records)) + b"".join(records)


def fan(polygon):
    return [(polygon[0], b, c) for b, c in itertools.pairwise(polygon[1:])]


def test_a_step_file_has_a_unit_and_round_faces_are_divided_as_finely_in_any_size(written):
    text = (SHAPES_FOLDER / "cube_with_hole.step").read_text()
    centimetres = written("cm.stp", text.replace("SI_UNIT(.MILLI.,", "SI_UNIT(.CENTI.,"))
    mm3 = 1000 * (60**3 - 60 * HEXAGON)
    assert volume(read_shape(centimetres)) == pytest.approx(mm3, rel=1e-12)
    plain, large = (read_shape(SHAPES_FOLDER / "block_with_bore.step", s) for s in (1.0, 6.0))
    assert volume(large) == pytest.approx(6**3 * volume(plain), rel=1e-3)
    assert len(large.surfaces) == len(plain.surfaces)
    assert all(surface.chord_error_mm <= 0.02 for surface in large.surfaces)


def test_obj_with_non_convex_polygons_negative_numbers_and_textures(written):
    profile = [(0, 0), (80, 0), (80, 20), (20, 20), (20, 60), (0, 60)]
    lines = ["# an L", "mtllib l.mtl", "o L"]
    lines += [f"v {x} {y} {z}" for z in (0, 40) for x, y in profile]
    lines += ["vn 0 0 1", "f -12//1 -7//1 -8//1 -9//1 -10//1 -11//1", "f 7/1/1 8/2 9 10 11 12"]
    lines += [f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}" for k in range(6)]
    solid = read_shape(written("l.obj", "\n".join(lines).replace("10 11", "10 \\\n11")))
    assert (len(solid.faces), volume(solid)) == (8, pytest.approx(2400 * 40))


def prism(ring, height, caps):
    """Return the triangles of a prism over a ring (x, y), its caps as triangles of the ring."""
    low, high = ([(x, y, z) for x, y in ring] for z in (0, height))
    found = [[high[k] for k in cap] for cap in caps] + [[low[k] for k in cap[::-1]] for cap in caps]
    for k in range(-1, len(ring) - 1):
        found += [(low[k], low[k + 1], high[k + 1]), (low[k], high[k + 1], high[k])]
    return found


SOLID = SHAPES["cube"](side=60)
SIDES = [fan(SOLID.vertices[list(face.loops[0])]) for face in SOLID.faces]
CUBE = [triangle for side in SIDES for triangle in side]


def pointed_cube():
    """A cube whose front has a point on its upper edge, filled on the top by a flat triangle."""
    e, f, _, _, a, b, c, d = SOLID.vertices
    m = 0.3 * a + 0.7 * b
    sides = [triangle for k in (0, 2, 3, 4) for triangle in SIDES[k]]
    return [*sides, (e, f, m), (f, b, m), (e, m, a), (a, b, c), (a, c, d), (a, m, b)]


#: Between two walls that meet the top stands one 1.5 um wide, and a sliver of the top.
SLIVER = [(0, 0), (100, 0), (100, 60), (60, 60.0015), (60, 60), (0, 60)]
#: One side of a box has an edge that its neighbours have in two and three pieces.
PIECES = [*prism([(0, 0), (30, 0), (30, 20), (0, 20)], 10, []),
          ((0, 0, 10), (10, 0, 10), (0, 20, 10)), ((10, 0, 10), (18, 0, 10), (0, 20, 10)),
          ((18, 0, 10), (30, 0, 10), (0, 20, 10)), ((30, 0, 10), (30, 20, 10), (0, 20, 10)),
          ((15, 0, 0), (0, 0, 0), (0, 20, 0)), ((30, 0, 0), (15, 0, 0), (0, 20, 0)),
          ((30, 0, 0), (0, 20, 0), (30, 20, 0))]  # fmt: skip


def notched():
    """The mouth of a notch 1.2 um wide is closed, so that its outline touches itself."""
    ring = [(0, 0), (100, 0), (100, 20), (50, 20), (50.0006, 19.9992), (49.9994, 19.9992),
            (50, 20), (0, 20)]  # fmt: skip
    faces = [f"f {' '.join(str(k + 1) for k in reversed(range(8)))}", "f 9 10 11 12 13 14 15 16"]
    faces += [f"f {k + 1} {(k + 1) % 8 + 1} {(k + 1) % 8 + 9} {k + 9}" for k in range(8)]
    return "\n".join([f"v {x} {y} {z}" for z in (0, 30) for x, y in ring] + faces)


@pytest.mark.parametrize(
    ("name", "content", "faces", "mm3", "notes"),
    [
        ("point.stl", pointed_cube(), 6, 60**3, ()),
        ("sliver.stl", prism(SLIVER, 40, [(0, k, k + 1) for k in range(1, 5)]), None,
         100 * 60 * 40, None),
        ("pieces.stl", PIECES, 6, 6000, ()),
        ("notch.obj", notched(), 6, 100 * 20 * 30,
         ("points nearer than 0.0023 mm were joined",)),
    ],
)  # fmt: skip
def test_slivers_and_points_on_edges_vanish(written, name, content, faces, mm3, notes):
    solid = read_shape(written(name, content))
    assert volume(solid) == pytest.approx(mm3, rel=1e-4 if faces is None else 1e-6)
    if faces is not None:
        assert (len(solid.faces), solid.notes) == (faces, notes)


@pytest.mark.parametrize(
    ("triangles", "says"),
    [
        (CUBE[:-1], "not closed: 3 edges have one face only, the first from ("),
        ([*CUBE, CUBE[0]], "3 edges have more than two faces"),
        ([CUBE[0][::-1], *CUBE[1:]], "disagree about outside"),
        ([*CUBE[:2], *(t[::-1] for t in CUBE[:2])], "it is flat"),
        ([np.zeros((3, 3))] * 4, "smaller than a rounding"),
        (PIECES[:-1], "not closed"),
        # a notch whose tip cuts through the back of the bar
        (prism([(0, 0), (60, 0), (60, 60), (30, -5), (0, 60)], 40,
               [(0, 1, 3), (1, 2, 3), (0, 3, 4)]),
         "face F8: the edge between vertices 2 and 3 runs through it"),
    ],
    ids=["open", "doubled", "turned", "flat", "dot", "pieces", "through"],
)  # fmt: skip
def test_broken_meshes_are_told_apart(written, triangles, says):
    error = refused(written("broken.stl", triangles))
    assert says in error.cause
    assert error.fix
    assert error.place.endswith("broken.stl")


def test_bodies_are_counted_and_described(written):
    cube = np.array(CUBE) - np.mean(CUBE, axis=(0, 1))
    void = cube[:, ::-1] / 2
    error = refused(written("3.stl", np.concatenate([cube / 3 + 200, cube, void])))
    assert error.cause == (
        "3 separate bodies: 60 x 60 x 60 mm about (0, 0, 0), a void of 30 x 30 x 30 mm about "
        "(0, 0, 0), 20 x 20 x 20 mm about (200, 200, 200); one solid has one"
    )
    assert "boolean union" in error.fix
    six = np.concatenate([cube + 100 * k for k in range(6)])
    assert ", 2 smaller; one" in refused(written("6.stl", six)).cause


def test_marks_of_an_encoding_are_read_and_other_bytes_named(written):
    for encoding in ("utf-16", "utf-8-sig"):
        solid = read_shape(written("t.obj", TETRAHEDRON.encode(encoding)))
        assert volume(solid) == pytest.approx(60**3 / 6)
    text = (SHAPES_FOLDER / "l_bracket_ascii.stl").read_bytes()
    marked = read_shape(written("m.stl", b"\xef\xbb\xbf" + text))  # no binary one
    assert np.array_equal(marked.vertices, read_shape(written("plain.stl", text)).vertices)
    error = refused(written("t.obj", TETRAHEDRON.encode("utf-16-le")))
    assert error.cause == "it is no plain text: byte 1 is zero"
    assert error.fix.startswith("save it as text")


def sphere(rows, columns, radius=30.0):
    turn = np.pi * np.arange(rows + 1) / rows
    return lathe(*zip(radius * np.sin(turn), -radius * np.cos(turn), strict=True), sides=columns)


def test_a_sphere_stays_blank_and_too_many_faces_are_counted(written, monkeypatch):
    path = written("s.stl", sphere(24, 48))
    solid = read_shape(path)
    assert len(solid.blank) == len(solid.faces) == 1152
    assert {face.name.partition(".")[0] for face in solid.faces} == {"F1"}
    assert "1 curved region stays blank, 1152 of 1152 facets: F1 about (0, 0, 0)" in solid.notes[-1]
    monkeypatch.setattr(merge, "MOST_FACETS", 1000)
    cause = refused(path).cause  # and they are not called curved
    assert cause.startswith("1152 planar faces, the smallest of ")
    assert cause.endswith(" mm^2; 1000 are allowed")


def rounded_bar(steps, across=10):
    """Return the triangles of a bar of 60 x 40 x 50 mm, one long edge rounded by 10 mm."""
    turn = np.linspace(0, np.pi / 2, steps + 1)
    arc = np.stack([60 - across * (1 - np.cos(turn)), 30 + 10 * np.sin(turn)], axis=1)
    ring = [(0, 0), (60, 0), *arc.tolist(), (0, 40)]
    return prism(ring, 50, [(0, k, k + 1) for k in range(1, len(ring) - 1)])


def test_planar_faces_of_a_rounded_mesh_keep_their_symbols(written):
    solid = read_shape(written("r.stl", rounded_bar(100, across=14)))  # no circle
    blank = [solid.faces[face].name for face in solid.blank]
    assert blank == ["F7", *(f"F7.{k}" for k in range(2, 101))]
    plain = [f.name for k, f in enumerate(solid.faces) if k not in solid.blank]
    assert sorted(plain) == [f"F{k}" for k in range(1, 7)]
    assert volume(solid) == pytest.approx(50 * (2400 - 140 + 35 * np.pi), rel=1e-4)
    assert "100 of 106 facets: F7 about (53, 35, 25)" in solid.notes[-1]
    few = read_shape(written("f.stl", rounded_bar(20, across=14)))
    assert (len(few.faces), few.blank, few.surfaces) == (26, (), ())


def lathe(*rings, sides=40, squash=1.0):
    """Return the triangles of a solid of revolution through rings (radius, z), from below."""
    turn = 2 * np.pi * np.arange(sides) / sides
    p = np.array([np.stack([r * np.cos(turn), squash * r * np.sin(turn), turn * 0 + z], axis=1)
                  for r, z in rings])  # fmt: skip
    found = [*fan(p[0][::-1]), *fan(p[-1])]
    for a, b in itertools.pairwise(p):
        for k in range(-1, sides - 1):
            found += [(a[k], a[k + 1], b[k + 1]), (a[k], b[k + 1], b[k])]
    return found


@pytest.mark.parametrize(
    ("triangles", "walls"),
    [
        (lathe((30, 0), (30, 60), sides=200), [("cylinder", 200, 30, 0)]),
        (lathe((40, 0), (40, 80), sides=30), [("cylinder", 30, 40, 0)]),
        (lathe((25, 0), (35, 80)), [("cone", 40, 35, np.arctan(1 / 8))]),
        (lathe((30, 0), (30, 40), (20, 40), (20, 70)),
         [("cylinder", 40, 30, 0), ("cylinder", 40, 20, 0)]),
        (lathe((30, 0), (30, 60), (29.8, 61), (29.1, 62), (28.2, 62.7), (27, 63)),
         [("cylinder", 40, 30, 0)]),
        (rounded_bar(40), [("cylinder", 40, 10, 0)]),
        (rounded_bar(8), [("cylinder", 8, 10, 0)]),
    ],
    ids=["fine", "coarse", "cup", "shoulder", "fillet", "arc", "coarse arc"],
)  # fmt: skip
def test_round_walls_of_a_mesh_are_cylinders_and_cones(written, triangles, walls):
    turn = np.linalg.qr(np.random.default_rng(36).normal(size=(3, 3)))[0]
    turned = np.array(triangles)[:, :: int(np.linalg.det(turn).round())] @ turn
    solid = read_shape(written("w.stl", turned))
    assert [(one.kind, len(one.facets)) for one in solid.surfaces] == [wall[:2] for wall in walls]
    for one, wall in zip(solid.surfaces, walls, strict=True):
        assert (one.radius_mm, one.half_angle_rad) == pytest.approx(wall[2:], abs=2e-3)
        area = signed_area(development(solid, one).outline)
        assert sum(face_area(solid, k) for k in one.facets) == pytest.approx(area, rel=1e-5)
        assert not set(one.facets) & set(solid.blank)


def test_what_is_nearly_round_is_no_cylinder(written):
    for triangles in (
        lathe((30, 0), (30, 60), squash=1.01),
        lathe((30, 0), (30, 60), sides=64, squash=1.03),
        lathe((30, 0), (30, 60), sides=12),
        lathe((100, 0), (100, 60), sides=24),  # facets of 26 mm carry symbols themselves
        sphere(12, 24),
        lathe(*((20 + 3 * np.sin(z), 10 * z) for z in np.linspace(0.5, 2.6, 8))),  # a barrel
    ):
        assert read_shape(written("n.stl", triangles)).surfaces == ()


def test_a_wall_with_a_hole_is_round_beside_the_hole(written):
    """A window of three facets is cut through the wall of a tube; the others stay one wall."""
    from manifold3d import Manifold

    bore = Manifold.cylinder(80, 25, 25, 48).translate((0, 0, 5))
    window = Manifold.cube((40, 9, 20)).translate((0, -3, 20))
    mesh = (Manifold.cylinder(60, 30, 30, 48) - bore - window).to_mesh()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    walls = read_shape(written("h.stl", corners)).surfaces
    assert {(one.kind, one.closed) for one in walls} == {("cylinder", False)}
    assert sorted(one.concave for one in walls) == [False, True]
    assert all(43 <= len(one.facets) < 48 for one in walls)


def test_step_without_the_kernel_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "OCP", None)  # as if it were not installed
    error = refused(SHAPES_FOLDER / "cube_with_hole.step")
    assert "pip install 'encoded-objects[cad]'" in error.fix


def test_step_that_crashes_the_kernel_is_refused(written):
    # Digits changed at random: kernel 7.9 ends with signal 11 on this one.
    content = bytearray((SHAPES_FOLDER / "cube_with_hole.step").read_bytes())
    rng = np.random.default_rng(2)
    for _ in range(rng.integers(1, 40)):
        content[rng.integers(900, len(content) - 60)] = ord("0") + rng.integers(0, 10)
    error = refused(written("damaged.step", bytes(content)))
    assert "damaged" in error.fix


@pytest.mark.parametrize(
    ("name", "content", "place", "says"),
    [
        ("a.stl", b"", "a.stl", "empty"),
        ("a.stl", b"\x01" * 60, "a.stl", "neither ASCII nor binary STL: 60 bytes"),
        ("a.stl", bytes(80) + b"\x04\0\0\0" + bytes(120), "a.stl", "announces 4 triangles"),
        ("a.stl", bytes(84), "a.stl", "no faces"),
        ("a.stl", binary_stl([[[np.nan] * 3] * 3]), "a.stl", "triangle 1 at byte 84"),
        ("a.stl", binary_stl([[[1e9, 0, 0]] * 3]), "a.stl", "a coordinate is 1e+09 mm"),
        ("a.stl", "solid\nfacet normal 0 0 1\n", "a.stl:2", "without 'endsolid'"),
        ("a.stl", "solid\nvertex 1 2 x\n", "a.stl:2", "not a corner"),
        ("a.stl", "solid\nvertex 1 2 nan\n", "a.stl:2", "not a number"),
        ("a.stl", "solid\nfacet\nvertex 1 2 3\nendfacet\n", "a.stl:4", "a facet with 1 corners"),
        ("a.stl", "solid\nendsolid\n", "a.stl", "no faces"),
        ("a.stl", "solid\nfact normal\n", "a.stl:2", "'fact' is no word of STL"),
        ("a.obj", TETRAHEDRON + "f 1 2 9\n", "a.obj:9", "there is no vertex 9; 4 are defined"),
        ("a.obj", TETRAHEDRON + "f 1 0 2\n", "a.obj:9", "there is no vertex 0"),
        ("a.obj", TETRAHEDRON + "f 1 2\n", "a.obj:9", "a face of 2 vertices"),
        ("a.obj", TETRAHEDRON + "f a b c\n", "a.obj:9", "does not name vertices"),
        ("a.obj", TETRAHEDRON + "v 1 2\n", "a.obj:9", "not a point: it has three numbers"),
        ("a.obj", TETRAHEDRON + "v 1 2 3.1+e2\n", "a.obj:9", "'3.1+e2' is no number"),
        ("a.obj", TETRAHEDRON + "surf 1 2\n", "a.obj:9", "free-form"),
        ("a.obj", TETRAHEDRON + "?\n", "a.obj:9", "no word of OBJ"),
        ("a.obj", "v 0 0 0\n", "a.obj", "no faces"),
        ("a.step", "solid\n", "a.step", "it starts with 'solid'"),
        ("a.step", bytes(84), "a.step", "it is no text"),
        ("a.step", "ISO-10303-21;\nHEADER;", "a.step", "ends at byte 21 without 'END-ISO-1"),
        ("a", "x", "a", "no suffix"),
    ],
)
def test_bad_files_give_place_cause_and_way_out(tmp_path, written, name, content, place, says):
    error = refused(written(name, content))
    assert error.place == str(tmp_path / place)
    assert says in error.cause
    assert error.fix


def test_missing_and_large_files(tmp_path, monkeypatch):
    (tmp_path / "folder.stl").mkdir()
    assert "directory" in refused(tmp_path / "folder.stl").cause
    monkeypatch.setattr("generator.polyhedron.read.LARGEST_BYTES", 100)
    assert "are allowed" in refused(SHAPES_FOLDER / "l_bracket.stl").cause
