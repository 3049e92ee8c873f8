"""Whole layouts of known objects, islands of nets, codes of objects; placing on the torus."""

from types import SimpleNamespace

import numpy as np
import pytest
from reference.cells import listed

from generator.array.profiles import profile
from generator.errors import LayoutError
from generator.layout.layout import lay_out
from generator.layout.occupancy import TILE, Occupancy
from generator.layout.placement import FaceLayout, Layout, Placement, object_code
from generator.layout.torus import CORNER, TorusPosition, board_size, place_pieces
from generator.layout.unfold import split, unfold
from generator.polyhedron import shapes

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
ARRAY = profile("one-touch").array()


def laid_out(solid, occupied=NONE, kind="auto", array=ARRAY, pitch=7.0, half=2.7, **options):
    clearances = [[np.ones(len(loop)) for loop in face.loops] for face in solid.faces]
    return lay_out(solid, array, pitch, half, clearances, occupied, kind, **options)


def test_the_net_falls_into_islands_where_the_array_is_too_small():
    small = {"array": profile("product").array(), "pitch": 8.0, "half": 3.0}  # 15 x 15
    layout = laid_out(shapes.tetrahedron(75.0), kind="net", **small)
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
    assert all(solid.faces[k].name in caught.value.cause for k in (1, 2, 3, 4))
    assert "80.0 x 5.0 mm, 0 cells" in caught.value.cause
    assert "3x2 cells at 7 mm pitch" in caught.value.cause
    pitch = float(caught.value.fix.split("set pitch to ")[1].split(" mm")[0])
    scale = float(caught.value.fix.split("make the object ")[1].split(" times")[0])
    larger = shapes.box((80.0 * scale, 60.0 * scale, 5.0 * scale))
    for layout in (laid_out(solid, pitch=pitch, half=2.7 * pitch / 7.0), laid_out(larger)):
        assert all(face.places > 0 for face in layout.faces)


ROWS, COLUMNS = np.mgrid[:63, :65].reshape(2, -1)[:, :-300]
CUBE = shapes.cube(60.0)


@pytest.mark.parametrize(
    ("solid", "options", "message"),
    [
        (shapes.prism(12, 40.0, side=20.0), {"kind": "net"}, "set layout to faces"),
        (CUBE, {"occupied": (ROWS, COLUMNS), "kind": "faces"},
         r"needs 384 cells, 300 of 4095 are free[\s\S]*profile: auto"),
        (shapes.cube(180.0), {}, "not in blocks"),
    ],
)  # fmt: skip
def test_what_cannot_be_laid_out_is_refused(solid, options, message):
    with pytest.raises(LayoutError, match=message):
        laid_out(solid, **options)


def code_at(*cells, rows=63, columns=65):
    """Return the code of an object with a blank face and one face for each cell."""
    place, none = Placement(0, 0, 0.0, 0.0, 0.0), np.zeros(0, dtype=np.int64)
    faces = [FaceLayout(0, place, none, none, none, np.zeros((0, 2)), 0)]
    for row, column in cells:
        one = np.ones(1, dtype=np.int64)
        faces.append(FaceLayout(1, place, row * one, column * one, one, np.zeros((1, 2)), 0))
    return object_code(Layout("faces", 7.0, tuple(faces)), rows, columns)


def test_codes_count_cells():
    assert code_at((0, 0)) == "222"
    assert code_at((1, 0)) == code_at((2, 0), (1, 0), (1, 5)) == "24Y"  # 65 = 2 * 22 + 21
    # 65534 = ((6 * 22 + 3) * 22 + 8) * 22 + 18
    assert code_at((50, 1284), rows=51, columns=1285) == "C5EU"
    assert len(code_at((2**32 - 1, 2**32 - 1), rows=2**32, columns=2**32)) == 15
    codes = {code_at((r, c)) for r in range(63) for c in range(65)}
    assert len(codes) == 63 * 65
    assert "F" not in "".join(codes)


def test_a_piece_is_split_into_halves():
    net = split(unfold(CUBE), 0)
    assert sorted(map(len, net.pieces)) in ([2, 4], [3, 3])
    assert net.parents.count(-1) == 2


