"""The ladder behind one function: its picks and footprint; gels."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference.indenters import half_plane

from encoded_objects.base.sensor_type import Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.contact.contract import Touch
from probe.contact.gel import bridge, depths_mm, gel
from probe.contact.press import accuracy_of, footprint, level_for, press
from probe.contact.tabs import tabs
from probe.contact.tips import Tips
from probe.errors import ContactError
from probe.surface.indenters import FlatPlate, RoughSurface, Washer

TAB, PAD = (SensorType(overlay=Overlay(kind=kind)) for kind in ("tab", "pad"))
LEVEL = Touch(0.0, 0.0, 0.0, 64.0)


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
