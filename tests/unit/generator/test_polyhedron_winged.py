"""Winged edges, checks of a surface, and the messages of what is wrong with it."""

import numpy as np
import pytest

from generator.errors import ShapeError
from generator.polyhedron import polyhedron, volume

CUBE = [(x, y, z) for z in (0, 60) for x, y in ((0, 0), (60, 0), (60, 60), (0, 60))]
FACES = [(3, 2, 1, 0), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7)]


def refused(vertices, faces):
    with pytest.raises(ShapeError) as caught:
        polyhedron("polyhedron", vertices, faces)
    return caught.value


def frame():
    """A block with a square through hole: 16 vertices, genus 1."""
    inner = [(x, y, z) for z in (0, 60) for x, y in ((20, 20), (40, 20), (40, 40), (20, 40))]
    faces = [
        [FACES[0], (8, 9, 10, 11)],
        *FACES[1:5],
        [FACES[5], (15, 14, 13, 12)],
        *[(8 + (k + 1) % 4, 8 + k, 12 + k, 12 + (k + 1) % 4) for k in range(4)],
    ]
    return CUBE + inner, faces


def test_through_hole_has_genus_one():
    solid = polyhedron("polyhedron", *frame())
    assert (len(solid.vertices), len(solid.edges), len(solid.faces)) == (16, 24, 10)
    assert (solid.euler_characteristic, solid.genus) == (0, 1)
    assert volume(solid) == pytest.approx(60**3 - 20 * 20 * 60, rel=1e-14)
    assert len(solid.faces[0].loops) == 2


def test_solid_given_inside_out_is_turned_and_says_so():
    solid = polyhedron("polyhedron", CUBE, [face[::-1] for face in FACES])
    assert volume(solid) == 60**3
    assert solid.notes == ("all faces pointed inward and were turned outward",)
    assert [face.loops[0][0] for face in solid.faces] == [face[-1] for face in FACES]


def test_open_surface_names_edges_and_faces():
    error = refused(CUBE, FACES[:-1])
    assert "4 problems" in error.cause
    assert "face F2: open: the edge between vertex 4 (0, 0, 60) and vertex 5" in error.cause
    assert "add the face that is missing" in error.cause


def test_reversed_face_is_named():
    error = refused(CUBE, [*FACES[:2], FACES[2][::-1], *FACES[3:]])
    assert (error.place, error.fix) == ("face F3", "reverse the order of its vertices")


def test_bent_face_gives_the_measure():
    vertices = [*CUBE[:6], (60, 60, 61), CUBE[7]]
    error = refused(vertices, FACES)
    assert error.place == "face F6"
    assert error.cause == (
        "not planar: its vertices lie up to 0.25 mm off their plane, 0.01 mm is allowed; "
        "the farthest is vertex 4 (0, 0, 60)"
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda v, f: (v[:3], f), "3 vertices"),
        (lambda v, f: (v, [*f[:5], (4, 5, 6, 8)]), "there is no vertex 8; they are 0 to 7"),
        (lambda v, f: (v, [*f[:5], (4, 5, 6, -1)]), "there is no vertex -1"),
        (lambda v, f: (v, [*f[:5], (4, 5)]), "a loop of 2 vertices"),
        (lambda v, f: (v, [*f[:5], (4, 5, 6, 5)]), "visits vertex 5 (60, 0, 60) twice"),
        (lambda v, f: (v, [*f[:5], (4, 6, 5, 7)]), "crosses itself"),
        (lambda v, f: (v, [*f, (4, 5, 6, 7)]), "joins 3 faces (F2, F6, F7)"),
        (lambda v, f: ([*v, (9, 9, 9)], f), "vertex 8 (9, 9, 9) belongs to no face"),
        (
            lambda v, f: ([*v[:7], (60, 60, 60)], f),
            "vertex 6 (60, 60, 60) and vertex 7 are the same",
        ),
        (lambda v, f: ([*v[:7], (np.nan, 0, 0)], f), "vertex 7 is not a point"),
        (lambda v, f: ([(x, y, 0) for x, y, _ in v], f), "are the same point"),
    ],
)
def test_what_is_wrong_is_said(change, says):
    assert says in str(refused(*change(CUBE, FACES)))


