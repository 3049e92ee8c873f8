"""The layer: conditions of contact, an independent oracle, refusals, extreme scenes."""

import math

import numpy as np
import pytest
from reference.indenters import Formula, half_plane, paraboloid, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import STEEPEST_RAD, Touch, WristStiffness
from probe.contact.layer import DEEPEST, layer
from probe.contact.layer_equilibrium import deep_mm, descend, equilibrium, plate_of, springs_mm
from probe.contact.layer_influence import influence
from probe.contact.layer_patch import MOST_LEVELS, DepthWindow, levels_of, patch_under
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


@pytest.mark.parametrize("poisson", [0.3, 0.5])
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


@pytest.mark.parametrize("poisson", [0.0, 0.4999])
@pytest.mark.parametrize("scene", [name for name in SCENES if name not in ("held fast",)])
def test_an_independent_solver_finds_the_same(scene, poisson):
    """A quadratic programme over all levels and the plate, its matrix column by column."""
    import clarabel
    import scipy.sparse as sp

    surface, touch = SCENES[scene]
    levels, plate = posed(surface, pad(4, poisson=poisson), touch)
    grid, (count, n) = levels.grid, levels.shares.shape
    compliance = np.empty((n, n))
    for j in range(n):
        one = np.zeros(n)
        one[j] = 1.0
        compliance[:, j] = grid.sunk_mm(levels.image(one)).ravel()[levels.cells]
    level, cell = np.nonzero(levels.shares > 0)
    w = levels.shares[level, cell]
    edge, area = grid.edge_mm_mpa, grid.dx_mm**2
    # unknowns: force densities w q of all levels, and the plate's free turns (multipliers)
    between = (compliance - edge * np.eye(n))[np.ix_(cell, cell)] + np.diag(edge / w)
    depths, levers = levels.depths_mm[level, cell], levels.levers[:, cell]
    # min q'Aq/2 - q'(h - R b) over q >= 0 with the balance of z; a wrist adds its energy:
    # b_i = start_i + area R_i q / K_i, so K_i -> q'R_i'R_i q area / K_i / 2.
    quadratic, linear, rows, rights = between, -depths.copy(), [levers[0]], [touch.force_n / area]
    for i in (1, 2):
        linear = linear + plate.start[i] * levers[i]
        if plate.stiffness[i] == 0:
            rows.append(levers[i])
            rights.append(0.0)
            linear = linear - plate.start[i] * levers[i]
        elif math.isfinite(plate.stiffness[i]):
            quadratic = quadratic + np.outer(levers[i], levers[i]) * area / plate.stiffness[i]
    scale = 1 / max(np.abs(linear).max(), 1e-3)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
    m, k = len(w), len(rows)
    solver = clarabel.DefaultSolver(
        sp.csc_matrix(np.triu((quadratic + quadratic.T) / 2) * scale),
        linear * scale,
        sp.csc_matrix(np.vstack([*rows, -np.eye(m)])),
        np.concatenate([rights, np.zeros(m)]),
        [clarabel.ZeroConeT(k), clarabel.NonnegativeConeT(m)],
        settings,
    )
    pressures = np.bincount(cell, np.array(solver.solve().x), minlength=n)
    begun = equilibrium(levels, plate)
    for found in (begun, descend(begun, plate)):
        error = np.linalg.norm(found.pressures - pressures) / np.linalg.norm(pressures)
        assert error <= 3e-4
    assert count <= MOST_LEVELS + 1
    images = [grid.base_forces_n(levels.image(p)) for p in (begun.pressures, pressures)]
    assert np.linalg.norm(images[0] - images[1]) <= 1e-5 * np.linalg.norm(images[1])


SURFACES = (Washer(), RaisedStrip(1.3), sphere(30.0), Cross(1.6, 15.0), TiltedPlane(0.05, -0.08),
            RoughSurface(1, 0.1, 1.5), half_plane(), half_plane(-0.6),
            paraboloid(200.0))  # fmt: skip


