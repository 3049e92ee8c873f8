"""The layer against closed formulas and finite elements, its kernel against mpmath; a tab's law."""

import math

import mpmath
import numpy as np
import pytest
from reference.elements import COVERED, ELEMENTS, STRAINS, tactels_n
from reference.indenters import paraboloid

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.layer import layer
from probe.contact.layer_influence import (
    base_ratio,
    compliance_over_s,
    edge_compliance,
    influence,
    layer_compliance,
)
from probe.contact.neo_hooke import NeoHooke
from probe.contact.tabs import SKIN
from probe.surface.indenters import RaisedStrip, Washer

POISSON = (0.0, 0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.5 - 2**-40, 0.5)
S = [*10.0 ** np.linspace(-8, 2, 41), 0.999999, 1.0, 1.000001, 10.5, 19.7, 200.0, 400.0]


HELD = WristStiffness(math.inf, math.inf)


def compliance_ratio(s, poisson):
    """T(s): the layer's compliance over the half-space's."""
    return s * compliance_over_s(s, poisson)


def pad(**given):
    return SensorType(overlay=Overlay("pad", **given))


def off(found, truth):
    """Return by how much forces differ from the true ones, as a share."""
    return np.linalg.norm(found - truth) / np.linalg.norm(truth)


def exact(s, poisson):
    """T / s and B from the closed forms, with digits to spare."""
    with mpmath.workdps(80):
        s, nu = mpmath.mpf(float(s)), mpmath.mpf(poisson)
        sh, ch = mpmath.sinh(s), mpmath.cosh(s)
        below = 4 * (1 - nu) ** 2 + s**2 + (3 - 4 * nu) * sh**2
        t = ((3 - 4 * nu) * sh * ch - s) / below
        b = 2 * (1 - nu) * (2 * (1 - nu) * ch + s * sh) / below
        return float(t / s), float(b)


def solved(s, poisson):
    """T and B from the equations of elasticity themselves, integrated through the layer.

    u_x = U sin qx, u_z = W cos qx, stresses S cos qx and T sin qx; G = h = 1. The base holds
    U = W = 0, on top S = -1, T = 0.
    """
    with mpmath.workdps(50):
        q, nu = mpmath.mpf(s), mpmath.mpf(poisson)
        soft, side = (1 - 2 * nu) / (2 * (1 - nu)), nu / (1 - nu)
        along = [2 * q**2 / (1 - nu), 0, side * q, 0]
        law = mpmath.matrix([[0, q, 0, 1], [-side * q, 0, soft, 0], [0, 0, 0, -q], along])
        through = mpmath.expm(law)
        stress = mpmath.lu_solve(through[2:, 2:], mpmath.matrix([-1, 0]))
        sunk = -(through[1, 2] * stress[0] + through[1, 3] * stress[1])
        return float(sunk * q / (1 - nu)), float(-stress[0])


@pytest.mark.parametrize("poisson", POISSON)
def test_kernel_within_1e_14(poisson):
    s = np.array(S)
    ratio, base = compliance_over_s(s, poisson), base_ratio(s, poisson)
    for k, at in enumerate(S):
        true, arrives = exact(at, poisson)
        assert ratio[k] == pytest.approx(true, rel=1e-14, abs=0), at
        assert base[k] == pytest.approx(arrives, rel=1e-14, abs=0), at


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.4999, 0.5])
@pytest.mark.parametrize("s", [0.01, 0.5, 3.0, 20.0])
def test_kernel_solves_the_equations_of_the_layer(s, poisson):
    ratio, base = solved(s, poisson)
    assert compliance_ratio(np.array(s), poisson) == pytest.approx(ratio, rel=1e-13)
    assert base_ratio(np.array(s), poisson) == pytest.approx(base, rel=1e-13)


