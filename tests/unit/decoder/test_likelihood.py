"""Maximum likelihood against plain comparison with every place, and at its edges."""

import numpy as np
import pytest
from reference.windows import every_window

from decoder import Likelihood, MethodError, WindowError, decode_good_tuple, decode_likelihood
from decoder.ordered import Ordered
from decoder.ranking import AllPlaces
from decoder.window import hard_scores
from generator.array import PROFILES, array_from

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
