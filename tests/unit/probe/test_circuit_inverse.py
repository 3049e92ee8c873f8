"""Counts back to conductances: exact without noise, honest with it."""

from dataclasses import replace

import numpy as np
import pytest

from probe.circuit import QUIET, Electronics, Noise, effective_resistances, invert_readings
from probe.circuit.network import solve_floating
from probe.circuit.reading import scan_shares, shares
from probe.errors import CircuitError

READOUTS = ["floating", "grounded", "virtual"]


def washer(decades):
    x = np.arange(16) - 7.5
    radius = np.hypot(x, x[:, None])
    return np.where((radius > 2.2) & (radius < 4.8), 1.0, 10.0**-decades)


def few(number, seed, contrast=1e3):
    rng = np.random.default_rng(seed)
    g = np.full(256, 1 / contrast)
    g[rng.choice(256, number, replace=False)] = rng.uniform(0.3, 1, number)
    return g.reshape(16, 16)


def board(readout, **changes):
    """Return a board for conductances up to 1e-4 S."""
    e = Electronics(
        readout=readout, supply_v=1.0, reference_v=1.0, load_ohm=1e4, feedback_ohm=9e3,
        noise=Noise(0.3, 0.0, 0.05, 0.0, 0.0),
    )  # fmt: skip
    return replace(e, **changes)


def offered(g, e):
    return scan_shares(shares(g, e), e) * e.full + e.bias_lsb * e.lsb


def digitised(g, e, seed):
    noise = e.noise.idle_lsb * e.lsb * np.random.default_rng(seed).standard_normal(g.shape)
    return np.clip(np.rint(offered(g, e) + noise), 0, e.full)


@pytest.mark.parametrize("readout", READOUTS)
@pytest.mark.parametrize(("row", "column"), [(0.0, 0.0), (0.0, 300.0), (30.0, 300.0)])
def test_exact_without_noise_or_rounding(readout, row, column):
    g = 1e-4 * few(60, 1)
    e = board(readout, row_ohm=row, column_ohm=column)
    found = invert_readings(offered(g, e), e)
    np.testing.assert_allclose(found.conductance_s, g, rtol=2e-7)


@pytest.mark.parametrize("decades", [0, 2, 4, 6])
def test_floating_rows_over_six_decades(decades):
    for g in (washer(decades), 10 ** np.random.default_rng(1).uniform(-decades, 0, (16, 16))):
        for scale in (1.0, 1e-9):
            found = solve_floating(effective_resistances(scale * g))
            assert np.abs(found.conductance_s / (scale * g) - 1).max() <= 1e-8
            assert found.steps <= 12
            assert found.own.sum() == pytest.approx(31, rel=1e-9)


@pytest.mark.parametrize(
    ("pressed", "median"), [(5, (0.008, 0.004)), (30, (0.010, 0.004)), (80, (0.008, 0.006))]
)
def test_the_errors_of_a_10_bit_board_at_a_contrast_of_1000(pressed, median):
    errors = {"floating": [], "grounded": []}
    for seed in range(4):
        g = 1e-4 * few(pressed, seed)
        on = g > 1e-5
        for readout, load, known in (("floating", 1e4, errors["floating"]),
                                     ("grounded", 5e3, errors["grounded"])):  # fmt: skip
            e = board(readout, load_ohm=load)
            found = invert_readings(digitised(g, e, seed), e)
            known.append(np.median(np.abs(found.conductance_s / g - 1)[on]))
            assert not found.lost[on].any()
            assert found.conductance_s[~on].max() <= 0.03 * g.max()
    assert np.mean(errors["floating"]) <= median[0]
    assert np.mean(errors["grounded"]) <= median[1]


@pytest.mark.parametrize("readout", READOUTS)
@pytest.mark.parametrize("row", [0.0, 30.0])
def test_sigma_is_the_deviation_of_repeated_readings(readout, row):
    g = 1e-4 * few(40, 3, contrast=30)
    e = board(readout, row_ohm=row, column_ohm=100.0, bits=12)
    frames = [invert_readings(digitised(g, e, seed), e) for seed in range(15)]
    away = np.stack([f.conductance_s for f in frames]) - g
    scale = away / np.stack([f.sigma_s for f in frames])
    assert 0.8 <= np.sqrt((scale[:, g > 1e-5] ** 2).mean()) <= 1.2


@pytest.mark.parametrize("readout", READOUTS)
def test_what_lies_under_the_noise_is_lost_and_what_does_not_is_not(readout):
    g = np.full((16, 16), 1e-9)
    g[4:8, 4:8] = 1e-4
    e = board(readout)
    found = invert_readings(digitised(g, e, 1), e)
    assert not found.lost[4:8, 4:8].any()
    assert found.lost[g < 1e-8].mean() > 0.5
    assert (found.conductance_s <= 5 * found.sigma_s + 1e-9)[g < 1e-8].all()
    sharp = invert_readings(offered(1e-4 * few(60, 1), e), e, sigma_counts=1e-7)
    assert not sharp.lost.any()


def test_a_hidden_tactel_of_floating_rows_is_named():
    """Behind three pressed corners the fourth shows its neighbours, not itself."""
    g = np.full((16, 16), 1e-8)
    g[[2, 2, 9], [2, 9, 2]] = 1e-4
    e = board("floating", bits=16)
    found = invert_readings(digitised(g, e, 1), e)
    assert found.lost[9, 9]
    assert not found.lost[2, 2]


def test_saturated_readings_are_bounds_only():
    g = 1e-4 * few(20, 2)
    for readout in READOUTS:
        e = board(readout, reference_v=0.3)
        counts = digitised(g, e, 1)
        full = counts == e.full
        assert full.any()
        found = invert_readings(counts, e)
        assert found.lost[full].all()
        assert np.isinf(found.sigma_s[full]).all()


def test_a_column_that_carries_more_than_the_supply_can_give_is_refused():
    e = board("grounded", noise=QUIET)
    counts = np.full((16, 16), e.bias_lsb * e.lsb)
    counts[:, 3] = 400
    found = invert_readings(counts, e)
    assert np.isnan(found.conductance_s[:, 3]).all()
    assert found.lost[:, 3].all()
    assert np.isfinite(np.delete(found.conductance_s, 3, axis=1)).all()


@pytest.mark.parametrize("readout", READOUTS)
def test_frames_side_by_side_are_inverted_as_alone(readout):
    e = board(readout, row_ohm=5.0)
    counts = np.stack([digitised(1e-4 * few(20, seed), e, seed) for seed in range(3)])
    together = invert_readings(counts, e)
    for i in range(3):
        alone = invert_readings(counts[i], e)
        np.testing.assert_allclose(together.conductance_s[i], alone.conductance_s, rtol=1e-9)
        np.testing.assert_array_equal(together.lost[i], alone.lost)


def test_what_is_refused():
    e = Electronics()
    for bad in (np.full((16, 16), 1024), np.full((16, 16), -1), np.full((16, 16), np.nan), [1, 2]):
        with pytest.raises(CircuitError):
            invert_readings(bad, e)
    with pytest.raises(CircuitError, match="not above 0"):
        solve_floating(np.zeros((16, 16)))
