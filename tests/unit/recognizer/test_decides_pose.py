"""Where sensor and object stand: by complex numbers, by hand, and against drawn errors."""

import cmath
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from probe.arm import Arm, SensorPose
from probe.errors import PoseError
from probe.wrist import Wrist
from recognizer.touch.pose import face_pose, inside_mm
from recognizer.touch.recognition import Recognition, refusal
from recognizer.touch.robot import (
    MOVED_CHANCE,
    ObjectPose,
    Seating,
    carried_pose,
    fuse_poses,
    object_pose,
)

PITCH, HEIGHT = 7.0, 1.2
ROWS, COLUMNS = 8, 10  # a small torus, so that a wrong way round it shows


def touch(w, turn, rotation, first, cell, steps):
    """Return what `face_pose` takes of a sensor at w (complex, face, mm), turned by `turn`.

    The symbol at `first` (complex, face) is array cell `cell`, and lies `steps` = (i, j) cells
    right of and above lattice cell (0, 0). Five more stand beside it: 6 of the array's 10 columns.
    """
    row, column = cell
    i, j = steps
    centre = PITCH * complex(i + 0.5, j + 0.5)  # of the first symbol, lattice
    at = centre + cmath.exp(1j * rotation) * (w - first)
    run = [first + PITCH * k * cmath.exp(-1j * rotation) for k in range(6)]
    return (
        SimpleNamespace(
            array=SimpleNamespace(rows=ROWS, columns=COLUMNS),
            style=SimpleNamespace(pitch_mm=PITCH, height_mm=HEIGHT),
        ),
        SimpleNamespace(
            rows=np.full(len(run), row),
            columns=(column + np.arange(len(run))) % COLUMNS,
            centres_mm=np.array([[at.real, at.imag] for at in run]),
            rotation_rad=rotation,
        ),
        SimpleNamespace(row=(row + j) % ROWS, column=(column - i) % COLUMNS),
        SimpleNamespace(x_mm=at.real, y_mm=at.imag, theta_rad=turn + rotation),
    )


@pytest.mark.parametrize("rotation", [0.0, 0.4, -2.0, math.pi / 2])
@pytest.mark.parametrize("steps", [(0, 0), (2, -1), (-3, 4), (13, -21)])
def test_the_pose_on_the_face_is_where_the_sensor_was_put(rotation, steps):
    for turn, w in ((0.0, 20 + 30j), (1.1, 31.5 + 19j), (-0.7, 11 + 41j)):
        pose = face_pose(*touch(w, turn, rotation, 22.0 + 28.5j, (7, 9), steps))
        axis = cmath.exp(1j * turn)
        np.testing.assert_allclose(pose[:2, 0], [axis.real, axis.imag], atol=1e-9)
        np.testing.assert_allclose(pose[:3, 3], [w.real, w.imag, HEIGHT], atol=1e-9)


@pytest.mark.parametrize("dx", [-1.4, 0.2, 3.0, 5.4, 6.9])
@pytest.mark.parametrize("dy", [-3.4, 0.0, 3.4])
def test_on_a_face_longer_than_half_of_the_array_the_nearest_symbol_tells_the_place(dx, dy):
    for rotation in (0.0, math.pi / 2):
        at = PITCH * complex(dx, dy) * cmath.exp(-1j * rotation)
        pose = face_pose(*touch(at, 0.0, rotation, 0j, (4, 5), (0, 0)))
        assert pose[:2, 3] == pytest.approx([at.real, at.imag])


def test_the_symbol_that_is_nearest_both_ways_tells_the_place():
    embossed, face, place, fit = touch(0j, 0.0, 0.0, 0j, (2, 3), (0, 0))
    # in turn: 2 right and 3 up, 3 right and 2 up, 2 left and 2 down, 3 right and 3 down
    face.rows, face.columns = np.array([2 - 3, 2 - 2, 2 + 2, 2 + 3]), np.array([5, 6, 1, 6])
    face.centres_mm = np.array([[100.0, 0.0], [200.0, 0.0], [300.0, 0.0], [400.0, 0.0]])
    assert abs(face_pose(embossed, face, place, fit)[0, 3] - 300.0) < 50.0


SQUARE = [(0, 0), (10, 0), (10, 8), (0, 8)]
HOLE = [(3, 3), (3, 5), (6, 5), (6, 3)]
DIAMOND = [(5, 0), (10, 5), (5, 10), (0, 5)]
ROOT = math.sqrt(2)


