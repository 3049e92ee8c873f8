"""The plate always comes to rest, in balance, within 15 steps: 3 x 3000 stiff and soft scenes.

Stiffness of tips, wrist and force each over 1e+-6, tips from 1 to 256. Numerics case 4.
"""

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import rest

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
