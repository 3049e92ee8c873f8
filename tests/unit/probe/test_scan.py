"""Guarded approach, raster, poses over a surface, and the arm that is not where it believes."""

import math

import numpy as np
import pytest

from probe.arm import Arm, forward, inverse
from probe.errors import ContactError, PoseError, SurfaceError
from probe.scan import (
    ApproachLimits,
    JointErrors,
    follow_poses,
    guarded_approach,
    joint_path,
    joints_with_play,
    raster,
    surface_to_sensor,
    touch_at,
)

DEG = math.pi / 180
SQUARE = [(0, 0), (60, 0), (60, 60), (0, 60)]


class Bench:
    """A surface at some travel that pushes back; remembers what was done."""

    def __init__(self, law, at=3.0):
        self.law, self.at, self.went = law, at, []

    def __call__(self, travel):
        self.went.append(travel)
        return self.law(travel - self.at) if travel > self.at else 0.0


@pytest.mark.parametrize(
    "law",
    [
        lambda d: 8 * d,  # the wrist
        lambda d: 200 * d,
        lambda d: 2 * d**3,  # hardening
        lambda d: 40 * math.sqrt(d),  # softening
        lambda d: 8 * d + 3 * math.sin(40 * d),  # slipping
    ],
)
def test_the_wanted_force_is_reached_and_never_exceeded_much(law):
    felt = []
    bench = Bench(law)
    end = guarded_approach(lambda travel: felt.append(bench(travel)) or felt[-1])
    assert end
    assert abs(end.force_n - 80) <= 1
    assert max(felt) <= 120
    assert end.travel_mm == bench.went[-1]
    assert len(felt) <= 60


@pytest.mark.parametrize(
    ("law", "at", "limits", "reason", "travel", "force", "farthest"),
    [
        (lambda d: 8 * d, 1e9, {"travel_mm": 12, "step_mm": 0.5}, "no contact", 0, 0, 12),
        (lambda d: 1e4 * d, 3, {}, "force limit", 0, None, 3.5),  # not a step more
        (lambda d: 0.6 + 0.1 * d, 3, {"travel_mm": 10}, "travel limit", 10, 1.3, 10),
        (lambda d: 90.0 if d > 0.123 else 10.0, 3, {}, "too stiff", 3.123, 10, None),
    ],
)
def test_an_approach_that_fails_says_why(law, at, limits, reason, travel, force, farthest):
    bench = Bench(law, at)
    end = guarded_approach(bench, ApproachLimits(**limits))
    assert not end or reason == "too stiff"
    assert (end.reason, end.travel_mm) == (reason, pytest.approx(travel, abs=1e-4))
    assert force is None or end.force_n == pytest.approx(force)
    assert farthest is None or max(bench.went) == farthest
    if travel == 0:
        assert bench.went[-1] == 0  # it is lifted


def covered(places, theta, point, half=12.7):
    c, s = math.cos(theta), math.sin(theta)
    inside = np.abs((point - places) @ [[c, -s], [s, c]]) <= half + 1e-9
    return inside.all(axis=1).any()


@pytest.mark.parametrize("theta", [0, 20])
@pytest.mark.parametrize("sides", [3, 5])
def test_every_point_of_a_regular_face_is_under_a_touch(sides, theta):
    turns = 2 * np.pi * np.arange(sides) / sides
    corners = 40 * np.stack([np.cos(turns), np.sin(turns)], axis=1) + [100, -50]
    plan = raster([corners], theta_rad=theta * DEG)
    weights = np.random.default_rng(1).dirichlet(np.full(sides, 0.3), 400)
    for point in weights @ corners:
        assert covered(plan.places_mm, theta * DEG, point)


def test_a_face_that_is_not_convex_and_one_with_a_hole():
    ell = [(0, 0), (120, 0), (120, 40), (40, 40), (40, 120), (0, 120)]
    plan = raster([ell])
    assert not any(x > 60 and y > 60 for x, y in plan.places_mm)
    assert covered(plan.places_mm, 0, np.array([119, 39]))
    around = raster(
        [[(0, 0), (120, 0), (120, 120), (0, 120)], [(20, 20), (20, 100), (100, 100), (100, 20)]]
    )
    assert not any(np.hypot(*(place - 60)) < 20 for place in around.places_mm)
    assert around.cover.max() < 1