@pytest.mark.parametrize(
    ("loops", "points"),
    [
        ([SQUARE], [
            (1, 4, 1), (9.5, 4, 0.5), (5, 0.25, 0.25), (5, 7, 1), (5, 4, 4), (0.5, 7.5, 0.5),
            (-2, 4, -2), (13, 4, -3), (5, -1, -1), (5, 12, -4), (-3, -4, -5), (13, 12, -5),
            (13, -4, -5), (-3, 12, -5), (-2, 0, -2), (12, 8, -2), (-2, 8, -2), (12, 0, -2),
        ]),
        ([SQUARE, HOLE], [
            (4.5, 4, -1), (2, 4, 1), (7.5, 4, 1.5), (-1, 4, -1), (2, 2, ROOT), (4, 5.5, 0.5),
        ]),
        # a level through two corners crosses each once
        ([DIAMOND], [
            (5, 5, 5 / ROOT), (1, 5, 1 / ROOT), (9, 5, 1 / ROOT), (-1, 5, -1), (11, 5, -1),
            (5, -2, -2), (5, 13, -3), (1, 1, -3 / ROOT), (9, 9, -3 / ROOT), (9, 1, -3 / ROOT),
            (1, 9, -3 / ROOT), (4, 3, 2 / ROOT), (6, 7, 2 / ROOT), (7, 4, 2 / ROOT),
        ]),
        # of a steep edge, y = 4 (x - 10), a hundredth of a mm along x either side of it
        ([[(0, 0), (10, 0), (20, 40), (0, 40)]], [
            (10 + up / 4 - away, up, away * 4 / math.sqrt(17))
            for up in (4.0, 20.0, 36.0) for away in (0.01, -0.01)
        ]),
    ],
)  # fmt: skip
def test_how_far_a_point_lies_inside_an_outline(loops, points):
    turned = [one[1:] + one[:1] for one in loops]
    for way in (loops, loops[::-1], [one[::-1] for one in loops], turned):
        for aside, up in ((0.0, 0.0), (-3.0, 7.0)):  # frames lie anywhere
            at = [np.add(loop, [aside, up]) for loop in way]
            outline = SimpleNamespace(polygon_mm=tuple(at))
            found = [inside_mm(outline, x + aside, y + up) for x, y, _ in points]
            assert found == pytest.approx([inside for *_, inside in points])


JOINTS = np.radians([20.0, -40.0, 70.0, -25.0, 15.0])
PLANAR = np.array([[0.02, 0.004, 1e-4], [0.004, 0.01, -5e-5], [1e-4, -5e-5, 4e-5]])


def pose_of(rotvec, at):
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotvec).as_matrix()
    T[:3, 3] = at
    return T


T_OBJECT_FACE = pose_of([0.3, 1.1, -0.4], [30.0, -20.0, 10.0])
T_FACE_PROBE = pose_of([0.0, 0.0, 0.7], [22.0, 31.0, 1.0])
ANSWER = Recognition(0, "Cube", "F1", (3, 4), T_FACE_PROBE, T_OBJECT_FACE @ T_FACE_PROBE,
                     PLANAR, 30.0, None, "", inside_mm=20.0)  # fmt: skip


def moved(T, error):
    """A pose with an error of its origin and a small turn about it."""
    turn = Rotation.from_rotvec(error[3:]) * Rotation.from_matrix(T[:3, :3])
    return pose_of(turn.as_rotvec(), T[:3, 3] + error[:3])


def error_between(T, true):
    """Return the error of a pose's origin and the small turn about it: the inverse of `moved`."""
    turn = Rotation.from_matrix(true[:3, :3] @ T[:3, :3].T)
    return np.concatenate([true[:3, 3] - T[:3, 3], turn.as_rotvec()])


def test_a_sensor_that_hangs_over_the_border_sinks_and_tips():
    seating = Seating(0.5, 0.4, 0.3, 0.01, 0.05, half_mm=10.0)
    depths = [seating.depth_mm(at) for at in (25.0, 10.0, 5.0, 0.0, -1.0)]
    assert depths == pytest.approx([0.5, 0.5, 0.7, 0.9, 0.9])
    assert [seating.spread_rad(at) for at in (10.0, 2.5, 0.0)] == pytest.approx([0.01, 0.04, 0.05])
    assert seating.spread_rad(None) == seating.spread_rad(0.0)  # of a round face nothing is known


