"""Scans of simulated symbols: without and with decoded places, blank, wrong, by steps."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.surface.face import endless_face
from recognizer.errors import MosaicError
from recognizer.scan.mosaic.grow import add_touch, mosaic_of, settle_mosaic
from recognizer.scan.mosaic.mosaic import ALONE, no_touches, outliers
from recognizer.scan.mosaic.planar import PlacedTouch, compose_poses, planar_belief, relative_pose
from recognizer.scan.mosaic.register import AMBIGUOUS, CONSTANT
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
SPREAD = (1.0 * P, 1.0 * P, 0.3 * DEG)
DECODED = (0.03, 0.03, 0.1 * DEG)
T_FACE_ARM = np.array([60.0, 35.0, 0.4])

FELT = ReaderOptions(contact_counts=0.1)  #: of newtons without a calibration


@lru_cache
def scanned(n=4):
    """Places on the face, and what is felt there."""
    rng = np.random.default_rng(8)
    labels = rng.integers(0, 4, (23, 25))
    face = endless_face(labels, GLYPHS, pitch_mm=7.0, unit_mm=0.26 * 7)
    gains = np.exp(rng.normal(0, 0.1, (16, 16)))
    poses, signals = [], []
    for k in range(n * n):
        row, column = divmod(k, n)
        pose = compose_poses(T_FACE_ARM, np.array([column, -row, 0.0]) * 4.25 * P)
        pose = pose + rng.normal(0, SPREAD)
        forces = tabs(face, SENSOR, Touch(*pose, 80.0)).forces_n * gains
        forces = np.maximum(forces + rng.normal(0, 0.02, (16, 16)), 0)
        poses.append(pose)
        signals.append(signal_of(forces, floor=0.0, options=FELT))
    return np.array(poses), tuple(signals)


def touches(decoded=(), wrong=(), n=4):
    """The arm believes the raster; some touches were decoded, some of them wrongly."""
    true, signals = scanned(n)
    rng = np.random.default_rng(5)
    found = []
    for k, signal in enumerate(signals):
        row, column = divmod(k, n)
        believed = planar_belief(np.array([column, -row, 0.0]) * 4.25 * P, SPREAD)
        place = true[k] + rng.normal(0, DECODED) + np.array([21.0, 7.0, 0.0]) * (k in wrong)
        read = planar_belief(place, DECODED) if k in decoded else None
        found.append(PlacedTouch(signal, believed, read, seq=k))
    return found


def errors(mosaic, which=slice(None)):
    """Tactels."""
    true, _ = scanned()
    return np.hypot(*(mosaic.poses[which] - true[which])[:, :2].T) / P


def shape_error(mosaic):
    true, _ = scanned()
    a, b = mosaic.poses[:, :2], true[:, :2]
    z, w = (p[:, 0] + 1j * p[:, 1] - complex(*p.mean(axis=0)) for p in (a, b))
    turn = np.vdot(z, w)
    return np.sqrt(np.mean(np.abs(w - z * turn / abs(turn)) ** 2)) / P


def test_by_images_alone_the_shape_is_right():
    mosaic = mosaic_of(SENSOR, touches())
    assert not mosaic.on_face
    assert set(mosaic.reasons) == {""}
    assert shape_error(mosaic) < 0.07
    assert outliers(mosaic) == []
    assert (np.linalg.eigvalsh(mosaic.covariances) > 0).all()
    image = mosaic.image
    assert image.count.max() >= 9
    assert (image.error[image.known] > 0).all()
    middle = image.count >= 6
    assert np.median(image.deviation[middle]) < 0.4 * image.values[middle].std()


def test_a_few_decoded_touches_place_all_on_the_face():
    mosaic = mosaic_of(SENSOR, touches(decoded=(6, 9)))
    assert mosaic.on_face
    assert errors(mosaic).max() < 0.25
    assert np.sqrt(np.mean(errors(mosaic) ** 2)) < 0.12
    assert mosaic.arm[:2] == pytest.approx(T_FACE_ARM[:2], abs=2.0)
    away = mosaic.poses - scanned()[0]
    chi2 = np.einsum("ni,nij,nj->n", away, np.linalg.inv(mosaic.covariances), away)
    assert (chi2 < 16.3).mean() > 0.9


def test_where_all_are_decoded_they_stay():
    mosaic = mosaic_of(SENSOR, touches(decoded=range(16)))
    assert np.sqrt(np.mean(errors(mosaic) ** 2)) < 0.04


@pytest.mark.parametrize("wrong", [0, 10])
def test_a_wrongly_decoded_touch_is_named(wrong):
    mosaic = mosaic_of(SENSOR, touches(decoded=(0, 3, 6, 9, 10, 13), wrong=(wrong,)))
    named = [o.constraint.b for o in outliers(mosaic) if o.constraint.kind == "decoded"]
    assert named == [wrong]
    assert errors(mosaic).max() < 0.3


def test_one_by_one_is_nearly_all_at_once_and_a_value():
    mosaic, before = no_touches(SENSOR), []
    for touch in touches(decoded=(5,))[:9]:
        before.append((mosaic, mosaic.poses.copy(), len(mosaic.canvas.tiles)))
        mosaic = add_touch(mosaic, touch)
    for old, poses, tiles in before:
        assert (old.poses == poses).all()
        assert len(old.canvas.tiles) == tiles
    at_once = mosaic_of(SENSOR, touches(decoded=(5,))[:9])
    assert mosaic.poses == pytest.approx(at_once.poses, abs=0.05)
    assert settle_mosaic(at_once).poses == pytest.approx(at_once.poses, abs=1e-3)
    assert (np.trace(mosaic.covariances, axis1=1, axis2=2) > 0.99 * np.trace(
        at_once.covariances, axis1=1, axis2=2)).all()  # fmt: skip


def test_steps_do_not_drift():
    true, signals = scanned()
    rng = np.random.default_rng(3)
    spread = np.array([0.5 * P, 0.5 * P, 0.5 * DEG])
    some = [PlacedTouch(signals[0], planar_belief(true[0], DECODED))]
    counted = [true[0]]
    for k in range(1, 16):
        step = relative_pose(true[k - 1], true[k]) + rng.normal(0, spread)
        counted.append(compose_poses(counted[-1], step))
        some.append(PlacedTouch(signals[k], stepped=planar_belief(step, spread), seq=k))
    mosaic = mosaic_of(SENSOR, some)
    assert errors(mosaic).max() < 0.4
    assert errors(mosaic).max() < np.hypot(*(np.array(counted) - true)[:, :2].T).max() / P / 3


def test_blank_touches_stay_where_they_are_believed():
    rng = np.random.default_rng(1)
    flat = [
        signal_of(0.3 + rng.normal(0, 0.01, (16, 16)), floor=0.0, options=FELT) for _ in range(3)
    ]
    places = [planar_belief((k * 4.25 * P, 0.0, 0.0), SPREAD) for k in range(3)]
    some = [PlacedTouch(f, p, seq=k) for k, (f, p) in enumerate(zip(flat, places, strict=True))]
    mosaic = mosaic_of(SENSOR, some)
    assert mosaic.reasons == (CONSTANT,) * 3
    assert mosaic.poses == pytest.approx(np.array([p.pose for p in places]), abs=1e-6)
    assert mosaic.covariances[1] == pytest.approx(np.diag(np.square(SPREAD)), rel=1e-6)
    assert mosaic.image.count.max() == 3


def test_a_surface_that_repeats_is_ambiguous():
    face = endless_face(np.zeros((9, 9), int), GLYPHS, pitch_mm=7.0, unit_mm=0.26 * 7)
    wide = (2.5 * P, 2.5 * P, 0.3 * DEG)
    some = []
    for k in range(2):
        forces = tabs(face, SENSOR, Touch(30 + 6.0 * k, 40, 0.2, 80.0)).forces_n
        pose = planar_belief((6.0 * k * math.cos(0.2), -6.0 * k * math.sin(0.2), 0.0), wide)
        some.append(PlacedTouch(signal_of(forces, floor=0.0, options=FELT), pose, seq=k))
    mosaic = mosaic_of(SENSOR, some)
    assert mosaic.reasons == (ALONE, AMBIGUOUS)
    assert mosaic.poses[1] == pytest.approx(some[1].believed.pose, abs=1e-6)


def test_nothing_and_touches_that_cannot_be_placed():
    nothing = mosaic_of(SENSOR, [])
    assert len(nothing) == 0
    assert nothing.image.values.shape == (0, 0)
    small = signal_of(np.ones((8, 8)))
    with pytest.raises(MosaicError, match="8 x 8"):
        add_touch(nothing, PlacedTouch(small, planar_belief(np.zeros(3), SPREAD)))
    first, second = touches(decoded=(1,))[:2]
    decoded_only = PlacedTouch(second.signal, decoded=second.decoded)
    on_face, by_arm = add_touch(nothing, decoded_only), add_touch(nothing, first)
    with pytest.raises(MosaicError, match="without a frame"):
        add_touch(on_face, first)
    with pytest.raises(MosaicError, match="no pose by the arm"):
        add_touch(by_arm, decoded_only)