def test_tilts_are_those_of_the_contact_models():
    a, b = 0.02, -0.03
    about_x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    about_y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    T = surface_to_sensor(1, 2, 0.5, 3)
    T[:3, :3] = T[:3, :3] @ about_x @ about_y
    touch = touch_at(T, 1)
    assert (touch.x_mm, touch.y_mm, touch.theta_rad) == pytest.approx((1, 2, 0.5))
    assert (touch.tilt_x_rad, touch.tilt_y_rad) == pytest.approx((a, b))
    for x, y in ((10, 0), (0, 10), (-7, 4)):
        height = (T @ [x, y, 0, 1])[2]
        assert height == pytest.approx(3 + a * y - b * x, abs=2e-3)


def scan_poses():
    T_base_surface = surface_to_sensor(260, -30, 0.2, 100)
    plan = raster([SQUARE])
    return [
        T_base_surface @ surface_to_sensor(x, y, plan.theta_rad) for x, y in plan.places_mm.tolist()
    ]


def test_the_covariance_holds_what_happens():
    poses = scan_poses()
    errors = JointErrors((5e-4,) * 5, (0.0,) * 5)
    rng = np.random.default_rng(2)
    normed = []
    for _ in range(10):
        found = follow_poses(Arm(), poses, errors, rng)
        off = (found.true - found.believed)[:, :3, 3]
        for error, covariance in zip(off, found.covariance, strict=True):
            normed.append(error @ np.linalg.solve(covariance[:3, :3], error))
    assert np.mean(normed) == pytest.approx(3, rel=0.15)  # chi square of 3 freedoms


def test_play_drags_the_joint_along():
    errors = JointErrors((0.0,) * 5, (0.2, 0.0, 0.2, 0.2, 0.2))
    motor = np.zeros((7, 5))
    motor[:, 0] = 0, 1, 2, 1.9, 1.85, 1, 0
    motor[:, 1] = motor[:, 0]
    stands = joints_with_play(motor, errors, np.random.default_rng(3))
    assert stands[1:, 0] == pytest.approx([0.9, 1.9, 1.9, 1.9, 1.1, 0.1])
    assert stands[:, 1] == pytest.approx(motor[:, 1])
    assert np.abs(stands[:, 2]).max() <= 0.1


@pytest.mark.parametrize(
    ("call", "error", "match"),
    [
        (lambda: guarded_approach(lambda _: math.nan), ContactError, "the force at 0 mm is nan"),
        *((lambda limits=limits: guarded_approach(lambda _: 0.0, ApproachLimits(**limits)),
           ContactError, "contradict each other")
          for limits in ({"force_n": 0.1}, {"most_n": 80}, {"step_mm": 0}, {"travel_mm": 0.1},
                         {"tolerance_n": 0}, {"travel_mm": math.inf})),
        *((lambda loops=loops: raster(loops), SurfaceError, "outline")
          for loops in ([], [SQUARE[:2]], [[(0, 0), (1, 1), (2, 2)]], [[*SQUARE, (math.nan, 1)]])),
        *((lambda step=step: raster([SQUARE], step_tactels=step), SurfaceError,
           "tactels; take more than 0 and at most 16") for step in (0, 17, math.nan)),
        (lambda: touch_at(np.diag([1.0, -1.0, -1.0, 1.0]), 1), PoseError, "tilted by 180 degrees"),
        (lambda: touch_at(np.eye(3), 1), PoseError, "give T_surface_sensor"),
        (lambda: follow_poses(Arm(), [*scan_poses()[:3], surface_to_sensor(900, 0, 0, 100)],
                              JointErrors(), np.random.default_rng(1)),
         PoseError, "pose 3 of 4: .* out of reach .*nearer"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(call, error, match):
    with pytest.raises(error, match=match):
        call()


def test_a_path_keeps_its_branch():
    arm = Arm()
    start = inverse(arm, forward(arm, [0.1, -0.8, 1.2, 0.5, 0.2]))[0]
    steps = [start + t * np.array([0.2, 0.1, -0.2, 0.1, 0.3]) for t in np.linspace(0, 1, 20)]
    path = joint_path(arm, [forward(arm, q) for q in steps])
    assert path == pytest.approx(np.array(steps), abs=1e-9)
    assert joint_path(arm, []).shape == (0, 5)
