"""Every method of decoding: at every size and field, against all places, at its edges."""

import itertools

import numpy as np
import pytest
from reference.windows import every_window, windows_at

from decoder import (
    Likelihood,
    MethodError,
    WindowError,
    decode,
    decode_exact,
    decode_good_tuple,
    decode_likelihood,
)
from decoder.any_method import array_of_profile
from decoder.errors import DecoderError
from decoder.ordered import Ordered
from decoder.ranking import AllPlaces
from decoder.window import hard_scores
from generator.array import PROFILES, array_from, profile
from generator.array.polynomial import search_primitive
from generator.errors import LabKeyError

METHODS = ("table", "serial", "milestones", "logarithm")


@pytest.mark.parametrize(
    ("name", "method"),
    [
        *itertools.product(["thesis", "one-touch", "product"], METHODS),
        *itertools.product(["large", "tactel-16"], ["table", "milestones", "logarithm"]),
    ],
)
def test_every_window_of_a_profile_decodes_to_itself(name, method):
    array = PROFILES[name].array()
    rows, columns, windows = every_window(array, array.window)
    found = decode_exact(array, windows, method)
    assert found.answered.all()
    np.testing.assert_array_equal(found.rows, rows)
    np.testing.assert_array_equal(found.columns, columns)
    zero = decode_exact(array, np.zeros((2, *array.window), int), method)
    assert [one.reason for one in zero] == ["not an encoded surface"] * 2


SIZES = [
    (2, 32), (2, 53), (2, 63), (2, 64), (4, 32), (8, 21), (16, 16), (32, 10), (3, 1), (3, 40),
    (9, 20), (5, 27), (7, 20), (11, 18), (25, 12), (27, 12), (251, 3), (1021, 2),
]  # fmt: skip


