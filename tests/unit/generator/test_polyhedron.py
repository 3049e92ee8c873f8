"""Solids: closed forms, winged edges and their checks, frames, flattening, covered faces."""

import math
from fractions import Fraction

import numpy as np
import pytest
from random_shapes import extruded

from generator.errors import ShapeError
from generator.plane.polygon import side_of_polygon, signed_area
from generator.polyhedron import (
    SHAPES,
    Face,
    Polyhedron,
    dihedral,
    face_frame,
    face_normal,
    flatten,
    polyhedron,
    volume,
)
from generator.polyhedron.flatten import flatten_faces
from generator.polyhedron.front import covered_parts
from generator.polyhedron.shapes import cone, cylinder
from generator.polyhedron.winged import winged_edges


def test_faces_of_a_cube_lie_where_the_documentation_says():
    solid = SHAPES["cube"](side=60.0)
    outward = [face_normal(solid, k).round(12).tolist() for k in range(6)]
    assert outward == [[0, 0, -1], [0, -1, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]
    assert [face.name for face in solid.faces] == ["F1", "F2", "F3", "F4", "F5", "F6"]
    assert not solid.vertices.flags.writeable


def test_refused_lengths_say_what_is_allowed():
    for name, arguments, says, fix in (
        ("cube", {"side": math.nan}, "side is nan mm", "in that range"),
        ("cube", {"side": "60"}, "not a length", "60 mm"),
        ("cube", {"side": True}, "not a length", "60 mm"),
        ("box", {"size": [2, 80, 1000]}, "more than 200 times", "set x to 5 mm or more"),
        ("prism", {"sides": 6.0, "side": 40, "height": 60}, "3 to 64 sides", "whole number"),
        ("prism", {"sides": 6, "height": 60}, "neither side nor radius", "one of the two"),
        ("cone", {"diameter": 60, "height": 60, "top_diameter": 60}, "is not less than", ""),
        ("cylinder", {"diameter": 0.5, "height": 60}, "allowed are 1 to 5000", ""),
    ):
        with pytest.raises(ShapeError, match=says) as caught:
            (SHAPES | {"cone": cone, "cylinder": cylinder})[name](**arguments)
        assert fix in caught.value.fix


CUBE = [(x, y, z) for z in (0, 60) for x, y in ((0, 0), (60, 0), (60, 60), (0, 60))]
FACES = [(3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)]


#: A through hole in the cube: its corners, its rings in the floor and the roof, its walls.
HOLE = [(x, y, z) for z in (0, 60) for x, y in ((20, 20), (40, 20), (40, 40), (20, 40))]
RING, LID = (8, 9, 10, 11), (15, 14, 13, 12)
WALLS = [(8 + (k + 1) % 4, 8 + k, 12 + k, 12 + (k + 1) % 4) for k in range(4)]
#: A roof over the cube's floor, and a dent in its floor.
FLOOR = [(3, 2, 5), (2, 1, 5), (1, 0, 5), (0, 3, 5)]
ROOF = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
DENTED = [*CUBE[:4], (30, 30, 60), (30, 30, -20)]
TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
#: The projective plane on six vertices: closed, every edge twice, one-sided.
ONE_SIDED = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1),
             (1, 2, 4), (2, 3, 5), (3, 4, 1), (4, 5, 2), (5, 1, 3)]  # fmt: skip


def test_solids_with_a_hole_a_dent_and_given_inside_out():
    faces = [[FACES[0], RING], *FACES[1:5], [FACES[5], LID], *WALLS]
    assert polyhedron("polyhedron", CUBE + HOLE, faces).genus == 1
    assert len(polyhedron("polyhedron", DENTED, FLOOR + ROOF).faces) == 8
    solid = polyhedron("polyhedron", CUBE, [face[::-1] for face in FACES])
    assert volume(solid) == 60**3
    assert solid.notes == ("all faces pointed inward and were turned outward",)
    assert [face.loops[0][0] for face in solid.faces] == [face[-1] for face in FACES]


