"""The ladder behind one function: its picks and footprint; gels."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from reference.indenters import half_plane, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.contact.contract import Touch
from probe.contact.gel import bridge, depths_mm, gel
from probe.contact.press import AUTO_ERROR, LEVELS, accuracy_of, footprint, level_for, press, table
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.simulate.scene import bare_scene
from probe.simulate.sensor import simulated_sensor
from probe.simulate.world import levels
from probe.simulate.world.sensor import LevelSensor
from probe.surface.indenters import FlatPlate, RaisedStrip, RoughSurface, TiltedPlane, Washer

TAB, PAD = (SensorType(overlay=Overlay(kind=kind)) for kind in ("tab", "pad"))
LEVEL = Touch(0.0, 0.0, 0.0, 64.0)


@pytest.mark.parametrize("sensor", [TAB, PAD])
def test_pick_is_the_cheapest_that_holds_the_error(sensor):
    known = table()[sensor.overlay.kind]
    for error in [*(line.error for line in known), AUTO_ERROR, 0.1, 0.9]:
        level = level_for(sensor, error)
        picked = next(line for line in known if line.level == level)
        assert picked.error <= error
        assert all(line.ms >= picked.ms for line in known if line.error <= error)
    assert level_for(sensor) == level_for(sensor, AUTO_ERROR)
    assert [line.level for line in known] == [*LEVELS[sensor.overlay.kind]]
    assert np.all(np.diff([line.error for line in known]) < 0)
    assert np.all(np.diff([line.ms for line in known]) > 0)


@pytest.mark.parametrize(("sensor", "name"), [(TAB, "layer"), (PAD, "tabs"), (PAD, "layer-5")])
def test_levels_of_another_overlay_are_refused(sensor, name):
    with pytest.raises(ContactError, match="no level"):
        press(Washer(), sensor, LEVEL, accuracy=name)


def test_pick_holds_its_error_on_a_surface_that_was_not_measured():
    surface, touch = RoughSurface(seed=8, rms_mm=0.3, shortest_mm=2.0), Touch(3.0, 1.0, 1.1, 70.0)
    fine = tabs(surface, TAB, touch, Tips(127)).forces_n
    for error in (0.1, 0.05):
        found = press(surface, TAB, touch, accuracy=error).forces_n
        assert np.linalg.norm(found - fine) <= error * np.linalg.norm(fine)


def test_accuracy_is_read_from_text():
    assert (accuracy_of("0.01"), accuracy_of("tabs-19")) == (0.01, "tabs-19")
    for text in ("0", "-1", "inf", "nan"):
        with pytest.raises(ContactError, match="error of"):
            accuracy_of(text)


def test_footprint_of_half_a_face_bears_on_half_the_tactels():
    found = footprint(half_plane(), TAB, LEVEL)
    np.testing.assert_allclose(found.forces_n[:, :8], 0.5)
    assert not found.forces_n[:, 8:].any()
    assert (found.z_mm, found.tilt_x_rad, found.level, found.iterations) == (0.0, 0, "footprint", 0)


def test_footprint_of_a_pad_shares_by_area():
    columns = footprint(RaisedStrip(1.5875 * 3.5), PAD, LEVEL).forces_n.sum(axis=0)
    exact = np.clip(3.5 / 2 - np.abs(np.arange(16) - 7.5) + 0.5, 0, 1)
    np.testing.assert_allclose(columns / 64, exact / exact.sum(), atol=0.05)


def test_footprint_counts_down_to_a_quarter_of_the_overlay():
    assert (footprint(half_plane(-0.4), TAB, LEVEL).forces_n > 0).all()
    assert not footprint(half_plane(-0.6), TAB, LEVEL).forces_n[:, 8:].any()
    assert 0 < (footprint(sphere(), TAB, LEVEL).forces_n > 0).sum() < 256


def test_footprint_measures_a_tilt_against_the_plate():
    tilted = TiltedPlane(slope_x=0.1)
    assert footprint(tilted, TAB, LEVEL).forces_n[:, 0].sum() == 0
    along = footprint(tilted, TAB, Touch(0.0, 0.0, 0.0, 256.0, tilt_y_rad=-0.1))
    np.testing.assert_allclose(along.forces_n, 1.0)
    assert along.tilt_y_rad == -0.1


@pytest.mark.parametrize(
    ("surface", "force", "message"),
    [
        (FlatPlate(-math.inf), 1.0, "nothing under the sensor"),
        (FlatPlate(math.nan), 1.0, "no numbers"),
        (FlatPlate(), -1.0, "force of 0 or more"),
        (FlatPlate(), math.nan, "finite numbers"),
    ],
)
@pytest.mark.parametrize("sensor", [TAB, PAD])
def test_what_gives_no_image_is_refused(sensor, surface, force, message):
    with pytest.raises(ContactError, match=message):
        press(surface, sensor, Touch(0.0, 0.0, 0.0, force), accuracy="footprint")


GEL = sensor_type_named("gel-24x32")
PLAIN = replace(GEL, overlay=replace(GEL.overlay, membrane_mm=0.0, blur_mm=0.0))
SOFTLY = Touch(0.0, 0.0, 0.0, 2.0)


def test_a_plane_is_pressed_alike_all_over():
    contact = gel(FlatPlate(), PLAIN, SOFTLY)
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
        gel(Washer(outer_mm=8.0), GEL, replace(SOFTLY, force_n=200.0))
    with pytest.raises(ContactError, match="a tab overlay is no gel"):
        gel(FlatPlate(), SensorType(), SOFTLY)
    with pytest.raises(ContactError, match="nothing under the sensor"):
        gel(Washer(outer_mm=8.0), GEL, replace(SOFTLY, x_mm=90.0))
    assert not gel(FlatPlate(), GEL, replace(SOFTLY, force_n=0.0)).forces_n.any()


def test_the_ladder_knows_one_level_of_a_gel():
    assert level_for(GEL) == "gel"
    assert press(FlatPlate(), GEL, SOFTLY).level == "gel"
    with pytest.raises(ContactError, match=r"take auto, an error such as 0\.01, or gel"):
        level_for(GEL, "tabs")
    with pytest.raises(ContactError, match="the error of a gel's levels is not known"):
        level_for(GEL, 0.01)


def test_readings_are_depths_in_the_unit_of_the_type():
    forces = gel(FlatPlate(), PLAIN, SOFTLY).forces_n
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
        LevelSensor(GEL, levels.LEVELS[name]).read(scene, SOFTLY, rng).counts
        for name in ("sound", "typical")
    )
    assert sound.shape == typical.shape == (24, 32)
    beside = sound == 0
    assert beside.sum() > 200
    assert typical[beside].std() > 3  # noise, clipped at 0
    assert np.corrcoef(sound.ravel(), typical.ravel())[0, 1] > 0.95
