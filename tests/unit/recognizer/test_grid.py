"""The grid rebuilt by expected neighbours: thresholds, best fit, gaps, and what is expelled."""

import math

import numpy as np
import pytest

from recognizer.thesis.grid import grid
from recognizer.thesis.symbols import Symbol

PITCH = 12.0


def symbol(x, y, theta, label=0, off=0.1):
    rejected = "" if label >= 0 else "counts"
    return Symbol(label, x, y, theta, (x, y), off, rejected)


def laid(labels, theta=0.0, at=(0.0, 0.0), rng=None, place=0.0, turn=0.0):
    """Symbols of labels (rows, columns), -1 where none is felt, turned by theta."""
    found = []
    for (r, c), label in np.ndenumerate(labels):
        z = complex(c * PITCH, -r * PITCH) * complex(math.cos(theta), math.sin(theta))
        dx, dy, dt = (0, 0, 0) if rng is None else rng.normal(0, 1, 3) * (place, place, turn)
        if label >= 0:
            found.append(symbol(z.real + at[0] + dx, z.imag + at[1] + dy, theta + dt, int(label)))
    return found


LABELS = np.array([[0, 1, 1, 0], [1, 1, 0, 0], [0, 1, 0, 1]])


@pytest.mark.parametrize("theta", [0.0, 0.4, math.pi / 2, -2.5])
def test_window_is_read_at_any_turn(theta):
    found = grid(laid(LABELS, theta, (30.0, -7.0)), PITCH)
    assert np.array_equal(found.window, LABELS)
    assert len(found.members) == 12
    assert found.off_mm < 1e-9
    # an image point s lies at R s + (x, y): the upper left symbol is the centre of its cell
    c, s = math.cos(found.theta_rad), math.sin(found.theta_rad)
    i, j = found.first
    at = (found.x_mm + c * 30 + s * 7, found.y_mm + s * 30 - c * 7)
    assert at == pytest.approx(((i + 0.5) * PITCH, (j + 0.5) * PITCH), abs=1e-6)


def test_nothing_gives_no_grid():
    assert grid([], PITCH) is None
    assert grid([symbol(0, 0, 0.0, label=-1)], PITCH) is None


def test_what_stands_or_turns_otherwise_is_expelled():
    labels = LABELS.copy()
    labels[1, 1] = -1
    strangers = [symbol(18, -5, 0.0), symbol(6, 6, 0.0), symbol(12, -12, math.radians(40))]
    found = grid(laid(labels) + strangers, PITCH)
    assert np.array_equal(found.window, labels)
    assert len(found.members) == 11


def test_of_two_candidates_the_better_fit_is_chosen():
    labels = LABELS.copy()
    labels[0, 1] = -1
    two = [symbol(12 + 2.0, 0, 0.0, label=0), symbol(12 - 0.5, 0.3, 0.0, label=1)]
    found = grid(laid(labels) + two, PITCH)
    assert found.window[0, 1] == 1
    assert len(found.members) == 12


def test_threshold_is_a_share_of_the_pitch():
    far = [symbol(0, 0, 0.0), symbol(12 + 2.9, 0, 0.0)]
    assert grid(far, PITCH).window.shape == (1, 2)
    farther = [symbol(0, 0, 0.0), symbol(12 + 3.1, 0, 0.0)]  # .25 of 12 mm are 3
    assert len(grid(farther, PITCH).members) == 1


def test_symbols_beyond_a_gap_join_the_grid():
    labels = np.array([[0, 1, -1, 1], [1, 1, -1, 0]])
    found = grid(laid(labels, 0.3), PITCH)
    assert np.array_equal(found.window, labels)


def test_largest_grid_counts():
    lone = laid(np.array([[1, 0]]), at=(130.0, 40.0))
    found = grid(lone + laid(LABELS), PITCH)
    assert np.array_equal(found.window, LABELS)


def test_the_covariance_holds_what_happens():
    rng, normed = np.random.default_rng(1), []
    truth = grid(laid(LABELS), PITCH)
    for _ in range(60):
        noisy = laid(LABELS, rng=rng, place=0.2, turn=math.radians(4))
        found = grid(noisy, PITCH)
        i, j = np.subtract(found.first, truth.first) * PITCH  # cells are numbered from any symbol
        error = np.array(
            [
                found.x_mm - i - truth.x_mm,
                found.y_mm - j - truth.y_mm,
                found.theta_rad - truth.theta_rad,
            ]
        )
        normed.append(error @ np.linalg.solve(found.covariance, error))
    assert 1.5 < np.mean(normed) < 4.5  # chi square of 3 freedoms
