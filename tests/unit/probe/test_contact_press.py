"""The ladder behind one function: what it picks, that the pick holds its error, and footprint."""

import math

import numpy as np
import pytest
from reference.indenters import half_plane, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch
from probe.contact.press import AUTO_ERROR, LEVELS, accuracy_of, footprint, level_for, press, table
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import ContactError
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
