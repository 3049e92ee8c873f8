"""Worlds: columns under load, mountings, scaled prints."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType, SensorTypeError
from probe.circuit.fsr import conductances, fsr_of
from probe.circuit.network import loaded_columns
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import CircuitError, SurfaceError
from probe.simulate.scene import bare_scene
from probe.simulate.sensor import simulated_sensor
from probe.simulate.simulation import TouchOptions, simulate
from probe.simulate.world.levels import SOUND, TYPICAL
from probe.simulate.world.sensor import MOUNTINGS, LevelSensor, mount
from probe.simulate.world.surfaces import DistortedSurface, place_adjacent
from probe.surface.indenters import RaisedStrip
from probe.surface.polygon import polygon


def brute_force(g, floating, load_ohm):
    """Solve each pair's network of rows + columns anew, every node by Kirchhoff."""
    rows, columns = g.shape
    share = np.empty(g.shape)
    for r, c in np.ndindex(rows, columns):
        A = np.block([[np.diag(g.sum(axis=1)), -g], [-g.T, np.diag(g.sum(axis=0))]])
        A[rows + c, rows + c] += 1 / load_ohm
        for i in np.flatnonzero(~floating | (np.arange(rows) == r)):
            A[i] = np.eye(rows + columns)[i]
        share[r, c] = np.linalg.solve(A, np.eye(rows + columns)[r])[rows + c]
    return share


@pytest.mark.parametrize("loose", [[], [1], [0, 3], [0, 1, 2, 3, 4]])
def test_column_under_load_is_that_of_kirchhoff(loose):
    g = 10 ** np.random.default_rng(len(loose)).uniform(-7, -3, (5, 4))
    floating = np.isin(np.arange(5), loose)
    np.testing.assert_allclose(
        loaded_columns(g, floating, 470.0), brute_force(g, floating, 470.0), rtol=1e-9
    )


STAR = [(r * math.cos(a / 10 * math.pi), r * math.sin(a / 10 * math.pi))
        for a, r in zip(range(20), [4.0, 10.0] * 10, strict=True)]  # fmt: skip
ONES, APART = np.ones((5, 4)), np.ones((3, 3)) * [[1], [0], [1]]


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: loaded_columns(ONES, np.zeros(4, bool), 220.0), "floating rows"),
        (lambda: loaded_columns(ONES, np.zeros(5, bool), 0.0), "floating rows"),
        (lambda: loaded_columns(APART, np.ones(3, bool), 220.0), "joined to nothing"),
        (lambda: mount(np.zeros((12, 32)), "quarter turn"), "cannot be mounted 'quarter turn'"),
        (lambda: place_adjacent(polygon([STAR]), OBLONG, np.random.default_rng(1)),
         "no edge beside which"),
        (lambda: TouchOptions(frames=0), "frames 0; give a whole number of 1 or more"),
        (lambda: TouchOptions(touches=0), "touches 0; give a whole number of 1 or more"),
        (lambda: TouchOptions(seed=-1), "seed -1; give a whole number of 0 or more"),
        (lambda: simulate("washer", x="a"), "x 'a'; give a finite number"),
        (lambda: simulate("washer", x=[1, 2]), "x .1, 2.; give a finite number"),
        (lambda: simulate("washer", theta="30deg"), "theta '30deg'; give a finite number"),
        (lambda: simulate("washer", tilt_x=math.nan), "tilt_x nan; give a finite number"),
        (lambda: simulate("washer", scan="spiral"), "scan 'spiral'; give raster or kinesthetic"),
        (lambda: simulate(None), "None is no target; name a written part"),
        (lambda: simulate(Path("washer.x")), "washer.x: this names no surface"),
        (lambda: simulate("washer", sensor_type=5), "5 is no sensor type"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(call, match):
    with pytest.raises((CircuitError, SensorTypeError, SurfaceError), match=match):
        call()


GAIN_S, BREAK_N, LEAK_S = 1e-4, 0.01, 5e-8  # of the film, as the datasheet of the thesis has it


def test_film_on_its_way_back_reads_higher_where_it_was_pressed_more():
    """Counts are the divider of a loaded column under the force that the film still shows."""
    sensor, strip = SensorType(), RaisedStrip(6.0)
    touch = Touch(x_mm=0.3, y_mm=0.2, theta_rad=0.4, force_n=60.0, tilt_x_rad=0.02)
    rocked = replace(touch, force_n=1.4 * 60, tilt_x_rad=-0.02)
    now, before = (tabs(strip, sensor, t, Tips()).forces_n for t in (touch, rocked))
    felt = np.clip(before, now, 1.4 * now)
    g = LEAK_S + GAIN_S * np.maximum(felt - BREAK_N, 0.0)
    level = LevelSensor(sensor, replace(SOUND, hysteresis=0.4))
    counts = level.read(bare_scene(strip), touch, np.random.default_rng(3)).counts
    expected = 8 + 1023 * 150 / (1023 * 22 * GAIN_S) * g / (g.sum(axis=0) + 1 / 22)
    assert np.abs(counts - np.clip(expected, 0, 1023)).max() <= 0.5 + 1e-6
    ratio = felt[now > 0.05] / now[now > 0.05]
    assert ratio.min() < 1.1
    assert ratio.max() == pytest.approx(1.4)  # not one factor for all


@pytest.mark.parametrize("value", ["force", "conductance"])
def test_forces_and_conductances_are_counted_in_their_unit_with_the_type_s_noise(value):
    unit = {"force": 1e-3, "conductance": 1e-7}[value]
    sensor = replace(SensorType(), value=value, unit=unit, bits=14, noise=30.0, missing=((0, 0),))
    scene, touch = bare_scene(RaisedStrip(20.0, 20.0)), Touch(0.0, 0.0, 0.0, 100.0)
    for quiet in (True, False):
        single = simulated_sensor(sensor, quiet=quiet)
        level = LevelSensor(sensor, SOUND if quiet else replace(SOUND, noise_n=TYPICAL.noise_n))
        for one in (single, level):
            reading = one.read(scene, touch, np.random.default_rng(1))
            forces = reading.contact.forces_n
            film = replace(fsr_of(), series_ohm=0.0 * forces) if one is level else fsr_of()
            true = forces if value == "force" else conductances(film, forces)[0]
            true = np.where(sensor.present(), np.minimum(true / unit, sensor.full), 0.0)
            error = (reading.counts - true)[(true > 100) & (true < sensor.full)]
            if quiet:
                assert np.abs(error).max() <= 1.0
            else:
                assert error.std() == pytest.approx(30.0, rel=0.3)
            assert reading.counts[0, 0] == 0
            if value == "force":
                total = reading.counts.sum(dtype=float) * unit
                assert total == pytest.approx(100.0, rel=0.001 if quiet else 0.03)


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
    for mounting in MOUNTINGS:
        found, place = mount(image, mounting), of[mounting]
        assert all(found[place(r, c)] == image[r, c] for r, c in np.ndindex(16, 16))


def test_print_is_scaled_from_its_datum():
    print_ = DistortedSurface(RaisedStrip(2.0), 0.0, 0.01, (-30.0, 0.0))
    edge = -30 + 1.01 * (30 + 1.0)  # of the strip of 2 mm about 0, 31 mm from the datum
    within, beyond = print_.heights_mm(np.array([[edge - 1e-3, 0.0], [edge + 1e-3, 0.0]]))
    assert within > beyond


OBLONG = polygon([np.array([(0, 0), (40, 0), (40, 30), (0, 30)])])
