"""Engines of contact: MuJoCo's and Drake's against numbers worked by hand, and our own."""

from __future__ import annotations

import math
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from reference.indenters import Formula, block
from scipy.optimize import brentq

from encoded_objects.base.errors import MissingExtraError
from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.engines import engine_named
from probe.contact.meshes import AROUND_MM, DEEP_MM, mesh_under
from probe.contact.mujoco import DEEPEST_MM, STIFFER
from probe.contact.tips import Tips
from probe.errors import ProbeError
from probe.surface.indenters import FlatPlate
from probe.surface.mesh import mesh

RIGID = WristStiffness(math.inf, math.inf)
TIPS = Tips(points=7)
SENSOR = SensorType()


def compression_mm(force_n, overlay=SENSOR.overlay):
    """Return how far one tab is pressed by a force: neo-Hookean, of MuJoCo's stiffer elastomer."""
    area = math.pi * overlay.tab_diameter_mm**2 / 4
    modulus = STIFFER * overlay.young_mpa * DEEPEST_MM / overlay.height_mm

    def miss(c):
        stretch = 1 - c / DEEPEST_MM
        return modulus * area / 3 * (stretch**-2 - stretch) - force_n

    return brentq(miss, 0, 0.9 * DEEPEST_MM)


DRAKE = pytest.param(
    "drake",
    marks=pytest.mark.skipif(
        find_spec("pydrake") is None, reason="pip install 'encoded-objects[drake]'"
    ),
)


@pytest.fixture(scope="module", params=["mujoco", DRAKE])
def press(request):
    return engine_named(request.param).press


def test_a_plane_bears_all_tabs_alike(press):
    plate = mesh(block((-30, -30, -5), (30, 30, 0)))
    found = press(plate, SENSOR, Touch(0, 0, 0.3, 100.0, wrist=RIGID), TIPS)
    assert found.forces_n.sum() == pytest.approx(100, rel=2e-3)
    assert found.forces_n == pytest.approx(np.full((16, 16), 100 / 256), rel=5e-3)
    deep = compression_mm(100 / 256) if found.level == "mujoco" else 0.2  # as Drake's are stiffened
    assert -found.z_mm == pytest.approx(deep, rel=5e-3)


def test_an_engine_that_is_not_installed_says_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pydrake", None)
    monkeypatch.delitem(sys.modules, "probe.contact.drake", raising=False)
    with pytest.raises(MissingExtraError, match=r"engine drake needs pydrake.*objects\[drake\]"):
        engine_named("drake")


def test_the_touch_turns_the_sensor_not_the_image(press):
    # A block under x > 3, y > 5 of the surface; the sensor's +x points along the surface's +y.
    corner = mesh(block((3, 5, -2), (30, 30, 0)))
    centres = SENSOR.centres_mm()
    for theta, x, y in (
        (0, centres[..., 0], centres[..., 1]),
        (math.pi / 2, -centres[..., 1], centres[..., 0]),
    ):
        forces = press(corner, SENSOR, Touch(0, 0, theta, 20.0, wrist=RIGID), TIPS).forces_n
        assert (forces[(x > 3.7) & (y > 5.7)] > 0.1).all()
        assert not forces[(x < 2.3) | (y < 4.3)].any()


def heights_alone(surface):
    """Return a surface of which nothing but its heights is known."""
    return Formula(lambda x, y: surface.heights_mm(np.stack([x, y], axis=1)), surface.top_mm)


def test_only_what_lies_under_the_sensor_is_kept():
    part = mesh(block((-90, -90, -40), (90, 90, 0)))
    reach, deep = 12.7 + AROUND_MM, DEEP_MM
    # A body is cut; heights are closed by a floor deep enough for what is cut off.
    for surface, under, count in ((part, deep, 12), (heights_alone(part), 2 * deep, 12)):
        corners, faces = mesh_under(surface, SENSOR, Touch(50, 0, 0, 1.0))
        low, high = corners.min(axis=0), corners.max(axis=0)
        assert low == pytest.approx([50 - reach, -reach, -under], abs=1e-4)
        assert high == pytest.approx([50 + reach, reach, 0], abs=1e-4)
        assert len(faces) == count


@pytest.mark.parametrize(
    ("surface", "sensor", "touch", "says"),
    [
        (FlatPlate(-math.inf), SENSOR, Touch(0, 0, 0, 10.0), "nothing under the sensor"),
        (None, SensorType(overlay=Overlay(kind="pad")), Touch(0, 0, 0, 10.0), "knows tabs"),
        (None, SENSOR, Touch(500, 0, 0, 10.0), "nothing under the sensor"),
        (None, SENSOR, Touch(0, 0, 0, -1.0), "must be finite"),
    ],
)
def test_what_cannot_be_touched_is_refused(press, surface, sensor, touch, says):
    given = surface or mesh(block((-30, -30, -5), (30, 30, 0)))
    with pytest.raises(ProbeError, match=says):
        press(given, sensor, touch, TIPS)
