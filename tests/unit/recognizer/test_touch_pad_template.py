"""A pad's template against what must be so whatever computes it: a plate that is symmetric."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import SymbolStyle, alphabet_named
from generator.alphabet.strokes import Glyph
from recognizer.touch.symbols.template import template_of

STYLE = SymbolStyle(pitch_mm=7.0, height_mm=1.0, stroke_mm=1.4)
PLUS = (((-1.0, 0.0), (1.0, 0.0)), ((0.0, -1.0), (0.0, 1.0)))


@pytest.mark.parametrize("pitch_mm", [1.5875, 1.6, 2.0])  # odd and even numbers of grid steps
def test_crosses_are_felt_about_their_middle(pitch_mm):
    """A plate of crosses looks the same after half a turn, and so does what a pad feels of it."""
    dense = alphabet_named("dense-4")
    crosses = replace(dense, glyphs=(Glyph("+", PLUS),))
    sensor = replace(SensorType().with_overlay("pad"), pitch_mm=pitch_mm)
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
