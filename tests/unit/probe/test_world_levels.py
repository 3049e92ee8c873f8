"""Levels of sensors and prints: each does to the counts what it says, computed independently."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.circuit.electronics import QUIET, Electronics
from probe.circuit.network import loaded_columns
from probe.circuit.reading import shares
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import CircuitError
from probe.simulate.scene import bare_scene
from probe.simulate.world.levels import LEVELS, SOUND, TYPICAL
from probe.simulate.world.sensor import COUNTS_PER_N, MOUNTINGS, LevelSensor, mount, sample_sensor
from probe.simulate.world.surfaces import DistortedSurface
from probe.surface.indenters import FlatPlate, RaisedStrip

SENSOR = SensorType()
HERE = Touch(x_mm=0.3, y_mm=0.2, theta_rad=0.4, force_n=60.0)
STRIP = RaisedStrip(6.0)
GAIN_S, BREAK_N, LEAK_S = 1e-4, 0.01, 5e-8  # of the film, as the datasheet of the thesis has it


def counts_of(level, surface=None, touch=HERE, seed=3):
    scene = bare_scene(surface or FlatPlate())
    return LevelSensor(SENSOR, level).read(scene, touch, np.random.default_rng(seed)).counts


def film_s(forces_n):
    """Conductance of a sound film of exponent 1."""
    return LEAK_S + GAIN_S * np.maximum(np.asarray(forces_n) - BREAK_N, 0.0)


def brute_force(g, floating, load_ohm):
    """Solve each pair's network of rows + columns anew, every node by Kirchhoff."""
    rows, columns = g.shape
    share = np.empty(g.shape)
    for r in range(rows):
        for c in range(columns):
            A, b = np.zeros((rows + columns,) * 2), np.zeros(rows + columns)
            for i in range(rows):
                for j in range(columns):
                    for a, z in ((i, rows + j), (rows + j, i)):
                        A[a, a] += g[i, j]
                        A[a, z] -= g[i, j]
            A[rows + c, rows + c] += 1 / load_ohm
            for i in range(rows):
                if i == r or not floating[i]:
                    A[i], A[i, i], b[i] = 0.0, 1.0, float(i == r)
            share[r, c] = np.linalg.solve(A, b)[rows + c]
    return share


@pytest.mark.parametrize("loose", [[], [1], [0, 3], [0, 1, 2, 3, 4]])
def test_column_under_load_is_that_of_kirchhoff(loose):
    g = 10 ** np.random.default_rng(len(loose)).uniform(-7, -3, (5, 4))
    floating = np.isin(np.arange(5), loose)
    np.testing.assert_allclose(
        loaded_columns(g, floating, 470.0), brute_force(g, floating, 470.0), rtol=1e-9
    )


@pytest.mark.parametrize(("readout", "floats"), [("grounded", False), ("floating", True)])
def test_column_under_load_is_that_of_the_readouts_of_the_board(readout, floats):
    g = film_s(np.random.default_rng(1).exponential(size=(16, 16)))
    board = Electronics(readout=readout, supply_v=5, reference_v=5, noise=QUIET)
    found = loaded_columns(g, np.full(16, floats), board.load_ohm)
    np.testing.assert_allclose(found, shares(g, board), rtol=1e-8)


@pytest.mark.parametrize(
    ("floating", "load_ohm"), [(np.zeros(4, bool), 220.0), (np.zeros(5, bool), 0.0)]
)
def test_column_under_load_refuses_what_is_no_network(floating, load_ohm):
    with pytest.raises(CircuitError, match="floating rows"):
        loaded_columns(np.ones((5, 4)), floating, load_ohm)


def test_node_that_is_joined_to_nothing_is_refused():
    g = np.ones((3, 3))
    g[1] = 0
    with pytest.raises(CircuitError, match="joined to nothing"):
        loaded_columns(g, np.ones(3, bool), 220.0)


