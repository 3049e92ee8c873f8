"""Laws of poses in a plane, of the normalised correlation, and of the canvas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.canvas import CanvasEntry, add_to_canvas, empty_canvas, image_of
from recognizer.scan.mosaic.patch import patch_of
from recognizer.scan.mosaic.planar import compose_poses, inverse, relative_pose, transform_points
from recognizer.scan.mosaic.pose_graph import PLANE, Constraint, covariances, solve_pose_graph
from recognizer.scan.mosaic.search import KnownRaster, cross_correlate
from recognizer.touch.signal import signal_of

SENSOR = SensorType()
lengths = st.floats(-500, 500)
poses = st.tuples(lengths, lengths, st.floats(-math.pi, math.pi)).map(np.array)
seeds = st.integers(0, 2**32 - 1)


def same(a, b):
    away = a - b
    away[2] = math.remainder(away[2], 2 * math.pi)
    return np.abs(away).max() < 1e-9 * 1000


@given(poses, poses, poses)
def test_poses_are_a_group(a, b, c):
    assert same(compose_poses(compose_poses(a, b), c), compose_poses(a, compose_poses(b, c)))
    assert same(compose_poses(a, inverse(a)), np.zeros(3))
    assert same(compose_poses(a, relative_pose(a, b)), b)
    point = np.array([3.0, -4.0])
    assert transform_points(compose_poses(a, b), point) == pytest.approx(
        transform_points(a, transform_points(b, point)), abs=1e-8
    )


@given(seeds, st.floats(1e-3, 1e3), st.floats(-1e3, 1e3))
@settings(max_examples=20, deadline=None)
def test_gain_and_offset_leave_the_correlation_as_it_is(seed, gain, offset):
    rng = np.random.default_rng(seed)
    values, known = rng.normal(size=(14, 13)), rng.random((14, 13)) > 0.1
    image, seen = rng.normal(size=(9, 9)), rng.random((9, 9)) > 0.1
    wide = KnownRaster(values, known, 0, 0, 1)
    first, _ = cross_correlate(wide, KnownRaster(image, seen, 0, 0, 1))
    second, _ = cross_correlate(wide, KnownRaster(gain * image + offset, seen, 0, 0, 1))
    assert second == pytest.approx(first, abs=1e-4, nan_ok=True)
    assert np.nanmax(np.abs(first)) <= 1


@given(seeds, st.lists(poses, min_size=1, max_size=3))
@settings(max_examples=8, deadline=None)
def test_the_order_of_touches_does_not_matter_to_the_canvas(seed, places):
    rng = np.random.default_rng(seed)
    sure = np.diag([1e-3, 1e-3, 1e-6])
    patches = [patch_of(SENSOR, signal_of(rng.uniform(0, 9, (16, 16)))) for _ in places]
    entries = [CanvasEntry(pose, sure, 1.0) for pose in places]
    some = list(zip(patches, entries, strict=True))
    there, back = empty_canvas(SENSOR.pitch_mm), empty_canvas(SENSOR.pitch_mm)
    for one, other in zip(some, some[::-1], strict=True):
        there, back = add_to_canvas(there, *one), add_to_canvas(back, *other)
    assert there.tiles.keys() == back.tiles.keys()
    if np.ptp(np.array(places)[:, :2], axis=0).max() < 100:
        one, two = image_of(there), image_of(back)
        assert (one.count == two.count).all()
        assert one.values == pytest.approx(two.values, abs=1e-9)
    for each in some:
        there = add_to_canvas(there, *each, -1)
    assert not there.tiles


@given(seeds, st.integers(2, 12))
@settings(max_examples=20, deadline=None)
def test_any_constraints_give_a_pose_with_a_covariance(seed, n):
    rng = np.random.default_rng(seed)
    constraints = []
    for k in range(n):
        sure = np.diag(10.0 ** rng.uniform(-2, 6, 3))
        constraints.append(Constraint(PLANE, k, rng.normal(0, [50, 50, 2]), sure))
    for _ in range(3 * n):
        a, b = rng.choice(n, 2, replace=False).tolist()
        root = rng.normal(size=(3, rng.integers(1, 4))) * 10.0 ** rng.uniform(-2, 3)
        constraints.append(Constraint(a, b, rng.normal(0, [50, 50, 2]), root @ root.T))
    found = solve_pose_graph(constraints, rng.normal(0, 50, (n, 3)))
    assert np.isfinite(found.poses).all()
    assert ((found.weights > 0) & (found.weights <= 1)).all()
    spread = covariances(found.normal, range(n))
    scale = np.sqrt(np.diagonal(spread, axis1=1, axis2=2))
    assert (scale > 0).all()
    relative = spread / (scale[:, :, None] * scale[:, None, :])
    assert np.linalg.eigvalsh(relative).min() > -1e-6