def test_kernel_limits():
    for nu in POISSON:
        assert compliance_ratio(np.array(1e3), nu) == 1  # a half-space
        assert base_ratio(np.array(0.0), nu) == 1
        even = layer_compliance(0.0, Overlay("pad", 3.0, young_mpa=2.0, poisson=nu))
        confined = 3.0 * (1 + nu) * (1 - 2 * nu) / (2.0 * (1 - nu))
        assert even == pytest.approx(confined, rel=1e-14, abs=0)
    # Incompressible and thin: a film that flows, u = (q h)^2 h p / (3 G).
    thin = layer_compliance(1e-6, Overlay("pad", 2.0, young_mpa=3.0, poisson=0.5))
    assert thin == pytest.approx((2e-6) ** 2 * 2.0 / 3, rel=1e-11)


def test_stress_of_a_line_at_the_base_by_quadrature():
    """The base's spectrum, turned back into space: 1/pi of the integral of B(q h) cos qx."""
    sensor = pad(height_mm=2.0, poisson=0.4999)
    cells = 8
    grid = influence(sensor, cells)
    pressure = np.zeros((grid.rows, grid.columns))
    pressure[1:-1, grid.columns // 2 - 1 : grid.columns // 2 + 1] = 1.0  # two columns of cells
    felt = grid.base_forces_n(pressure)[8] / sensor.pitch_mm  # N/mm, far from the ends
    with mpmath.workdps(20):
        for column in (8, 10, 12):
            low, high = ((column - 8 + e) * sensor.pitch_mm for e in (0, 1))

            def density(q, low=low, high=high):
                _, base = exact(2.0 * q, 0.4999)
                reach = (mpmath.sin(q * high) - mpmath.sin(q * low)) / q
                return base * reach * 2 * mpmath.sin(q * grid.dx_mm) / q

            true = mpmath.quad(density, [1e-9, 1, 2, 4, 8, 16]) / mpmath.pi
            # The bell that the spectrum takes off is of the pressure: put it on again.
            assert felt[column] == pytest.approx(float(true), rel=2e-2, abs=2e-4)


def test_nyquist_of_the_tactels_tells_where_deblurring_ends():
    nyquist = math.pi / SensorType().pitch_mm
    for height, share in ((1, 0.61), (2, 0.185), (4, 0.0065)):
        assert base_ratio(np.array(nyquist * height), 0.4999) == pytest.approx(share, rel=0.03)


def test_edge_compliance_of_a_thin_compressible_layer_is_its_own():
    for nu in (0.0, 0.3, 0.45):
        thin = Overlay("pad", 1e-4, young_mpa=1.0, poisson=nu)
        whole, edge = layer_compliance(0.0, thin), edge_compliance(1.0, thin)
        assert edge == pytest.approx(whole, rel=2e-3)


@pytest.mark.parametrize("poisson", [0.3, 0.5])
def test_hertz_on_a_thick_pad(poisson):
    """A half-space's sphere, less what the base takes from its approach under a point force."""
    height, bend, a = 20.0, 60.0, 3.0
    star = 1.0 / (1 - poisson**2)
    force = 4 * star * a**3 / (3 * bend)
    s = np.linspace(0, 60, 6001)
    stiffer = np.trapezoid(1 - compliance_ratio(s, poisson), s) / (math.pi * star * height)
    touch = Touch(0.1, 0.3, 0, force, wrist=HELD)
    sensor = pad(height_mm=height, poisson=poisson)
    found = layer(paraboloid(bend), sensor, touch, cells_per_tactel=6)
    assert -found.z_mm == pytest.approx(a**2 / bend - stiffer * force, rel=1e-2)


@pytest.mark.parametrize(("ratio", "excess", "cells"), [(10, 1.18, 8), (20, 1.05, 8)])
def test_thin_incompressible_layer_under_a_paraboloid(ratio, excess, cells):
    # F -> pi G a^6 / (32 R h^3) for a / h -> infinity; the depth is then a^2 / 4R.
    height, bend = 10.0 / ratio, 400.0
    sensor = pad(height_mm=height, young_mpa=3.0, poisson=0.5)
    force = math.pi * 10.0**6 / (32 * bend * height**3) * excess
    touch = Touch(0.1, 0.2, 0, force, wrist=HELD)
    found = layer(paraboloid(bend), sensor, touch, cells_per_tactel=cells)
    assert -found.z_mm == pytest.approx(10.0**2 / (4 * bend), rel=3e-3)


@pytest.mark.parametrize(
    ("cells", "samples", "tactels", "depth"),
    [(2, 16, 1e-2, 6e-3), (4, 16, 5e-3, 4e-3), (4, 64, 2e-3, 2e-3), (8, 16, 1.2e-3, 2e-3)],
)
def test_washer_of_figure_4_10(cells, samples, tactels, depth):
    sensor, kept, approaches = pad(), np.s_[1:-1, 1:-1], []
    for x, y, theta in ((0, 0, 0), (0.31, -0.17, 0.4), (-0.7, 0.55, 1.1), (0.5, 0.6, 2.0)):
        touch = Touch(x, y, theta, 80.0, wrist=HELD)
        truth = tactels_n("washer", sensor, touch)[kept]
        found = layer(Washer(), sensor, touch, cells_per_tactel=cells, samples=samples)
        approaches.append(-found.z_mm / ELEMENTS["washer"]["depth_mm"] - 1)
        assert off(found.forces_n[kept], truth) <= tactels
        assert abs(approaches[-1]) <= depth
    assert abs(np.mean(approaches)) <= max(depth / 2, 2e-3)


def test_strokes_thinner_than_a_cell_are_felt_alike_at_every_place():
    """The force is where a fine grid has it; the depth is felt by the stroke's width, roughly."""
    sensor, width = pad(), 0.25  # a cell of 4 per tactel is 0.4 wide
    wide = layer(RaisedStrip(2 * width), sensor, Touch(0, 0, 0.1, 12.0, wrist=HELD)).z_mm
    for x in (0.0, 0.13, 0.29):
        touch = Touch(x, 0.0, 0.1, 12.0, wrist=HELD)
        fine = layer(RaisedStrip(width), sensor, touch, cells_per_tactel=16)
        found = layer(RaisedStrip(width), sensor, touch)
        assert off(found.forces_n, fine.forces_n) <= 0.03
        assert 1 <= found.z_mm / fine.z_mm <= 1.25
        assert found.z_mm < wide


@pytest.mark.parametrize(("height", "allowed"), [(1, 0.14), (2, 0.08)])
def test_tab_law_to_half_its_height(height, allowed):
    area = math.pi * Overlay().tab_diameter_mm ** 2 / 4
    found, _ = NeoHooke(area / height, height)(STRAINS * height)
    assert found == pytest.approx(np.array(ELEMENTS[f"tab {height} mm"]), rel=allowed)


def test_partly_covered_tab_bears_less_than_all_and_more_than_its_share():
    found = COVERED * (1 + SKIN) / (1 + SKIN * COVERED)
    # .0303 less at three quarters
    assert found == pytest.approx(np.array(ELEMENTS["tab covered"]), abs=0.031)


def test_layer_agrees_with_elements_in_space():
    found = layer(paraboloid(60.0), pad(), Touch(-2.0, 1.1, 0.4, 60.0, 0.01, -0.02))
    truth, (z, *tilts) = (ELEMENTS["paraboloid"][name] for name in ("forces_n", "plate"))
    inner = np.s_[1:-1, 1:-1]  # the outermost bear what the endless layer has beyond them, too
    assert off(found.forces_n[inner], np.array(truth)[inner]) <= 5e-3
    assert found.z_mm == pytest.approx(z, rel=2e-3)
    assert (found.tilt_x_rad, found.tilt_y_rad) == pytest.approx(tilts, abs=1e-4)