@pytest.mark.parametrize(("order", "degree"), SIZES)
def test_logarithm_up_to_2_to_the_64(order, degree):
    family = "prba" if order == 2 else "prmvs" if degree == 1 else "prmva"
    values = {"family": family, "order": order, "degree": degree}
    if order > 250:
        values["polynomial"] = list(search_primitive(order, degree))
    array = array_from(values)
    period = order**degree - 1
    places = [0, 1, period - 1, period // 2, period // 3, 2**52 % period, (2**63 + 5) % period]
    cells = [array.cell(t) for t in places]
    windows = windows_at(array, [r for r, _ in cells], [c for _, c in cells], array.window)
    found = decode_exact(array, windows, "logarithm")
    assert [d.t for d in found] == places
    assert [(d.row, d.column) for d in found] == cells


def test_contradicting_cells_are_refused():
    array = PROFILES["thesis"].array()
    window = windows_at(array, [3], [4], (6, 6))[0]
    assert decode_exact(array, window)[0]
    window[1, 5] ^= 1
    assert decode_exact(array, window)[0].reason == "not an encoded surface"
    product = PROFILES["product"].array()
    window = windows_at(product, [3], [4], (4, 4))[0]
    window[1, 2] = (window[1, 2] + 4) % 8  # another row term than its neighbours'
    assert decode_exact(product, window)[0].reason == "not an encoded surface"


@pytest.mark.parametrize(
    ("array", "shape", "unseen", "most"),
    [
        (PROFILES["thesis"].array(), (6, 2), [(0, 0), (3, 1)], 4),
        (array_from({"family": "prmva", "order": 3, "degree": 8}), None, [(0, 0)], 3),
        (PROFILES["product"].array(), None, [(0, slice(None))], 4),
    ],
)
def test_too_few_cells_list_the_places_that_they_allow(array, shape, unseen, most):
    shape = shape or array.window
    window = windows_at(array, [5], [7], shape)[0]
    for cells in unseen:
        window[cells] = -1
    found, seen = decode_exact(array, window)[0], window >= 0
    assert (found.reason, found.row) == ("too few symbols", None)
    assert (5, 7) in {(c.row, c.column) for c in found.candidates}
    assert len(found.candidates) <= most
    for place in found.candidates:
        there = windows_at(array, [place.row], [place.column], shape)[0]
        assert (there == window)[seen].all()
    nothing = decode_exact(array, np.full(shape, -1))[0]
    assert nothing.reason == "too few symbols"


def test_methods_refuse_sizes_that_would_not_end():
    array = array_from({"family": "prba", "order": 2, "degree": 48})
    window = np.ones(array.window, int)
    for method in ("table", "serial", "milestones"):
        with pytest.raises(MethodError, match="at most"):
            decode_exact(array, window, method)
    with pytest.raises(MethodError, match="unknown method"):
        decode_exact(array, window, "guess")


@pytest.mark.parametrize(
    "values",
    [
        {"family": "prba", "polynomial": "0x1099", "rows": 63, "columns": 65},
        {"family": "prba", "order": 2, "degree": 64},
        {"family": "prmva", "order": 4, "degree": 6},
        {"family": "prmva", "order": 3, "degree": 8},
        {"family": "prmva", "order": 9, "degree": 4},
    ],
)
def test_windows_that_each_miss_other_symbols_decode_as_one_by_one(values):
    array = array_from(values)
    side = 10 if array.rows > 10**6 else 6
    rng = np.random.default_rng(2)
    drawn = rng.integers(0, 2**62, (60, 2)).tolist()
    places = [(row % array.rows, column % array.columns) for row, column in drawn]
    windows = windows_at(array, *zip(*places, strict=True), (side, side))
    windows = np.where(rng.random(windows.shape) < rng.uniform(0, 0.9, (60, 1, 1)), -1, windows)
    windows[3] = 0
    windows[4, 0, 0] = (array.symbols(*np.uint64(places[4])) + 1) % array.order
    together = decode_exact(array, windows)
    assert [d.reason for d in together].count("too few symbols") > 2
    for window, found, place in zip(windows, together, places, strict=True):
        alone = decode_exact(array, window)[0]
        assert (found.row, found.column, found.reason) == (alone.row, alone.column, alone.reason)
        assert found.candidates == alone.candidates
        assert not found or (found.row, found.column) == place


KEY = "0123-4567-89AB-CDER"


@pytest.fixture(scope="module", params=["one-touch", "large"])
def keyed(request):
    return profile(request.param).array_of_lab(KEY)


def test_the_window_that_no_place_shows_is_the_one_of_the_term_0(keyed):
    assert keyed.permutation[0] != 0
    empty = np.full(keyed.window, keyed.permutation[0])
    assert not decode_exact(keyed, empty).answered.any()
    assert decode_exact(keyed, np.zeros(keyed.window, np.int64)).answered.all()


def test_a_key_says_whose_array(keyed):
    windows = windows_at(keyed, [5], [7], keyed.window)
    name = "one-touch" if keyed.rows == 63 else "large"
    own = decode(windows[0], profile=name, lab_key=KEY)
    published = decode(windows[0], profile=name)
    assert (own.row, own.column) != (published.row, published.column)
    with pytest.raises(DecoderError, match="the same array in every lab"):
        array_of_profile("thesis", KEY)
    with pytest.raises(LabKeyError):
        array_of_profile("one-touch", "0123")


ROBUST = array_from({"family": "prba", "polynomial": "0x1655", "rows": 63, "columns": 65})
ARRAYS = {
    "thesis": PROFILES["thesis"].array(),
    "GF(4)": PROFILES["one-touch"].array(),
    "GF(3)": array_from({"family": "prmva", "order": 3, "degree": 6}),
    "GF(9)": array_from({"family": "prmva", "order": 9, "degree": 3}),
    "product": PROFILES["product"].array(),
    "one row": array_from({"family": "prbs", "order": 2, "degree": 8}),
}


@pytest.mark.parametrize("name", ["thesis", "GF(4)", "GF(3)", "GF(9)"])
def test_ordered_statistics_agree_with_the_transform_at_few_errors(name):
    array = ARRAYS[name]
    shape = (6, 6) if array.order == 2 else (5, 5)
    rng = np.random.default_rng(4)
    rows, _, windows = every_window(array, shape)
    chosen = rng.choice(rows.size, 200, replace=False)
    read = windows[chosen]
    read = np.where(rng.random(read.shape) < 0.05, (read + 1) % array.order, read)
    scores = hard_scores(read, array.order).reshape(200, -1, array.order)
    whole = AllPlaces(array, shape).rank(scores, 2)
    near = AllPlaces(array, shape)
    near._method = Ordered(array.sequence, array.offsets(*np.indices(shape)))
    found = near.rank(scores, 2)
    clear = whole.values[:, 0] - whole.values[:, 1] > 1e-3
    same = (found.rows[:, 0] == whole.rows[:, 0]) & (found.columns[:, 0] == whole.columns[:, 0])
    assert same[clear].mean() > 0.97
    np.testing.assert_allclose(found.values[same, 0], whole.values[same, 0], atol=1e-3)
    assert (found.values[:, 0] <= whole.values[:, 0] + 1e-3).all()


def test_floor_of_success_rates():
    """Likeliest place if single; `encoding.md`: 96 and 75, 99.9 and 95 %."""
    rng = np.random.default_rng(6)
    for side, floors in ((5, (95.0, 72.5)), (6, (99.5, 94.0))):
        rows, columns, windows = every_window(ROBUST, (side, side))
        for error, floor in zip((0.05, 0.10), floors, strict=True):
            read = windows ^ (rng.random(windows.shape) < error)
            found = Likelihood(ROBUST, doubt=1.0).decode(read)
            right = (found.rows == rows) & (found.columns == columns)
            assert 100 * (right & (found.margins > 1e-3)).mean() > floor
            if (side, error) == (6, 0.05):
                default = Likelihood(ROBUST).decode(read)
                assert right[default.answered].all()
                assert default.answered.mean() > 0.9


@pytest.mark.parametrize(("order", "degree"), [(2, 64), (4, 32), (2, 40), (3, 20)])
def test_ordered_statistics_on_large_arrays(order, degree):
    family = "prba" if order == 2 else "prmva"
    array = array_from({"family": family, "order": order, "degree": degree})
    side = 12 if degree * order > 100 else 10
    assert array.identifies(*np.indices((side, side)))
    rng = np.random.default_rng(10)
    window = array.symbols(*np.indices((side, side)))
    read = np.where(rng.random(window.shape) < 0.02, (window + 1) % order, window)
    read[0, :3] = -1
    found = decode_likelihood(array, read)[0]
    assert (found.row, found.column, found.t) == (0, 0, 0)


def test_a_batch_may_be_empty():
    found = decode_exact(ARRAYS["thesis"], np.zeros((0, 6, 2), int))
    assert (len(found), list(found)) == (0, [])
    with pytest.raises(IndexError):
        found[0]
    for array in ARRAYS.values():
        assert len(decode_likelihood(array, np.zeros((0, 4, 4), int), rotations=(0, 1))) == 0
    assert len(decode_good_tuple(ROBUST, np.zeros((0, 6, 6), int))) == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.01e6])
def test_scores_that_are_not_finite_are_refused(bad):
    scores = np.zeros((6, 6, 2))
    scores[1, 1, 1] = 1e6
    decode_likelihood(ROBUST, scores)
    scores[1, 1, 1] = bad
    with pytest.raises(WindowError, match="finite"):
        decode_likelihood(ROBUST, scores)


def test_good_tuple_is_the_weaker_way():
    rng = np.random.default_rng(13)
    rows, columns, windows = every_window(ROBUST, (6, 6))
    clean = decode_good_tuple(ROBUST, windows)
    np.testing.assert_array_equal(clean.rows, rows)
    read = windows ^ (rng.random(windows.shape) < 0.05)
    found = decode_good_tuple(ROBUST, read)
    right = found.answered & (found.rows == rows) & (found.columns == columns)
    best = Likelihood(ROBUST, doubt=1.0).decode(read)
    assert 0.4 < right.mean() < ((best.rows == rows) & (best.columns == columns)).mean()
    with pytest.raises(MethodError):
        decode_good_tuple(ROBUST, np.zeros((2, 2), int))
    with pytest.raises(MethodError):
        decode_good_tuple(ARRAYS["product"], np.zeros((6, 6), int))
