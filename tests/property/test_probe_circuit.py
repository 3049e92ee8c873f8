"""Any matrix: finite and monotone forward, back to where it came from, no step left undone."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from probe.circuit import QUIET, Electronics, effective_resistances, invert_readings
from probe.circuit.network import solve_floating
from probe.circuit.reading import scan_shares, shares, unscan_shares

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
