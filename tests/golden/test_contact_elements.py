"""Finite elements against closed formulas, against one another, and the two laws of a tab."""

import numpy as np
import pytest
from reference.elements_axisymmetric import DEGREES, apparent_modulus, section
from reference.elements_round import indented, washer_pad
from reference.elements_space import elements
from reference.elements_tab import Tab, compressed, partly_covered
from reference.indenters import paraboloid, sphere

from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.layer import layer

STIFF = WristStiffness(1e9, 1e9)
MESH = {"per_tactel": 1, "layers": 2, "margin_mm": 6.0}  #: of elements in space
NEAR_HALF = (0.499, 0.4999, 0.49999, 0.5)
#: Stiffness of a bonded disc of S = 1 over the reference, 8 elements through its height.
LOCKING = {
    "q1": {0.3: 1.005, 0.49: 1.13, 0.499: 1.95, 0.4999: 9.9, 0.49999: 89},
    "q2": {0.3: 1.001, 0.49: 1.019, 0.499: 1.032, 0.4999: 1.039, 0.49999: 1.042},
    "q1p0": {0.3: 1.004, 0.49: 1.026, 0.499: 1.030, 0.4999: 1.030, 0.49999: 1.030, 0.5: 1.030},
    "q2q1": {0.3: 1.001, 0.49: 1.004, 0.499: 1.004, 0.4999: 1.004, 0.49999: 1.004, 0.5: 1.004},
}


def disc(poisson, kind="q2q1", parts=(16, 8)):
    return apparent_modulus(2.0, 1.0, poisson, kind, parts=parts)


@pytest.fixture(scope="module")
def reference():
    return {nu: disc(nu, parts=(64, 32)) for nu in LOCKING["q2q1"]}


@pytest.mark.parametrize("kind", DEGREES)
def test_locking_table(kind, reference):
    for nu, ratio in LOCKING[kind].items():
        assert disc(nu, kind) / reference[nu] == pytest.approx(ratio, rel=5e-3), nu


@pytest.mark.parametrize(("kind", "allowed"), [("q1p0", 0.035), ("q2q1", 0.005)])
def test_no_locking_towards_one_half(kind, allowed, reference):
    errors = [disc(nu, kind) / reference[nu] - 1 for nu in (0.3, 0.49, *NEAR_HALF)]
    assert max(np.abs(errors)) <= allowed
    assert np.ptp(errors[2:]) <= 0.002


@pytest.mark.parametrize(
    ("shape", "low", "high"), [(0.15, 0.0, 0.07), (0.25, 0.0, 0.07), (1.0, -0.03, 0.0),
                               (2.0, -0.03, 0.0)]
)  # fmt: skip
def test_bonded_disc_near_its_formula(shape, low, high):
    # The formula is too low for slim discs and too high for flat ones.
    found = apparent_modulus(2 * shape, 1.0, 0.49999, parts=(max(8, round(24 * shape)), 12))
    assert low <= found / (1 + 2 * shape**2) - 1 <= high


@pytest.mark.parametrize("shape", [0.5, 1.0, 2.0])
def test_sliding_top_is_half_of_a_disc_twice_as_high(shape):
    sliding = apparent_modulus(2 * shape, 1.0, 0.49999, parts=(32, 12), bonded_top=False)
    whole = apparent_modulus(2 * shape, 2.0, 0.49999, parts=(32, 24))
    assert sliding == pytest.approx(whole, rel=1e-6)
    assert sliding == pytest.approx(1 + shape**2 / 2, rel=0.07)


def test_cylinder_that_slides_at_both_ends_has_youngs_modulus():
    part = section(np.linspace(0, 1, 4), np.linspace(0, 2, 3), 3.0, 0.45)
    ends = [part.axial(slice(None), slice(k, k + 1)) for k in (0, part.z.size - 1)]
    held = np.concatenate([*ends, part.radial(slice(0, 1), slice(None))])
    found = part.solved(held, np.where(np.isin(held, ends[1]), -0.02, 0.0))
    assert -(part.matrix[ends[1]] @ found).sum() == pytest.approx(3.0 * 0.01 * np.pi, rel=1e-9)


@pytest.mark.parametrize(
    ("ratio", "excess", "edge"), [(10, 1.180, 0.886), (20, 1.049, 0.936), (40, 1.013, 0.967)]
)
def test_thin_incompressible_layer_under_a_paraboloid(ratio, excess, edge):
    # F -> pi G a^6 / (32 R h^3) for a / h -> infinity, with a = 2 sqrt(R depth) of that limit;
    # the contact itself ends about 1.2 h further in, where the layer is no longer thin. So a^6
    # of the true edge is half as much at a / h = 10: it is no measure of the force. The Fourier
    # kernel of the endless layer gives the same excess (1.180, 1.049) and edge (.886, .936).
    height, bend, radius, shear = 0.1, 200.0, 0.1 * ratio, 1.0
    r = np.concatenate([np.linspace(0, 1.2 * radius, 145), np.linspace(1.2, 2.2, 12)[1:] * radius])
    pad = section(r, np.linspace(0, height, 5), 3 * shear, 0.5)
    force = np.pi * shear * radius**6 / (32 * bend * height**3) * excess
    pressed = indented(pad, lambda r: -(r**2) / (2 * bend), force)
    thin = 2 * np.sqrt(bend * pressed.depth_mm)
    found = force / (np.pi * shear * thin**6 / (32 * bend * height**3))
    assert found == pytest.approx(excess, rel=2e-3)
    assert pad.r[pressed.active].max() / thin == pytest.approx(edge, rel=8e-3)
    assert pressed.top_n[pressed.active][1:].min() > 0


