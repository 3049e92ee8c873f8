"""Taken cells as bits in tiles: the same cells come back, and adding costs what is added."""

from types import SimpleNamespace

import numpy as np
import pytest

from generator.layout.occupancy import TILE, Occupancy, cells_of_tiles, tiles_of
from generator.layout.torus import CORNER, board_size

PLACES = {
    "corner": (np.array([0, 0, 63, 64, 127]), np.array([0, 64, 63, 64, 0])),
    "far": (np.array([0, 2**62, 2**63 - 2]), np.array([2**63 - 2, 5, 2**63 - 2])),
    "none": (np.empty(0, np.int64), np.empty(0, np.int64)),
    "many": tuple(np.unravel_index(np.random.default_rng(2).permutation(200 * 300)[:9000],
                                   (200, 300))),
}  # fmt: skip


def of(rows, columns, cells=((), ())):
    return Occupancy.from_cells(*cells, SimpleNamespace(rows=rows, columns=columns, first=(0, 0)))


def block(row, column, height, width):
    return tuple(i.ravel() for i in np.mgrid[row : row + height, column : column + width])


def listed(cells):
    return list(zip(*(part.tolist() for part in cells), strict=True))


@pytest.mark.parametrize("place", PLACES)
def test_cells_come_back_sorted(place):
    assert listed(cells_of_tiles(tiles_of(*PLACES[place]))) == sorted(listed(PLACES[place]))


def test_cells_are_taken_and_freed_one_by_one():
    chance = np.random.default_rng(7)
    held, occupancy = set(), of(130, 150)
    for _ in range(30):
        some = np.stack([chance.integers(0, 130, 200), chance.integers(0, 150, 200)])
        if chance.random() < 0.6:
            occupancy, held = occupancy.with_cells(*some), held | set(listed(some))
        else:
            occupancy, held = occupancy.without_cells(*some), held - set(listed(some))
        assert occupancy.used == len(held)
        assert listed(occupancy.cells()) == sorted(held)
    rows, columns = occupancy.cells()
    whole = np.zeros((130, 150), dtype=bool)
    whole[rows, columns] = True
    for size in ((130, 150), (64, 128), (1, 149), (100, 7)):
        assert np.array_equal(occupancy.corner(*size), whole[: size[0], : size[1]])
    array = SimpleNamespace(rows=130, columns=150, first=(0, 0))
    assert Occupancy.from_tiles(occupancy.tiles, array).used == len(held)
    assert occupancy.without_cells(rows, columns).tiles == {}


def test_more_cells_change_their_own_tiles_alone():
    before = of(4095, 4097, block(0, 0, 640, 640))
    after = before.with_cells(*block(60, 640, 8, 8))
    changed = [at for at in after.tiles if after.tiles[at] is not before.tiles.get(at)]
    assert sorted(changed) == [(0, 10), (1, 10)]
    assert before.used == 640**2
    assert after.used == before.used + 64


def test_what_is_opened_of_a_large_array_follows_its_objects():
    far = block(2000, 3000, 8, 8)
    assert board_size(of(4095, 4097)) == (CORNER, CORNER)
    assert board_size(of(4095, 4097, block(0, 0, 700, 700))) == (704, 704)
    # another lab's objects, imported from elsewhere on the array, open nothing
    assert board_size(of(4095, 4097, block(0, 0, 700, 700)).with_cells(*far)) == (704, 704)
    assert board_size(of(1023, 1025, block(0, 0, 1023, 1025))) == (1023, 1025)
    assert board_size(of(255, 257)) == (255, 257)
    assert min(board_size(of(2**32 - 1, 2**32 + 1, block(0, 0, 10, 30 * TILE)))) >= 30 * TILE


@pytest.mark.parametrize("first", [(0, 0), (1, 1), (64, 128), (129, 149), (100, 60)])
def test_the_corner_begins_at_the_first_cell_and_goes_round(first):
    chance = np.random.default_rng(7)
    taken = chance.random((130, 150)) < 0.3
    array = SimpleNamespace(rows=130, columns=150, first=first)
    occupancy = Occupancy.from_cells(*np.nonzero(taken), array)
    assert occupancy.first == first
    assert occupancy.with_cells([1], [1]).first == first
    seen = np.roll(taken, (-first[0], -first[1]), axis=(0, 1))
    for size in ((130, 150), (64, 128), (1, 149), (100, 7)):
        assert np.array_equal(occupancy.corner(*size), seen[: size[0], : size[1]])
    assert Occupancy.from_tiles(occupancy.tiles, array).first == first


@pytest.mark.parametrize("first", [(0, 0), (5, 3), (4000, 4090), (2048, 64)])
def test_what_is_opened_begins_at_the_first_cell(first):
    array = SimpleNamespace(rows=4095, columns=4097, first=first)
    rows, columns = block(*first, 700, 700)
    near = Occupancy.from_cells(rows % 4095, columns % 4097, array)
    assert all(640 <= side <= 704 for side in board_size(near))
    rows, columns = block(first[0] + 1500, first[1] + 1500, 8, 8)
    far = Occupancy.from_cells(rows % 4095, columns % 4097, array)
    assert board_size(far) == (CORNER, CORNER)
