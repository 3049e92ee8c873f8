"""Tactels, network and board: by hand, against many digits, and counts back to conductances."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from probe.circuit import (
    QUIET,
    Electronics,
    Noise,
    conductances,
    effective_resistances,
    fsr_of,
    invert_readings,
    read_counts,
    transconductances,
)
from probe.circuit.network import solve_floating
from probe.circuit.reading import scan_shares, shares
from probe.errors import CircuitError


def test_any_force_stays_below_the_series_resistance_and_two_decades_are_those_of_the_thesis():
    per_n_cm2 = np.full((16, 16), 0.15875**2)
    low, high = (conductances(fsr_of(), n * per_n_cm2)[0][0, 0] for n in (1, 100))
    assert 80 < high / low < 200
    fsr = replace(fsr_of(), hysteresis=0.0)
    for force in (1e3, 1e9, 1e300):
        assert conductances(fsr, force * per_n_cm2)[0].max() <= 1 / 500 + fsr.leak_s


def exact_resistances(g, digits=50):
    """Return the resistances by a 31x31 inverse in many digits."""
    rows, columns = g.shape
    with mpmath.workdps(digits):
        size = rows + columns
        laplacian = mpmath.zeros(size)
        for r, c in np.ndindex(rows, columns):
            x, b = mpmath.mpf(float(g[r, c])), rows + c
            laplacian[r, r] += x
            laplacian[b, b] += x
            laplacian[r, b] -= x
            laplacian[b, r] -= x
        inverse = laplacian[: size - 1, : size - 1] ** -1

        def z(a, b):
            return inverse[a, b] if max(a, b) < size - 1 else mpmath.mpf(0)

        pairs = np.ndindex(rows, columns)
        found = [z(r, r) + z(rows + c, rows + c) - 2 * z(r, rows + c) for r, c in pairs]
    return np.array(found, float).reshape(rows, columns)


HIDDEN = np.full((16, 16), 1e-6)
HIDDEN[[2, 2, 9], [2, 9, 2]] = 1  # three corners, behind which the fourth is hidden
EVEN = 10 ** np.random.default_rng(6).uniform(-6, 0, (16, 16))


@pytest.mark.parametrize("g", [HIDDEN, EVEN], ids=["hidden corner", "even in decades"])
def test_six_decades_of_conductance_against_fifty_digits(g):
    error = effective_resistances(1e-4 * g) / exact_resistances(1e-4 * g) - 1
    assert np.abs(error).max() <= 1e-13  # asked: 1.7e-10


def test_driven_rows_agree_with_the_whole_network():
    g, row, column = EVEN, 0.05, 0.2
    laplacian = np.zeros((32, 32))
    laplacian[:16, 16:], laplacian[16:, :16] = -g, -g.T
    np.fill_diagonal(laplacian, np.r_[g.sum(1) + 1 / row, g.sum(0) + 1 / column])
    expected = np.linalg.inv(laplacian)[16:, :16].T / row / column
    np.testing.assert_allclose(transconductances(g, row, column), expected, rtol=1e-11)


IDEAL = Electronics(noise=QUIET, settling_s=1.0, coupling=0.0, bias_lsb=0.0)


def pressed(seed=0, share=0.25, most=1.5):
    rng = np.random.default_rng(seed)
    return np.where(rng.random((16, 16)) < share, rng.uniform(0.1, most, (16, 16)), 0.0)


def read(electronics, forces, fsr=None, seed=0):
    return read_counts(forces, electronics, fsr or fsr_of(), None, np.random.default_rng(seed))[0]


def test_each_ideal_readout_by_its_formula():
    forces = pressed(most=3.0)
    g, _ = conductances(fsr_of(), forces)
    through = 2200 / (2200 + effective_resistances(g))
    ideal = {
        "floating": 2 * through,
        "grounded": 2 * g / (g.sum(axis=0) + 1 / 2200),
        "virtual": 2 * 2200 * g,
    }
    for readout, share in ideal.items():
        expected = np.clip(np.rint(share * 1023), 0, 1023)
        np.testing.assert_array_equal(read(replace(IDEAL, readout=readout), forces), expected)
    assert (expected == 1023).any()


READOUTS = ["floating", "grounded", "virtual"]


def few(number, seed, contrast=1e3):
    rng = np.random.default_rng(seed)
    g = np.full(256, 1 / contrast)
    g[rng.choice(256, number, replace=False)] = rng.uniform(0.3, 1, number)
    return g.reshape(16, 16)


def board_of(readout, **changes):
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
@pytest.mark.parametrize("row", [0.0, 30.0])
def test_sigma_is_the_deviation_of_repeated_readings(readout, row):
    g = 1e-4 * few(40, 3, contrast=30)
    e = board_of(readout, row_ohm=row, column_ohm=100.0, bits=12)
    frames = [invert_readings(digitised(g, e, seed), e) for seed in range(15)]
    away = np.stack([f.conductance_s for f in frames]) - g
    scale = away / np.stack([f.sigma_s for f in frames])
    assert 0.8 <= np.sqrt((scale[:, g > 1e-5] ** 2).mean()) <= 1.2


@pytest.mark.parametrize("readout", READOUTS)
def test_what_lies_under_the_noise_is_lost_and_what_does_not_is_not(readout):
    g = np.full((16, 16), 1e-9)
    g[4:8, 4:8] = 1e-4
    e = board_of(readout)
    found = invert_readings(digitised(g, e, 1), e)
    assert not found.lost[4:8, 4:8].any()
    assert found.lost[g < 1e-8].mean() > 0.5
    assert (found.conductance_s <= 5 * found.sigma_s + 1e-9)[g < 1e-8].all()
    sharp = invert_readings(offered(1e-4 * few(60, 1), e), e, sigma_counts=1e-7)
    assert not sharp.lost.any()


def test_a_hidden_tactel_of_floating_rows_is_named():
    """Behind three pressed corners the fourth shows its neighbours, not itself."""
    e = board_of("floating", bits=16)
    found = invert_readings(digitised(1e-4 * HIDDEN, e, 1), e)
    assert found.lost[9, 9]
    assert not found.lost[2, 2]


def test_a_column_that_carries_more_than_the_supply_can_give_is_refused():
    e = board_of("grounded", noise=QUIET)
    counts = np.full((16, 16), e.bias_lsb * e.lsb)
    counts[:, 3] = 400
    found = invert_readings(counts, e)
    assert np.isnan(found.conductance_s[:, 3]).all()
    assert found.lost[:, 3].all()
    assert np.isfinite(np.delete(found.conductance_s, 3, axis=1)).all()


FORCES, BLOCKS, GAPPED = np.zeros((16, 16)), np.kron(np.eye(2), np.ones((8, 8))), np.ones((16, 16))
GAPPED[3] = 0


@pytest.mark.parametrize(
    ("call", "match"),
    [
        *((lambda bad=bad: conductances(fsr_of(), bad), ".")
          for bad in (np.zeros((15, 16)), FORCES - 1, FORCES + np.nan)),
        (lambda: conductances(fsr_of(), FORCES, conductances(fsr_of(), np.zeros((3, 16, 16)))[1]),
         "state"),
        (lambda: replace(fsr_of(), gain_s=FORCES), "gain_s"),
        (lambda: replace(fsr_of(), exponent=np.ones((3, 3))), "shape"),
        (lambda: replace(fsr_of(), leak_s=0.0), "leak"),
        (lambda: effective_resistances(BLOCKS), "falls into parts"),
        (lambda: effective_resistances(GAPPED), "leak"),
        *((lambda solve=solve, bad=bad: solve(bad), ".")
          for solve in (effective_resistances, transconductances)
          for bad in (-np.ones((4, 4)), np.full((4, 4), np.nan), np.ones(16))),
        *((lambda change=change: replace(Electronics(), **change), ".")
          for change in ({"readout": "open"}, {"bits": 0}, {"bits": 17}, {"load_ohm": 0.0},
                         {"row_ohm": -1.0}, {"coupling": 0.5}, {"tau_s": float("nan")},
                         {"noise": Noise(idle_lsb=-1)})),
        *((lambda bad=bad: invert_readings(bad, Electronics()), ".")
          for bad in (FORCES + 1024, FORCES - 1, FORCES + np.nan, [1, 2])),
        (lambda: solve_floating(FORCES), "not above 0"),
    ],
)  # fmt: skip
def test_what_is_no_film_network_board_or_reading_is_refused(call, match):
    with pytest.raises(CircuitError, match=match):
        call()