def washer(parts, **options):
    pad = washer_pad(3.5, 7.5, 2.0, 1.0, 0.4999, parts=parts, **options)
    flat = lambda r: np.where((r > 3.5 - 1e-9) & (r < 7.5 + 1e-9), 0.0, -np.inf)  # noqa: E731
    return indented(pad, flat, 80.0)


def test_washer_of_figure_4_10():
    sensor = SensorType(overlay=Overlay(kind="pad"))
    fine = washer(24)
    truth = fine.tactels_n(sensor)
    assert fine.depth_mm == pytest.approx(0.26528, rel=3e-4)
    assert truth == pytest.approx(truth[::-1, ::-1], abs=1e-12)
    assert fine.pad_force_n == pytest.approx(80, rel=1e-9)
    assert truth.sum() == pytest.approx(79.01, abs=0.01)  # the rest is borne beyond the matrix
    for options, tactels, depth in (
        ({"parts": 4}, 4e-3, 3.4e-3),
        ({"parts": 8}, 9e-4, 1.5e-3),
        ({"parts": 16}, 3e-4, 4e-4),
        ({"parts": 8, "kind": "q1p0"}, 1e-2, 3e-2),
        ({"parts": 24, "radius_mm": 35.0}, 1e-5, 1e-5),
    ):
        found = washer(**options)
        error = found.tactels_n(sensor) - truth
        assert np.sqrt((error**2).mean() / (truth**2).mean()) <= tactels
        assert abs(found.depth_mm / fine.depth_mm - 1) <= depth


@pytest.mark.parametrize(("height", "allowed"), [(1.0, 0.14), (2.0, 0.08)])
def test_tab_law_to_half_its_height(height, allowed):
    tab = Tab(height_mm=height)
    strain = np.array([0.001, 0.1, 0.2, 0.3, 0.4, 0.5])
    law = (tab.young_mpa / 3) * ((1 - strain) ** -2 - (1 - strain)) * np.pi * tab.diameter_mm**2 / 4
    assert compressed(tab, strain * height, parts=6) == pytest.approx(law, rel=allowed)


def test_partly_covered_tab_bears_less_than_all_and_more_than_its_share():
    tab, strain = Tab(height_mm=1.0), np.array([0.1])
    whole = partly_covered(tab, 1.0, strain, parts=3)
    for share in (0.25, 0.5, 0.75):
        part = float((partly_covered(tab, share, strain, parts=3) / whole)[0])
        assert part == pytest.approx(share * (1 + 0.59 * (1 - share)), abs=0.03)


@pytest.mark.parametrize("wrist", [WristStiffness(), STIFF])
def test_elements_in_space_agree_with_the_section(wrist):
    sensor = SensorType(overlay=Overlay(kind="pad"))
    ball = sphere(20.0)
    at = (0.3, -0.4)
    touch = Touch(-at[0], -at[1], 0.0, 20.0, wrist=wrist)
    found = elements(ball, sensor, touch, **MESH)
    r = np.concatenate([np.linspace(0, 6, 61), 6 + 19 * np.linspace(0, 1, 20)[1:] ** 2])
    pad = section(r, 2 * (1 - (1 - np.linspace(0, 1, 9)) ** 1.6), 1.0, 0.4999)
    points = lambda r: ball.heights_mm(np.stack([r, 0 * r], axis=-1))  # noqa: E731
    truth = indented(pad, points, 20.0)
    # The plate gives way to the moment about the sensor's centre, and the ball rolls on it.
    turn = found.tilt_x_rad, found.tilt_y_rad
    middle = at[0] + 20.0 * turn[1], at[1] - 20.0 * turn[0]
    tactels = truth.tactels_n(sensor, middle)
    error = np.sqrt(((found.forces_n - tactels) ** 2).mean() / (tactels**2).mean())
    assert error <= 8e-3  # 1.2e-3 with two elements on a tactel
    z = found.z_mm + turn[0] * at[1] - turn[1] * at[0]
    assert -z == pytest.approx(truth.depth_mm, rel=5e-3)
    for about, moment in zip(turn, (middle[1] * 20, -middle[0] * 20), strict=True):
        assert about * wrist.tilt_x_nmm_rad == pytest.approx(moment, rel=0.06)  # .004 with two


def test_layer_agrees_with_elements_in_space():
    sensor, surface = SensorType(overlay=Overlay(kind="pad")), paraboloid(60.0)
    touch = Touch(-2.0, 1.1, 0.4, 60.0, 0.01, -0.02)
    truth, found = elements(surface, sensor, touch, **MESH), layer(surface, sensor, touch)
    inner = np.s_[1:-1, 1:-1]  # the outermost bear what the endless layer has beyond them, too
    error = np.linalg.norm((found.forces_n - truth.forces_n)[inner])
    assert error <= 5e-3 * np.linalg.norm(truth.forces_n[inner])
    assert found.z_mm == pytest.approx(truth.z_mm, rel=2e-3)
    tilts = truth.tilt_x_rad, truth.tilt_y_rad
    assert (found.tilt_x_rad, found.tilt_y_rad) == pytest.approx(tilts, abs=1e-4)
