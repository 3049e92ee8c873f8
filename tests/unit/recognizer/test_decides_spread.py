"""How far readings scatter: two parts told apart by one touch, worked by hand and by loops."""

import math

import numpy as np
import pytest

from recognizer.touch.symbols import posterior
from recognizer.touch.symbols.posterior import TactelScatter, fit_scatter, second_differences

USUAL = TactelScatter(0.08, 0.08)


def test_variances_are_those_of_both_parts():
    parts = np.array([[1.0, 4.0, 0.0], [0.0, 2.0, 9.0]])
    assert TactelScatter(0.5, 0.1).variances(parts) == pytest.approx([0.25, 1.02, 0.09])


def test_what_lies_far_out_weighs_little():
    left, parts, trust = np.array([0.0, 2.0, 20.0, 2.0]), np.ones((2, 4)), np.array([1.0, 1, 1, 0])
    weights = TactelScatter(math.sqrt(3), 1.0).weights(left, parts, trust)  # variance 4
    assert weights == pytest.approx([9 / 32, 9 / 36, 9 / 432, 0.0])


def test_the_log_likelihood_is_students():
    left, parts, trust = np.array([0.5, -3.0, 1.0]), np.ones((2, 3)), np.array([1.0, 1.0, 0.0])
    spread = TactelScatter(0.6, 0.8)  # variance 1
    expected = sum(-4.5 * math.log(1 + x * x / 8) for x in (0.5, -3.0))
    assert spread.log_likelihood(left, parts, trust) == pytest.approx(expected)
    wider = TactelScatter(1.2, 1.6).log_likelihood(left, parts, trust)
    expected = sum(-4.5 * math.log(1 + x * x / 32) - math.log(2) for x in (0.5, -3.0))
    assert wider == pytest.approx(expected)


def touched(felt, aside, seed, count=256):
    """Residuals of a touch whose tactels differ in slope, and of which nothing was fitted."""
    rng = np.random.default_rng(seed)
    parts = np.stack([0.7 + rng.random(count), 3 * rng.random(count) ** 2])
    left = np.sqrt(TactelScatter(felt, aside).variances(parts)) * rng.standard_normal(count)
    return left, parts


def told(left, parts, jacobian=None, trust=None, rounds=60):
    unknowns = np.zeros((len(left), 1)) if jacobian is None else jacobian
    known = np.eye(unknowns.shape[1]) * 1e-9
    spread = USUAL
    for _ in range(rounds):
        trusted = np.ones(len(left)) if trust is None else trust
        spread = fit_scatter(spread, left, parts, unknowns, known, trusted)
    return spread


@pytest.mark.parametrize(("felt", "aside"), [(0.05, 0.2), (0.03, 0.1), (0.08, 0.08)])
def test_a_touch_tells_even_sensors_from_straight_ones(felt, aside, monkeypatch):
    monkeypatch.setattr(posterior, "USUAL_WEIGHT", 0.5)
    found = [told(*touched(felt, aside, seed)) for seed in range(20)]
    # Student's scale of normal errors is a little less than their deviation
    assert np.mean([one.felt for one in found]) == pytest.approx(0.93 * felt, rel=0.12)
    assert np.mean([one.aside_mm for one in found]) == pytest.approx(0.93 * aside, rel=0.25)


def test_few_tactels_leave_it_as_usual_and_many_do_not():
    few = told(*touched(0.3, 0.3, 1, count=2))
    many = told(*touched(0.3, 0.3, 1, count=2000))
    assert many.felt > 0.25
    assert few.felt < 0.2
    nothing = told(np.zeros(3), np.ones((2, 3)), trust=np.zeros(3))
    assert (nothing.felt, nothing.aside_mm) == pytest.approx((0.08, 0.08))


def test_a_dead_tactel_does_not_widen_it():
    left, parts = touched(0.1, 0.1, 3)
    sound = told(left, parts)
    left[7] = 40.0
    dead = told(left, parts)
    assert dead.felt == pytest.approx(sound.felt, rel=0.1)


def test_what_was_fitted_away_is_counted():
    """Half of all unknowns free: residuals are half as large, the spread is not."""
    rng = np.random.default_rng(4)
    left, parts = touched(0.1, 0.0, 4)
    jacobian = rng.standard_normal((256, 128))
    taken = left - jacobian @ np.linalg.lstsq(jacobian, left, rcond=None)[0]
    assert np.std(taken) < 0.75 * np.std(left)
    assert told(taken, parts, jacobian).felt == pytest.approx(told(left, parts).felt, rel=0.25)
    assert told(taken, parts).felt < 0.8 * told(left, parts).felt


def test_second_differences_by_hand():
    image = np.array([[1.0, 2.0, 4.0], [0.0, 5.0, 1.0]])
    rows, columns = second_differences(image.reshape(-1, 1), (2, 3))
    assert rows.reshape(2, 3).tolist() == [[-2.0, 1.0, -7.0], [1.0, -8.0, 2.0]]
    assert columns.reshape(2, 3).tolist() == [[0.0, 1.0, -6.0], [5.0, -9.0, 3.0]]
    both = second_differences(np.column_stack([image.ravel(), 2 * image.ravel()]), (2, 3))
    np.testing.assert_array_equal(both[0][:, 1], 2 * rows[:, 0])
    np.testing.assert_array_equal(both[1][:, 0], columns[:, 0])