@pytest.mark.parametrize("seed", range(36))
def test_scenes_at_random_are_finite_and_balanced(seed):
    rng = np.random.default_rng([5, seed])
    height, young = 10 ** rng.uniform(math.log10(0.05), math.log10(20)), 10 ** rng.uniform(-1, 2)
    sensor = pad(height_mm=height, young_mpa=young,
                 poisson=float(rng.choice([0, 0.3, 0.45, 0.49, 0.4999, 0.5])))  # fmt: skip
    force = young * min(height, 2.0) * 10 ** rng.uniform(-3, 0.5)
    wrist = WristStiffness(*(force * 10 ** rng.uniform(2, 6, 2)))
    x, y = rng.uniform(-5, 5, 2)
    tilts = rng.uniform(-0.17, 0.17, 2) * (rng.random() < 0.5)
    touch = Touch(x, y, rng.uniform(0, 6.3), force, *tilts, wrist)
    found, why = attempt(SURFACES[seed % 9], sensor, touch, cells_per_tactel=2)
    if found is None:
        assert any(word in why for word in ("tips", "press the pad", "strokes"))
        return
    assert np.isfinite(found.forces_n).all()
    assert found.forces_n.min() >= 0
    assert found.forces_n.sum() == pytest.approx(force, rel=1e-9)
    assert np.isfinite([found.z_mm, found.tilt_x_rad, found.tilt_y_rad]).all()
    # The wrist's moment is that of the pressure on the pad; the tactels' is about the same.
    assert max(abs(found.tilt_x_rad), abs(found.tilt_y_rad)) <= STEEPEST_RAD


@pytest.mark.parametrize("height", [0.05, 0.3, 2.0, 20.0])
@pytest.mark.parametrize("poisson", [0.0, 0.5])
def test_pads_of_every_height(height, poisson):
    sensor = pad(height_mm=height, poisson=poisson)
    found = layer(Washer(), sensor, Touch(0.3, 0.1, 0.2, 1.0), cells_per_tactel=2)
    assert found.forces_n.sum() == pytest.approx(1.0, rel=1e-9)
    assert -DEEPEST * height <= found.z_mm < 0
    if height == 0.05:  # thin: the image is the footprint
        assert found.forces_n[8, 8] <= 1e-3 * found.forces_n.max()


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


def test_edge_of_a_face_and_ten_degrees():
    sensor, ten = pad(), math.radians(10.0)
    edge = layer(half_plane(), sensor, Touch(3.0, 0.0, 0.0, 30.0, wrist=WristStiffness(1e5, 1e5)))
    assert edge.forces_n[:, :7].sum() > 0.97 * 30  # matter where x <= -3 mm: 6.1 columns
    assert edge.forces_n[:, 9:].sum() < 0.01 * 30
    tilted = layer(
        FlatPlate(),
        sensor,
        Touch(0, 0, 0, 10.0, ten, 0.0, WristStiffness(1e9, 1e9)),
        cells_per_tactel=4,
    )
    assert tilted.tilt_x_rad == pytest.approx(ten, rel=1e-4)
    assert tilted.forces_n[8:].sum() > 0.99 * 10  # the plate's lower side is at the bottom
    with pytest.raises(ContactError, match="tips"):
        layer(half_plane(), sensor, Touch(3.0, 0.0, 0.0, 30.0, wrist=FREE))
    with pytest.raises(ContactError, match="tips: its centre"):
        layer(Washer(4.0, 0.0), sensor, Touch(8.0, 0.0, 0.0, 30.0, wrist=FREE))


@pytest.mark.parametrize("width", [0.01, 0.03, 0.1])
def test_thin_strokes_are_felt_or_refused_never_lost(width):
    sensor = pad()
    for theta in (0.0, 0.3):
        for floor in (-math.inf, -0.5):
            found, why = attempt(
                RaisedStrip(width, floor_mm=floor), sensor, Touch(0.1, 0, theta, 2.0)
            )
            if found is None:
                assert "thin" in why or "strokes" in why
            else:
                assert found.forces_n[:, 6:10].sum() > 0.5 * 2.0


def test_what_is_refused():
    sensor, touch = pad(), Touch(0, 0, 0, 10.0)
    for other, text in (
        (SensorType(), "is of kind 'tab'"),
        (pad(height_mm=0.0), "height is 0"),
        (pad(young_mpa=math.nan), "modulus"),
        (pad(poisson=0.51), "ratio"),
        (pad(poisson=-0.1), "ratio"),
    ):
        with pytest.raises(ContactError, match=text):
            layer(Washer(), other, touch)
    for cells in (0, 65):
        with pytest.raises(ContactError, match="cells per tactel"):
            layer(Washer(), sensor, touch, cells_per_tactel=cells)
    with pytest.raises(ContactError, match="grid of"):
        layer(Washer(), pad(height_mm=2000.0), touch)
    with pytest.raises(ContactError, match="samples per cell"):
        layer(Washer(), sensor, touch, samples=20)
    for force in (-1.0, math.nan, math.inf):
        with pytest.raises(ContactError, match="load"):
            layer(Washer(), sensor, Touch(0, 0, 0, force))
    with pytest.raises(ContactError, match="nothing under"):
        layer(Washer(), sensor, Touch(80.0, 0, 0, 10.0))
    with pytest.raises(ContactError, match="no numbers"):
        layer(Formula(lambda x, _y: np.where(x > 0, math.nan, 0.0)), sensor, touch)
