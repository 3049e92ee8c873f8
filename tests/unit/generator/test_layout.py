"""Whole layouts of known objects, nets known by heart, and footprints worked by hand."""

import numpy as np
import pytest

from generator.array.profiles import profile
from generator.errors import LayoutError
from generator.layout.footprint import (
    free_grid,
    mirror_region,
    move_region,
    region_of,
)
from generator.layout.layout import lay_out
from generator.layout.placement import CODE_LETTERS, FaceLayout, Layout, Placement, object_code
from generator.layout.places import array_cells, count_places, count_windows
from generator.layout.unfold import overlap, split, triangles_of, unfold
from generator.polyhedron import shapes

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
ARRAY = profile("one-touch").array()


def clearances(solid, clearance=1.0):
    return [[np.full(len(loop), clearance) for loop in face.loops] for face in solid.faces]


def laid_out(solid, occupied=NONE, kind="auto", array=ARRAY, pitch=7.0, half=2.7, **options):
    return lay_out(solid, array, pitch, half, clearances(solid), occupied, kind, **options)


def test_the_60_mm_cube_carries_384_symbols():
    layout = laid_out(shapes.cube(60.0))
    assert layout.kind == "faces"
    assert [len(face.rows) for face in layout.faces] == [64] * 6
    assert [face.places for face in layout.faces] == [42] * 6
    assert (layout.blank_faces, layout.warnings) == ((), ())
    for face in layout.faces:
        x = 30.0 + 7.0 * np.arange(-3.5, 4.0)
        assert np.allclose(np.unique(np.round(face.centres_mm, 4)), x, atol=1e-4)


def test_the_net_falls_into_islands_where_the_array_is_too_small():
    array = profile("product").array()  # 15 x 15
    solid = shapes.tetrahedron(75.0)
    layout = laid_out(solid, kind="net", array=array, pitch=8.0, half=3.0)
    assert len({(f.placement.row, f.placement.column) for f in layout.faces}) > 1


def test_a_face_identified_by_its_rank_alone_is_one_place():
    layout = laid_out(shapes.box((80.0, 60.0, 12.0)), kind="faces")
    assert sorted(face.places for face in layout.faces) == [1, 1, 1, 1, 63, 63]


def test_faces_without_a_place_are_listed_with_what_would_help():
    solid = shapes.box((80.0, 60.0, 5.0))
    with pytest.raises(LayoutError) as caught:
        laid_out(solid)
    layout = laid_out(solid, allow_blank_faces=True)
    assert layout.blank_faces == (1, 2, 3, 4)
    assert [warning.endswith("left blank") for warning in layout.warnings] == [True]
    names = [solid.faces[k].name for k in (1, 2, 3, 4)]
    assert all(name in caught.value.cause for name in names)
    assert "80.0 x 5.0 mm, 0 cells" in caught.value.cause
    assert "3x2 cells at 7 mm pitch" in caught.value.cause
    assert "smaller window than 3x2" in caught.value.fix
    pitch = float(caught.value.fix.split("set pitch to ")[1].split(" mm")[0])
    better = laid_out(solid, pitch=pitch, half=2.7 * pitch / 7.0)
    assert all(face.places > 0 for face in better.faces)
    scale = float(caught.value.fix.split("make the object ")[1].split(" times")[0])
    larger = laid_out(shapes.box((80.0 * scale, 60.0 * scale, 5.0 * scale)))
    assert all(face.places > 0 for face in larger.faces)


def test_faces_are_left_blank_on_purpose_without_a_warning():
    for kind in ("faces", "net"):
        layout = laid_out(shapes.cube(60.0), kind=kind, blank_faces={0, 3})
        assert (layout.blank_faces, layout.warnings) == ((0, 3), ())
        assert len(layout.faces) == 6


def test_a_net_that_loses_a_face_names_the_way_out():
    with pytest.raises(LayoutError, match="set layout to faces"):
        laid_out(shapes.prism(12, 40.0, side=20.0), kind="net")


def test_a_full_array_says_how_many_cells_are_free_and_needed():
    rows, columns = np.mgrid[:63, :65].reshape(2, -1)
    with pytest.raises(LayoutError, match=r"needs 384 cells, 300 of 4095 are free") as caught:
        laid_out(shapes.cube(60.0), (rows[:-300], columns[:-300]), kind="faces")
    assert "profile: auto" in caught.value.fix
    with pytest.raises(LayoutError, match="not in blocks"):
        laid_out(shapes.cube(180.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "nets"}, "unknown layout 'nets'"),
        ({"half": 4.0}, "8 mm do not fit a pitch of 7 mm"),
        ({"half": 0.0}, "0 mm do not fit"),
        ({"pitch": np.nan}, "pitch of nan mm"),
        ({"blank_faces": (7,)}, "no face 7"),
    ],
)
def test_impossible_requests_are_refused(options, message):
    with pytest.raises(LayoutError, match=message):
        laid_out(shapes.cube(60.0), **options)


