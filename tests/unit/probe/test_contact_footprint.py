"""Footprint: the force is shared by cover."""

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch
from probe.contact.press import footprint
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.surface.indenters import FlatPlate, HalfPlane, RaisedStrip, Sphere, TiltedPlane

SENSOR = SensorType()
PAD = SensorType(overlay=Overlay(kind="pad"))


def test_half_a_face_bears_on_half_the_tactels():
    found = footprint(HalfPlane(), SENSOR, Touch(0.0, 0.0, 0.0, 64.0))
    np.testing.assert_allclose(found.forces_n[:, :8], 0.5)
    assert not found.forces_n[:, 8:].any()
    assert (found.z_mm, found.tilt_x_rad, found.level, found.iterations) == (0.0, 0, "footprint", 0)


@pytest.mark.parametrize(("points", "within"), [(19, 0.05), (127, 0.015)])
def test_shares_are_those_of_the_area(points, within):
    strip = RaisedStrip(width_mm=1.5875 * 3.5)
    found = footprint(strip, PAD, Touch(0.0, 0.0, 0.0, 1.0), Tips(points))
    columns = found.forces_n.sum(axis=0)
    exact = np.clip(3.5 / 2 - np.abs(np.arange(16) - 7.5) + 0.5, 0, 1)
    np.testing.assert_allclose(columns, exact / exact.sum(), atol=within)


def test_depth_tells_what_counts_as_touched():
    touch = Touch(0.0, 0.0, 0.0, 10.0)
    step = HalfPlane(floor_mm=-0.4)
    assert (footprint(step, SENSOR, touch).forces_n > 0).all()
    assert not footprint(step, SENSOR, touch, depth_mm=0.3).forces_n[:, 8:].any()
    ball = footprint(Sphere(20.0), SENSOR, touch).forces_n
    assert 0 < (ball > 0).sum() < 256


def test_a_tilt_is_measured_against_the_plate():
    tilted = TiltedPlane(slope_x=0.1)
    level = footprint(tilted, SENSOR, Touch(0.0, 0.0, 0.0, 256.0))
    assert level.forces_n[:, 0].sum() == 0
    along = footprint(tilted, SENSOR, Touch(0.0, 0.0, 0.0, 256.0, tilt_y_rad=-0.1))
    np.testing.assert_allclose(along.forces_n, 1.0)
    assert along.tilt_y_rad == -0.1


def test_no_force_is_an_exactly_zero_image():
    found = footprint(FlatPlate(), SENSOR, Touch(0.0, 0.0, 0.0, 0.0))
    assert not found.forces_n.any()
    assert found.z_mm == math.inf


@pytest.mark.parametrize(
    ("surface", "force", "named", "message"),
    [
        (FlatPlate(-math.inf), 1.0, {}, "nothing under the sensor"),
        (FlatPlate(math.nan), 1.0, {}, "no numbers"),
        (FlatPlate(), -1.0, {}, "not negative"),
        (FlatPlate(), math.nan, {}, "finite"),
        (FlatPlate(), 1.0, {"depth_mm": -1.0}, "depth of -1 mm"),
    ],
)
def test_what_gives_no_image_is_refused(surface, force, named, message):
    with pytest.raises(ContactError, match=message):
        footprint(surface, SENSOR, Touch(0.0, 0.0, 0.0, force), **named)
