"""Rivals of what a sensor sees, against every place of small arrays compared with every other."""

import re
from pathlib import Path

import numpy as np
import pytest
from reference.rivals import rival_shares, serves
from reference.visible import VisibleSet, visible_sets

from generator.array import array_from, next_larger, profile

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


@pytest.mark.parametrize(("pitch_mm", "cells"), [(7, 8.5), (6, 12.3), (5, 19.0), (4, 31.7)])
def test_symbols_seen_whole_by_pitch(pitch_mm, cells):
    """Mid-face, as measured by another program: 8.4, 12.0, 18.5, 30.7 on a 60 mm face."""
    sets = visible_sets(pitch_mm, SENSOR, 0.36 * pitch_mm)
    assert sum(one.share for one in sets) == pytest.approx(1)
    assert sum(one.share * len(one.cells) for one in sets) == pytest.approx(cells, abs=0.05)
    assert [one.share for one in sets] == sorted((one.share for one in sets), reverse=True)


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
