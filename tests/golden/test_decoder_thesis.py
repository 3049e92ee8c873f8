"""The thesis's own windows, by every method; and what it prints wrong."""

import json
from math import sqrt
from pathlib import Path

import numpy as np
import pytest

from decoder import decode_exact, decode_likelihood
from decoder.milestones import optimal_distance
from generator.array import array_from, profile

GOLDEN = json.loads(
    (Path(__file__).parents[2] / "fixtures" / "golden.json").read_text(encoding="utf-8")
)
METHODS = ("table", "serial", "milestones", "logarithm")


def labels(rows):
    return np.array([[int(symbol) for symbol in row] for row in rows])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("rows", "x", "y", "t"),
    [
        ("01 11 01 01 00 01", 61, 1, 2206),  # figure 6.17
        ("00 10 00 00 00 10", 9, 25, 529),  # figure 6.18
        ("00 01 11 01 01 10", 25, 5, 3470),  # figure 6.19
    ],
)
def test_recognition_figures(rows, x, y, t, method):
    found = decode_exact(profile("thesis").array(), labels(rows.split()), method)[0]
    assert (found.column, found.row, found.t, found.reason) == (x, y, t, "")


def test_recognition_figures_by_likelihood():
    windows = [labels(w["window"]) for w in GOLDEN["prba_63x65"]["golden_windows"]]
    found = decode_likelihood(profile("thesis").array(), windows, error=1e-6, blank=0)
    assert [(d.column, d.row) for d in found] == [(61, 1), (9, 25), (25, 5)]
    assert max(d.doubt for d in found) < 2e-5


@pytest.mark.parametrize("method", METHODS)
def test_figure_5_11(method):
    found = decode_exact(profile("product").array(), GOLDEN["fig_5_11"]["window"], method)[0]
    assert (found.row, found.column) == (5, 7)


def test_figure_5_11_by_likelihood_and_with_one_symbol_in_each_row_and_column():
    array = profile("product").array()
    window = np.array(GOLDEN["fig_5_11"]["window"])
    found = decode_likelihood(array, window, error=1e-3)[0]
    assert (found.row, found.column) == (5, 7)
    few = np.where(np.eye(2, dtype=bool)[[0, 1, 0, 0]], window, -1)  # four, not p + q - 1 = 5
    assert np.count_nonzero(few >= 0) == 4
    assert decode_exact(array, few)[0].t == 5 * 15 + 7


@pytest.mark.parametrize("method", METHODS)
def test_every_window_of_figure_5_10(method):
    array = array_from({"family": "prmvs", "order": 4, "degree": 5, "polynomial": "x^5+x+A"})
    text = GOLDEN["fig_5_10"]["sequence"]
    ring = np.array([int(symbol) for symbol in text + text[:4]])
    windows = np.lib.stride_tricks.sliding_window_view(ring, 5)[:, None, :]
    found = decode_exact(array, windows, method)
    np.testing.assert_array_equal(found.indices, np.arange(1023))
    assert array.rows == 1


def test_table_5_2():
    rows = GOLDEN["table_5_2"]["rows"]
    for cost, (k1, k4) in {"1/4": (1, 4), "4/1": (4, 1)}.items():
        found = [round((2**n - 1) / sqrt(k1 / k4 * (2**n - 1))) for n in (8, 16, 24, 32)]
        assert found == rows[cost]


def test_optimal_distance_costs_least_and_the_printed_formula_does_not():
    period = 2**16 - 1
    for k1, k4 in ((1, 4), (4, 1), (1, 1)):
        best = optimal_distance(period, k1, k4)
        costs = [k1 * period / t + k4 * t for t in range(1, period)]  # figure 5.4
        assert best == 1 + int(np.argmin(costs))
    assert 1 / 512 * 2**8 - 1 < 0  # as printed: no distance at all where milestones are cheap
    assert optimal_distance(2**8 - 1, 1, 512) == 1


def test_appendix_5_tuple_is_no_remainder():
    """The thesis takes (1, 0, 1) for t^2 + 1 and finds 6; the index of the tuple is 2."""
    array = array_from(
        {"family": "prbs", "polynomial": [1, 1, 0, 1], "initial": [0, 0, 1], "degree": 3}
    )
    assert decode_exact(array, [[1, 0, 1]])[0].t == GOLDEN["appendix5_example"]["thesis_i"] == 2
    assert GOLDEN["appendix5_example"]["exponent_of_r"] == 6