def test_levels_of_one_fault_are_typical_or_sound_but_for_that():
    for name, level in LEVELS.items():
        assert level.name == name
        if name in ("low", "typical", "hard", "mismatch", "sound"):
            continue
        base = SOUND if name in ("places-08", "bleed-2") else TYPICAL
        differ = {k for k, v in asdict(level).items() if v != asdict(base)[k]} - {"name"}
        assert len(differ) == 1, name


@pytest.mark.parametrize("load_ohm", [22.0, 2200.0, 10000.0])
def test_flat_plate_is_read_as_the_divider_of_a_loaded_column(load_ohm):
    g = film_s(HERE.force_n / 256)
    share = g / (16 * g + 1 / load_ohm)
    gain = max(1.0, 150 / (1023 * load_ohm * GAIN_S))
    expected = 8 + 1023 * gain * share
    counts = counts_of(replace(SOUND, load_ohm=load_ohm))
    assert np.abs(counts - expected).max() <= 0.5 + 1e-6


@pytest.mark.parametrize(("name", "dead"), [("dead-10", 26), ("dead-40", 102)])
def test_dead_tactels_are_those_that_a_press_does_not_move(name, dead):
    level = replace(LEVELS[name], noise_n=0.0, bleed=0.0)
    assert (counts_of(level) <= 9).sum() == dead


def test_spread_of_gains_is_that_of_the_level():
    level = replace(SOUND, gain=0.12)
    counts = np.concatenate([counts_of(level, seed=seed).ravel() for seed in range(8)])
    assert np.log(counts - 8.0).std() == pytest.approx(0.12, rel=0.1)


def test_exponent_is_that_of_the_level():
    level, twice = replace(SOUND, exponent=0.88), replace(HERE, force_n=120.0)
    ratio = (counts_of(level, touch=twice).mean() - 8) / (counts_of(level).mean() - 8)
    over = ((120 / 256 - BREAK_N) / (60 / 256 - BREAK_N)) ** 0.88
    assert ratio == pytest.approx(over, rel=0.03)  # the divider takes 1 %


def test_noise_is_that_of_the_level():
    level = replace(SOUND, noise_n=0.02)
    noise = counts_of(level).astype(float) - counts_of(SOUND)
    assert noise.std() == pytest.approx(0.02 * COUNTS_PER_N, rel=0.15)


def test_rows_bleed_into_the_rows_beside_them():
    sound, bled = (counts_of(replace(SOUND, bleed=b), STRIP).astype(float) - 8 for b in (0.0, 0.02))
    for row in range(16):
        beside = sum(sound[r] for r in (row - 1, row + 1) if 0 <= r < 16)
        np.testing.assert_allclose(bled[row], 0.96 * sound[row] + 0.02 * beside, atol=1.1)


@pytest.mark.parametrize(("name", "rows"), [("floating-10", 2), ("floating", 16)])
def test_floating_rows_carry_the_ghosts_of_the_network(name, rows):
    level = replace(SOUND, floating=LEVELS[name].floating, load_ohm=220.0)
    sensor = SensorType(rows=16, columns=6)
    reading = LevelSensor(sensor, level).read(bare_scene(STRIP), HERE, np.random.default_rng(3))
    counts, contact = reading.counts, reading.contact
    floating = sample_sensor(sensor, np.random.default_rng(3)).floating_rows(level)
    assert floating.sum() == rows
    share = brute_force(film_s(contact.forces_n), floating, 220.0)
    expected = np.clip(8 + 1023 * 150 / (1023 * 220 * GAIN_S) * share, 0, 1023)
    assert np.abs(counts - expected).max() <= 0.5 + 1e-6


