"""The layer: conditions of contact, which one solution alone meets, refusals, extreme scenes.

The rigid plate on tips and wrist: by hand, where it tips. The layer's blur taken back as far as
the noise lets: case 7 of the stiff and extreme cases.
"""

import math

import numpy as np
import pytest
from reference.indenters import Formula, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import STEEPEST_RAD, Touch, WristStiffness
from probe.contact.deblur import LEAST_SHARE, blur_of, deblur, thickest_mm, transmitted_share
from probe.contact.layer import layer
from probe.contact.layer_equilibrium import deep_mm, descend, equilibrium, plate_of, springs_mm
from probe.contact.layer_influence import influence
from probe.contact.layer_patch import DepthWindow, levels_of, patch_under
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import PlatePose, rest
from probe.errors import ContactError
from probe.surface.indenters import Cross, FlatPlate, RaisedStrip, RoughSurface, TiltedPlane, Washer

FREE, HELD = WristStiffness(0.0, 0.0), WristStiffness(math.inf, math.inf)
HINGED = WristStiffness(0.0, math.inf)
POINTS, ONE = SensorType().centres_mm().reshape(-1, 2), Linear(1.0)


def pad(rows=16, **given):
    return SensorType(rows=rows, columns=rows, overlay=Overlay("pad", **given))


def attempt(*scene, **options):
    """Return the contact and "", or None and why it was refused."""
    try:
        return layer(*scene, **options), ""
    except ContactError as refused:
        return None, str(refused)


def posed(surface, sensor, touch, cells=2, plane=None, floor=-1.0):
    """Levels and plate of a scene, seen from a plane, nothing left out above the floor."""
    grid = influence(sensor, cells)
    patch = patch_under(surface, sensor, touch, cells_per_tactel=cells)
    patch = patch.with_cells(np.arange(grid.rows * grid.columns)[: patch.coarse_mm.size])
    levels = levels_of(patch, grid, DepthWindow(plane or PlatePose(0.0, 0.0, 0.0), floor))
    return levels, plate_of(touch, levels)


SCENES = {
    "washer": (Washer(6.0, 2.0), Touch(0.3, -0.2, 0.4, 6.0)),
    "off the middle": (sphere(20.0), Touch(1.0, 0.7, 0.0, 3.0, 0.02, -0.03)),
    "held fast": (Cross(1.3, 7.0), Touch(0.2, 0.1, 0.3, 5.0, 0.01, 0.0, HELD)),
    "free": (FlatPlate(), Touch(0.0, 0.0, 0.0, 10.0, wrist=FREE)),
    "rough": (RoughSurface(3, 0.05, 1.0), Touch(0.0, 0.0, 0.0, 4.0)),
    "one wrist axis": (RaisedStrip(2.0), Touch(0.4, 0, 0.2, 4.0, 0, 0.01, HINGED)),
}


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999, 0.5])
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("method", ["active set", "descent"])
def test_no_tension_no_penetration_and_balance(scene, poisson, method):
    surface, touch = SCENES[scene]
    levels, plate = posed(surface, pad(5, poisson=poisson), touch)
    found = equilibrium(levels, plate)
    assert found.converged
    if method == "descent":
        found = descend(found, plate)
    springs = springs_mm(levels, found.pressures, found.plate)
    deepest = deep_mm(levels, found.plate).max()
    pressed = np.maximum(springs, 0.0)
    assert found.pressures.min() >= -1e-4 * found.pressures.max()
    # What a cell bears is what its levels bear; levels out of touch are not run through.
    assert (levels.shares * pressed).sum(axis=0) / levels.grid.edge_mm_mpa == pytest.approx(
        found.pressures, abs=2e-4 * found.pressures.max()
    )
    assert springs[found.touching].min() >= -1e-4 * deepest
    area, load = levels.grid.dx_mm**2, levels.levers @ found.pressures
    moment = area * load - plate.finite * (found.plate - plate.start)
    assert moment[plate.free] == pytest.approx(
        np.array([touch.force_n, 0, 0])[plate.free], abs=1e-4 * touch.force_n
    )
    assert found.plate[~plate.free] == pytest.approx(plate.start[~plate.free])


