"""Templates out of the cache, crosses about their middle, and how an overlay presses.

Round faces under the sensor are in the corpus `answers`.
"""

import math
from dataclasses import fields, replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from generator.alphabet.strokes import Glyph
from recognizer.touch import prepare
from recognizer.touch.prepare import template_and_bank
from recognizer.touch.symbols.image import pressing_of
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