def test_film_on_its_way_back_reads_higher_where_it_was_pressed_more():
    touch = replace(HERE, tilt_x_rad=0.02)
    rocked = replace(touch, force_n=1.4 * 60, tilt_x_rad=-0.02)
    now, before = (tabs(STRIP, SENSOR, t, Tips()).forces_n for t in (touch, rocked))
    felt = np.clip(before, now, 1.4 * now)
    g = film_s(felt)
    expected = np.clip(8 + 1023 * 150 / (1023 * 22 * GAIN_S) * g / (g.sum(0) + 1 / 22), 0, 1023)
    counts = counts_of(replace(SOUND, hysteresis=0.4), STRIP, touch)
    assert np.abs(counts - expected).max() <= 0.5 + 1e-6
    pressed = now > 0.05
    ratio = felt[pressed] / now[pressed]
    assert ratio.min() < 1.1
    assert ratio.max() == pytest.approx(1.4)  # not one factor for all


@pytest.mark.parametrize(("name", "places"), [("slide-2", 5)])
def test_slide_is_the_mean_of_the_forces_on_its_way(name, places):
    level = replace(SOUND, slide_mm=LEVELS[name].slide_mm)
    counts = counts_of(level, STRIP)
    rng = np.random.default_rng(3)
    sample_sensor(SENSOR, rng)
    towards = rng.uniform(-np.pi, np.pi)
    ways = np.linspace(-level.slide_mm / 2, level.slide_mm / 2, places)
    forces = np.mean(
        [tabs(STRIP, SENSOR, replace(HERE, x_mm=HERE.x_mm + way * np.cos(towards),
                                     y_mm=HERE.y_mm + way * np.sin(towards))).forces_n
         for way in ways], axis=0,
    )  # fmt: skip
    g = film_s(forces)
    expected = np.clip(8 + 1023 * 150 / (1023 * 22 * GAIN_S) * g / (g.sum(0) + 1 / 22), 0, 1023)
    assert np.abs(counts - expected).max() <= 0.5 + 1e-6


def test_mountings_put_each_tactel_where_they_say():
    image = np.arange(256, dtype=np.uint16).reshape(16, 16)
    of = {
        "as drawn": lambda r, c: (r, c),
        "quarter turn": lambda r, c: (15 - c, r),
        "mirrored": lambda r, c: (r, 15 - c),
        "transposed": lambda r, c: (c, r),
        "halves swapped": lambda r, c: (r, (c + 8) % 16),
        "rolled": lambda r, c: (r, (c + 1) % 16),
    }
    assert set(of) == set(MOUNTINGS)
    for mounting, place in of.items():
        found = mount(image, mounting)
        assert all(found[place(r, c)] == image[r, c] for r in range(16) for c in range(16))
        level = replace(TYPICAL, mounting=mounting)
        np.testing.assert_array_equal(
            counts_of(level, STRIP), mount(counts_of(TYPICAL, STRIP), mounting)
        )


def test_mounting_that_would_change_the_shape_is_refused():
    with pytest.raises(CircuitError, match="cannot be mounted 'quarter turn'"):
        mount(np.zeros((12, 32), np.uint16), "quarter turn")


def test_print_is_scaled_from_its_datum():
    print_ = DistortedSurface(RaisedStrip(2.0), 0.0, 0.01, (-30.0, 0.0))
    edge = -30 + 1.01 * (30 + 1.0)  # of the strip of 2 mm about 0, 31 mm from the datum
    within, beyond = print_.heights_mm(np.array([[edge - 1e-3, 0.0], [edge + 1e-3, 0.0]]))
    assert within > beyond


def test_instance_of_a_sensor_is_the_same_at_every_touch():
    instance = sample_sensor(SENSOR, np.random.default_rng(5))
    level = replace(TYPICAL, noise_n=0.0)
    first, second = (
        LevelSensor(SENSOR, level, instance=instance)
        .read(bare_scene(FlatPlate()), HERE, np.random.default_rng(seed))
        .counts
        for seed in (1, 2)
    )
    np.testing.assert_array_equal(first, second)
    assert (counts_of(level, seed=1) != counts_of(level, seed=2)).any()
