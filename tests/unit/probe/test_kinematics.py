"""Wrist and arm: the thesis's equations and matrices, limits, singularities, errors, springs."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from probe.arm import (
    LEAST_SINGULAR,
    LENGTH_MM,
    Arm,
    forward,
    inverse,
    jacobian,
    joint_speeds,
    sensor_pose,
)
from probe.errors import PoseError
from probe.wrist import (
    Wrist,
    WristPose,
    counts_of,
    distances_at,
    distances_mm,
    gripper_to_plate,
    plate_to_sensor,
    stiffness,
    tilt_error_rad,
    travel_under_load,
    wrist_pose,
)

DEG = math.pi / 180


def printed_angles(d, ab, ad, gamma):
    """Return the angles as the thesis prints the equations, beta = 90 degrees."""
    a, b, c, e = d
    return (
        math.atan((a - b - c + e) / (2 * ab * math.sin(gamma))),
        math.atan((a + b - c - e) / (2 * ad)),
    )


def turned(about_x, about_y, about_z):
    """Return the rotation about x, then y, then z."""
    return Rotation.from_euler("xyz", [about_x, about_y, about_z]).as_matrix()


def test_the_matrix_is_that_of_the_thesis_with_one_sign_changed():
    x, y, gamma = 0.11, -0.15, 1.2
    T = gripper_to_plate(Wrist(gamma_rad=gamma), WristPose(6.5, x, y, np.zeros((3, 3))))
    assert T[:3, :3] == pytest.approx(turned(x, y, -gamma), abs=1e-15)


@pytest.mark.parametrize("gamma", [90, 45, 5, -90])
def test_distances_are_those_between_the_plates(gamma):
    wrist = Wrist(ab_mm=50, ad_mm=70, gamma_rad=gamma * DEG)
    pose = WristPose(6.0, 8 * DEG, -7 * DEG, np.zeros((3, 3)))
    # the lower plate in the wrist frame: a point of it and its normal
    normal = turned(pose.theta_x_rad, pose.theta_y_rad, 0.0)[:, 2]
    expected = [6.0 - normal[:2] @ corner / normal[2] for corner in wrist.corners_mm()]
    d = distances_at(wrist, pose.z_mm, pose.theta_x_rad, pose.theta_y_rad)
    assert d == pytest.approx(expected, abs=1e-12)
    found = wrist_pose(wrist, d)
    assert (found.z_mm, found.theta_x_rad, found.theta_y_rad) == pytest.approx(
        (6.0, 8 * DEG, -7 * DEG), abs=1e-12
    )


@pytest.mark.parametrize(("gamma", "degrees"), [(90, 0.0095), (1, 0.55), (0.01, 44)])
def test_an_error_of_a_hundredth_of_a_millimetre(gamma, degrees):
    """Case 11 of the stiff and extreme cases, and what numbers drawn at random make of it."""
    error = tilt_error_rad(0.01, 60, gamma * DEG) / DEG
    assert error == pytest.approx(degrees, rel=0.02)
    rng = np.random.default_rng(1)
    slopes = [
        math.tan(printed_angles(d, 60, 60, gamma * DEG)[0])
        for d in rng.normal(5, 0.01, (20_000, 4))
    ]
    assert math.atan(np.std(slopes)) / DEG == pytest.approx(error, rel=0.02)


@pytest.mark.parametrize("gamma", [0, 1.1, 179, -0.5])
def test_transducers_in_a_line_are_refused(gamma):
    with pytest.raises(PoseError, match="almost in a line") as caught:
        Wrist(gamma_rad=gamma * DEG)
    assert "0.02" in caught.value.fix
    Wrist(gamma_rad=1.15 * DEG)  # sin = 0.0201


def tilted(*pose, off=0.0):
    """Return the pose that is told of distances, one of which is off."""
    return wrist_pose(Wrist(), np.add(distances_at(Wrist(), *pose), (0, 0, off, 0)))


def test_counts_are_distances_to_half_a_count():
    wrist = Wrist()
    d = distances_at(wrist, 4.2, 6 * DEG, -10 * DEG)
    assert np.abs(distances_mm(wrist, counts_of(wrist, d)) - d).max() <= wrist.mm_per_count / 2
    assert counts_of(wrist, [-100, 100, 0, 0]).tolist()[:2] == [0, 1023]


def test_the_sensor_looks_the_other_way():
    T = plate_to_sensor(Wrist(tips_mm=12))
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1)
    above = T @ [0, 0, 1, 1]
    assert above == pytest.approx([0, 0, 11, 1])  # off the object is nearer to the robot


def test_springs():
    wrist = Wrist()
    held = stiffness(wrist)
    assert held.tilt_x_nmm_rad == pytest.approx(3000)
    assert held.tilt_y_nmm_rad == pytest.approx(3000)
    assert [travel_under_load(wrist, force) for force in (0, 40, 200)] == pytest.approx([10, 5, 0])
    wide = stiffness(Wrist(ab_mm=30))
    assert (wide.tilt_x_nmm_rad, wide.tilt_y_nmm_rad) == pytest.approx((750, 3000))


ARM = Arm()
SHORT = Arm(a_mm=(0, 200, 100, 0, 0), d_mm=(0, 0, 0, 0, 0))
STIFF = Arm(low_rad=(2,) * 5, high_rad=(2.1,) * 5)
DOWN = np.diag([1.0, -1.0, -1.0])
LEVEL = WristPose(10, 0, 0, np.zeros((3, 3)))


def matrix_of_the_thesis(q):
    """Return the arm matrix of 4.1, with elements (2, 1) and (1, 4) corrected."""
    q1, q2, q3, q4, q5 = q
    c1, s1, c5, s5 = math.cos(q1), math.sin(q1), math.cos(q5), math.sin(q5)
    c2, s2, c23, s23 = math.cos(q2), math.sin(q2), math.cos(q2 + q3), math.sin(q2 + q3)
    c234, s234 = math.cos(q2 + q3 + q4), math.sin(q2 + q3 + q4)
    out = 228.6 * c2 + 228.6 * c23 + 9.5 * c234 - 75 * s234
    down = 228.6 * s2 + 228.6 * s23 + 9.5 * s234 + 75 * c234
    return [
        [c1 * c234 * c5 + s1 * s5, -c1 * c234 * s5 + s1 * c5, -c1 * s234, c1 * out],
        [s1 * c234 * c5 - c1 * s5, -s1 * c234 * s5 - c1 * c5, -s1 * s234, s1 * out],
        [-s234 * c5, s234 * s5, -c234, 260.4 - down],
        [0, 0, 0, 1],
    ]


def at(x, y, z, turn=DOWN):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, (x, y, z)
    return pose


def test_the_link_table_gives_the_corrected_matrix():
    rng = np.random.default_rng(1)
    for q in rng.uniform(-math.pi, math.pi, (50, 5)):
        assert forward(ARM, q) == pytest.approx(np.array(matrix_of_the_thesis(q)), abs=1e-11)


def test_joint_ranges_choose_among_the_branches():
    narrow = Arm(low_rad=(-1.5, -3, 0, -3, -3), high_rad=(1.5, 3, 3, 3, 3))
    branches = inverse(narrow, at(100, 50, 250))
    assert 1 <= len(branches) < 4
    assert all(narrow.inside(branch) for branch in branches)


def leaning(axis):
    """Return an approach 20 degrees off the vertical."""
    return at(300, 0, 200, Rotation.from_euler(axis, 20, degrees=True).as_matrix() @ DOWN)


@pytest.mark.parametrize(
    ("call", "cause"),
    [
        (lambda: forward(ARM, [0, 0, 0, 0]), "give 5 angles"),
        (lambda: forward(ARM, [0, 0, 0, 0, math.nan]), "give 5 angles"),
        (lambda: inverse(ARM, np.eye(3)), "no rigid transform"),
        (lambda: inverse(ARM, 2 * np.eye(4)), "no rigid transform"),
        (lambda: inverse(ARM, np.full((4, 4), np.nan)), "no rigid transform"),
        (lambda: inverse(Arm(alpha_rad=(0.0,) * 5), at(300, 0, 200)), "closed form holds"),
        (lambda: inverse(ARM, leaning("x")), "20 degrees off the vertical plane"),
        # 600 - 9.5 - 457.2
        (lambda: inverse(ARM, at(600, 0, 185.4)), "would be 133.3 mm out of reach"),
        (lambda: inverse(SHORT, at(50, 0, 0)), "50 mm out of reach"),
        (lambda: inverse(STIFF, at(100, 50, 250)), "beyond the range of a joint only, at"),
        (lambda: joint_speeds(ARM, np.zeros(5), [1, 2, 3]), "give 3 speeds"),
        (lambda: joint_speeds(ARM, np.zeros(5), [math.nan] * 6), "give 3 speeds"),
        (lambda: sensor_pose(ARM, np.zeros(5), [1e-3], Wrist(), LEVEL), "standard deviations"),
        *((lambda ab=ab, ad=ad: Wrist(ab_mm=ab, ad_mm=ad), "above 0 mm")
          for ab, ad in ((0, 60), (60, -1), (math.nan, 60), (math.inf, 60))),
        (lambda: tilted(5, 0.05, 0.05, off=0.2), r"0\.05 mm off a plane; check the transducers"),
        (lambda: wrist_pose(Wrist(), [1, 2, 3]), "give AA', BB', CC', DD'"),
        (lambda: wrist_pose(Wrist(), [1, 2, 3, math.nan]), "give AA', BB', CC', DD'"),
        (lambda: tilted(-0.1, 0, 0), r"z of the wrist is -0\.1 mm, the end stops are at 0 and 10"),
        (lambda: tilted(11, 0, 0), "z of the wrist is 11 mm"),
        (lambda: tilted(5, 0, 10.2 * DEG), r"theta_y of the wrist is 10\.2 degrees, .* -10 and 10"),
        (lambda: stiffness(Wrist(gamma_rad=60 * DEG)), "makes a moment about y"),
    ],
)  # fmt: skip
def test_what_is_no_wrist_or_pose_is_refused(call, cause):
    with pytest.raises(PoseError, match=cause):
        call()
    assert inverse(ARM, leaning("y"))
    assert tilted(10, 0, 0).z_mm == pytest.approx(10)  # an end stop


def test_over_the_base_axis():
    """Shoulder singularity: with a vertical approach the first angle is free."""
    lean = Rotation.from_euler("ZY", [40, 30], degrees=True).as_matrix() @ DOWN
    c, s = math.cos(40 * DEG), math.sin(40 * DEG)
    poses = [at(0, 0, 600), at(1e-13, -1e-13, 600), at(0, 0, 600, np.eye(3))]
    poses += [at(r * c, r * s, 600, lean) for r in (0, 1e-12, 1e-9, 1e-6, 1e-3, 1)]
    for pose in poses:
        for q in inverse(ARM, pose):
            assert forward(ARM, q) == pytest.approx(pose, abs=1e-9)


def test_the_jacobian_is_the_derivative():
    rng = np.random.default_rng(4)
    for q in rng.uniform(-3, 3, (20, 5)):
        analytic = jacobian(ARM, q)
        for i in range(5):
            step = np.zeros(5)
            step[i] = 1e-6
            before, after = forward(ARM, q - step), forward(ARM, q + step)
            move = (after - before)[:3, 3] / 2e-6
            turn = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec() / 2e-6
            assert analytic[:, i] == pytest.approx([*move, *turn], abs=1e-4)


def test_the_other_directions_are_followed_through_the_singularity():
    q = [0.2, -0.6, 0.0, 0.9, 0.1]
    u, values, v = np.linalg.svd(jacobian(ARM, q) / np.repeat([LENGTH_MM, 1.0], 3)[:, None])
    for i in range(4):
        assert values[i] > LEAST_SINGULAR
        twist = values[i] * u[:, i] * np.repeat([LENGTH_MM, 1.0], 3)
        assert joint_speeds(ARM, q, twist) == pytest.approx(v[i], abs=1e-9)


def test_speeds_do_not_jump_on_the_way_into_the_singularity():
    twist = [50, 20, -30, 0.1, 0.2, -0.1]
    bends = np.linspace(-0.3, 0.3, 2001)
    speeds = np.array([joint_speeds(ARM, [0.2, -0.6, bend, 0.9, 0.1], twist) for bend in bends])
    jumps = np.abs(np.diff(speeds, axis=0)).max()
    assert jumps < 0.1 * np.abs(speeds).max()


def test_the_sensor_hangs_under_the_gripper():
    wrist = Wrist(tips_mm=12)
    found = sensor_pose(ARM, np.zeros(5), np.zeros(5), wrist, LEVEL)
    assert found.T_base_sensor[:3, 3] == pytest.approx([466.7, 0, 185.4 - 22])
    assert found.T_base_sensor[:3, 2] == pytest.approx([0, 0, 1])  # away from the object
    assert not found.covariance.any()


def test_the_covariance_of_the_sensor_is_that_of_drawn_errors():
    wrist = Wrist(gamma_rad=70 * DEG, reading_mm=0.02)
    q = np.array([0.4, -0.7, 1.1, 0.5, -0.3])
    true = (6.0, 5 * DEG, -4 * DEG)
    sd = np.array([1e-4, 2e-4, 1e-4, 3e-4, 5e-4])
    told = sensor_pose(ARM, q, np.diag(sd**2), wrist, wrist_pose(wrist, distances_at(wrist, *true)))
    rng = np.random.default_rng(7)
    drawn = []
    for _ in range(1500):
        d = distances_at(wrist, *true) + rng.normal(0, wrist.reading_mm, 4)
        T = sensor_pose(ARM, q + rng.normal(0, sd), sd, wrist, wrist_pose(wrist, d)).T_base_sensor
        error = Rotation.from_matrix(T[:3, :3] @ told.T_base_sensor[:3, :3].T).as_rotvec()
        drawn.append([*(T - told.T_base_sensor)[:3, 3], *error])
    spread = np.sqrt(told.covariance.diagonal())
    measured = np.cov(drawn, rowvar=False)
    assert np.abs((measured - told.covariance) / np.outer(spread, spread)).max() < 0.12
    assert np.linalg.eigvalsh(told.covariance / np.outer(spread, spread)).min() > 0
