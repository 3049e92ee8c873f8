"""Elements of a pad in extreme scenes: a finite answer, or a refusal that names the way out."""

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.elements import condensed_pad, elements
from probe.contact.press import press
from probe.errors import ContactError
from probe.surface.indenters import Cross, FlatPlate, Paraboloid, RaisedStrip, Sphere, TiltedPlane

SMALL = {"rows": 8, "columns": 8}
PAD = SensorType(**SMALL, overlay=Overlay(kind="pad"))
BALL = Sphere(20.0)
FREE = WristStiffness(0.0, 0.0)


def touch(force=20.0, x=0.0, y=0.0, **options):
    return Touch(x, y, options.pop("theta", 0.0), force, **options)


def pressed(surface, at, sensor=PAD, **options):
    return elements(surface, sensor, at, **{"per_tactel": 1, "layers": 2, **options})


def test_no_force_is_an_exactly_zero_image():
    found = pressed(BALL, touch(0.0))
    assert not found.forces_n.any()
    assert found.z_mm == np.inf


@pytest.mark.parametrize(
    ("surface", "at", "overlay"),
    [
        (BALL, touch(1e-9), {}),
        (FlatPlate(), touch(), {}),
        (FlatPlate(), touch(tilt_x_rad=np.radians(10)), {}),
        (FlatPlate(), touch(tilt_x_rad=np.radians(10), wrist=FREE), {}),
        (TiltedPlane(0.1, -0.05), touch(), {}),
        (Sphere(2.0), touch(1.0, 6.3, 6.3), {}),
        (Cross(1.4, 9.0), touch(theta=0.3), {}),
        (RaisedStrip(1.4), touch(x=0.3, theta=0.5), {}),
        (BALL, touch(x=3.0, wrist=WristStiffness(1e12, 1e12)), {}),
        (BALL, touch(x=3.0, wrist=WristStiffness(1e-6, 1e-6)), {}),
        (BALL, touch(5.0), {"height_mm": 0.05}),
        (BALL, touch(), {"height_mm": 20.0}),
        (BALL, touch(), {"poisson": 0.0}),
        (BALL, touch(), {"poisson": 0.5}),
        (BALL, touch(2e5), {"young_mpa": 1e4}),
    ],
)
def test_extreme_scenes_have_a_finite_answer_that_bears_the_force(surface, at, overlay):
    found = pressed(surface, at, SensorType(**SMALL, overlay=Overlay(kind="pad", **overlay)))
    assert found.forces_n.min() >= 0
    assert found.forces_n.sum() == pytest.approx(at.force_n, rel=1e-5)
    assert np.isfinite([found.z_mm, found.tilt_x_rad, found.tilt_y_rad]).all()


@pytest.mark.parametrize(
    ("surface", "at", "cause"),
    [
        (BALL, touch(1e9), "into a pad"),
        (FlatPlate(), touch(1e9), "into a pad"),
        (FlatPlate(), touch(1e300), "into a pad"),
        (FlatPlate(), touch(np.nan), "force is nan"),
        (FlatPlate(), touch(-1.0), "force is -1"),
        (FlatPlate(), touch(x=np.inf), "pose"),
        (FlatPlate(np.nan), touch(), "no numbers"),
        (Sphere(2.0), touch(x=100.0), "nothing lies under"),
        (Sphere(2.0), touch(1.0, 6.3, 6.3, wrist=FREE), "tips"),
    ],
)
def test_scenes_without_an_answer_are_refused(surface, at, cause):
    with pytest.raises(ContactError, match=cause) as caught:
        pressed(surface, at)
    assert caught.value.fix


@pytest.mark.parametrize("floor", [-np.inf, -0.05, -1.0])
@pytest.mark.parametrize(("width", "x"), [(0.3, 0.3), (0.01, 0.3), (0.01, 0.0)])
def test_strokes_thinner_than_the_mesh_are_refused_never_lost(floor, width, x):
    with pytest.raises(ContactError, match="too thin") as caught:
        pressed(RaisedStrip(width, floor_mm=floor), touch(x=x))
    assert "walls_mm" in caught.value.fix


