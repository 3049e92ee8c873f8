"""The laws of a tab and the layer against finite elements in space."""

import math

import numpy as np
import pytest
from reference.elements import COVERED, ELEMENTS, STRAINS
from reference.indenters import paraboloid

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch
from probe.contact.layer import layer
from probe.contact.neo_hooke import NeoHooke
from probe.contact.tabs import SKIN


@pytest.mark.parametrize(("height", "allowed"), [(1, 0.14), (2, 0.08)])
def test_tab_law_to_half_its_height(height, allowed):
    area = math.pi * Overlay().tab_diameter_mm ** 2 / 4
    found, _ = NeoHooke(area / height, height)(STRAINS * height)
    assert found == pytest.approx(np.array(ELEMENTS[f"tab {height} mm"]), rel=allowed)


def test_partly_covered_tab_bears_less_than_all_and_more_than_its_share():
    found = COVERED * (1 + SKIN) / (1 + SKIN * COVERED)
    # .0303 less at three quarters
    assert found == pytest.approx(np.array(ELEMENTS["tab covered"]), abs=0.031)


def test_layer_agrees_with_elements_in_space():
    touch = Touch(-2.0, 1.1, 0.4, 60.0, 0.01, -0.02)
    found = layer(paraboloid(60.0), SensorType(overlay=Overlay(kind="pad")), touch)
    told = ELEMENTS["paraboloid"]
    truth, (z, *tilts) = np.array(told["forces_n"]), told["plate"]
    inner = np.s_[1:-1, 1:-1]  # the outermost bear what the endless layer has beyond them, too
    error = np.linalg.norm((found.forces_n - truth)[inner])
    assert error <= 5e-3 * np.linalg.norm(truth[inner])
    assert found.z_mm == pytest.approx(z, rel=2e-3)
    assert (found.tilt_x_rad, found.tilt_y_rad) == pytest.approx(tilts, abs=1e-4)
