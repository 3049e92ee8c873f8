"""Depths, forces and loads of an image: the law written out again, number by number."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from recognizer.touch.symbols.image import (
    Image,
    Pressing,
    deep_gain,
    first_gain,
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


Y, X = np.indices((SIDE, SIDE))
ACROSS, UP = (X - HALF) / HALF, (HALF - Y) / HALF
PEAKS = (X % 2 == 1) & (Y % 2 == 0)


def image(forces, *, newtons=True, trust=None, loaded=None, ink=0.5):
    points = HALF * np.column_stack([ACROSS.ravel(), UP.ravel()])
    return Image(
        points_mm=points,
        forces=np.ravel(forces).astype(float),
        trust=np.ones(SIDE * SIDE) if trust is None else np.ravel(trust),
        shape=(SIDE, SIDE),
        pressing=Pressing(hardens=True, symbol=SYMBOL, deepest=DEEPEST, scale=SCALE),
        newtons=newtons,
        plane=np.column_stack([np.ones(len(points)), points / HALF]),
        falls=None,
        template=SimpleNamespace(ink=ink),
        loaded=np.ones(SIDE * SIDE, np.bool_) if loaded is None else np.ravel(loaded),
    )


def depths(gain):
    return gain[1] + gain[2] * ACROSS + gain[3] * UP


@pytest.mark.parametrize("newtons", [True, False])
@pytest.mark.parametrize("plane", [(2.0, 0.3, -0.2), (0.6, -0.1, 0.07)])
def test_symbols_all_over_give_the_plane_that_pressed_them(newtons, plane):
    ink = 0.4
    forces = ink * (plane[0] + plane[1] * ACROSS + plane[2] * UP)
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


def pressed(gain, on_symbol, on_face):
    """Forces of a plate under a gain, and nothing where neither a symbol nor the face is."""
    forces = np.vectorize(force)
    depth = depths(gain)
    felt = np.where(on_symbol, forces(depth), np.where(on_face, forces(depth - SYMBOL), 0.0))
    return math.exp(gain[0]) * felt


def test_a_plate_that_comes_down_on_the_bare_face_gives_its_tilt():
    gain = np.array([math.log(SCALE), 0.45, -0.3, 0.02])
    left = X < SIDE / 2
    forces = pressed(gain, ~left & PEAKS, left)
    np.testing.assert_allclose(tilted_gain(image(forces)), gain, atol=2e-3)
    turned = tilted_gain(image(forces[:, ::-1]))
    np.testing.assert_allclose(turned, gain * [1, 1, -1, 1], atol=2e-3)


def test_one_plane_goes_through_symbols_and_the_bare_face():
    gain, loaded = np.array([math.log(SCALE), 0.6, 0.25, -0.1]), X < 11
    forces = pressed(gain, PEAKS & loaded, loaded)
    found = deep_gain(image(forces, loaded=loaded))
    assert found[0] == pytest.approx(gain[0])
    np.testing.assert_allclose(found[1:], gain[1:], atol=0.08)
    turned = deep_gain(image(forces[:, ::-1], loaded=loaded[:, ::-1]))
    np.testing.assert_allclose(turned, found * [1, 1, -1, 1], atol=1e-9)
