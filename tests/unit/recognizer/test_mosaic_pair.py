"""One simulated touch against another: where it lies, or why that cannot be told."""

from __future__ import annotations

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.surface.face import endless_face
from recognizer.scan.mosaic.patch import patch_of
from recognizer.scan.mosaic.planar import compose_poses, inverse
from recognizer.scan.mosaic.register import AMBIGUOUS, APART, CONSTANT, NOISE, register_patches
from recognizer.touch.options import ReaderOptions
from recognizer.touch.signal import signal_of

SENSOR = SensorType()
P = SENSOR.pitch_mm
DEG = math.pi / 180
GLYPHS = (
    (((-1, 1), (-1, -1)), ((-1, -1), (1, -1))),
    (((1, -1), (-1, -1)), ((-1, -1), (-1, 0)), ((-1, 0), (0, 1)), ((0, -1), (0, 0))),
    (((-1, -1), (0, -1)), ((0, -1), (0, 0)), ((0, 0), (1, 1)), ((0, 0), (-1, 0))),
    (((-1, 1), (-1, -1)), ((-1, -1), (1, -1)), ((1, -1), (1, 1))),
)
A = np.array([41.3, 52.9, 0.35])
BELIEF = np.diag([P**2, P**2, (0.5 * DEG) ** 2])

FELT = ReaderOptions(contact_counts=0.1)  #: of newtons without a calibration


class Ridges:
    """Ridges across one direction, unevenly spaced."""

    top_mm = 0.0

    def __init__(self, angle, uneven=True):
        self.across = np.array([math.cos(angle), math.sin(angle)])
        self.shifts = np.random.default_rng(5).uniform(-0.3, 0.3, 99) * uneven

    def heights_mm(self, points):
        u = points @ self.across / 7
        k = np.floor(u).astype(int)
        return np.where(np.abs(u - k - 0.5 - self.shifts[k % 99]) < 0.16, 0.0, -1.0)


def symbols(seed=0, alike=False):
    labels = np.random.default_rng(seed).integers(0, 4, (23, 25))
    return endless_face(labels * 0 if alike else labels, GLYPHS, pitch_mm=7.0, unit_mm=0.26 * 7)


def felt(surface, pose, seed=0, trust=None, force=80.0):
    rng = np.random.default_rng(seed)
    forces = tabs(surface, SENSOR, Touch(*pose, force)).forces_n
    noisy = forces * np.exp(np.random.default_rng(9).normal(0, 0.1, (16, 16)))
    noisy = np.maximum(noisy + rng.normal(0, 0.02, (16, 16)), 0)
    if trust is not None:
        noisy = np.where(trust > 0, noisy, 0.0)
    return patch_of(SENSOR, signal_of(noisy, trust=trust, floor=0.0, options=FELT))


def two(surface, true, **options):
    return felt(surface, A, 1, **options), felt(
        surface, compose_poses(A, np.array(true)), 2, **options
    )


@pytest.mark.parametrize("seed", range(3))
def test_symbols_lock_to_a_tenth_of_a_tactel(seed):
    rng = np.random.default_rng(seed)
    true = np.array([4.25 * P, 0.3 * P, 0.5 * DEG]) + rng.normal(0, [1, 1, 0.003])
    found = register_patches(
        *two(symbols(seed), true), true + np.array([1.0, -1.2, 0.01]), BELIEF, period_mm=7
    )
    assert found
    assert found.rank == 3
    assert math.hypot(*(found.pose - true)[:2]) < 0.15 * P
    assert abs(found.pose[2] - true[2]) < 0.6 * DEG
    away = found.pose - true
    assert away @ np.linalg.solve(found.covariance, away) < 16
    assert found.gain == pytest.approx(1.0, abs=0.25)


def test_the_other_way_round_it_is_the_inverse():
    true = np.array([5.0, -3.0, 0.02])
    a, b = two(symbols(1), true)
    there = register_patches(a, b, true + np.array([0.5, 0.5, 0]), BELIEF, period_mm=7)
    back = register_patches(b, a, inverse(true + np.array([0.5, 0.5, 0])), BELIEF, period_mm=7)
    assert inverse(back.pose)[:2] == pytest.approx(there.pose[:2], abs=0.05)


def test_dead_tactels_and_a_dead_row_stay_out():
    trust = np.ones((16, 16))
    trust[5, :] = trust[2, 3] = trust[11, 9] = 0
    true = np.array([4.0, 5.0, 0.0])
    found = register_patches(
        *two(symbols(2), true, trust=trust), true + np.array([1, 1, 0]), BELIEF, period_mm=7
    )
    assert found
    assert math.hypot(*(found.pose - true)[:2]) < 0.2 * P


def test_a_stronger_touch_is_a_gain():
    surface, true = symbols(3), np.array([3.0, 0.0, 0.0])
    a, b = felt(surface, A, 1, force=30.0), felt(surface, compose_poses(A, true), 2, force=60.0)
    assert register_patches(a, b, true, BELIEF).gain == pytest.approx(0.5, rel=0.15)


@pytest.mark.parametrize("angle", [0.0, 0.6, 1.9])
def test_ridges_define_the_motion_across_them(angle):
    true = np.array([3.0, 2.0, 0.01])
    off = np.array([0.8, -0.6, 0.003])
    found = register_patches(*two(Ridges(angle), true), true + off, BELIEF, period_mm=math.inf)
    assert found
    assert found.rank == 2
    local = angle - A[2]
    across = np.array([math.cos(local), math.sin(local), 0.0])
    along = np.array([-math.sin(local), math.cos(local), 0.0])
    assert abs(across @ (found.pose - true)) < 0.2 * P
    assert along @ (found.pose - true - off) == pytest.approx(0, abs=0.15)  # as believed
    assert 0.5 * P**2 < along @ found.covariance @ along < 1.01 * P**2
    assert across @ found.covariance @ across < (0.2 * P) ** 2


def test_one_pitch_away_all_looks_the_same():
    true = np.array([3.0, 2.0, 0.0])
    pair = two(symbols(alike=True), true)
    wide = np.diag([(2.5 * P) ** 2, (2.5 * P) ** 2, (0.3 * DEG) ** 2])
    found = register_patches(*pair, true + np.array([2.5, -2.0, 0]), wide, period_mm=7)
    assert found.reason == AMBIGUOUS
    assert (found.pose == true + np.array([2.5, -2.0, 0])).all()
    near = register_patches(*pair, true + np.array([0.3, 0.2, 0]), BELIEF / 9, period_mm=7)
    assert near
    assert math.hypot(*(near.pose - true)[:2]) < 0.15 * P


def test_reasons_for_no_answer():
    rng = np.random.default_rng(0)
    flat = [patch_of(SENSOR, signal_of(70 + rng.normal(0, 2, (16, 16)), floor=0.0)) for _ in "ab"]
    assert register_patches(*flat, np.zeros(3), BELIEF).reason == CONSTANT
    nothing = patch_of(SENSOR, signal_of(np.zeros((16, 16))))
    assert register_patches(nothing, flat[0], np.zeros(3), BELIEF).reason == CONSTANT
    a, b = two(symbols(1), [3.0, 0.0, 0.0])
    assert register_patches(a, b, np.array([30.0, 0.0, 0.0]), BELIEF).reason == APART
    rough = [patch_of(SENSOR, signal_of(rng.exponential(9, (16, 16)), floor=0.0)) for _ in "ab"]
    refused = register_patches(*rough, np.zeros(3), BELIEF, period_mm=7)
    assert refused.reason == NOISE
    assert (refused.information == 0).all()
    assert math.isnan(refused.gain)
    assert not refused
