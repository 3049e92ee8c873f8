"""Distances -> tilt and back: the thesis's equations, their limits, errors, end stops, springs."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

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
    expected = [
        (normal[2] * 6.0 - normal[:2] @ corner) / normal[2] for corner in wrist.corners_mm()
    ]
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


@pytest.mark.parametrize(
    ("call", "match"),
    [
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
def test_what_is_no_wrist_or_pose_is_refused(call, match):
    with pytest.raises(PoseError, match=match):
        call()
    assert tilted(10, 0, 0).z_mm == pytest.approx(10)  # an end stop


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
