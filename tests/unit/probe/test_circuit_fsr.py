"""The law of the tactels, its memory, and sensors that are drawn."""

from dataclasses import replace

import numpy as np
import pytest

from probe.circuit import conductances, fsr_of
from probe.errors import CircuitError


def law(force, **changes):
    fsr = replace(fsr_of(), **changes)
    return fsr, conductances(fsr, np.full((16, 16), float(force)))


def test_a_newton_over_the_break_force_gives_the_gain():
    fsr, (g, _) = law(1.01, series_ohm=np.zeros((16, 16)))
    np.testing.assert_allclose(g - fsr.leak_s, 1e-4, rtol=1e-12)


def test_the_thesis_s_two_decades_from_1_to_100_newton_per_square_centimetre():
    area = 0.15875**2
    low = law(1 * area)[1][0][0, 0]
    high = law(100 * area)[1][0][0, 0]
    assert 80 < high / low < 200


def test_the_series_resistance_bounds_any_force():
    for force in (1e3, 1e9, 1e300):
        fsr, (g, _) = law(force, hysteresis=0.0)
        assert np.isfinite(g).all()
        assert g[0, 0] <= 1 / 500 + fsr.leak_s


def test_hysteresis_is_bounded_and_does_not_know_the_rate():
    fsr = replace(fsr_of(), drift=0.0, series_ohm=np.zeros((16, 16)), break_n=np.zeros((16, 16)))
    one = np.ones((16, 16))

    def last(path, elapsed):
        state = None
        for force in path:
            g, state = conductances(fsr, force * one, state, elapsed)
        return g[0, 0] - fsr.leak_s

    assert last([1.0], 0.1) == pytest.approx(1e-4)
    assert last([2.0, 1.0], 0.1) == pytest.approx(1.1e-4)
    assert last([2.0, 1.0], 9.0) == last([2.0, 1.5, 1.0], 0.1) == last([2.0, 1.0], 0.1)
    assert last([2.0, 1.0, 1.05], 0.1) == pytest.approx(1.1e-4)  # inside the loop it stays
    assert last([2.0, 1.0, 1.5], 0.1) == pytest.approx(1.5e-4)  # and leaves by the way up
    assert last([2.0, 0.0], 0.1) == 0.0


def test_creep_is_a_share_per_decade_of_time_and_starts_anew_with_a_new_load():
    fsr = replace(fsr_of(), hysteresis=0.0, series_ohm=np.zeros((16, 16)))
    one = np.ones((16, 16))
    first, state = conductances(fsr, one)
    later, state = conductances(fsr, one, state, 99.0)
    assert (later - fsr.leak_s)[0, 0] / (first - fsr.leak_s)[0, 0] == pytest.approx(1.10)
    _, off = conductances(fsr, 0 * one, state, 1.0)
    again, _ = conductances(fsr, one, off, 1.0)
    np.testing.assert_allclose(again, first, rtol=1e-12)


def test_dead_stuck_and_preloaded_tactels():
    dead, stuck, preload = np.zeros((16, 16), bool), np.zeros((16, 16)), np.zeros((16, 16))
    dead[0, 0], stuck[0, 1], preload[0, 2] = True, 3e-5, 0.5
    fsr = replace(fsr_of(), dead=dead, stuck_s=stuck, preload_n=preload)
    rest, loaded = (conductances(fsr, np.full((16, 16), f))[0] for f in (0.0, 1.0))
    assert rest[0, 0] == loaded[0, 0] == fsr.leak_s
    assert rest[0, 1] == loaded[0, 1] == 3e-5
    assert rest[0, 2] > 100 * rest[5, 5]
    assert loaded[0, 2] > loaded[5, 5]


def test_what_is_refused():
    fsr = fsr_of()
    for bad in (np.zeros((15, 16)), np.full((16, 16), -1.0), np.full((16, 16), np.nan)):
        with pytest.raises(CircuitError):
            conductances(fsr, bad)
    _, state = conductances(fsr, np.zeros((3, 16, 16)))
    with pytest.raises(CircuitError, match="state"):
        conductances(fsr, np.zeros((16, 16)), state)
    with pytest.raises(CircuitError, match="gain_s"):
        replace(fsr, gain_s=np.zeros((16, 16)))
    with pytest.raises(CircuitError, match="shape"):
        replace(fsr, exponent=np.ones((3, 3)))
    with pytest.raises(CircuitError, match="leak"):
        replace(fsr, leak_s=0.0)
