"""What a tactel costs: each number by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from reference.touch_loops import log_likelihoods

from recognizer.touch.symbols import linearize
from recognizer.touch.symbols.linearize import psi_deviation


def psi(response):
    return math.log(1 + 3 * response) / math.log(4)


def read_at(value, faint):
    """Deviation of psi where readings scatter by a share of what a plateau presses: by steps."""
    step = 1e-6
    response = (4**value - 1) / 3
    return faint * (psi(response + step) - psi(response)) / step


def by_hand(seen, table, press, bare, trust, noise, faint=0.0):
    """Log-likelihoods of the symbols at one tactel, and of none, nats."""
    found = []
    for value, by_x, by_y in table:
        own = read_at(value, faint) * press / noise
        width = math.sqrt(0.8**2 + value**2 + by_x**2 + by_y**2 + own**2)
        away = (seen - value) / (width * noise / press)
        found.append(trust * (-min(away**2 / 2, 8.0) - math.log(width)))
    none = []
    for value in (0.0, psi(bare)):  # beyond the edge of the face, or over it
        width = math.hypot(0.8, value, read_at(value, faint) * press / noise)
        away = (seen - value) / (width * noise / press)
        none.append(trust * (-min(away**2 / 2, 8.0) - math.log(width)))
    return [*found, max(none)]


def asked(seen, tables, press, bare, trust, noise, faint=0.0):
    b, n, q = len(seen), len(trust), len(tables[0][0])
    every = np.zeros((b, n, q, 6), np.float32)
    every[..., :3] = tables
    every[..., 3:] = 9.0  # what is fitted of the form is no noise
    felt = SimpleNamespace(
        psi=np.array(seen), press=np.array(press), bare=np.array(bare),
        trust=np.array(trust), faint=np.full((b, n), faint),
    )  # fmt: skip
    return log_likelihoods(felt, every, np.array(noise))


@pytest.mark.parametrize("faint", [0.0, 0.03, 0.2])
def test_every_tactel_under_every_plane(faint):
    rng = np.random.default_rng(1)
    b, n, q = 2, 40, 3
    seen, press = rng.uniform(0, 1.3, (b, n)), rng.uniform(0.2, 1.0, (b, n))
    bare = np.where(rng.random((b, n)) < 0.5, 0.0, rng.uniform(0, 0.9, (b, n)))
    trust = rng.uniform(0, 1, n)
    tables = rng.normal(size=(b, n, q, 3)) * [0.5, 0.4, 0.7] + [0.5, 0.0, 0.0]
    noise = np.array([0.12, 0.3])
    found = asked(seen, tables, press, bare, trust, noise, faint)
    assert found.shape == (b, n, q + 1)
    for i in range(b):
        for k in range(n):
            truth = by_hand(
                seen[i, k], tables[i, k], press[i, k], bare[i, k], trust[k], noise[i], faint
            )
            np.testing.assert_allclose(found[i, k], truth, rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize(
    ("seen", "value", "nats"),
    [
        (0.0, 0.0, -math.log(0.8)),
        (0.6, 0.6, 0.0),  # 0.8 and 0.6 make 1
        (0.75, 0.6, -0.5),  # one standard deviation
        (0.3, 0.6, -2.0),
        (9.0, 0.6, -8.0),  # a spike costs 8 nats
        (-9.0, 0.6, -8.0),
    ],
)
def test_a_tactel_by_hand(seen, value, nats):
    found = asked([[seen]], [[[(value, 0.0, 0.0)]]], [[1.0]], [[0.0]], [1.0], [0.15])
    assert found[0, 0, 0] == pytest.approx(nats, abs=1e-5)
    hung = asked([[seen]], [[[(value, 0.0, 0.0)]]], [[0.0]], [[0.0]], [1.0], [0.15])
    width = math.hypot(0.8, value)
    away = (seen - value) * 1e-3 / 0.15 / width  # where nothing presses hardly anything is told
    assert hung[0, 0, 0] == pytest.approx(-min(away**2 / 2, 8) - math.log(width), abs=1e-5)


def test_slopes_count_by_the_square_of_how_far_tactels_are_displaced(monkeypatch):
    # 0.8, 0.6 and a slope of 2 over half a mm: the root of 0.64 + 0.36 + 1
    monkeypatch.setattr(linearize, "DISPLACED_MM", 0.5)
    table = np.zeros((1, 1, 1, 6), np.float32)
    table[..., 0], table[..., 1] = 0.6, 2.0
    felt = SimpleNamespace(faint=np.zeros((1, 1)))
    width = psi_deviation(felt, table, np.full((1, 1), 0.15))
    assert width[0, 0, 0] == pytest.approx(math.sqrt(2.0))


@pytest.mark.parametrize(("faint", "counts"), [(0.0299, False), (0.0301, True)])
def test_noise_of_readings_counts_from_three_hundredths_of_a_plateau(faint, counts):
    felt = SimpleNamespace(faint=np.full((1, 1), faint))
    width = psi_deviation(felt, np.zeros((1, 1, 1, 6), np.float32), np.full((1, 1), 0.15))
    own = 3 / math.log(4) * faint / 0.15 if counts else 0.0
    assert width[0, 0, 0] == pytest.approx(math.hypot(0.8, own), rel=1e-5)
