"""The lattice of one face: counts that can be worked by hand."""

import numpy as np
import pytest

from generator.array.profiles import profile
from generator.layout.footprint import move_region, region_of
from generator.layout.lattice import choose_lattice, edge_rotations
from generator.layout.places import array_cells, count_places, count_windows, rank_test


def rectangle(width, height, clearance=1.0):
    loop = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    return region_of([loop], [np.full(4, clearance)])


@pytest.mark.parametrize("clearance", [0.8, 1.0, 1.5, 2.0, 2.3])
def test_the_face_of_the_60_mm_cube_holds_8_by_8_aligned_and_centred(clearance):
    lattice = choose_lattice([rectangle(60.0, 60.0, clearance)], 2.7, 7.0, (3, 2))
    (cells,) = lattice.cells
    assert lattice.rotation_rad == 0.0
    assert lattice.places == (6 * 7,)
    j, i = cells.T
    x, y = lattice.x_mm + 7.0 * np.unique(i), lattice.y_mm + 7.0 * np.unique(j)
    assert len(cells) == 64
    assert x == pytest.approx(30.0 + 7.0 * np.arange(-3.5, 4.0), abs=1e-5)
    assert y == pytest.approx(x, abs=1e-5)


def test_a_face_without_any_play_keeps_its_cells():
    width = 49.0 + 5.4 + 2.0  # 8 cells, exactly
    lattice = choose_lattice([rectangle(width, width)], 2.7, 7.0, (3, 2))
    assert len(lattice.cells[0]) == 64
    lattice = choose_lattice([rectangle(width - 1e-3, width)], 2.7, 7.0, (3, 2), search=False)
    assert len(lattice.cells[0]) == 56


def test_a_strip_is_turned_so_that_the_window_fits():
    lattice = choose_lattice([rectangle(23.0, 16.0)], 2.7, 7.0, (3, 2))  # 3 columns, 2 rows
    assert len(lattice.cells[0]) == 6
    assert lattice.places == (1,)
    assert lattice.quarter == 1
    lattice = choose_lattice([rectangle(16.0, 23.0)], 2.7, 7.0, (3, 2))
    assert (lattice.places, lattice.quarter) == ((1,), 0)


def test_the_lattice_follows_the_first_edge():
    region = move_region(rectangle(60.0, 40.0), 0.3)
    lattice = choose_lattice([region], 2.7, 7.0, (3, 2))
    assert lattice.rotation_rad == pytest.approx(-0.3)
    assert len(lattice.cells[0]) == 8 * 5


def test_edge_rotations_are_distinct_modulo_a_quarter_turn():
    triangle = np.array([[0.0, 0.0], [60.0, 0.0], [30.0, 30.0 * 3**0.5]])
    rotations = edge_rotations([region_of([triangle], [np.ones(3)])])
    assert rotations == pytest.approx([0.0, -np.pi / 6, np.pi / 6])
    assert edge_rotations([rectangle(3.0, 4.0)]) == [0.0]


def test_a_tiny_face_shows_nothing():
    lattice = choose_lattice([rectangle(5.0, 5.0)], 2.7, 7.0, (3, 2), lambda *_: True)
    assert lattice.places == (0,)
    assert len(lattice.cells[0]) == 0


def test_cells_that_pass_the_rank_test_are_one_place():
    identifies = rank_test(profile("one-touch").array())
    row = choose_lattice([rectangle(80.0, 9.0)], 2.7, 7.0, (3, 2), identifies)
    assert (len(row.cells[0]), row.places) == (11, (1,))
    short = choose_lattice([rectangle(30.0, 9.0)], 2.7, 7.0, (3, 2), identifies)
    assert (len(short.cells[0]), short.places) == (4, (0,))


def test_rank_test_agrees_with_the_array():
    array = profile("thesis").array()
    identifies = rank_test(array)
    rows, columns = np.mgrid[:6, :2].reshape(2, -1)
    for _ in range(2):  # the second answer is remembered
        assert identifies(rows, columns)
        assert not identifies(rows[:11], columns[:11])
        assert identifies(columns, rows) == array.identifies(columns, rows)


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