@pytest.mark.parametrize("floor", [-np.inf, -0.05])
@pytest.mark.parametrize("theta", [0.1, 0.5, np.pi / 4])
def test_thin_strokes_across_the_mesh_are_refused(floor, theta):
    with pytest.raises(ContactError, match="too thin"):
        pressed(RaisedStrip(0.1, floor_mm=floor), touch(5.0, x=0.2, theta=theta))


@pytest.mark.parametrize("force", [1.0, 10.0])
@pytest.mark.parametrize("theta", [0.0, 0.2, 0.5, np.pi / 4])
def test_strokes_as_wide_as_printed_pass_at_any_turn(theta, force):
    found = pressed(Cross(1.4, 9.0), touch(force, x=0.37, y=-0.21, theta=theta))
    assert found.forces_n.sum() == pytest.approx(force, rel=1e-5)


def test_lines_at_the_walls_let_a_thin_stroke_through():
    strip = RaisedStrip(0.3 + 1e-9)
    found = pressed(strip, touch(5.0), walls_mm=((0.15,), ()))
    assert found.forces_n.sum() == pytest.approx(5.0, rel=1e-5)
    assert found.forces_n[:, 3:5].sum() > 0.6 * 5.0


def test_image_turns_and_mirrors_with_the_touch():
    ball = Paraboloid(30.0)
    there = pressed(ball, touch(x=1.2, y=-0.5))
    turned = pressed(ball, touch(x=-1.2, y=0.5))
    mirrored = pressed(ball, touch(x=-1.2, y=-0.5))
    assert turned.forces_n == pytest.approx(there.forces_n[::-1, ::-1], abs=1e-9)
    assert mirrored.forces_n == pytest.approx(there.forces_n[:, ::-1], abs=1e-9)
    # The sensor's point (x, y) lies over (x + 1.2, y - .5): the ball is left of the middle, above.
    row, column = np.unravel_index(there.forces_n.argmax(), there.forces_n.shape)
    assert (row, column) == (3, 3)


def test_far_side_of_the_pad_bears_what_its_edge_leaves():
    # Beside a free side the pad gives way more: the plate sinks deeper than on one that goes on.
    strip, at = RaisedStrip(1.5875 + 1e-9, 6.35 + 1e-9), touch(5.0, -5.55625)
    walls = ((4.7625,), (3.175,))
    free = pressed(strip, at, walls_mm=walls)
    wide = pressed(strip, at, walls_mm=walls, margin_mm=6.0)
    assert free.forces_n.sum() == pytest.approx(5.0, rel=1e-5)
    assert wide.forces_n.sum() < 0.95 * 5.0
    assert free.z_mm + free.tilt_y_rad * -5.55625 < wide.z_mm + wide.tilt_y_rad * -5.55625


def test_condensed_pad_is_kept_for_the_next_touch():
    one = condensed_pad(PAD, 1, 2)
    assert condensed_pad(PAD, 1, 2) is one


@pytest.mark.parametrize(
    ("options", "cause"),
    [
        ({"memory_gb": 1e-3}, "GB"),
        ({"per_tactel": 0}, "elements on a tactel"),
        ({"layers": 0}, "layers"),
        ({"margin_mm": -1.0}, "margin"),
    ],
)
def test_meshes_that_cannot_be_are_refused(options, cause):
    with pytest.raises(ContactError, match=cause):
        pressed(BALL, touch(), **options)


def test_ladder_reaches_elements_by_name_for_a_pad_alone():
    found = press(BALL, PAD, touch(), accuracy="elements")
    assert found.level == "elements"
    assert found.forces_n == pytest.approx(elements(BALL, PAD, touch()).forces_n)
    with pytest.raises(ContactError, match="no level 'elements'"):
        press(BALL, SensorType(**SMALL), touch(), accuracy="elements")
    with pytest.raises(ContactError, match="kind 'tab'"):
        pressed(BALL, touch(), SensorType(**SMALL))