@pytest.mark.parametrize(
    ("seed", "surface"),
    [(10, RaisedStrip(1.3)), (13, TiltedPlane(0.05, -0.08)), (23, RoughSurface(1, 0.1, 1.5))],
)
def test_scenes_at_random_are_finite_and_balanced(seed, surface):
    rng = np.random.default_rng([5, seed])
    height, young = 10 ** rng.uniform(math.log10(0.05), math.log10(20)), 10 ** rng.uniform(-1, 2)
    sensor = pad(height_mm=height, young_mpa=young,
                 poisson=float(rng.choice([0, 0.3, 0.45, 0.49, 0.4999, 0.5])))  # fmt: skip
    force = young * min(height, 2.0) * 10 ** rng.uniform(-3, 0.5)
    wrist = WristStiffness(*(force * 10 ** rng.uniform(2, 6, 2)))
    x, y = rng.uniform(-5, 5, 2)
    tilts = rng.uniform(-0.17, 0.17, 2) * (rng.random() < 0.5)
    touch = Touch(x, y, rng.uniform(0, 6.3), force, *tilts, wrist)
    found, why = attempt(surface, sensor, touch, cells_per_tactel=2)
    if why:
        assert any(word in why for word in ("tips", "press the pad", "strokes"))
        return
    assert np.isfinite(found.forces_n).all()
    assert found.forces_n.min() >= 0
    assert found.forces_n.sum() == pytest.approx(force, rel=1e-9)
    assert np.isfinite([found.z_mm, found.tilt_x_rad, found.tilt_y_rad]).all()
    assert max(abs(found.tilt_x_rad), abs(found.tilt_y_rad)) <= STEEPEST_RAD


@pytest.mark.parametrize("exponent", range(-9, 10, 3))
def test_forces_of_every_size_are_borne_or_refused(exponent):
    force, sensor = 10.0**exponent, pad()
    small = layer(Washer(), sensor, Touch(0.3, 0.1, 0.2, 1e-3, wrist=HELD), cells_per_tactel=2)
    touch = Touch(0.3, 0.1, 0.2, force, wrist=HELD)
    found, why = attempt(Washer(), sensor, touch, cells_per_tactel=2)
    if why:
        assert force >= 1e3
        assert "strains are not small" in why
        return
    assert force < 1e3
    # Under a flat stamp everything goes with the force.
    assert found.z_mm == pytest.approx(small.z_mm * force / 1e-3, rel=1e-3)
    assert found.forces_n / force == pytest.approx(small.forces_n / 1e-3, rel=1e-3, abs=1e-5)


def load(force=80.0, *wrist, **tilts):
    return Touch(0.0, 0.0, 0.0, force, wrist=WristStiffness(*wrist), **tilts)


def standing(touch, height=0.0):
    """Return how a plate rests whose tips are all over one height."""
    return rest(POINTS, np.full(256, height), ONE, touch)


def test_a_stiff_arm_keeps_its_tilt_and_a_soft_one_gives_way():
    def at(stiffness):
        return standing(load(80.0, stiffness, stiffness, tilt_x_rad=0.02, tilt_y_rad=-0.01)).pose

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


def blurred(sensor, forces):
    return (blur_of(sensor)[0] @ forces.ravel()).reshape(16, 16)


@pytest.mark.parametrize("height", [1.0, 2.0, 3.0])
def test_the_blur_is_that_of_the_layer(height):
    """Against the layer's own stress at the base on a finer grid: an even square of a tactel."""
    sensor = pad(height_mm=height)
    grid = influence(sensor, 16)
    pressure = np.zeros((grid.rows, grid.columns))
    pressure[1 + 6 * 16 : 1 + 7 * 16, 1 + 9 * 16 : 1 + 10 * 16] = 1 / sensor.pitch_mm**2
    felt = grid.base_forces_n(pressure)
    force = np.zeros((16, 16))
    force[6, 9] = 1
    assert blurred(sensor, force) == pytest.approx(felt, abs=5e-3 * felt.max())
    assert blurred(sensor, force).sum() == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999, 0.5])
def test_the_thickest_pad_is_where_the_refusal_begins(poisson):
    most = thickest_mm(pad(height_mm=2.0, poisson=poisson))
    share = transmitted_share(pad(height_mm=most, poisson=poisson))
    assert share == pytest.approx(LEAST_SHARE, rel=1e-6)
    deblur(IMAGE, pad(height_mm=0.99 * most, poisson=poisson), noise_n=0.1)
    with pytest.raises(ContactError, match=r"passes.*at most"):
        deblur(IMAGE, pad(height_mm=1.01 * most, poisson=poisson), noise_n=0.1)