def torus(rows, columns, cells=NONE, first=(0, 0)):
    return Occupancy.from_cells(*cells, SimpleNamespace(rows=rows, columns=columns, first=first))


def block(rows, columns):
    return np.ones((rows, columns), dtype=bool)


def test_the_place_with_most_contact_is_taken():
    taken = np.zeros((12, 12), dtype=bool)
    taken[5, 3:9] = taken[6, 3] = taken[6, 8] = True  # a bay, four cells wide
    (spot,) = place_pieces(torus(12, 12, np.nonzero(taken)), [(block(1, 4), (0, 1, 2, 3))])
    assert spot == TorusPosition(6, 4, 0)
    # a narrow large array wraps along its short side alone
    taken = np.ones((3, 1 << 17), dtype=bool)
    taken[[2, 0], 100:104] = False
    (spot,) = place_pieces(torus(3, 1 << 17, np.nonzero(taken)), [(block(2, 4), (0,))])
    assert spot == TorusPosition(2, 100, 0)


@pytest.mark.parametrize("size", [(63, 65), (1023, 1025)])
def test_placing_from_another_first_cell_is_a_shift_of_the_same(size):
    rows, columns = size
    pieces = [(block(5, 7), (0, 1)), (block(4, 4), (0,))] * 3
    first = (rows - 3, columns // 2)
    elsewhere = place_pieces(torus(rows, columns, first=first), pieces)
    for one, other in zip(place_pieces(torus(rows, columns), pieces), elsewhere, strict=True):
        assert other == TorusPosition(
            (one.row + first[0]) % rows, (one.column + first[1]) % columns, one.quarter
        )


def cells(row, column, height, width):
    return tuple(i.ravel() for i in np.mgrid[row : row + height, column : column + width])


@pytest.mark.parametrize("first", [(0, 0), (129, 149), (100, 60)])
def test_cells_are_taken_and_freed_one_by_one_and_seen_from_the_first_cell(first):
    chance = np.random.default_rng(7)
    held, occupancy = set(), torus(130, 150, first=first)
    for _ in range(30):
        some = np.stack([chance.integers(0, 130, 200), chance.integers(0, 150, 200)])
        if chance.random() < 0.6:
            occupancy, held = occupancy.with_cells(*some), held | set(listed(some))
        else:
            occupancy, held = occupancy.without_cells(*some), held - set(listed(some))
        assert (occupancy.used, occupancy.first) == (len(held), first)
        assert listed(occupancy.cells()) == sorted(held)
    rows, columns = occupancy.cells()
    whole = np.zeros((130, 150), dtype=bool)
    whole[rows, columns] = True
    seen = np.roll(whole, (-first[0], -first[1]), axis=(0, 1))
    for size in ((130, 150), (64, 128), (1, 149), (100, 7)):
        assert np.array_equal(occupancy.corner(*size), seen[: size[0], : size[1]])
    array = SimpleNamespace(rows=130, columns=150, first=first)
    assert Occupancy.from_tiles(occupancy.tiles, array).used == len(held)
    assert occupancy.without_cells(rows, columns).tiles == {}


def test_what_is_opened_of_a_large_array_follows_its_objects():
    far = cells(2000, 3000, 8, 8)
    assert board_size(torus(4095, 4097)) == (CORNER, CORNER)
    assert board_size(torus(4095, 4097, cells(0, 0, 700, 700))) == (704, 704)
    # another lab's objects, imported from elsewhere on the array, open nothing
    assert board_size(torus(4095, 4097, cells(0, 0, 700, 700)).with_cells(*far)) == (704, 704)
    assert board_size(torus(1023, 1025, cells(0, 0, 1023, 1025))) == (1023, 1025)
    assert board_size(torus(255, 257)) == (255, 257)
    assert min(board_size(torus(2**32 - 1, 2**32 + 1, cells(0, 0, 10, 30 * TILE)))) >= 30 * TILE
    for first in ((5, 3), (4000, 4090)):
        near = torus(4095, 4097, cells(*first, 700, 700), first)
        assert all(640 <= side <= 704 for side in board_size(near))
        away = torus(4095, 4097, cells(first[0] + 1500, first[1] + 1500, 8, 8), first)
        assert board_size(away) == (CORNER, CORNER)