@pytest.mark.parametrize("face", [3, [0, 1.5, 2], ["a", "b", "c"], [True, 1, 2]])
def test_faces_that_are_no_lists_of_numbers_are_refused(face):
    assert "list of vertex numbers" in refused(CUBE, [*FACES[:5], face]).cause


def test_holes_that_are_wrong_are_named():
    vertices, faces = frame()
    turned = [[faces[0][0], faces[0][1][::-1]], *faces[1:]]
    assert "hole 1 runs counter-clockwise" in str(refused(vertices, turned))
    swapped = [faces[0][::-1], *faces[1:]]
    assert "hole 1 lies outside it; list the outer loop first" in str(refused(vertices, swapped))


def test_sliver_and_flat_solids_are_refused():
    flat = [(0, 0, 0), (60, 0, 0), (30, 1e-5, 0), (30, 0, 40)]
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    assert "a line, not a face" in str(refused(flat, faces))
    pressed = [(0, 0, 0), (60, 0, 0), (0, 60, 0), (20, 20, 1e-5)]
    assert "the solid is flat: its volume is 0.006 mm^3" in str(refused(pressed, faces))


def test_two_bodies_are_refused():
    far = [(x + 100, y, z) for x, y, z in CUBE]
    faces = FACES + [tuple(v + 8 for v in face) for face in FACES]
    assert "2 separate shells (they start at faces F1, F7)" in refused(CUBE + far, faces).cause


def test_bodies_that_touch_at_a_vertex_are_refused():
    other = [(60 + x, 60 + y, 60 + z) for x, y, z in CUBE]
    number = {0: 6, **{k: k + 7 for k in range(1, 8)}}
    faces = FACES + [tuple(number[v] for v in face) for face in FACES]
    assert "touches itself at vertex 6 (60, 60, 60)" in refused(CUBE + other[1:], faces).cause


def test_solid_that_cuts_through_itself_is_refused():
    # A block whose notch is deeper than the block is thick.
    profile = [(0, 0), (80, 0), (80, 40), (50, 40), (40, -20), (30, 40), (0, 40)]
    vertices = [(x, y, z) for z in (0, 40) for x, y in profile]
    sides = [(k, (k + 1) % 7, (k + 1) % 7 + 7, k + 7) for k in range(7)]
    error = refused(vertices, [tuple(range(6, -1, -1)), *sides, tuple(range(7, 14))])
    assert "cross or touch" in error.cause
    # The same found in space alone: a spike through the opposite face.
    pierced = [(0, 0, 0), (60, 0, 0), (60, 60, 0), (0, 60, 0), (30, 30, 40), (30, 30, 60)]
    faces = [(0, 3, 2, 1), (0, 1, 5), (1, 2, 5), (2, 3, 5), (3, 0, 5)]
    polyhedron(
        "polyhedron", [*pierced[:4], pierced[5]], [tuple(min(v, 4) for v in f) for f in faces]
    )
    dented = [*pierced[:4], (30, 30, 60), (30, 30, -20)]
    floor = [(3, 2, 5), (2, 1, 5), (1, 0, 5), (0, 3, 5)]
    roof = [(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]
    assert len(polyhedron("polyhedron", dented, floor + roof).faces) == 8
    dented[5] = (55, 30, 40)
    assert "runs through it at" in str(refused(dented, floor + roof))


def test_moebius_band_of_faces_has_no_outside():
    # The projective plane on six vertices: closed, every edge twice, one-sided.
    rng = np.random.default_rng(5)
    vertices = rng.uniform(0, 60, size=(6, 3))
    faces = [
        (0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1),
        (1, 2, 4), (2, 3, 5), (3, 4, 1), (4, 5, 2), (5, 1, 3),
    ]  # fmt: skip
    assert "no outside" in str(refused(vertices, faces))
