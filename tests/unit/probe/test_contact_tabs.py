"""Separate tabs: the law of a tip, frames, leaving out, extremes and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference.indenters import Formula, half_plane, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.plate import PlatePose
from probe.contact.tabs import SKIN, tabs
from probe.contact.tips import NUMBERS, Tips, rings, tip_points
from probe.errors import ContactError
from probe.surface.indenters import FlatPlate, TiltedPlane, Washer

SENSOR = SensorType()
RIGID = WristStiffness(math.inf, math.inf)
APART = SensorType(2, 2, 20.0)  #: of which one tab alone meets a corner
AREA = math.pi * 1.2666**2 / 4


def pressed(surface, force=80.0, sensor=SENSOR, tips=None, **where):
    at = {"x_mm": 0.0, "y_mm": 0.0, "theta_rad": 0.0, **where}
    return tabs(surface, sensor, Touch(force_n=force, **at), tips)


@pytest.mark.parametrize("force", [1e-6, 80.0, 1e5])
def test_covered_wholly_a_tab_is_the_neo_hookean_column(force):
    found = pressed(FlatPlate(1.0), force)
    np.testing.assert_allclose(found.forces_n, force / 256, rtol=1e-5)
    stretch = 1 - (1.0 - found.z_mm) / 2.0
    stress = (1 / 3) * (1 - stretch) * (1 + stretch + stretch**2) / stretch**2
    assert stress * AREA * 256 == pytest.approx(force, rel=1e-5)


@pytest.mark.parametrize(("points", "edge_mm"), [(37, -0.5), (127, -0.3), (37, -0.1), (127, 0.2)])
def test_a_tip_covered_in_part_bears_more_than_its_share(points, edge_mm):
    """Sinking by the same depth: F(c)/F(1) within .02 of c (1 + .59 (1 - c)). Numerics, L1."""
    tips = Tips(points)
    at, _ = tip_points(APART, tips)
    share = float((at[0, :, 0] + 10.0 <= edge_mm).mean())
    tiny = 1e-6
    touch = Touch(10.0 - edge_mm, -10.0, 0.0, tiny, wrist=RIGID)
    corner = Formula(lambda x, y: np.where((x <= 0) & (y > -10), 0.0, -math.inf))
    part = tabs(corner, APART, touch, tips)
    whole = tabs(FlatPlate(), APART, replace(touch, force_n=4 * tiny), tips)
    ratio = whole.z_mm / part.z_mm
    assert ratio == pytest.approx(share * (1 + SKIN) / (1 + SKIN * share), rel=1e-4)
    assert abs(ratio - share * (1 + 0.59 * (1 - share))) < 0.022


def test_points_that_were_not_foreseen_to_touch_are_taken_in(monkeypatch):
    touch = Touch(0.0, 0.0, 0.0, 200.0)
    right = tabs(half_plane(floor_mm=-0.3), SENSOR, touch)
    too_high = (PlatePose(-1e-3, 0.0, 0.0), 1e-3)
    monkeypatch.setattr("probe.contact.tabs.predicted_pose", lambda *_: too_high)
    found = tabs(half_plane(floor_mm=-0.3), SENSOR, touch)
    np.testing.assert_allclose(found.forces_n, right.forces_n, atol=1e-4)


def test_frames_and_signs_of_a_touch():
    # The sensor stands with its right half over the face, so its right columns bear.
    found = pressed(half_plane(), x_mm=0.0, theta_rad=math.pi)
    right = found.forces_n[:, 8:].sum()
    assert right > 0.95 * 80
    # The face pushes up on the right, which lifts it: zeta = z - tilt_y x rises with x.
    assert found.tilt_y_rad < 0
    top = pressed(half_plane(), x_mm=0.0, theta_rad=-math.pi / 2)
    # theta = -90: the sensor's y is the surface's x, matter lies where the sensor's y <= 0.
    assert top.forces_n[8:].sum() > 0.95 * 80
    assert top.tilt_x_rad < 0


def needle_at(x_mm, y_mm, radius_mm):
    return Formula(lambda x, y: np.where(np.hypot(x - x_mm, y - y_mm) < radius_mm, 0, -np.inf))


EXTREME = {
    "flat": (FlatPlate(), {}),
    "needle": (needle_at(8.73, 0.79, 0.3), {}),
    "corner": (Formula(lambda x, y: -3 * np.hypot(x, y)), {"x_mm": 1.0}),
    "sphere": (sphere(2.0), {}),
    "step": (half_plane(floor_mm=-1.0), {"x_mm": 5.0}),
    "tilt": (Washer(floor_mm=-1.0), {"tilt_x_rad": math.radians(10)}),
    "edge": (half_plane(), {"x_mm": 11.5}),
}


@pytest.mark.parametrize("force", [1e-9, 1.0, 1e4, 1e9])
@pytest.mark.parametrize("scene", EXTREME)
def test_extreme_scenes_give_a_finite_image_or_a_clear_refusal(force, scene):
    surface, where = EXTREME[scene]
    try:
        found = pressed(surface, force, **where)
    except ContactError:
        assert force > 1e3
        assert scene != "flat"
        return
    assert np.isfinite([*found.forces_n.ravel(), found.z_mm]).all()
    assert found.forces_n.sum() == pytest.approx(force, rel=1e-5)
    assert (found.forces_n >= 0).all()


def test_a_free_plate_finds_its_own_tilt():
    found = pressed(TiltedPlane(0.05, -0.03), wrist=WristStiffness(0.0, 0.0))
    assert found.tilt_y_rad == pytest.approx(-0.05, abs=1e-6)
    assert found.tilt_x_rad == pytest.approx(-0.03, abs=1e-6)
    np.testing.assert_allclose(found.forces_n, 80 / 256, rtol=1e-3)


def test_tabs_that_all_stand_off_by_the_same_are_a_sensor_moved():
    shifts = np.broadcast_to([0.2, -0.1], (16, 16, 2)).copy()
    shifted = pressed(Washer(), tips=Tips(shifts_mm=shifts), wrist=RIGID)
    moved = pressed(Washer(), x_mm=0.2, y_mm=-0.1, wrist=RIGID)
    np.testing.assert_allclose(shifted.forces_n, moved.forces_n, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("surface", "given", "message"),
    [
        (FlatPlate(), {"sensor": SensorType(overlay=Overlay(kind="pad"))}, "overlay is a pad"),
        (FlatPlate(-math.inf), {}, "nothing under the sensor to bear 80 N"),
        (FlatPlate(math.nan), {}, "no numbers"),
        (FlatPlate(math.inf), {}, "no numbers"),
        (FlatPlate(), {"force": -1.0}, "force not negative"),
        (FlatPlate(), {"force": math.inf}, "finite"),
        (FlatPlate(), {"tips": Tips(8)}, "patterns have 7, 19"),
        (FlatPlate(), {"tips": Tips(lengths_mm=np.zeros(3))}, "lengths have shape"),
    ],
)
def test_what_gives_no_touch_is_refused(surface, given, message):
    with pytest.raises(ContactError, match=message):
        pressed(surface, **given)


@pytest.mark.parametrize("n", NUMBERS)
def test_patterns_have_the_disc_s_moments(n):
    points = rings(n)
    assert points.shape == (n, 2)
    np.testing.assert_allclose(points.mean(axis=0), 0, atol=1e-15)
    second = points.T @ points / n
    assert second[0, 0] == pytest.approx(second[1, 1], rel=1e-12)
    assert second[0, 1] == pytest.approx(0, abs=1e-15)
    # The middle point stands for a disc of its own, of which it knows the centre alone.
    assert np.trace(second) == pytest.approx(0.5 - 0.5 / n**2, rel=1e-12)
    assert np.hypot(*points.T).max() < 1
