"""The layer: conditions of contact, which one solution alone meets, refusals, extreme scenes."""

import math

import numpy as np
import pytest
from reference.indenters import Formula, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import STEEPEST_RAD, Touch, WristStiffness
from probe.contact.layer import layer
from probe.contact.layer_equilibrium import deep_mm, descend, equilibrium, plate_of, springs_mm
from probe.contact.layer_influence import influence
from probe.contact.layer_patch import DepthWindow, levels_of, patch_under
from probe.contact.plate import PlatePose
from probe.errors import ContactError
from probe.surface.indenters import Cross, FlatPlate, RaisedStrip, RoughSurface, TiltedPlane, Washer

FREE, HELD = WristStiffness(0.0, 0.0), WristStiffness(math.inf, math.inf)


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
    "one wrist axis": (
        RaisedStrip(2.0),
        Touch(0.4, 0, 0.2, 4.0, 0, 0.01, WristStiffness(0.0, math.inf)),
    ),
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
    if found is None:
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
    if found is None:
        assert force >= 1e3
        assert "strains are not small" in why
        return
    assert force < 1e3
    # Under a flat stamp everything goes with the force.
    assert found.z_mm == pytest.approx(small.z_mm * force / 1e-3, rel=1e-3)
    assert found.forces_n / force == pytest.approx(small.forces_n / 1e-3, rel=1e-3, abs=1e-5)


HERE = Touch(0, 0, 0, 10.0)


@pytest.mark.parametrize(
    ("sensor", "touch", "options", "text"),
    [
        (SensorType(), HERE, {}, "is of kind 'tab'"),
        (pad(), HERE, {"cells_per_tactel": 0}, "cells per tactel"),
        (pad(), HERE, {"cells_per_tactel": 65}, "cells per tactel"),
        (pad(height_mm=2000.0), HERE, {}, "grid of"),
        (pad(), HERE, {"samples": 20}, "samples per cell"),
        (pad(), Touch(0, 0, 0, -1.0), {}, "load"),
        (pad(), Touch(0, 0, 0, math.nan), {}, "load"),
        (pad(), Touch(0, 0, 0, math.inf), {}, "load"),
        (pad(), Touch(80.0, 0, 0, 10.0), {}, "nothing under"),
        (pad(), Touch(8.0, 0.0, 0.0, 30.0, wrist=FREE), {}, "tips: its centre"),
    ],
)
def test_what_is_refused(sensor, touch, options, text):
    with pytest.raises(ContactError, match=text):
        layer(Washer(4.0, 0.0), sensor, touch, **options)


def test_a_surface_without_numbers_is_refused():
    with pytest.raises(ContactError, match="no numbers"):
        layer(Formula(lambda x, _y: np.where(x > 0, math.nan, 0.0)), pad(), HERE)
