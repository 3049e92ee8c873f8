"""Forces to counts: ideal boards by hand, faults one at a time, and the noise as measured."""

from dataclasses import replace

import numpy as np
import pytest
from reference.drawn_fsr import DATASHEET, draw_fsr, read_sequence

from probe.circuit import (
    QUIET,
    Electronics,
    Noise,
    conductances,
    effective_resistances,
    fsr_of,
    read_counts,
)
from probe.circuit.reading import scan_shares, unscan_shares
from probe.errors import CircuitError

IDEAL = Electronics(noise=QUIET, settling_s=1.0, coupling=0.0, bias_lsb=0.0)


def pressed(seed=0, share=0.25, most=1.5):
    rng = np.random.default_rng(seed)
    return np.where(rng.random((16, 16)) < share, rng.uniform(0.1, most, (16, 16)), 0.0)


def read(electronics, forces, fsr=None, seed=0):
    return read_counts(forces, electronics, fsr or fsr_of(), None, np.random.default_rng(seed))[0]


def test_each_ideal_readout_by_its_formula():
    forces = pressed()
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


def test_counts_rise_with_force_and_stop_at_full_scale():
    virtual = replace(IDEAL, readout="virtual")
    counts = [int(read(virtual, np.full((16, 16), f))[3, 3]) for f in (0, 0.1, 0.5, 1, 3, 50)]
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == 1023


def test_the_tactel_before_is_seen_as_much_as_the_settling_leaves():
    board = replace(IDEAL, settling_s=10e-6, tau_s=5e-6)
    share = np.zeros((16, 16))
    share[4, 15] = 1.0
    seen = scan_shares(share, board)
    rest = np.exp(-2.0)
    assert seen[4, 15] == pytest.approx(1 - rest)
    assert seen[5, 0] == pytest.approx((1 - rest) * rest)
    assert seen[4, 14] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(unscan_shares(seen, board), share, atol=1e-12)


def test_columns_couple_and_are_parted_again():
    board = replace(IDEAL, coupling=-1e-3)
    share = np.zeros((16, 16))
    share[4, 7] = 1.0
    seen = scan_shares(share, board)
    assert seen[9, 7] == pytest.approx(-1e-3)
    assert seen[9, 8] == 0
    np.testing.assert_allclose(unscan_shares(seen, board), share, atol=1e-15)


def test_the_default_board_is_at_least_as_bad_as_the_measured_one():
    board, forces = Electronics(), pressed(3)
    assert board.residue * 1023 >= 0.86
    assert board.coupling <= -1e-3
    counts, _ = read_sequence(
        np.broadcast_to(forces, (800, 16, 16)),
        board,
        draw_fsr(np.random.default_rng(1), DATASHEET),
        None,
        np.random.default_rng(2),
    )
    away = counts - np.median(counts, axis=0)
    usual = np.where(np.abs(away) > 50, np.nan, away)
    deviation = np.nanstd(usual, axis=0)
    idle, active = deviation[forces == 0], deviation[counts.mean(axis=0) > 30]
    assert 0.24 <= np.median(idle) <= 0.8
    assert active.min() >= 6
    assert 14 <= np.median(active) <= 30
    assert (np.abs(away[:, forces == 0]) > 50).mean() >= 451e-6


def test_the_contact_s_noise_does_not_average_out_at_once():
    board = replace(Electronics(), noise=Noise(0.0, 1.2, 0.05, 0.0, 0.0))
    forces = np.full((1000, 16, 16), 0.5)
    counts, _ = read_sequence(forces, board, fsr_of(), None, np.random.default_rng(0))
    away = counts - counts.mean(axis=0)
    kept = (away[1:] * away[:-1]).mean() / (away**2).mean()
    assert kept == pytest.approx(np.exp(-board.frame_s / 0.05), abs=0.02)


@pytest.mark.parametrize("readout", ["floating", "grounded", "virtual"])
def test_touches_side_by_side_are_read_as_alone(readout):
    board = Electronics(readout=readout, row_ohm=20.0, column_ohm=50.0, noise=QUIET)
    forces = np.stack([pressed(i) for i in range(4)])
    alone = [read(board, force) for force in forces]
    np.testing.assert_array_equal(read(board, forces), alone)
    assert read(board, forces).dtype == np.uint16


def test_what_is_refused():
    for change in (
        {"readout": "open"},
        {"bits": 0},
        {"bits": 17},
        {"load_ohm": 0.0},
        {"row_ohm": -1.0},
        {"coupling": 0.5},
        {"tau_s": float("nan")},
        {"noise": Noise(idle_lsb=-1)},
    ):
        with pytest.raises(CircuitError):
            replace(Electronics(), **change)
