"""Gels: springs, the membrane's obstacle problem, blur, and depth maps as readings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.contact.contract import Touch
from probe.contact.gel import bridge, depths_mm, gel
from probe.contact.press import level_for, press
from probe.errors import ContactError
from probe.simulate.scene import bare_scene
from probe.simulate.sensor import simulated_sensor
from probe.simulate.world.levels import LEVELS
from probe.simulate.world.sensor import LevelSensor
from probe.surface.indenters import FlatPlate, Washer

GEL = sensor_type_named("gel-24x32")
PLAIN = replace(GEL, overlay=replace(GEL.overlay, membrane_mm=0.0, blur_mm=0.0))
TOUCH = Touch(0.0, 0.0, 0.0, 2.0)


def test_a_plane_is_pressed_alike_all_over():
    contact = gel(FlatPlate(), PLAIN, TOUCH)
    area = 24 * 32 * 0.58**2
    assert contact.forces_n.sum() == pytest.approx(2.0)
    assert np.ptp(contact.forces_n) < 1e-9
    depth = 2.0 / area / (0.3 / 3.0)  # pressure over E / height
    assert depths_mm(PLAIN, contact.forces_n) == pytest.approx(np.full((24, 32), depth))
    assert contact.z_mm == pytest.approx(-depth)


def test_the_membrane_follows_and_bridges():
    depth = np.zeros((41, 41))
    depth[18:23, 18:23] = 1.0
    imprint, _ = bridge(depth, 3.0)
    assert (imprint >= depth).all()
    assert imprint[20, 20] == 1.0
    inner = imprint[1:-1, 1:-1]
    beside = imprint[:-2, 1:-1] + imprint[2:, 1:-1] + imprint[1:-1, :-2] + imprint[1:-1, 2:]
    left = inner - 9.0 * (beside - 4 * inner)
    free = inner > depth[1:-1, 1:-1] + 1e-9
    assert np.abs(left[free]).max() < 0.05  # w - l^2 laplace(w) = 0 where it is free
    assert left[~free].min() > -1e-6  # and pushed out where it is held
    assert imprint[20, 26] > imprint[20, 29] > imprint[20, 35] > 0


def test_beside_a_long_edge_it_falls_with_its_way():
    depth = np.zeros((5, 120))
    depth[:, :40] = 1.0
    imprint, _ = bridge(np.tile(depth, (20, 1)), 4.0)
    line = imprint[50, 40:70]
    assert line[4] / line[0] == pytest.approx(np.exp(-1), rel=0.03)
    assert (bridge(depth, 0.0)[0] == depth).all()


def test_what_a_gel_cannot_take_is_refused():
    with pytest.raises(ContactError, match="presses the gel through"):
        gel(Washer(outer_mm=8.0), GEL, replace(TOUCH, force_n=200.0))
    with pytest.raises(ContactError, match="a tab overlay is no gel"):
        gel(FlatPlate(), SensorType(), TOUCH)
    with pytest.raises(ContactError, match="nothing under the sensor"):
        gel(Washer(outer_mm=8.0), GEL, replace(TOUCH, x_mm=90.0))
    assert not gel(FlatPlate(), GEL, replace(TOUCH, force_n=0.0)).forces_n.any()


def test_the_ladder_knows_one_level_of_a_gel():
    assert level_for(GEL) == "gel"
    assert press(FlatPlate(), GEL, TOUCH).level == "gel"
    with pytest.raises(ContactError, match=r"take auto, an error such as 0\.01, or gel"):
        level_for(GEL, "tabs")
    with pytest.raises(ContactError, match="the error of a gel's levels is not known"):
        level_for(GEL, 0.01)


def test_readings_are_depths_in_the_unit_of_the_type():
    forces = gel(FlatPlate(), PLAIN, TOUCH).forces_n
    depth = depths_mm(PLAIN, forces)[0, 0]
    rng = np.random.default_rng(1)
    quiet = next(simulated_sensor(PLAIN, quiet=True).counts([forces], rng))
    assert (quiet == round(depth / 1e-3)).all()
    noisy = next(simulated_sensor(PLAIN).counts([forces], rng))
    assert noisy.std() == pytest.approx(GEL.noise, rel=0.1)


def test_a_level_makes_a_gel_worse():
    rng = np.random.default_rng(2)
    scene = bare_scene(Washer(outer_mm=10.0))
    sound, typical = (
        LevelSensor(GEL, LEVELS[name]).read(scene, TOUCH, rng).counts
        for name in ("sound", "typical")
    )
    assert sound.shape == typical.shape == (24, 32)
    beside = sound == 0
    assert beside.sum() > 200
    assert typical[beside].std() > 3  # noise, clipped at 0
    assert np.corrcoef(sound.ravel(), typical.ravel())[0, 1] > 0.95
