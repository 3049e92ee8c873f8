"""Rivals of what a sensor sees, against every place of small arrays compared with every other."""

import re
from pathlib import Path

import numpy as np
import pytest
from reference.rivals import RankTest, light_words, rival_shares, serves
from reference.visible import PoseGrid, VisibleSet, visible_sets

from generator.array import array_from, next_larger, profile
from generator.array.field import field_of_order
from generator.array.window import echelon

SENSOR = (12.7, 12.7)
SMALL = [
    {"family": "prba", "rows": 15, "columns": 17},
    {"family": "prmva", "order": 3, "rows": 5, "columns": 16},
    {"family": "prmva", "order": 4, "rows": 7, "columns": 9},
    {"family": "prmva", "order": 4, "rows": 15, "columns": 17},
    {"family": "prmva", "order": 5, "rows": 4, "columns": 31},
    {"family": "prmva", "order": 8, "rows": 7, "columns": 9},
]


def patches(seed, number=12):
    """Sets of 0 to 12 cells in a 5x4 patch, cell (0, 0) of the patch among the smallest."""
    rng = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(range(5), range(4), indexing="ij"), -1).reshape(-1, 2)
    for size in rng.integers(0, 13, number):
        cells = grid[np.sort(rng.permutation(len(grid))[:size])]
        yield cells - (cells.min(axis=0) if size else 0)


@pytest.mark.parametrize("definition", SMALL, ids=str)
def test_rivals_are_those_found_by_comparing_all_places(definition):
    array = array_from(definition)
    r, c = (g.ravel() for g in np.indices((array.rows, array.columns)))
    for cells in patches(array.order):
        shown = array.symbols(r[:, None] + cells[:, 0], c[:, None] + cells[:, 1])
        apart = (shown[:, None] != shown).sum(axis=2)
        np.fill_diagonal(apart, 99)
        shares = rival_shares(array, [VisibleSet(cells, 1.0)])
        places = len(r)
        for most in range(3):
            found = (apart <= most).sum()
            # of all differences of states one leads from a place to the state 0
            assert found == round(shares.rivals[most] * (places - 1)), (cells, most)
            assert shares.poses[most] == float(shares.rivals[most] > 0)
        full = min(len(cells), array.full_rank)
        rank = array.rank(cells[:, 0], cells[:, 1]) if len(cells) else 0
        assert shares.short == float(rank < full)
        assert shares.cells == len(cells)


@pytest.mark.parametrize("order", [2, 3, 4, 5, 7, 8, 9])
def test_light_words_are_those_of_the_listed_code(order):
    field = field_of_order(order)
    rng = np.random.default_rng(order)
    matrices = rng.integers(0, order, (40, 3, 5)) * (rng.random((40, 3, 5)) < 0.5)
    rank, words = light_words(field, matrices)
    for matrix, found_rank, found in zip(matrices, rank, words, strict=True):
        basis, pivots = echelon(field, matrix)
        listed = np.zeros((1, 5), dtype=np.int64)
        for row in basis:
            multiples = field.multiplication[np.arange(order)[:, None], row]
            listed = field.addition[listed[:, None], multiples].reshape(-1, 5)
        weights = np.count_nonzero(listed, axis=1)
        assert found_rank == len(pivots)
        assert found.tolist() == [(weights == weight).sum() for weight in range(3)]


def test_shares_are_weighted_by_the_poses_of_each_set():
    array = array_from(SMALL[2])
    one = VisibleSet(np.array([[0, 0]]), 0.25)
    window = VisibleSet(np.stack(np.meshgrid(range(3), range(3)), -1).reshape(-1, 2), 0.75)
    shares = rival_shares(array, [one, window])
    alone = rival_shares(array, [VisibleSet(window.cells, 1.0)])
    assert shares.cells == 0.25 + 0.75 * 9
    assert shares.poses == (0.25, 0.25 + 0.75 * alone.poses[1], 0.25 + 0.75 * alone.poses[2])
    assert shares.rivals[0] == 0.25 * 15
    assert shares.short == 0.0