def test_clearances_must_match_the_edges():
    solid = shapes.cube(60.0)
    good = clearances(solid)
    for bad in (good[:5], [[np.ones(3)]] * 6, [[np.full(4, -1.0)]] * 6, [[np.full(4, np.inf)]] * 6):
        with pytest.raises(LayoutError, match="clearance"):
            lay_out(solid, ARRAY, 7.0, 2.7, bad, NONE)


def layout_at(*cells):
    """Return a layout of a blank face and one face for each cell."""
    place = Placement(0, 0, 0.0, 0.0, 0.0)
    blank = np.zeros(0, dtype=np.int64)
    faces = [FaceLayout(0, place, blank, blank, blank, np.zeros((0, 2)), 0)]
    for row, column in cells:
        one = np.ones(1, dtype=np.int64)
        faces.append(FaceLayout(1, place, row * one, column * one, one, np.zeros((1, 2)), 0))
    return Layout("faces", 7.0, tuple(faces))


@pytest.mark.parametrize(
    ("rows", "columns", "cells", "code"),
    [
        (63, 65, [(0, 0)], "222"),
        (63, 65, [(1, 0)], "24Y"),  # 65 = 2 * 22 + 21
        (63, 65, [(2, 0), (1, 0), (1, 5)], "24Y"),  # the first cell
        (51, 1285, [(50, 1284)], "C5EU"),  # 65534 = ((6 * 22 + 3) * 22 + 8) * 22 + 18
        (2**32, 2**32, [(2**32 - 1, 2**32 - 1)], "D" + "?" * 14),
    ],
)
def test_codes_count_cells(rows, columns, cells, code):
    found = object_code(layout_at(*cells), rows, columns)
    number = 0
    for letter in found:
        number = number * len(CODE_LETTERS) + CODE_LETTERS.index(letter)
    row, column = min(cells)
    assert number == row * columns + column
    assert len(found) == len(code)
    if "?" not in code:
        assert found == code


def test_every_cell_has_its_own_code():
    codes = {object_code(layout_at((r, c)), 63, 65) for r in range(63) for c in range(65)}
    assert len(codes) == 63 * 65
    assert "F" not in "".join(codes)


def test_windows_of_masks():
    mask = np.ones((4, 5), dtype=bool)
    assert count_windows(mask, (3, 2)) == 2 * 4
    mask[1, 2] = False
    assert count_windows(mask, (3, 2)) == 4
    assert count_windows(mask, (5, 1)) == 0
    rows, columns = np.nonzero(mask)
    assert count_places(rows + 7, columns - 9, (3, 2), None) == 4


def test_quarter_turns_of_cells_turn_counter_clockwise():
    cells = np.array([[0, 0], [0, 1], [1, 1]])  # (j up, i right): right, then up
    rows, columns = array_cells(cells, 0)
    assert (rows.tolist(), columns.tolist()) == ([0, 0, -1], [0, 1, 1])
    rows, columns = array_cells(cells, 1)
    assert (rows.tolist(), columns.tolist()) == ([0, -1, -1], [0, 0, -1])


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


@pytest.mark.parametrize(
    ("other", "overlaps"),
    [
        ((1, 0), False),  # they touch
        ((1, 1), False),
        ((5, 5), False),
        ((0, 0), True),  # and cross no edge
        ((0.5, 0), True),
        ((0.4, 0.4, 0.1), True),
        ((1 - 1e-6, 0), True),
    ],
)
def test_squares_overlap_where_they_share_an_area(other, overlaps):
    assert overlap(square(0, 0), square(*other), 1e-9) == overlaps


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


SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def region(clearance=1.0, hole=None):
    loops = [SQUARE] if hole is None else [SQUARE, hole]
    return region_of(loops, [np.full(len(loop), clearance) for loop in loops])


def test_a_hole_keeps_its_distance_on_every_side():
    hole = np.array([[4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 4.0]])  # clockwise
    x = np.array([1.0, 2.4, 2.6, 5.0, 7.4, 7.6, 9.0])
    free = free_grid(region(0.5, hole), 0.5, np.array([5.0]), x)[0]
    assert free.tolist() == [True, True, True, False, True, True, True]
    free = free_grid(region(1.0, hole), 0.7, np.array([5.0]), x)[0]
    assert free.tolist() == [False, False, False, False, False, False, False]


def test_moved_and_mirrored_keep_the_face_on_the_left():
    face = move_region(region(), np.pi / 2, 10.0, 0.0)
    assert np.allclose(face.start[0], (10, 0))
    x = np.array([5.0])
    assert free_grid(face, 2.0, x, x).all()
    assert free_grid(mirror_region(face), 2.0, x, x).all()