@pytest.mark.parametrize(
    ("vertices", "faces", "says"),
    [
        (CUBE[:3], FACES, "3 vertices"),
        (CUBE, [*FACES[:5], (4, 5, 6, -1)], "there is no vertex -1"),
        (CUBE, [*FACES[:5], (4, 5)], "a loop of 2 vertices"),
        (CUBE, [*FACES[:5], (4, 5, 6, 5)], "visits vertex 5 (60, 0, 60) twice"),
        (CUBE, [*FACES[:5], (4, 6, 5, 7)], "crosses itself"),
        (CUBE, [*FACES, (4, 5, 6, 7)], "joins 3 faces (F2, F6, F7)"),
        ([*CUBE, (9, 9, 9)], FACES, "vertex 8 (9, 9, 9) belongs to no face"),
        ([*CUBE[:7], (60, 60, 60)], FACES, "6 (60, 60, 60) and vertex 7 are the same"),
        ([*CUBE[:7], (np.nan, 0, 0)], FACES, "vertex 7 is not a point"),
        ([(x, y, 0) for x, y, _ in CUBE], FACES, "are the same point"),
        *[(CUBE, [*FACES[:5], face], "list of vertex numbers")
          for face in (3, [0, 1.5, 2], ["a", "b", "c"], [True, 1, 2])],
        (CUBE + HOLE, [[FACES[0], RING[::-1]], *FACES[1:5], [FACES[5], LID], *WALLS],
         "hole 1 runs counter-clockwise"),
        (CUBE + HOLE, [[RING, FACES[0]], *FACES[1:5], [FACES[5], LID], *WALLS],
         "hole 1 lies outside it; list the outer loop first"),
        ([(0, 0, 0), (60, 0, 0), (30, 1e-5, 0), (30, 0, 40)], TETRAHEDRON, "a line, not a face"),
        ([(0, 0, 0), (60, 0, 0), (0, 60, 0), (20, 20, 1e-5)], TETRAHEDRON,
         "the solid is flat: its volume is 0.006 mm^3"),
        ([*CUBE, *((x + 100, y, z) for x, y, z in CUBE)],
         [*FACES, *(tuple(v + 8 for v in face) for face in FACES)],
         "2 separate shells (they start at faces F1, F7)"),
        # the first corner of the other cube is the last of this one
        ([*CUBE, *((60 + x, 60 + y, 60 + z) for x, y, z in CUBE[1:])],
         [*FACES, *(tuple(v + 7 if v else 6 for v in face) for face in FACES)],
         "touches itself at vertex 6 (60, 60, 60)"),
        ([*DENTED[:5], (55, 30, 40)], FLOOR + ROOF, "runs through it at"),
        (np.random.default_rng(5).uniform(0, 60, size=(6, 3)), ONE_SIDED, "no outside"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_what_is_wrong_is_said(vertices, faces, says):
    with pytest.raises(ShapeError) as caught:
        polyhedron("polyhedron", vertices, faces)
    assert says in str(caught.value)


def test_a_notch_deeper_than_its_block_is_refused():
    profile = [(0, 0), (80, 0), (80, 40), (50, 40), (40, -20), (30, 40), (0, 40)]
    with pytest.raises(ShapeError, match="cross or touch"):
        extruded([np.array(profile, float)], 40)


ELL = np.array([(0, 0), (80, 0), (80, 20), (20, 20), (20, 60), (0, 60)], float)


def unchecked(vertices, faces):
    """A polyhedron too thin for the checks, to reach the limits of the formulas."""
    named = tuple(Face(f"F{k + 1}", (face,)) for k, face in enumerate(faces))
    edges = winged_edges([face.loops for face in named])
    return Polyhedron("polyhedron", np.array(vertices, dtype=float), named, edges)


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


DODECAHEDRON = SHAPES["dodecahedron"](side=30)
LOOPS = [face.loops for face in DODECAHEDRON.faces]


def bend(vertices):
    """Return the most by which a face of the dodecahedron leaves its plane."""
    faces = [vertices[list(loop)] - vertices[list(loop)].mean(axis=0) for (loop,) in LOOPS]
    return max(np.linalg.svd(points)[1][2] for points in faces)


def test_many_equations_are_solved_as_few(monkeypatch):
    vertices = np.round(DODECAHEDRON.vertices, 3)
    dense, _ = flatten_faces(vertices, LOOPS)
    monkeypatch.setattr(flatten, "DENSE_EQUATIONS", 10)
    sparse, _ = flatten_faces(vertices, LOOPS)
    assert bend(sparse) < 1e-12
    assert sparse == pytest.approx(dense, abs=1e-9)
    assert (sparse != vertices).any()
    monkeypatch.setattr(flatten, "MOST_EQUATIONS", 20)
    assert (flatten_faces(vertices, LOOPS)[0] == vertices).all()


def test_planar_enough_for_parts_stays_as_given_where_there_are_many(monkeypatch):
    vertices = DODECAHEDRON.vertices + 1e-10 * np.random.default_rng(3).normal(size=(20, 3))
    assert flatten_faces(vertices, LOOPS)[1] > 0.0
    monkeypatch.setattr(flatten, "DENSE_EQUATIONS", 10)
    assert flatten_faces(vertices, LOOPS)[1] == 0.0


def covered(outline, distance):
    """Return y of the normals of covered faces of a bar -> covered area, and its extent in x."""
    solid = extruded([np.array(outline, float)], 40.0)
    found = {}
    for face, loops in covered_parts(solid, range(len(solid.faces)), distance).items():
        T, points = face_frame(solid, face), np.concatenate(loops)
        x = points @ T[0, :2] + T[0, 3]
        area = -sum(signed_area(loop) for loop in loops)
        found[round(face_normal(solid, face)[1])] = (area, x.min(), x.max())
    return found


#: A slot of 2 mm, and an overhang that rises by 1 mm in 10 from 1 mm above the floor, at x = 20.
SLOT = [(0, 0), (60, 0), (60, 20), (20, 20), (20, 22), (50, 22), (50, 42), (0, 42)]
SLANTED = [(0, 0), (60, 0), (60, 20), (20, 20), (20, 21), (60, 25), (60, 40), (0, 40)]


def test_faces_cover_each_other_as_far_as_they_are_near():
    for shape in ("cube", "tetrahedron", "dodecahedron"):
        assert covered_parts(SHAPES[shape](side=40), range(4), 1000.0) == {}
    assert covered(ELL, 1000.0) == {}  # a neighbour across a reflex edge is no cover
    found = covered(SLOT, 2.8)
    assert sorted(found) == [-1, 1]
    for wall in found.values():
        assert wall == pytest.approx((30 * 40, 20, 50))
    assert covered(SLANTED, 3.0)[1] == pytest.approx((20 * 40, 20, 40))