def test_a_sensor_sees_the_cells_whose_centres_lie_deep_enough():
    poses = PoseGrid(places=5, turns=7)
    sets = visible_sets(7.0, (9.0, 14.0), 2.0, poses)
    known = {}
    for turn in (np.arange(7) + 0.5) / 7 * np.pi:
        for x0 in (np.arange(5) + 0.5) / 5 - 0.5:
            for y0 in (np.arange(5) + 0.5) / 5 - 0.5:
                cells = []
                for row in range(-5, 6):
                    for column in range(-5, 6):
                        x, y = 7.0 * (column - x0), 7.0 * (-row - y0)
                        across = x * np.cos(turn) + y * np.sin(turn)
                        up = y * np.cos(turn) - x * np.sin(turn)
                        if abs(across) <= 7.0 and abs(up) <= 12.0:
                            cells.append((row, column))
                least = np.min(cells, axis=0)
                key = tuple(sorted((r - least[0], c - least[1]) for r, c in cells))
                known[key] = known.get(key, 0) + 1
    found = {tuple(sorted(map(tuple, one.cells.tolist()))): one.share * 175 for one in sets}
    assert found == pytest.approx(known)


@pytest.mark.parametrize(("pitch_mm", "cells"), [(7, 8.5), (6, 12.3), (5, 19.0), (4, 31.7)])
def test_symbols_seen_whole_by_pitch(pitch_mm, cells):
    """Mid-face, as measured by another program: 8.4, 12.0, 18.5, 30.7 on a 60 mm face."""
    sets = visible_sets(pitch_mm, SENSOR, 0.36 * pitch_mm)
    assert sum(one.share for one in sets) == pytest.approx(1)
    assert sum(one.share * len(one.cells) for one in sets) == pytest.approx(cells, abs=0.05)
    assert [one.share for one in sets] == sorted((one.share for one in sets), reverse=True)


def test_a_sensor_too_small_for_a_symbol_sees_none():
    (none,) = visible_sets(7.0, (2.0, 2.0), 2.5)
    assert none.share == 1.0
    assert none.cells.shape == (0, 2)
    shares = rival_shares(array_from(SMALL[2]), [none])
    assert shares.poses == (1.0, 1.0, 1.0)
    assert shares.short == 0.0


def test_255_columns_hide_more_than_51_rows():
    """Every 3x3 window four times, every diamond of eight cells sixteen times."""
    square = array_from({"family": "prmva", "order": 4, "rows": 255, "columns": 257})
    strip = array_from({"family": "prmva", "order": 4, "rows": 51, "columns": 1285})
    three = np.stack(np.meshgrid(range(3), range(3)), -1).reshape(-1, 2)
    diamond = np.array([[0, 1], [1, 0], [1, 1], [1, 2], [2, 0], [2, 1], [2, 2], [3, 1]])
    for cells, times in ((three, 4), (diamond, 16)):
        view = [VisibleSet(cells, 1.0)]
        assert rival_shares(square, view).rivals[0] == times - 1
        assert rival_shares(strip, view).rivals[0] == 0


def test_profiles_serve_a_sensor_at_their_pitch():
    for name in ("one-touch", "large", "fine"):
        one = profile(name)
        assert serves(one.array(), one.pitch_mm, SENSOR, 0.36 * one.pitch_mm), name
    larger = profile("large")
    for _ in range(4):
        larger = next_larger(larger)
        assert serves(larger.array(), 5.5, SENSOR, 0.36 * 5.5), larger.encoding


def test_the_guide_says_how_many_rivals_the_profiles_have():
    text = (Path(__file__).parents[3] / "docs" / "folds.md").read_text()
    sets = visible_sets(7.0, SENSOR, 2.52)
    for name in ("one-touch", "large"):
        array = profile(name).array()
        (row,) = re.findall(rf"\| {array.rows}x{array.columns} `{name}`.*? \| (.*?) \|", text)
        poses, rivals = row.rstrip(")").split(" (")
        shares = rival_shares(array, sets)
        assert [float(share) for share in poses.split(" / ")] == pytest.approx(
            [100 * share for share in shares.poses], abs=0.51
        )
        assert float(rivals) == pytest.approx(shares.rivals[0], abs=0.01)


def test_an_array_serves_a_sensor_up_to_the_limit():
    small = profile("one-touch").array()
    square = array_from({"family": "prmva", "order": 4, "rows": 255, "columns": 257})
    assert serves(small, 7.0, SENSOR, 2.52)
    assert serves(square, 5.0, SENSOR, 1.8)
    assert not serves(square, 7.0, SENSOR, 2.52)
    assert not serves(small, 7.0, SENSOR, 2.52, RankTest(most_short=0.05))
