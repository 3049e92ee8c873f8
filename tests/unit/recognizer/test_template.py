"""Templates out of the cache, crosses about their middle, and round faces under the sensor."""

import math
from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from generator.alphabet.strokes import Glyph
from generator.database.registered import Bend
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.surface.face import endless_face
from recognizer.touch import prepare
from recognizer.touch.prepare import template_and_bank
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.curvature import guess_curvatures
from recognizer.touch.symbols.image import image_of_signal, pressing_of
from recognizer.touch.symbols.search import bank_of
from recognizer.touch.symbols.template import template_of

SENSOR = SensorType()
CASE = (alphabet_named("dense-4"), SymbolStyle(), SENSOR)


def same(one, other):
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        assert np.array_equal(a, b), field.name
        assert np.asarray(a).dtype == np.asarray(b).dtype, field.name


def test_kept_as_worked_out(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    felt = template_of(*CASE)
    bank = bank_of(felt, CASE[2])
    for _ in range(2):
        template_and_bank.cache_clear()
        kept, kept_bank = template_and_bank(*CASE)
        same(kept, felt)
        same(kept_bank, bank)
        assert not kept.rimmed.flags.writeable
        monkeypatch.setattr(prepare, "template_of", None)  # the second time it is read
    template_and_bank.cache_clear()


STYLE = SymbolStyle(pitch_mm=7.0, height_mm=1.0, stroke_mm=1.4)
PLUS = (((-1.0, 0.0), (1.0, 0.0)), ((0.0, -1.0), (0.0, 1.0)))


@pytest.mark.parametrize("pitch_mm", [1.5875, 1.6, 2.0])  # odd and even numbers of grid steps
def test_crosses_are_felt_about_their_middle(pitch_mm):
    """A plate of crosses looks the same after half a turn, and so does what a pad feels of it."""
    dense = alphabet_named("dense-4")
    crosses = replace(dense, glyphs=(Glyph("+", PLUS),))
    sensor = replace(SENSOR.with_overlay("pad"), pitch_mm=pitch_mm)
    template = template_of(crosses, STYLE, sensor)
    psi = template.values[:, :, 0, 0].astype(float)
    felt = np.expm1(psi * math.log(4))
    axis = (np.arange(template.size) - (template.size - 1) / 2) * template.step_mm
    inner = np.abs(axis) < 3.0
    part = felt[np.ix_(inner, inner)] - felt[np.ix_(inner, inner)].min()
    x = (part.sum(axis=0) * axis[inner]).sum() / part.sum()
    y = (part.sum(axis=1) * axis[inner]).sum() / part.sum()
    assert math.hypot(x, y) < 0.1 * template.step_mm
    assert np.abs(felt - felt[::-1, ::-1]).max() < 0.02 * felt.max()


INK = 0.35  # about the mean response of the symbols of the default alphabet
BARS = ((((-0.9, 0.9), (0.9, 0.9)), ((-0.9, -0.9), (0.9, -0.9))),)  # fmt: skip


class Rolled:
    """Symbols all over a cylinder that touches the plane along a line through the origin."""

    top_mm = 1.0

    def __init__(self, radius_mm, towards_rad):
        self.bend = Bend(radius_mm, towards_rad)
        self.face = endless_face([[0]], BARS)

    def heights_mm(self, points_mm):
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
    signal = Signal(forces, np.ones(forces.shape), contact=True, newtons=True)
    image = image_of_signal(SENSOR, signal, SimpleNamespace(ink=INK), 1.0)
    found = guess_curvatures(image, SENSOR, (20.0, 40.0, 80.0), 3)
    assert 1 <= len(found) <= 3
    turns = [math.remainder(b.bend.towards_rad - math.radians(degrees), math.pi) for b in found]
    assert min(map(abs, turns)) < math.radians(12)
    assert found[0].left <= found[-1].left
    assert np.isfinite(found[0].gain).all()
