"""Arm, wrist and plate, anywhere in their ranges: there and back, at rest, or a clear refusal."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from encoded_objects.base.sensor_type import SensorType
from probe.arm import GAIN, LEAST_SINGULAR, LENGTH_MM, Arm, forward, inverse, joint_speeds
from probe.contact.contract import Touch, WristStiffness
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import rest
from probe.errors import PoseError
from probe.wrist import Wrist, distances_at, gripper_to_plate, wrist_pose

ARM = Arm()
ANGLE = st.floats(-math.pi, math.pi)
JOINTS = st.lists(ANGLE, min_size=5, max_size=5).map(np.array)


@settings(deadline=None, max_examples=150)
@given(JOINTS)
def test_inverse_of_forward_has_the_angles_among_its_branches(q):
    # Where the elbow is straight or folded, or the gripper over the base, angles are lost
    # to rounding, and only the pose comes back; see the next test.
    pose = forward(ARM, q)
    assume(abs(math.sin(q[2])) > 1e-3)
    assume(np.hypot(*pose[:2, 3]) / 500 + np.hypot(*pose[:2, 2]) > 1e-3)
    apart = [np.abs(np.exp(1j * branch) - np.exp(1j * q)).max() for branch in inverse(ARM, pose)]
    assert min(apart) < 1e-9


@settings(deadline=None, max_examples=150)
@given(JOINTS, st.sampled_from([1.0, 1e-3, 1e-6, 1e-9, 1e-12, 0.0]), st.booleans())
def test_every_branch_reaches_the_pose_singular_or_not(q, bend, folded):
    q[2] = q[2] * bend + (math.pi if folded else 0.0)
    pose = forward(ARM, q)
    branches = inverse(ARM, pose)
    assert 1 <= len(branches) <= 4
    for branch in branches:
        assert np.abs(branch).max() <= math.pi
        assert np.abs(forward(ARM, branch) - pose).max() < 2e-6  # mm: a nanometre or two


@settings(deadline=None, max_examples=100)
@given(st.lists(st.floats(-700, 700), min_size=3, max_size=3), ANGLE, ANGLE)
def test_a_vertical_approach_is_reached_or_refused(place, turn, tilt):
    pose = np.eye(4)
    out = math.atan2(place[1], place[0])
    pose[:3, :3] = Rotation.from_euler("ZYZ", [out, tilt, turn]).as_matrix()
    pose[:3, 3] = place
    branches, refusal = [], ""
    try:
        branches = inverse(ARM, pose)
    except PoseError as error:
        refusal = str(error)
    assert branches or "out of reach" in refusal
    for branch in branches:
        assert np.abs(forward(ARM, branch) - pose).max() < 2e-6


@settings(deadline=None, max_examples=100)
@given(JOINTS, st.lists(st.floats(-1, 1), min_size=6, max_size=6).map(np.array), st.integers(0, 15))
def test_joint_speeds_are_bounded_everywhere(q, twist, exponent):
    q[2] *= 10.0**-exponent
    speeds = joint_speeds(ARM, q, twist * np.repeat([LENGTH_MM, 1.0], 3))
    assert np.linalg.norm(speeds) <= GAIN / LEAST_SINGULAR * np.linalg.norm(twist) * 1.000001


@settings(deadline=None, max_examples=150)
@given(
    ab=st.floats(10, 200),
    ad=st.floats(10, 200),
    sine=st.floats(0.021, 1.0),
    obtuse=st.booleans(),
    z=st.floats(0, 10),
    x=st.floats(-10, 10),
    y=st.floats(-10, 10),
)
def test_the_wrist_there_and_back(ab, ad, sine, obtuse, z, x, y):
    gamma = math.pi - math.asin(sine) if obtuse else math.asin(sine)
    wrist = Wrist(ab_mm=ab, ad_mm=ad, gamma_rad=gamma)
    x, y = math.radians(x), math.radians(y)
    found = wrist_pose(wrist, distances_at(wrist, z, x, y))
    assert abs(found.z_mm - z) < 1e-11
    assert abs(found.theta_x_rad - x) < 1e-11
    assert abs(found.theta_y_rad - y) < 1e-11
    turn = gripper_to_plate(wrist, found)[:3, :3]
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-14
    assert np.linalg.eigvalsh(found.covariance).min() > -1e-18


POINTS = SensorType().centres_mm().reshape(-1, 2)
HALF = 12.7  # mm
SCENES = ("flat", "cross", "razor", "one", "two", "sphere", "random")
EPS = np.finfo(float).eps


def scene(rng, kind):
    x, y = POINTS.T
    if kind in ("one", "two"):
        heights = np.full(256, -1.0)
        heights[rng.choice(256, 1 + (kind == "two"), replace=False)] = 0
        return heights
    return {
        "flat": np.zeros(256),
        "cross": np.where((abs(x) < 1) | (abs(y) < 1), 0.0, -1.0),
        "razor": np.where(abs(x - y) < 0.8, 0.0, -1.0),
        "sphere": -(x**2 + y**2) / 20,
        "random": rng.random(256),
    }[kind]


def drawn(rng, number):
    """Return points, heights, stiffness and a load."""
    some = rng.choice(256, int(rng.integers(1, 257)) if number % 2 else 256, replace=False)
    heights = scene(rng, SCENES[number % len(SCENES)])[some]
    heights += rng.choice([0, 0.02, 0.17]) * (POINTS[some] @ [0.6, 0.8])
    spread = rng.choice([0, 3, 6])
    k = 10 ** rng.uniform(-spread, spread, len(some))
    force = 10 ** rng.uniform(-6, 6)
    wrist = WristStiffness(*[10 ** rng.uniform(-6, 6) * HALF**2] * 2)
    aside = HALF * np.array([0.2, 0.3])  # the force acts beside the middle of the tips
    return POINTS[some] - aside, heights, k, Touch(0.0, 0.0, 0.0, force, wrist=wrist)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_springs_come_to_rest(seed):
    rng = np.random.default_rng(seed)
    for number in range(3000):
        points, heights, k, load = drawn(rng, number)
        found = rest(points, heights, Linear(k), load)
        assert found.iterations <= 15
        in_balance(found, points, heights, k, load)


def test_crushed_columns_come_to_rest():
    rng = np.random.default_rng(3)
    for number in range(700):
        points, heights, k, load = drawn(rng, number)
        found = rest(points, heights, NeoHooke(k, 2.0), load)
        depth = heights - found.pose.heights_mm(points)
        assert depth.max() < 2.0
        assert found.iterations <= 30
        stiffness = NeoHooke(k, 2.0)(np.maximum(depth, 0))[1]
        in_balance(found, points, heights, stiffness, load)


def in_balance(found, points, heights, k, load):
    """Forces and moments about both axes add up, but for rounding of place times stiffness."""
    pose, forces = found.pose, found.forces_n
    assert np.isfinite(forces).all()
    assert (forces >= 0).all()
    touching = forces > 0
    reach = abs(pose.z_mm) + HALF * (abs(pose.tilt_x_rad) + abs(pose.tilt_y_rad)) + 5
    rounding = 100 * EPS * (k[touching].sum() * reach)
    turned_x = load.wrist.tilt_x_nmm_rad * pose.tilt_x_rad
    turned_y = load.wrist.tilt_y_nmm_rad * pose.tilt_y_rad
    x, y = points.T
    slack = 1e-9 * (load.force_n + forces.sum()) + rounding
    assert abs(forces.sum() - load.force_n) <= slack
    slack = HALF * slack + 1e-9 * (abs(turned_x) + abs(turned_y))
    assert abs(turned_x - forces @ y) <= slack
    assert abs(turned_y + forces @ x) <= slack
