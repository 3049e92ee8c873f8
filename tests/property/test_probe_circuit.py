"""Any matrix and any law: finite and monotone forward, back to where it came from, or refused."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from probe.calibration import (
    Calibration,
    calibrate_image,
    calibration_from,
    calibration_hash,
    expected_counts,
    known_load,
    read_calibration,
    write_calibration,
)
from probe.calibration.fit import fit_laws, law_s
from probe.circuit import QUIET, Electronics, effective_resistances, invert_readings
from probe.circuit.network import solve_floating
from probe.circuit.reading import scan_shares, shares, unscan_shares
from probe.errors import CalibrationError

seeds = st.integers(0, 2**32)
sizes = st.tuples(st.integers(2, 9), st.integers(2, 9))


@st.composite
def matrices(draw, decades=6.0):
    rng = np.random.default_rng(draw(seeds))
    spread = draw(st.floats(0, decades))
    scale = 10 ** draw(st.floats(-9, 3))
    shape = draw(sizes)
    if draw(st.booleans()):
        return scale * 10 ** rng.uniform(-spread, 0, shape)
    return scale * np.where(rng.random(shape) < draw(st.floats(0.05, 0.9)), 1.0, 10**-spread)


@settings(deadline=None, max_examples=40)
@given(matrices(12.0))
def test_foster_holds_and_more_conductance_never_means_more_resistance(g):
    resistance = effective_resistances(g)
    assert np.isclose((g * resistance).sum(), sum(g.shape) - 1, rtol=1e-12)
    more = g.copy()
    more[0, -1] *= 1.5
    assert (effective_resistances(more) <= resistance * (1 + 1e-12)).all()


@settings(deadline=None, max_examples=40)
@given(matrices())
def test_floating_rows_give_back_what_they_were_made_from(g):
    found = solve_floating(effective_resistances(g))
    rounding = 1e-11 * g.max()  # of what flows beside a tactel through all others
    np.testing.assert_allclose(found.conductance_s, g, rtol=1e-7, atol=rounding)


@settings(deadline=None, max_examples=40)
@given(matrices(8.0), seeds, st.floats(-6, 1))
def test_contradictory_resistances_still_settle_within_the_bounds(g, seed, noise):
    wrong = np.exp(10**noise * np.random.default_rng(seed).standard_normal(g.shape))
    found = solve_floating(effective_resistances(g) * wrong)
    assert (found.conductance_s >= 0).all()
    assert (found.own <= 1 + 1e-6).all()
    assert np.isclose(found.own.sum(), sum(g.shape) - 1, rtol=1e-6)


@settings(deadline=None, max_examples=40)
@given(
    matrices(3.0),
    st.sampled_from(["floating", "grounded", "virtual"]),
    st.floats(0, 0.2),
    st.floats(0, 2),
    st.floats(0.1, 3),
)
def test_every_board_is_inverted(g, readout, row, column, load):
    one = 1 / g.max()
    e = Electronics(
        readout=readout, supply_v=1.0, reference_v=1.0, load_ohm=load * one, noise=QUIET,
        feedback_ohm=0.5 * one, row_ohm=row * one / 10, column_ohm=column * one / 10, bits=16,
    )  # fmt: skip
    read = scan_shares(shares(g, e), e) * e.full + e.bias_lsb * e.lsb
    found = invert_readings(np.clip(read, 0, e.full), e, sigma_counts=1e-3)
    saturated = read >= e.full
    if not saturated.any():
        np.testing.assert_allclose(found.conductance_s, g, rtol=1e-5)
    assert found.lost[saturated].all()


@settings(deadline=None, max_examples=40)
@given(seeds, sizes, st.floats(0.1, 20), st.floats(-0.02, 0.02))
def test_the_scan_is_undone(seed, shape, settled, coupling):
    e = replace(Electronics(), settling_s=settled * 5e-6, coupling=coupling)
    share = np.random.default_rng(seed).random((3, *shape))
    np.testing.assert_allclose(unscan_shares(scan_shares(share, e), e), share, atol=1e-10)


@st.composite
def calibrations(draw):
    """Draw a calibration whose numbers are arbitrary but possible."""
    rng = np.random.default_rng(draw(seeds))
    shape = draw(st.tuples(st.integers(2, 6), st.integers(2, 6)))
    readout = draw(st.sampled_from(["grounded", "virtual", "floating", None]))
    board = None if readout is None else Electronics(readout=readout, bits=16)
    scale = 30.0 if board is None else 1e-4
    root = rng.normal(size=(*shape, 3, 3)) * [0.02, 0.02, 0.002]
    covariance = np.swapaxes(root, -1, -2) @ root
    upper = np.triu_indices(3)
    return Calibration(
        sensor=draw(st.text(max_size=8)),
        made="",
        board=board,
        full=65535,
        loads=tuple(draw(st.lists(st.text(max_size=20), max_size=4))),
        condition=rng.choice(5, shape, p=[0.8, 0.05, 0.05, 0.05, 0.05]),
        bias_counts=200 + rng.normal(size=shape),
        rest_counts=250 + rng.normal(size=shape),
        noise_counts=rng.uniform(0.2, 2, shape),
        gain_s=scale * np.exp(0.3 * rng.normal(size=shape)),
        exponent=rng.uniform(0.6, 1.5, shape),
        break_n=rng.uniform(-0.1, 0.05, shape),
        covariance=covariance[..., upper[0], upper[1]],
        most_n=np.full(shape, 3.0),
        scatter=float(rng.uniform(0.5, 2)),
        repeat=0.05,
    )


@settings(deadline=None, max_examples=40)
@given(calibrations())
def test_a_file_gives_back_what_was_written(calibration):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "c.json"
        digest = write_calibration(calibration, path)
        back = read_calibration(path, sensor=calibration.sensor)
        assert calibration_hash(back) == digest
        assert write_calibration(back, path) == digest


@settings(deadline=None, max_examples=40)
@given(calibrations(), seeds)
def test_what_is_expected_of_a_force_reads_as_that_force(calibration, seed):
    forces = np.random.default_rng(seed).uniform(0.3, 1.0, calibration.shape)
    counts = expected_counts(forces, calibration)
    read = calibrate_image(counts, calibration)
    assert np.isfinite(read.values).all()
    assert (read.values >= 0).all()
    assert (read.bad >= calibration.bad).all()
    assert (read.values[read.bad] == 0).all()
    assert np.isinf(read.sigma[read.bad]).all()
    clipped = (counts <= 0) | (counts >= calibration.full)  # its column's coupling is not known
    told = ~read.bad & (read.values > 0) & ~clipped.any(axis=0)
    # a bad tactel's count is not known, and its neighbours hear a thousandth of it, which is more
    # of a small reading: .0013 at most in 3,000 calibrations
    np.testing.assert_allclose(read.values[told], forces[told], rtol=3e-3)


@settings(deadline=None, max_examples=60)
@given(
    seeds,
    st.floats(-9, 3),
    st.floats(0.4, 2.5),
    st.floats(0, 0.9),
    st.integers(4, 12),
)
def test_a_clean_law_is_found(seed, gain, exponent, broken, number):
    force = np.sort(np.random.default_rng(seed).uniform(0, 1, number))
    force = (0.1 * 30 ** ((force - force[0]) / (force[-1] - force[0])))[:, None]
    read = law_s(force, np.array([10**gain]), np.array([exponent]), np.array([0.1 * broken]))
    used = np.ones(read.shape, bool)
    found = fit_laws(force, read, 0.001 * read, used, np.zeros(1, bool))
    law = law_s(force, found.gain_s, found.exponent, found.break_n)
    np.testing.assert_allclose(law, read, rtol=0.003)
    assert np.isfinite(found.covariance).all()


@settings(deadline=None, max_examples=40)
@given(seeds, st.lists(st.floats(0, 5), max_size=6), st.floats(0, 5))
@example(53976, [1.0, 2.0, 0.5, 5e-324], 1.0)  # a load as small as a number can be
def test_loads_either_determine_every_law_or_are_refused(seed, levels, noise):
    rng = np.random.default_rng(seed)

    def frames(force):
        return np.clip(np.rint(4 + 200 * force + noise * rng.normal(size=(30, 3, 3))), 0, 1023)

    loads = [known_load(frames(f), np.full((3, 3), f)) for f in levels]
    try:
        calibration = calibration_from(frames(0.0), loads, sensor="S")
    except CalibrationError:
        return
    assert len({round(f, 6) for f in levels}) >= 3
    live = ~calibration.bad
    assert np.isfinite(calibration.covariance[live]).all()
    read = calibrate_image(frames(1.0)[0], calibration)
    assert np.isfinite(read.values).all()
    near = live & (calibration.most_n > 1) & ~read.bad
    assert (np.abs(read.values - 1.0) < 8 * read.sigma + 0.1)[near].all()
