"""Depths, forces and loads of an image: the law written out again, number by number."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.sensor_state import unknown_state
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.image import (
    WHOLE,
    Image,
    Pressing,
    bend_image,
    bounded_gain,
    deep_gain,
    find_loaded_area,
    first_gain,
    image_of_signal,
    normalize_image,
    pressing_of,
    tilted_gain,
)
from recognizer.touch.symbols.kernels import DEEPEST

SIDE = 16
HALF = SIDE / 2 - 0.5
SYMBOL, SCALE = 0.35, 2.5


def force(depth, hardens=True):
    """F of a tab (neo-Hookean, straight on beyond 0.8), or of a pad."""
    if depth <= 0:
        return 0.0
    if not hardens:
        return 3.0 * depth
    u = min(depth, 0.8)
    return (1 - u) ** -2 - (1 - u) + max(depth - 0.8, 0.0) * (2 * (1 - u) ** -3 + 1)


def slope(depth):
    return 2 * (1 - depth) ** -3 + 1


def test_how_an_overlay_presses_by_its_kind():
    tab, pad = SensorType(), SensorType().with_overlay("pad")
    pad = replace(pad, overlay=replace(pad.overlay, young_mpa=0.6))
    law = pressing_of(tab, 0.9)
    area = math.pi * (tab.overlay.tab_diameter_mm / 2) ** 2
    assert law.hardens
    assert law.scale == pytest.approx(tab.overlay.young_mpa * area / 3)
    assert law.symbol == pytest.approx(0.9 / tab.overlay.height_mm)
    law = pressing_of(pad, 0.9)
    assert not law.hardens
    assert law.scale == pytest.approx(0.6 * pad.pitch_mm * pad.pitch_mm / 3)
    depths = np.array([-0.5, 0.1, 0.4])
    np.testing.assert_allclose(law.force(depths), [0.0, 0.3, 1.2])
    np.testing.assert_allclose(law.slope(depths), [0.0, 3.0, 3.0])
    np.testing.assert_allclose(law.depth(law.force(depths[1:])), depths[1:])


def test_a_sensor_reaches_as_far_as_its_farthest_tactel():
    assert image(np.ones((SIDE, SIDE))).reach_mm == pytest.approx(HALF * math.sqrt(2))


def image(forces, *, hardens=True, newtons=True, trust=None, falls=None, loaded=None, ink=0.5):
    y, x = np.indices((SIDE, SIDE)).reshape(2, -1)
    points = np.column_stack([x - HALF, HALF - y]).astype(float)
    return Image(
        points_mm=points,
        forces=np.asarray(forces, float).ravel(),
        trust=np.ones(SIDE * SIDE) if trust is None else np.asarray(trust, float).ravel(),
        shape=(SIDE, SIDE),
        pressing=Pressing(hardens=hardens, symbol=SYMBOL, deepest=DEEPEST, scale=SCALE),
        newtons=newtons,
        plane=np.column_stack([np.ones(len(points)), points / HALF]),
        falls=falls,
        template=SimpleNamespace(ink=ink),
        loaded=np.ones(SIDE * SIDE, np.bool_) if loaded is None else loaded,
    )


def depths(gain):
    y, x = np.indices((SIDE, SIDE)).reshape(2, -1)
    return gain[1] + gain[2] * (x - HALF) / HALF + gain[3] * (HALF - y) / HALF


@pytest.mark.parametrize(
    ("gain", "steepest", "truth"),
    [
        ([0.3, 0.2, 0.1, -0.1], 1.7, [0.3, 0.2, 0.1, -0.1]),
        ([0.3, 0.2, 0.3, -0.2], 1.7, [0.3, 0.2, 0.204, -0.136]),  # 0.5 becomes 0.34
        ([0.3, 0.2, -0.3, 0.2], 0.9, [0.3, 0.2, -0.108, 0.072]),
        ([-9.0, 0.5, 0.0, 0.0], 0.9, [-9.0, 0.5, 0.0, 0.0]),
        ([1.0, 0.2, 0.2, -0.14], 1.7, [1.0, 0.2, 0.2, -0.14]),
    ],
)
def test_slopes_are_at_most_so_many_depths(gain, steepest, truth):
    np.testing.assert_allclose(bounded_gain(np.array([gain, gain]), steepest), [truth, truth])


@pytest.mark.parametrize("newtons", [True, False])
@pytest.mark.parametrize("plane", [(2.0, 0.3, -0.2), (0.6, -0.1, 0.07)])
def test_symbols_all_over_give_the_plane_that_pressed_them(newtons, plane):
    ink = 0.4
    x, y = (np.indices((SIDE, SIDE))[axis] for axis in (1, 0))
    forces = ink * (plane[0] + plane[1] * (x - HALF) / HALF + plane[2] * (HALF - y) / HALF)
    trust = np.ones((SIDE, SIDE))
    forces[3, 4], trust[3, 4] = 900.0, 0.0  # a bad tactel
    found = first_gain(image(forces, newtons=newtons, trust=trust, ink=ink))
    scale = SCALE if newtons else plane[0] / force(0.25)
    assert found[0] == pytest.approx(math.log(scale))
    assert force(found[1]) * scale == pytest.approx(plane[0], rel=1e-3)
    if not newtons:
        assert found[1] == pytest.approx(0.25, abs=1e-4)
    steep = scale * slope(found[1])
    assert found[2:] == pytest.approx([plane[1] / steep, plane[2] / steep], rel=1e-3)


def test_the_first_guess_is_not_steeper_than_nine_tenths_of_its_depth():
    x = (np.arange(SIDE) - HALF) / HALF
    found = first_gain(image(np.tile(2.0 + 6.0 * x, (SIDE, 1)), ink=0.5))
    assert found[2] == pytest.approx(0.9 * found[1])
    assert found[3] == pytest.approx(0.0, abs=1e-9)


def test_where_nothing_presses_there_is_no_gain():
    assert first_gain(image(np.zeros((SIDE, SIDE)), ink=0.5)) is None
    assert first_gain(image(-np.ones((SIDE, SIDE)), ink=0.5)) is None


def psi(response):
    return math.log(1 + 3 * max(response, 0.0)) / math.log(4)


@pytest.mark.parametrize("hardens", [True, False])
@pytest.mark.parametrize("fallen", [False, True])
def test_an_image_under_gains_tactel_by_tactel(hardens, fallen):
    rng = np.random.default_rng(2)
    forces, trust = rng.uniform(0, 9, SIDE**2), rng.uniform(0, 1, SIDE**2)
    gains = np.array([[0.4, 0.5, 0.3, -0.1], [1.1, 0.25, -0.3, 0.1]])
    falls = rng.uniform(0, 0.3, (2, SIDE**2)) if fallen else None
    found = normalize_image(image(forces, hardens=hardens, trust=trust, falls=falls), gains)
    for b, gain in enumerate(gains):
        depth = depths(gain) - (falls[b] if fallen else 0.0)
        plain = [force(one, hardens) for one in depth]
        lower = [force(one - SYMBOL, hardens) for one in depth]
        least = 0.12 * max(plain)
        measure = 0.0
        for n in range(SIDE**2):
            share = max(plain[n], least)
            plateau = math.exp(gain[0]) * share
            measure -= trust[n] * math.log(plateau + 3 * forces[n])
            truth = {
                "depth": depth[n],
                "plain": plain[n],
                "lower": lower[n],
                "plateau": plateau,
                "psi": psi(forces[n] / plateau),
                "press": min(max(depth[n] / (0.5 * gain[1]), 0.2), 1.0),
                "bare": lower[n] / share,
                "contact": min(plain[n] / least, 1.0),
            }
            for name, value in truth.items():
                assert getattr(found, name)[b, n] == pytest.approx(value, rel=1e-6), name
        assert found.measure[b] == pytest.approx(measure)
    np.testing.assert_array_equal(found.trust, trust)


def loaded_half():
    """Flags of the left half of the image."""
    return np.indices((SIDE, SIDE))[1].ravel() < SIDE / 2


def test_what_is_not_loaded_says_nothing_of_the_plane():
    rng = np.random.default_rng(4)
    half = loaded_half()
    forces = np.where(half, rng.uniform(1, 9, SIDE**2), 0.0)
    gains = np.array([[0.4, 0.3, 0.4, 0.0], [0.4, 0.3, -0.2, 0.0]])  # deep to the right, shallow
    found = normalize_image(image(forces, loaded=half), gains)
    assert (found.plateau[:, ~half] == forces.max()).all()
    assert (found.bare[:, ~half] == 0.0).all()
    assert (found.psi[:, ~half] == 0.0).all()
    for b, gain in enumerate(gains):
        plain = np.array([force(u) for u in depths(gain)])
        least = 0.12 * plain[half].max()  # however deep it stands where nothing is felt
        assert found.plateau[b, half] == pytest.approx(
            math.exp(0.4) * np.maximum(plain, least)[half]
        )
        inside = depths(gain)[half].mean()
        assert found.press[b] == pytest.approx(np.clip(depths(gain) / (0.5 * inside), 0.2, 1.0))
    all_over = normalize_image(image(forces), gains)
    told = half.astype(float)
    apart = [
        one.measure + (told * np.log(one.plateau + 3 * forces)).sum(axis=1)
        for one in (found, all_over)
    ]
    assert apart[0][0] == pytest.approx(apart[0][1])  # the same, whatever the plane says there
    assert abs(apart[1][0] - apart[1][1]) > 1


def test_the_first_guess_is_made_of_what_is_loaded():
    half = loaded_half()
    forces = np.where(half, 2.0, 0.0)
    found = first_gain(image(forces, loaded=half, ink=0.5))
    assert np.abs(found[2:]).max() < 1e-9  # as deep all over, not falling to the right
    assert found[1] > first_gain(image(forces, ink=0.5))[1]


def tilted(gain):
    """Forces of a plate that comes down on the bare face on the left, on symbols on the right."""
    depth = depths(gain).reshape(SIDE, SIDE)
    y, x = np.indices((SIDE, SIDE))
    left = x < SIDE / 2
    tops = ~left & (x % 2 == 1) & (y % 2 == 0)
    forces = [
        math.exp(gain[0]) * (force(u - SYMBOL) if on_face else force(u) if top else 0.0)
        for u, on_face, top in zip(depth.ravel(), left.ravel(), tops.ravel(), strict=True)
    ]
    return np.array(forces).reshape(SIDE, SIDE)


def test_a_plate_that_comes_down_on_the_bare_face_gives_its_tilt():
    gain = np.array([math.log(SCALE), 0.45, -0.3, 0.02])
    found = tilted_gain(image(tilted(gain)))
    np.testing.assert_allclose(found, gain, atol=2e-3)
    left = tilted_gain(image(tilted(gain)[:, ::-1]))
    np.testing.assert_allclose(left, [gain[0], gain[1], -gain[2], gain[3]], atol=2e-3)


def test_its_slopes_are_at_most_seventeen_tenths_of_its_depth():
    gain = np.array([math.log(SCALE), 0.35, -0.63, 0.0])
    found = tilted_gain(image(tilted(gain)))
    assert found[1] == pytest.approx(0.35, abs=0.02)
    assert np.abs(found[2:]).sum() == pytest.approx(1.7 * found[1])


COLUMN = np.tile(np.arange(SIDE), (SIDE, 1))
ROW = COLUMN.T
PEAKS = (COLUMN % 2 == 1) & (ROW % 2 == 0)


def halves(left, base=0.0, peak=1.0):
    """Forces: on the left what is given, on the right peaks over a base."""
    return np.where(COLUMN < 8, left, np.where(PEAKS, peak, base))


@pytest.mark.parametrize(
    ("forces", "comes_down"),
    [
        # on the bare face the lowest readings reach three tenths of the highest
        (halves(np.where(COLUMN % 2, 1.0, 0.31)), True),
        (halves(np.where(COLUMN % 2, 1.0, 0.29)), False),
        # and six hundredths of the highest of all
        (halves(0.061), True),
        (halves(0.059), False),
        # beside a plateau they stay below half of these three tenths
        (halves(1.0, base=0.14), True),
        (halves(1.0, base=0.16), False),
        # lowest: a fifth are lower; one column of five may be, two may not
        (halves(np.where(COLUMN % 5, 1.0, 0.02)), True),
        (halves(np.where(COLUMN % 5 > 1, 1.0, 0.02)), False),
    ],
)
def test_what_is_taken_for_the_bare_face_and_for_a_plateau(forces, comes_down):
    assert (tilted_gain(image(forces)) is not None) is comes_down


@pytest.mark.parametrize(("share", "counts"), [(0.81, True), (0.79, False)])
def test_a_tactel_is_on_a_plateau_from_four_fifths_of_the_highest_around_it(share, counts):
    beside = (COLUMN % 2 == 0) & (ROW % 4 == 0)
    forces = np.where((COLUMN >= 8) & beside, share, halves(1.0))
    known = np.where((COLUMN > 4) & (COLUMN < 8) | (COLUMN >= 8) & PEAKS, 0.0, 1.0)
    assert (tilted_gain(image(forces, trust=known)) is not None) is counts


@pytest.mark.parametrize(("few", "enough"), [(10, True), (9, False)])
@pytest.mark.parametrize("kind", ["bare", "plateau"])
def test_ten_tactels_of_either_kind_are_enough(kind, few, enough):
    side = COLUMN < 5 if kind == "bare" else (COLUMN > 9) & PEAKS
    known = np.where((COLUMN > 4) & (COLUMN < 8), 0.0, 1.0).ravel()
    known[np.flatnonzero(COLUMN < 8 if kind == "bare" else COLUMN >= 8)] = 0.0
    known[np.flatnonzero(side)[:few]] = 1.0
    assert (tilted_gain(image(halves(1.0), trust=known)) is not None) is enough


def test_single_tactels_in_empty_surroundings_are_no_plateaus():
    lone = (COLUMN % 3 == 1) & (ROW % 3 == 0)  # twelve known, of 25 around each at most 3 press
    known = np.where((COLUMN > 4) & (COLUMN < 10), 0.0, 1.0)
    forces = np.where(COLUMN < 8, 1.0, np.where((COLUMN > 9) & lone, 1.0, 0.0))
    assert tilted_gain(image(forces, trust=known)) is None
    assert tilted_gain(image(np.zeros((SIDE, SIDE)))) is None


@pytest.mark.parametrize("peak", [1.0, 2.0])
def test_where_the_scale_is_not_known_plateaus_are_as_deep_as_usual(peak):
    found = tilted_gain(image(halves(1.0, peak=peak), newtons=False))
    assert found[0] == pytest.approx(math.log(peak / force(0.25)))


def test_a_plane_that_hangs_over_the_centre_is_no_tilt():
    # 1.15 deep in the first two columns, hardly at all in the seventh and ninth
    peaks = (COLUMN >= 6) & (COLUMN % 2 == 0) & (ROW % 2 == 0)
    forces = np.where(COLUMN < 4, 30.0, np.where(peaks, 0.1, 0.0))
    known = (COLUMN < 2) | (COLUMN <= 6) & peaks | (COLUMN == 8) & peaks & (ROW < 6)
    assert tilted_gain(image(forces, trust=np.where(known, 1.0, 0.0))) is None
    near = np.where(COLUMN < 4, 30.0, np.where(peaks, 4.0, 0.0))
    assert tilted_gain(image(near, trust=np.where(known, 1.0, 0.0)))[1] > 0


def test_an_image_of_a_signal_has_a_row_for_each_tactel():
    sensor = SensorType()
    forces = np.arange(256.0).reshape(16, 16)
    trust = np.linspace(0, 1, 256).reshape(16, 16)
    signal = SimpleNamespace(forces=forces, trust=trust, newtons=True, state=None, noise=2.5)
    found = image_of_signal(sensor, signal, None, 1.0)
    pitch = 1.5875
    assert found.points_mm.shape == (256, 2)
    # tactel (2, 5): columns to the right, rows down
    np.testing.assert_allclose(found.points_mm[37], [(5 - 7.5) * pitch, (7.5 - 2) * pitch])
    assert found.forces[37] == 37.0
    assert found.trust[37] == trust[2, 5]
    assert (found.shape, found.newtons, found.falls) == ((16, 16), True, None)
    assert found.noise == 2.5
    np.testing.assert_array_equal(found.aside, np.ones(256))
    half = np.array(sensor.half_mm)
    np.testing.assert_allclose(found.plane[37], [1.0, *(found.points_mm[37] / half)])
    assert np.ptp(found.points_mm[:, 0]) == pytest.approx(15 * pitch)


def test_a_round_face_falls_away_under_the_plate():
    sensor = SensorType()
    flat = image_of_signal(
        sensor, Signal(np.ones((16, 16)), np.ones((16, 16)), contact=True, newtons=False), None, 1.0
    )
    height = sensor.overlay.height_mm
    raised = []

    def falls(points):
        return points[:, 0] ** 2 / 40.0

    def at(symbol):
        raised.append(symbol)
        return SimpleNamespace(falls_mm=falls)

    bend = SimpleNamespace(
        raised=at, unrolled_mm=lambda points, symbol: points * [1.1, 1.0] + symbol
    )
    one = bend_image(flat, sensor, bend)
    points = flat.points_mm
    np.testing.assert_allclose(one.points_mm, points * [1.1, 1.0] + 1.0)  # symbols of one mm
    np.testing.assert_allclose(one.falls, [falls(points) / height])
    assert raised == [pytest.approx(1.0)]
    two = bend_image(flat, sensor, bend, (0.5, 0.8))
    np.testing.assert_allclose(
        two.falls, [0.5 * falls(points) / height, 0.8 * falls(points) / height]
    )


def test_tips_of_a_learned_sensor_stand_elsewhere_and_scatter_as_learned():
    sensor = SensorType()
    state = unknown_state(sensor)
    deviation, aside = state.aside_deviation_mm.copy(), np.zeros((16, 16, 2))
    deviation[2, 5] = 0.03, 0.09  # of .15 each way before
    aside[2, 5] = 0.1, -0.2
    state = replace(state, aside_mm=aside, aside_deviation_mm=deviation)
    plain = Signal(np.ones((16, 16)), np.ones((16, 16)), contact=True, newtons=False)
    flat, found = (
        image_of_signal(sensor, replace(plain, state=one), None, 1.0) for one in (None, state)
    )
    moved = found.points_mm - flat.points_mm
    np.testing.assert_allclose(moved[37], [0.1, -0.2], atol=1e-12)
    assert np.count_nonzero(moved) == 2
    assert found.aside[36:38] == pytest.approx([1.0, (0.2**2 + 0.6**2) / 2])
    bent = [bend_image(one, sensor, Bend(40.0, 0.0)).points_mm for one in (flat, found)]
    assert np.abs(bent[1] - bent[0])[37].min() > 0.09
    assert np.count_nonzero(bent[1] - bent[0]) == 2


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
    assert found[0] == pytest.approx(math.log(strong / force(0.75)), abs=0.35)
    assert found[1] == pytest.approx(GAIN[1], abs=0.15)
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


def test_a_deep_gain_is_no_steeper_and_does_not_hang():
    steep = np.array([math.log(SCALE), 0.3, 0.7, 0.0])
    found = deep_gain(image(over_an_edge(steep), loaded=LOADED))
    assert np.abs(found[2:]).sum() <= 1.7 * found[1] + 1e-9
    hanging = (COLUMN < 5).ravel()  # deep far from the centre, and falling towards it
    away = np.array([math.log(SCALE), -0.3, -1.0, 0.0])
    assert deep_gain(image(over_an_edge(away, loaded=hanging), loaded=hanging)) is None


SENSOR = SensorType()
SHAPE = (SENSOR.rows, SENSOR.columns)


def loaded(forces, *, noise=1.0, trust=None, sensor=SENSOR):
    known = np.ones(SHAPE) if trust is None else trust
    return find_loaded_area(sensor, Signal(forces, known, True, False, noise))


def strokes(rows, columns, force=100.0):
    """Every third tactel pressed, from the first to the last of some rows and columns."""
    forces = np.zeros(SHAPE)
    forces[rows.start : rows.stop : 3, columns.start : columns.stop : 3] = force
    return forces


def test_gaps_between_strokes_are_loaded_and_what_lies_beyond_them_is_not():
    found = loaded(strokes(range(10), range(7)))
    truth = np.zeros(SHAPE, np.bool_)
    truth[:10, :7] = True
    np.testing.assert_array_equal(found, truth)


def test_a_gap_wider_than_the_square_is_open():
    forces = strokes(range(16), range(16))
    forces[4:12, 4:12] = 0.0
    assert not loaded(forces)[7:9, 7:9].any()
    assert loaded(forces)[:4].all()


@pytest.mark.parametrize(("force", "is_loaded"), [(5.1, True), (4.9, False)])
def test_noise_is_no_load(force, is_loaded):
    forces = strokes(range(10), range(4), 400.0)
    forces[14, 14] = force  # five deviations of the noise
    assert loaded(forces)[14, 14] == is_loaded


@pytest.mark.parametrize(("force", "is_loaded"), [(17.0, True), (15.0, False)])
def test_what_a_strong_neighbour_bleeds_is_no_load(force, is_loaded):
    forces = np.zeros(SHAPE)
    forces[:8] = strokes(range(8), range(16), 400.0)[:8]
    forces[8, 6] = force  # 4 % of the highest, two rows beside one
    assert loaded(forces)[8, 6] == is_loaded


def test_noise_is_at_most_a_share_of_the_strongest_readings():
    light = strokes(range(16), range(16), 8.0)
    assert loaded(light, noise=3.0).all()  # 15 counts would leave none
    light[8:, :] *= 0.1
    assert not loaded(light, noise=3.0)[12:].any()  # 1.2 is five times 3 % of 8


def test_what_cannot_be_told_is_loaded_all_over():
    assert loaded(np.zeros(SHAPE)).all()
    assert loaded(strokes(range(9), range(9)), trust=np.zeros(SHAPE)).all()
    pad = SENSOR.with_overlay("pad")
    assert loaded(strokes(range(9), range(9)), sensor=pad).all()


def test_bad_tactels_load_nothing():
    forces, trust = strokes(range(10), range(4)), np.ones(SHAPE)
    forces[13, 13], trust[13, 13] = 500.0, 0.0
    assert not loaded(forces, trust=trust)[11:, 11:].any()