@pytest.mark.parametrize("height", [0.05, 1.0, 2.0, 3.0])
def test_without_noise_the_forces_come_back(height):
    true = np.random.default_rng(1).exponential(0.1, (16, 16))
    true[3:9, 4] = 0
    found = deblur(blurred(pad(height_mm=height), true), pad(height_mm=height), noise_n=0.0)
    assert found.forces_n == pytest.approx(true, abs=1e-6)
    assert found.resolved == 256


@pytest.mark.parametrize("height", [1.0, 2.0, 3.0, 3.7])
def test_noise_is_held_down_and_told(height):
    """The error is that of the noise and of what was left out; never the plain inverse's."""
    rng = np.random.default_rng(2)
    sensor, noise = pad(height_mm=height), 0.01
    true = np.kron(rng.exponential(0.3, (4, 4)), np.ones((4, 4)))
    clean = blurred(sensor, true)
    found = deblur(clean + noise * rng.normal(size=(16, 16)), sensor, noise_n=noise)
    assert (found.forces_n >= 0).all()
    assert found.noise_n <= 10 * noise
    error = np.linalg.norm(found.forces_n - true) / np.linalg.norm(true)
    assert error < np.linalg.norm(clean - true) / np.linalg.norm(true)
    assert found.resolved <= {1.0: 256, 2.0: 256, 3.0: 200, 3.7: 150}[height]  # lost as pads grow


HERE, WASHER, IMAGE = Touch(0, 0, 0, 10.0), Washer(4.0, 0.0), np.ones((16, 16))
HOLE = Formula(lambda x, _y: np.where(x > 0, math.nan, 0.0))


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: layer(WASHER, SensorType(), HERE), "is of kind 'tab'"),
        (lambda: layer(WASHER, pad(), HERE, cells_per_tactel=0), "cells per tactel"),
        (lambda: layer(WASHER, pad(), HERE, cells_per_tactel=65), "cells per tactel"),
        (lambda: layer(WASHER, pad(height_mm=2000.0), HERE), "grid of"),
        (lambda: layer(WASHER, pad(), HERE, samples=20), "samples per cell"),
        (lambda: layer(WASHER, pad(), Touch(0, 0, 0, -1.0)), "load"),
        (lambda: layer(WASHER, pad(), Touch(0, 0, 0, math.nan)), "load"),
        (lambda: layer(WASHER, pad(), Touch(0, 0, 0, math.inf)), "load"),
        (lambda: layer(WASHER, pad(), Touch(80.0, 0, 0, 10.0)), "nothing under"),
        (lambda: layer(WASHER, pad(), Touch(8.0, 0.0, 0.0, 30.0, wrist=FREE)), "tips: its centre"),
        (lambda: layer(HOLE, pad(), HERE), "no numbers"),
        (lambda: standing(load(-1.0)), "not negative"),
        (lambda: standing(load(math.nan)), "finite"),
        (lambda: standing(load(1.0, tilt_x_rad=math.nan)), "finite"),
        (lambda: standing(load(1.0, -1.0, 0.0)), "a wrist of"),
        (lambda: standing(load(1.0, math.nan, 1.0)), "a wrist of"),
        (lambda: standing(load(5.0), -math.inf), "nothing under the plate to bear 5 N"),
        (lambda: deblur(IMAGE, SensorType(), noise_n=0.01), "kind 'tab'"),
        (lambda: deblur(IMAGE, pad(height_mm=4.0), noise_n=0.01), r"passes.*at most 3\.75 mm"),
        (lambda: deblur(IMAGE[:, 1:], pad(), noise_n=0.01), "shape"),
        (lambda: deblur(IMAGE * np.nan, pad(), noise_n=0.01), "finite"),
        (lambda: deblur(IMAGE, pad(), noise_n=-1.0), "noise"),
        (lambda: deblur(IMAGE, pad(), noise_n=math.inf), "noise"),
    ],
)
def test_what_is_refused(call, text):
    with pytest.raises(ContactError, match=text):
        call()
