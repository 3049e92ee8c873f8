"""Placing on the torus: small cases worked by hand, large arrays, and what is taken already."""

from types import SimpleNamespace

import numpy as np
import pytest
from reference.cells import listed

from generator.layout.occupancy import TILE, Occupancy
from generator.layout.torus import CORNER, TorusPosition, board_size, place_pieces

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
TURNS = (0, 1, 2, 3)


def torus(rows, columns, cells=NONE, first=(0, 0)):
    return Occupancy.from_cells(*cells, SimpleNamespace(rows=rows, columns=columns, first=first))


def block(rows, columns):
    return np.ones((rows, columns), dtype=bool)


def test_the_place_with_most_contact_is_taken():
    taken = np.zeros((12, 12), dtype=bool)
    taken[5, 3:9] = taken[6, 3] = taken[6, 8] = True  # a bay, four cells wide
    (spot,) = place_pieces(torus(12, 12, np.nonzero(taken)), [(block(1, 4), TURNS)])
    assert spot == TorusPosition(6, 4, 0)


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
