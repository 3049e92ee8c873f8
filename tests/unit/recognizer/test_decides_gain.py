"""Depths, forces and loads of an image: the law written out again, number by number."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.sensor_state import unknown_state
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.image import (
    Image,
    Pressing,
    bend_image,
    deep_gain,
    find_loaded_area,
    first_gain,
    image_of_signal,
    pressing_of,
    tilted_gain,
)
from recognizer.touch.symbols.kernels import DEEPEST

SIDE = 16
HALF = SIDE / 2 - 0.5
SYMBOL, SCALE = 0.35, 2.5


def force(depth):
    """F of a tab: neo-Hookean, straight on beyond 0.8."""
    u = min(max(depth, 0.0), 0.8)
    return (1 - u) ** -2 - (1 - u) + max(depth - 0.8, 0.0) * (2 * (1 - u) ** -3 + 1)


def slope(depth):
    return 2 * (1 - depth) ** -3 + 1


def test_how_an_overlay_presses_by_its_kind():
    tab, pad = SensorType(), SensorType().with_overlay("pad")
    pad = replace(pad, overlay=replace(pad.overlay, young_mpa=0.6))
    law = pressing_of(tab, 0.9)
    area = math.pi * (tab.overlay.tab_diameter_mm / 2) ** 2
    assert law.hardens
    assert law.scale == pytest.approx(tab.overlay.young_mpa * area / 3)
    assert law.symbol == pytest.approx(0.9 / tab.overlay.height_mm)
    law = pressing_of(pad, 0.9)
    assert not law.hardens
    assert law.scale == pytest.approx(0.6 * pad.pitch_mm * pad.pitch_mm / 3)
    depths = np.array([-0.5, 0.1, 0.4])
    np.testing.assert_allclose(law.force(depths), [0.0, 0.3, 1.2])
    np.testing.assert_allclose(law.slope(depths), [0.0, 3.0, 3.0])
    np.testing.assert_allclose(law.depth(law.force(depths[1:])), depths[1:])


def image(forces, *, newtons=True, trust=None, loaded=None, ink=0.5):
    y, x = np.indices((SIDE, SIDE)).reshape(2, -1)
    points = np.column_stack([x - HALF, HALF - y]).astype(float)
    return Image(
        points_mm=points,
        forces=np.asarray(forces, float).ravel(),
        trust=np.ones(SIDE * SIDE) if trust is None else np.asarray(trust, float).ravel(),
        shape=(SIDE, SIDE),
        pressing=Pressing(hardens=True, symbol=SYMBOL, deepest=DEEPEST, scale=SCALE),
        newtons=newtons,
        plane=np.column_stack([np.ones(len(points)), points / HALF]),
        falls=None,
        template=SimpleNamespace(ink=ink),
        loaded=np.ones(SIDE * SIDE, np.bool_) if loaded is None else loaded,
    )


def depths(gain):
    y, x = np.indices((SIDE, SIDE)).reshape(2, -1)
    return gain[1] + gain[2] * (x - HALF) / HALF + gain[3] * (HALF - y) / HALF


@pytest.mark.parametrize("newtons", [True, False])
@pytest.mark.parametrize("plane", [(2.0, 0.3, -0.2), (0.6, -0.1, 0.07)])
def test_symbols_all_over_give_the_plane_that_pressed_them(newtons, plane):
    ink = 0.4
    x, y = (np.indices((SIDE, SIDE))[axis] for axis in (1, 0))
    forces = ink * (plane[0] + plane[1] * (x - HALF) / HALF + plane[2] * (HALF - y) / HALF)
    trust = np.ones((SIDE, SIDE))
    forces[3, 4], trust[3, 4] = 900.0, 0.0  # a bad tactel
    found = first_gain(image(forces, newtons=newtons, trust=trust, ink=ink))
    scale = SCALE if newtons else plane[0] / force(0.25)
    assert found[0] == pytest.approx(math.log(scale))
    assert force(found[1]) * scale == pytest.approx(plane[0], rel=1e-3)
    if not newtons:
        assert found[1] == pytest.approx(0.25, abs=1e-4)
    steep = scale * slope(found[1])
    assert found[2:] == pytest.approx([plane[1] / steep, plane[2] / steep], rel=1e-3)


def test_where_nothing_presses_there_is_no_gain():
    assert first_gain(image(np.zeros((SIDE, SIDE)), ink=0.5)) is None
    assert first_gain(image(-np.ones((SIDE, SIDE)), ink=0.5)) is None


def tilted(gain):
    """Forces of a plate that comes down on the bare face on the left, on symbols on the right."""
    depth = depths(gain).reshape(SIDE, SIDE)
    y, x = np.indices((SIDE, SIDE))
    left = x < SIDE / 2
    tops = ~left & (x % 2 == 1) & (y % 2 == 0)
    forces = [
        math.exp(gain[0]) * (force(u - SYMBOL) if on_face else force(u) if top else 0.0)
        for u, on_face, top in zip(depth.ravel(), left.ravel(), tops.ravel(), strict=True)
    ]
    return np.array(forces).reshape(SIDE, SIDE)


def test_a_plate_that_comes_down_on_the_bare_face_gives_its_tilt():
    gain = np.array([math.log(SCALE), 0.45, -0.3, 0.02])
    found = tilted_gain(image(tilted(gain)))
    np.testing.assert_allclose(found, gain, atol=2e-3)
    left = tilted_gain(image(tilted(gain)[:, ::-1]))
    np.testing.assert_allclose(left, [gain[0], gain[1], -gain[2], gain[3]], atol=2e-3)


COLUMN = np.tile(np.arange(SIDE), (SIDE, 1))
ROW = COLUMN.T
PEAKS = (COLUMN % 2 == 1) & (ROW % 2 == 0)


def test_tips_of_a_learned_sensor_stand_elsewhere_and_scatter_as_learned():
    sensor = SensorType()
    state = unknown_state(sensor)
    deviation, aside = state.aside_deviation_mm.copy(), np.zeros((16, 16, 2))
    deviation[2, 5] = 0.03, 0.09  # of .15 each way before
    aside[2, 5] = 0.1, -0.2
    state = replace(state, aside_mm=aside, aside_deviation_mm=deviation)
    plain = Signal(np.ones((16, 16)), np.ones((16, 16)), contact=True, newtons=False)
    flat, found = (
        image_of_signal(sensor, replace(plain, state=one), None, 1.0) for one in (None, state)
    )
    moved = found.points_mm - flat.points_mm
    np.testing.assert_allclose(moved[37], [0.1, -0.2], atol=1e-12)
    assert np.count_nonzero(moved) == 2
    assert found.aside[36:38] == pytest.approx([1.0, (0.2**2 + 0.6**2) / 2])
    bent = [bend_image(one, sensor, Bend(40.0, 0.0)).points_mm for one in (flat, found)]
    assert np.abs(bent[1] - bent[0])[37].min() > 0.09
    assert np.count_nonzero(bent[1] - bent[0]) == 2


GAIN = np.array([math.log(SCALE), 0.6, 0.25, -0.1])
LOADED = (COLUMN < 11).ravel()


def test_one_plane_goes_through_symbols_and_the_bare_face():
    edge = np.array(
        [
            SCALE * force(u if top else u - SYMBOL) if here else 0.0
            for u, top, here in zip(depths(GAIN), PEAKS.ravel(), LOADED, strict=True)
        ]
    )
    found = deep_gain(image(edge, loaded=LOADED))
    assert found[0] == pytest.approx(GAIN[0])
    np.testing.assert_allclose(found[1:], GAIN[1:], atol=0.08)
    forces, loaded = (one.reshape(SIDE, SIDE)[:, ::-1] for one in (edge, LOADED))
    mirrored = deep_gain(image(forces, loaded=loaded.ravel()))
    np.testing.assert_allclose(mirrored, found * [1, 1, -1, 1], atol=1e-9)


def test_gaps_between_strokes_are_loaded_and_what_lies_beyond_them_is_not():
    forces, truth = np.zeros((SIDE, SIDE)), np.zeros((SIDE, SIDE), np.bool_)
    forces[:10:3, :7:3] = 100.0
    truth[:10, :7] = True
    known = np.ones((SIDE, SIDE))
    found = find_loaded_area(SensorType(), Signal(forces, known, True, False, 1.0))
    np.testing.assert_array_equal(found, truth)
