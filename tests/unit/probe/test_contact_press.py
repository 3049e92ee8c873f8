"""The ladder behind one function, its picks and footprint; separate tabs; gels; refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference.indenters import Formula, half_plane, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.contact.contract import Touch, WristStiffness
from probe.contact.gel import bridge, depths_mm, gel
from probe.contact.plate import PlatePose
from probe.contact.press import accuracy_of, footprint, level_for, press
from probe.contact.tabs import SKIN, tabs
from probe.contact.tips import NUMBERS, Tips, rings, tip_points
from probe.errors import ContactError
from probe.surface.indenters import FlatPlate, RoughSurface, TiltedPlane, Washer

TAB, PAD = (SensorType(overlay=Overlay(kind=kind)) for kind in ("tab", "pad"))
LEVEL = Touch(0.0, 0.0, 0.0, 64.0)
RIGID = WristStiffness(math.inf, math.inf)
APART = SensorType(2, 2, 20.0)  #: of which one tab alone meets a corner
AREA = math.pi * 1.2666**2 / 4


def pressed(surface, force=80.0, sensor=TAB, tips=None, **where):
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
    right = tabs(half_plane(floor_mm=-0.3), TAB, touch)
    too_high = (PlatePose(-1e-3, 0.0, 0.0), 1e-3)
    monkeypatch.setattr("probe.contact.tabs.predicted_pose", lambda *_: too_high)
    found = tabs(half_plane(floor_mm=-0.3), TAB, touch)
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


def test_pick_holds_its_error_on_a_surface_that_was_not_measured():
    surface, touch = RoughSurface(seed=8, rms_mm=0.3, shortest_mm=2.0), Touch(3.0, 1.0, 1.1, 70.0)
    fine = tabs(surface, TAB, touch, Tips(127)).forces_n
    for error in (0.1, 0.05):
        found = press(surface, TAB, touch, accuracy=error).forces_n
        assert np.linalg.norm(found - fine) <= error * np.linalg.norm(fine)


def test_footprint_of_half_a_face_bears_on_half_the_tactels():
    found = footprint(half_plane(), TAB, LEVEL)
    np.testing.assert_allclose(found.forces_n[:, :8], 0.5)
    assert not found.forces_n[:, 8:].any()
    # down to a quarter of the overlay
    assert (footprint(half_plane(-0.4), TAB, LEVEL).forces_n > 0).all()
    assert not footprint(half_plane(-0.6), TAB, LEVEL).forces_n[:, 8:].any()


GEL = sensor_type_named("gel-24x32")
PLAIN = replace(GEL, overlay=replace(GEL.overlay, membrane_mm=0.0, blur_mm=0.0))
SOFTLY = Touch(0.0, 0.0, 0.0, 2.0)
WASHER = Washer(outer_mm=8.0)


def test_a_plane_is_pressed_alike_all_over():
    contact = gel(FlatPlate(), PLAIN, SOFTLY)
    area = 24 * 32 * 0.58**2
    assert contact.forces_n.sum() == pytest.approx(2.0)
    assert np.ptp(contact.forces_n) < 1e-9
    depth = 2.0 / area / (0.3 / 3.0)  # pressure over E / height
    assert depths_mm(PLAIN, contact.forces_n) == pytest.approx(np.full((24, 32), depth))
    assert contact.z_mm == pytest.approx(-depth)


def test_the_membrane_follows_and_bridges():
    depth = np.zeros((41, 41))
    depth[18:23, 18:23] = 1.0
    imprint, _ = bridge(depth, 3.0)
    assert (imprint >= depth).all()
    assert imprint[20, 20] == 1.0
    inner = imprint[1:-1, 1:-1]
    beside = imprint[:-2, 1:-1] + imprint[2:, 1:-1] + imprint[1:-1, :-2] + imprint[1:-1, 2:]
    left = inner - 9.0 * (beside - 4 * inner)
    free = inner > depth[1:-1, 1:-1] + 1e-9
    assert np.abs(left[free]).max() < 0.05  # w - l^2 laplace(w) = 0 where it is free
    assert left[~free].min() > -1e-6  # and pushed out where it is held
    assert imprint[20, 26] > imprint[20, 29] > imprint[20, 35] > 0


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: gel(WASHER, GEL, replace(SOFTLY, force_n=200.0)), "presses the gel through"),
        (lambda: gel(FlatPlate(), SensorType(), SOFTLY), "a tab overlay is no gel"),
        (lambda: gel(WASHER, GEL, replace(SOFTLY, x_mm=90.0)), "nothing under the sensor"),
        (lambda: level_for(GEL, "tabs"), r"take auto, an error such as 0\.01, or gel"),
        (lambda: level_for(GEL, 0.01), "the error of a gel's levels is not known"),
        (lambda: level_for(TAB, "layer"), "no level"),
        (lambda: level_for(PAD, "tabs"), "no level"),
        (lambda: level_for(PAD, "layer-5"), "no level"),
        (lambda: accuracy_of("-1"), "error of"),
        (lambda: accuracy_of("nan"), "error of"),
        (lambda: pressed(FlatPlate(), sensor=PAD), "overlay is a pad"),
        (lambda: pressed(FlatPlate(-math.inf)), "nothing under the sensor to bear 80 N"),
        (lambda: pressed(FlatPlate(math.nan)), "no numbers"),
        (lambda: pressed(FlatPlate(math.inf)), "no numbers"),
        (lambda: pressed(FlatPlate(), -1.0), "force not negative"),
        (lambda: pressed(FlatPlate(), math.inf), "finite"),
        (lambda: pressed(FlatPlate(), tips=Tips(8)), "patterns have 7, 19"),
        (lambda: pressed(FlatPlate(), tips=Tips(lengths_mm=np.zeros(3))), "lengths have shape"),
        *((lambda sensor=sensor, surface=surface, force=force:
           press(surface, sensor, replace(LEVEL, force_n=force), accuracy="footprint"), says)
          for sensor in (TAB, PAD)
          for surface, force, says in (
              (FlatPlate(-math.inf), 1.0, "nothing under the sensor"),
              (FlatPlate(math.nan), 1.0, "no numbers"),
              (FlatPlate(), -1.0, "force of 0 or more"),
              (FlatPlate(), math.nan, "finite numbers"))),
    ],
)  # fmt: skip
def test_what_gives_no_image_is_refused(call, says):
    with pytest.raises(ContactError, match=says):
        call()
