"""The gain of a plate that comes down on symbols and on the bare face beside an edge."""

import math

import numpy as np
import pytest

from recognizer.touch.symbols.image import WHOLE, deep_gain
from tests.unit.recognizer.test_decides_gain import COLUMN, PEAKS, SCALE, SIDE, SYMBOL, force, image

GAIN = np.array([math.log(SCALE), 0.6, 0.25, -0.1])
LOADED = (COLUMN < 11).ravel()


def over_an_edge(gain=GAIN, peaks=PEAKS, loaded=LOADED):
    """Forces of peaks, and of the bare face, under a plane; none beyond."""
    depth = image(np.zeros(SIDE * SIDE)).plane @ gain[1:]
    scale = math.exp(gain[0])
    forces = [
        scale * force(u if top else u - SYMBOL) if here else 0.0
        for u, top, here in zip(depth, peaks.ravel(), loaded, strict=True)
    ]
    return np.array(forces)


def test_one_plane_goes_through_symbols_and_the_bare_face():
    found = deep_gain(image(over_an_edge(), loaded=LOADED))
    assert found[0] == pytest.approx(GAIN[0])
    np.testing.assert_allclose(found[1:], GAIN[1:], atol=0.08)
    forces, loaded = (one.reshape(SIDE, SIDE)[:, ::-1] for one in (over_an_edge(), LOADED))
    mirrored = deep_gain(image(forces, loaded=loaded.ravel()))
    np.testing.assert_allclose(mirrored, found * [1, 1, -1, 1], atol=1e-9)


def test_where_the_scale_is_not_known_strong_readings_are_deep():
    counts = over_an_edge() * 70
    found = deep_gain(image(counts, newtons=False, loaded=LOADED))
    again = deep_gain(image(3 * counts, newtons=False, loaded=LOADED))
    np.testing.assert_allclose(again - found, [math.log(3.0), 0, 0, 0], atol=1e-9)
    strong = 70 * SCALE * force(0.6)
    assert found[0] == pytest.approx(math.log(strong / force(0.65)), abs=0.35)
    assert found[1] == pytest.approx(GAIN[1], abs=0.1)
    assert np.sign(found[2:]).tolist() == [1, -1]


def test_what_lies_beyond_the_edge_and_what_is_not_trusted_says_nothing():
    forces = over_an_edge()
    found = deep_gain(image(forces, loaded=LOADED))
    other = np.where(LOADED, forces, 50.0)
    np.testing.assert_array_equal(deep_gain(image(other, loaded=LOADED)), found)
    bad = (COLUMN == 3).ravel()
    without = deep_gain(image(forces, trust=~bad, loaded=LOADED))
    spoilt = deep_gain(image(np.where(bad, 999.0, forces), trust=~bad, loaded=LOADED))
    np.testing.assert_array_equal(spoilt, without)
    np.testing.assert_allclose(without, found, atol=0.08)


@pytest.mark.parametrize(("columns", "guessed"), [(14, True), (15, True), (16, False)])
def test_amid_a_face_nothing_is_guessed(columns, guessed):
    loaded = np.isin(COLUMN, np.arange(columns)).ravel()
    forces = over_an_edge(loaded=loaded)
    assert WHOLE == 0.95
    assert (deep_gain(image(forces, loaded=loaded)) is not None) is guessed


def test_it_is_guessed_from_ten_tactels_that_press():
    forces, known = over_an_edge(), np.flatnonzero(LOADED & PEAKS.ravel())
    for count, guessed in ((9, False), (10, True)):
        trust = np.zeros(SIDE * SIDE)
        trust[known[:count]] = 1.0
        assert (deep_gain(image(forces, trust=trust, loaded=LOADED)) is not None) is guessed
    assert deep_gain(image(0.0 * forces, loaded=LOADED)) is None


def test_a_face_that_is_not_touched_is_no_depth():
    light = np.array([math.log(SCALE), 0.2, 0.05, 0.0])
    found = deep_gain(image(over_an_edge(light), loaded=LOADED))
    np.testing.assert_allclose(found[1:], light[1:], atol=0.07)


def test_its_slopes_are_at_most_seventeen_tenths_of_its_depth():
    steep = np.array([math.log(SCALE), 0.3, 0.7, 0.0])
    found = deep_gain(image(over_an_edge(steep), loaded=LOADED))
    assert np.abs(found[2:]).sum() <= 1.7 * found[1] + 1e-9
    hanging = (COLUMN < 5).ravel()  # deep far from the centre, and falling towards it
    away = np.array([math.log(SCALE), -0.3, -1.0, 0.0])
    assert deep_gain(image(over_an_edge(away, loaded=hanging), loaded=hanging)) is None
