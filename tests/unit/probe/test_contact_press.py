"""The ladder behind one function: what it picks, and that the pick holds its error."""

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch
from probe.contact.press import AUTO_ERROR, LEVELS, accuracy_of, level_for, press, table
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.surface.indenters import RoughSurface, Washer

TAB, PAD = (SensorType(overlay=Overlay(kind=kind)) for kind in ("tab", "pad"))


@pytest.mark.parametrize("sensor", [TAB, PAD])
def test_pick_is_the_cheapest_that_holds_the_error(sensor):
    known = table()[sensor.overlay.kind]
    for error in [*(line.error for line in known), AUTO_ERROR, 0.1, 0.9]:
        level = level_for(sensor, error)
        picked = next(line for line in known if line.level == level)
        assert picked.error <= error
        assert all(line.ms >= picked.ms for line in known if line.error <= error)
    assert level_for(sensor) == level_for(sensor, AUTO_ERROR)


@pytest.mark.parametrize("sensor", [TAB, PAD])
def test_finer_is_measured_better_and_dearer(sensor):
    lines = table()[sensor.overlay.kind]
    assert [line.level for line in lines] == [*LEVELS[sensor.overlay.kind]]
    assert np.all(np.diff([line.error for line in lines]) < 0)
    assert np.all(np.diff([line.ms for line in lines]) > 0)


def test_errors_that_no_level_holds_are_refused_with_the_best():
    with pytest.raises(ContactError, match=r"no level holds.*layer-16"):
        level_for(PAD, 1e-9)


@pytest.mark.parametrize(("sensor", "name"), [(TAB, "layer"), (PAD, "tabs"), (PAD, "layer-5")])
def test_levels_of_another_overlay_are_refused(sensor, name):
    with pytest.raises(ContactError, match="no level"):
        press(Washer(), sensor, Touch(0, 0, 0, 10), accuracy=name)


@pytest.mark.parametrize(
    ("sensor", "accuracy", "level"),
    [
        (TAB, "footprint", "footprint"),
        (TAB, "tabs", "tabs"),
        (TAB, 0.05, "tabs"),
        (PAD, "layer", "layer"),
        (PAD, "auto", "layer"),
    ],
)
def test_every_level_carries_the_force(sensor, accuracy, level):
    contact = press(Washer(), sensor, Touch(0.4, -0.2, 0.3, 60.0), accuracy=accuracy)
    assert contact.level == level
    assert contact.forces_n.shape == (16, 16)
    assert contact.forces_n.sum() == pytest.approx(60.0, rel=1e-6)


def test_pick_holds_its_error_on_a_surface_that_was_not_measured():
    surface, touch = RoughSurface(seed=8, rms_mm=0.3, shortest_mm=2.0), Touch(3.0, 1.0, 1.1, 70.0)
    fine = tabs(surface, TAB, touch, Tips(127)).forces_n
    for error in (0.1, 0.05):
        found = press(surface, TAB, touch, accuracy=error).forces_n
        assert np.linalg.norm(found - fine) <= error * np.linalg.norm(fine)


def test_accuracy_is_read_from_text():
    assert accuracy_of("0.01") == 0.01
    assert accuracy_of("tabs-19") == "tabs-19"
    for text in ("0", "-1", "inf", "nan"):
        with pytest.raises(ContactError, match="error of"):
            accuracy_of(text)
    assert math.isfinite(AUTO_ERROR)