def test_the_covariance_is_that_of_drawn_errors():
    rng = np.random.default_rng(2)
    root = rng.normal(0, 1, (6, 6)) * np.repeat([0.2, 0.002], 3)[:, None]
    sensor = SensorPose(pose_of([0.4, -2.2, 0.6], [300.0, 50.0, 90.0]), root @ root.T)
    seating = Seating(pressed_mm=0.3, z_mm=0.4, tilt_rad=0.01)
    sunk = pose_of([0.0, 0.0, 0.0], [0.0, 0.0, -seating.pressed_mm])
    placed = object_pose(ANSWER, sensor, seating)
    number = 800
    errors = rng.multivariate_normal(np.zeros(6), sensor.covariance, number)
    planar = rng.multivariate_normal(np.zeros(3), PLANAR, number)
    drawn = np.empty((number, 6))
    for k in range(number):
        touch = np.zeros(6)
        touch[[0, 1, 5]] = planar[k]
        touch[2] = rng.normal(0, math.hypot(seating.z_mm, 0.01 * seating.half_mm / 2))
        touch[3:5] = rng.normal(0, seating.tilt_rad, 2)
        T_object_probe = T_OBJECT_FACE @ moved(T_FACE_PROBE @ sunk, touch)
        true = moved(sensor.T_base_sensor, errors[k]) @ np.linalg.inv(T_object_probe)
        drawn[k] = error_between(placed.T_robot_object, true)
    whitened = np.linalg.solve(np.linalg.cholesky(placed.covariance), drawn.T)
    assert np.cov(whitened) == pytest.approx(np.eye(6), abs=6 / math.sqrt(number))


def test_what_is_not_known():
    sensor = SensorPose(np.eye(4), np.zeros((6, 6)))
    assert object_pose(refusal(0, "ambiguous"), sensor) is None
    with pytest.raises(PoseError, match="end stops"):
        carried_pose(Arm(), Wrist(), JOINTS, np.zeros(5), [0, 0, 0, 0])


BASE = pose_of([0.2, -0.1, 0.9], [320.0, 40.0, 30.0])
SPREAD = np.diag([0.2, 0.2, 0.4, 2e-3, 2e-3, 2e-3]) ** 2


def drawn(rng, number, shift=None, after=0):
    """Poses of an object that is shifted after some of them."""
    poses = []
    for k in range(number):
        T = BASE if shift is None or k < after else moved(BASE, np.array(shift))
        poses.append(ObjectPose(moved(T, rng.multivariate_normal(np.zeros(6), SPREAD)), SPREAD))
    return poses


def test_several_touches_tighten_and_hold():
    """Errors drawn anew shrink by the root of the number; what is shared stays, and is honest."""
    rng = np.random.default_rng(6)
    roots = [rng.normal(0, 1, (6, 6)) * np.repeat([0.2, 0.002], 3)[:, None] for _ in range(9)]
    own = [root @ root.T for root in roots]
    shared = np.diag([0.0, 0.0, 0.16, 1e-4, 1e-4, 0.0])
    inside, moved_ones, number = 0, 0, 300
    for _ in range(number):
        common = rng.multivariate_normal(np.zeros(6), shared)
        poses = []
        for covariance in own:
            off = rng.multivariate_normal(np.zeros(6), covariance) + common
            poses.append(ObjectPose(moved(BASE, -off), covariance + shared, shared))
        fused = fuse_poses(poses)
        moved_ones += fused.moved
        left = error_between(fused.pose.T_robot_object, BASE)
        inside += left @ np.linalg.solve(fused.pose.covariance, left) < 12.592
    assert 0.92 < inside / number < 0.98
    assert moved_ones <= 3
    tight = np.linalg.inv(sum(np.linalg.inv(covariance) for covariance in own)) + shared
    assert fused.pose.covariance == pytest.approx(tight, rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("after", [1, 3, 5])
def test_a_moved_object_is_noticed_and_since_when(after):
    rng = np.random.default_rng(7)
    shift = [2.0, -1.5, 0.0, 0.0, 0.0, 0.02]
    for _ in range(20):
        fused = fuse_poses(drawn(rng, 6, shift, after))
        assert (fused.moved, fused.since) == (True, after)
        again = fuse_poses(drawn(rng, 6, shift, after)[fused.since :])
        assert (again.moved, again.since) == (False, 0)


def test_an_object_that_lies_still_is_not_taken_for_moved():
    rng = np.random.default_rng(8)
    number = 400
    alarms = sum(fuse_poses(drawn(rng, 2 + k % 4)).moved for k in range(number))
    assert alarms <= 4  # MOVED_CHANCE of them, .4
    assert MOVED_CHANCE == 1e-3


@pytest.mark.parametrize(("by", "noticed"), [(0.99, False), (1.01, True)])
def test_a_move_is_noticed_from_one_in_a_thousand_on(by, noticed):
    step = by * math.sqrt(22.458 * 2 * SPREAD[0, 0])  # chi2 of six freedoms, both poses off
    poses = [ObjectPose(T, SPREAD) for T in (BASE, moved(BASE, np.array([step, 0, 0, 0, 0, 0])))]
    assert fuse_poses(poses).moved is noticed
