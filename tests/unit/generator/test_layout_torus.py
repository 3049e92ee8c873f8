"""Placing on the torus: small cases worked by hand, large arrays, and what is taken already."""

from types import SimpleNamespace

import numpy as np
import pytest

from generator.layout.occupancy import Occupancy
from generator.layout.torus import TorusPosition, cells_at, place_pieces

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
TURNS = (0, 1, 2, 3)


def torus(rows, columns, cells=NONE):
    return Occupancy.from_cells(*cells, SimpleNamespace(rows=rows, columns=columns, first=(0, 0)))


def block(rows, columns):
    return np.ones((rows, columns), dtype=bool)


def test_the_faces_of_a_cube_stand_side_by_side():
    spots = place_pieces(torus(63, 65), [(block(8, 8), TURNS)] * 6)
    assert spots == [TorusPosition(0, 8 * k, 0) for k in range(6)]


def test_a_piece_may_wrap_around_both_sides():
    taken = np.ones((5, 6), dtype=bool)
    taken[np.ix_([4, 0], [5, 0, 1])] = False
    occupancy = torus(5, 6, np.nonzero(taken))
    (spot,) = place_pieces(occupancy, [(block(2, 3), (0,))])
    assert spot == TorusPosition(4, 5, 0)
    rows, columns = cells_at(block(2, 3), spot, 5, 6)
    assert sorted(zip(rows.tolist(), columns.tolist(), strict=True)) == [
        (0, 0), (0, 1), (0, 5), (4, 0), (4, 1), (4, 5),
    ]  # fmt: skip


def test_a_piece_is_turned_only_where_that_is_allowed():
    taken = np.ones((5, 7), dtype=bool)
    taken[1:4, 2] = False
    occupancy = torus(5, 7, np.nonzero(taken))
    assert place_pieces(occupancy, [(block(1, 3), (0, 2))]) == [None]
    assert place_pieces(occupancy, [(block(1, 3), TURNS)]) == [TorusPosition(1, 2, 1)]


def test_turns_of_a_piece_without_symmetry():
    form = np.array([[1, 1, 1], [1, 0, 0]], dtype=bool)
    hole = np.rot90(form, 3)
    taken = np.ones((9, 9), dtype=bool)
    taken[3:6, 4:6] = ~hole
    (spot,) = place_pieces(torus(9, 9, np.nonzero(taken)), [(form, TURNS)])
    assert spot == TorusPosition(3, 4, 3)
    rows, columns = cells_at(form, spot, 9, 9)
    assert not taken[rows, columns].any()


def test_the_place_with_most_contact_is_taken():
    taken = np.zeros((12, 12), dtype=bool)
    taken[5, 3:9] = taken[6, 3] = taken[6, 8] = True  # a bay, four cells wide
    (spot,) = place_pieces(torus(12, 12, np.nonzero(taken)), [(block(1, 4), TURNS)])
    assert spot == TorusPosition(6, 4, 0)


def test_what_does_not_fit_is_left_and_the_rest_is_placed():
    spots = place_pieces(
        torus(6, 6), [(block(7, 1), (0,)), (block(6, 6), (0,)), (block(1, 1), (0,))]
    )
    assert spots == [None, TorusPosition(0, 0, 0), None]


def test_empty_pieces_need_no_place():
    assert place_pieces(torus(6, 6), [(np.zeros((0, 0), dtype=bool), (0,))]) == [None]


def test_occupancy_counts_each_cell_once_and_on_the_torus():
    occupancy = torus(5, 7, ([0, 5, -5, 4], [1, 8, 1, 6]))
    assert (occupancy.used, occupancy.free) == (2, 33)
    assert occupancy.density == pytest.approx(2 / 35)
    assert occupancy.with_cells([4, 3], [6, 0]).used == 3


@pytest.mark.parametrize(("rows", "columns"), [(4095, 4097), (2**32 - 1, 2**32 + 1), (2**63, 5)])
def test_only_a_corner_of_a_large_array_is_looked_at(rows, columns):
    pieces = [(block(4, 5), TURNS)] * 40
    spots = place_pieces(torus(rows, columns), pieces)
    assert all(spot is not None and spot.row < 192 and spot.column < 192 for spot in spots)
    again = torus(rows, columns)
    for (mask, _), spot in zip(pieces, spots, strict=True):
        again = again.with_cells(*cells_at(mask, spot, rows, columns))
    assert again.used == 40 * 20


def test_the_corner_grows_when_it_is_full():
    rows, columns = 4095, 4097
    corner = np.mgrid[:192, :192].reshape(2, -1)
    far = np.array([[4094], [4096]])
    occupancy = torus(rows, columns, np.concatenate([corner, far], axis=1))
    (spot,) = place_pieces(occupancy, [(block(30, 40), (0,))])
    assert spot is not None
    assert max(spot.row, spot.column) >= 192
    (big,) = place_pieces(occupancy, [(block(700, 900), (0,))])
    assert big is not None


def test_a_narrow_large_array_wraps_along_its_short_side_alone():
    taken = np.ones((3, 1 << 17), dtype=bool)
    taken[[2, 0], 100:104] = False
    (spot,) = place_pieces(torus(3, 1 << 17, np.nonzero(taken)), [(block(2, 4), (0,))])
    assert spot == TorusPosition(2, 100, 0)


@pytest.mark.parametrize("size", [(63, 65), (1023, 1025)])
def test_placing_from_another_first_cell_is_a_shift_of_the_same(size):
    rows, columns = size
    pieces = [(block(5, 7), (0, 1)), (block(4, 4), (0,))] * 3
    first = (rows - 3, columns // 2)
    array = SimpleNamespace(rows=rows, columns=columns, first=first)
    elsewhere = place_pieces(Occupancy.from_cells(*NONE, array), pieces)
    for one, other in zip(place_pieces(torus(rows, columns), pieces), elsewhere, strict=True):
        assert other == TorusPosition(
            (one.row + first[0]) % rows, (one.column + first[1]) % columns, one.quarter
        )
