"""The rigid plate on tips and wrist: by hand, where it tips, and refusals."""

import math

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import rest
from probe.errors import ContactError

POINTS = SensorType().centres_mm().reshape(-1, 2)
ONE = Linear(1.0)


def load(force=80.0, *wrist, **tilts):
    return Touch(0.0, 0.0, 0.0, force, wrist=WristStiffness(*wrist), **tilts)


def test_a_stiff_arm_keeps_its_tilt_and_a_soft_one_gives_way():
    def at(stiffness):
        tilted = load(80.0, stiffness, stiffness, tilt_x_rad=0.02, tilt_y_rad=-0.01)
        return rest(POINTS, np.zeros(256), ONE, tilted).pose

    held, nearly, soft = at(math.inf), at(1e12), at(1e-3)
    assert (held.tilt_x_rad, held.tilt_y_rad) == (0.02, -0.01)
    assert nearly.z_mm == pytest.approx(held.z_mm, rel=1e-6)
    assert math.hypot(soft.tilt_x_rad, soft.tilt_y_rad) < 1e-6


@pytest.mark.parametrize("force", [1e-9, 1.0, 80.0, 1e9])
def test_a_crushed_column_answers_by_its_law(force):
    found = rest(np.zeros((1, 2)), np.array([0.5]), NeoHooke(0.6, 2.0), load(force, 0.0, 0.0))
    stretch = 1 - (0.5 - found.pose.z_mm) / 2.0
    assert 0 < stretch < 1
    law = 0.6 * 2.0 / 3 * (1 - stretch) * (1 + stretch + stretch**2) / stretch**2
    assert law == pytest.approx(force, rel=1e-6)
    assert found.forces_n[0] == pytest.approx(force, rel=1e-9)


@pytest.mark.parametrize(("aside", "stands"), [(0.0, True), (11.8, True), (12.0, False)])
def test_a_free_plate_tips_where_its_centre_leaves_the_hull(aside, stands):
    points, heights = POINTS + np.array([aside, 0.0]), np.full(256, -1.0)
    heights[[37, 200]] = 0.0
    if stands:
        found = rest(points, heights, ONE, load(1.0, 0.0, 0.0))
        assert found.forces_n.sum() == pytest.approx(1.0, rel=1e-9)
        assert found.forces_n @ points == pytest.approx(0.0, abs=1e-8)
        return
    with pytest.raises(ContactError, match=r"tips.*outside the hull.*0\.09375 \.\.\. 23\.91 mm"):
        rest(points, heights, ONE, load(1.0, 0.0, 0.0))


def test_a_free_plate_needs_the_hull_along_its_free_axes_alone():
    at = np.array([[2.0, 1.0], [2.0, -1.0]])
    held = rest(at, np.zeros(2), ONE, load(1.0, 0.0, 100.0))
    assert held.forces_n.sum() == pytest.approx(1.0)
    with pytest.raises(ContactError, match="tips"):
        rest(at, np.zeros(2), ONE, load(1.0, 100.0, 0.0))
    alone = rest(np.zeros((1, 2)), np.zeros(1), ONE, load(1.0, 0.0, 0.0))
    assert alone.forces_n == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("touch", "height", "cause"),
    [
        (load(-1.0), 0.0, "not negative"),
        (load(math.nan), 0.0, "finite"),
        (load(1.0, tilt_x_rad=math.nan), 0.0, "finite"),
        (load(1.0, -1.0, 0.0), 0.0, "a wrist of"),
        (load(1.0, math.nan, 1.0), 0.0, "a wrist of"),
        (load(5.0), -math.inf, "nothing under the plate to bear 5 N"),
    ],
)
def test_loads_that_nothing_bears_are_refused(touch, height, cause):
    with pytest.raises(ContactError, match=cause):
        rest(POINTS, np.full(256, height), ONE, touch)
