"""Round faces under the sensor: the image with its bend, and the bend from forces alone."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.surface.face import endless_face
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.curvature import guess_curvatures
from recognizer.touch.symbols.image import Image, image_of_signal, pressing_of

SENSOR = SensorType()
INK = 0.35  # about the mean response of the symbols of the default alphabet
BARS = ((((-0.9, 0.9), (0.9, 0.9)), ((-0.9, -0.9), (0.9, -0.9))),)  # fmt: skip


def image(forces: np.ndarray) -> Image:
    signal = Signal(forces, np.ones(forces.shape), contact=True, newtons=True)
    return image_of_signal(SENSOR, signal, SimpleNamespace(ink=INK), 1.0)


class Rolled:
    """Symbols all over a cylinder that touches the plane along a line through the origin."""

    top_mm = 1.0

    def __init__(self, radius_mm: float, towards_rad: float) -> None:
        self.bend = Bend(radius_mm, towards_rad)
        self.face = endless_face([[0]], BARS)

    def heights_mm(self, points_mm: np.ndarray) -> np.ndarray:
        return self.face.heights_mm(points_mm) - self.bend.falls_mm(points_mm)


def test_how_an_overlay_presses_by_its_kind():
    tab, pad = SENSOR, SENSOR.with_overlay("pad")
    area = math.pi * (tab.overlay.tab_diameter_mm / 2) ** 2
    for sensor, each in ((tab, area), (pad, pad.pitch_mm**2)):
        law = pressing_of(sensor, 0.9)
        assert law.hardens is (sensor is tab)
        assert law.scale == pytest.approx(sensor.overlay.young_mpa * each / 3)
        assert law.symbol == pytest.approx(0.9 / sensor.overlay.height_mm)
        depths = np.array([0.1, 0.4])
        np.testing.assert_allclose(law.depth(law.force(depths)), depths)
    np.testing.assert_allclose(law.force(np.array([-0.5, 0.1, 0.4])), [0.0, 0.3, 1.2])


@pytest.mark.parametrize("radius", [20.0, 40.0, 80.0])
@pytest.mark.parametrize("degrees", [0.0, 37.0, 90.0, 141.0])
def test_forces_tell_along_which_line_a_cylinder_lies(radius, degrees):
    surface = Rolled(radius, math.radians(degrees))
    forces = press(surface, SENSOR, Touch(0, 0, 0, 60.0)).forces_n
    found = guess_curvatures(image(forces), SENSOR, (20.0, 40.0, 80.0), 3)
    assert 1 <= len(found) <= 3
    turns = [math.remainder(b.bend.towards_rad - math.radians(degrees), math.pi) for b in found]
    assert min(map(abs, turns)) < math.radians(12)
    assert found[0].left <= found[-1].left
    assert np.isfinite(found[0].gain).all()
