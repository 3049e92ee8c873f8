"""The rigid plate on tips and wrist: by hand, against an interior-point solver, and refusals."""

import math

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import rest
from probe.errors import ContactError

POINTS = SensorType().centres_mm().reshape(-1, 2)
FREE, RIGID = WristStiffness(0.0, 0.0), WristStiffness(math.inf, math.inf)
ONE = Linear(1.0)


def load(force=80.0, *wrist, **tilts):
    return Touch(0.0, 0.0, 0.0, force, wrist=WristStiffness(*wrist), **tilts)


def test_level_springs_share_the_force():
    found = rest(POINTS, np.full(256, 3.0), Linear(2.0), load(51.2))
    assert found.pose.z_mm == pytest.approx(3.0 - 51.2 / (256 * 2.0), rel=1e-12)
    assert abs(found.pose.tilt_x_rad) + abs(found.pose.tilt_y_rad) < 1e-15
    np.testing.assert_allclose(found.forces_n, 0.2, rtol=1e-12)


def test_one_tip_off_the_centre_turns_the_plate_against_the_wrist():
    at, force = np.array([[4.0, -3.0]]), 5.0
    found = rest(at, np.zeros(1), Linear(10.0), load(force, 3000.0, 2000.0))
    assert found.pose.tilt_x_rad == pytest.approx(force * -3.0 / 3000, rel=1e-12)
    assert found.pose.tilt_y_rad == pytest.approx(-force * 4.0 / 2000, rel=1e-12)
    # The tip alone is pressed by F/k; there the plate stands that much below the surface.
    assert found.pose.heights_mm(at)[0] == pytest.approx(-force / 10, rel=1e-12)


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


def test_neo_hooke_is_linear_at_small_strain_and_its_tangent_is_its_slope():
    law = NeoHooke(0.7, 2.0)
    at = np.array([-3.0, 1e-12, 1e-3, 0.4, 1.5, 1.999])
    force, tangent = law(at)
    assert force[1] == pytest.approx(0.7e-12, rel=1e-10)
    assert tangent[1] == pytest.approx(0.7, rel=1e-10)
    step = 1e-6 * (2.0 - at)
    slope = (law(at + step)[0] - law(at - step)[0]) / (2 * step)
    np.testing.assert_allclose(tangent, slope, rtol=1e-6)
    assert (tangent > 0).all()


def test_an_interior_point_solver_finds_the_same_rest():
    rng = np.random.default_rng(4)
    for _ in range(12):
        n = int(rng.integers(3, 120))
        points, heights = POINTS[rng.choice(256, n, replace=False)], rng.random(n)
        k, wrist = 10 ** rng.uniform(-2, 2, n), 10 ** rng.uniform(1, 5, 2)
        a, b = rng.uniform(-0.05, 0.05, 2)
        touch = load(10 ** rng.uniform(-1, 2), *wrist, tilt_x_rad=a, tilt_y_rad=b)
        pose = rest(points, heights, Linear(k), touch).pose
        z, turn_x, turn_y = oracle(points, heights, k, touch)
        assert pose.z_mm == pytest.approx(z, abs=1e-6)
        assert (pose.tilt_x_rad, pose.tilt_y_rad) == pytest.approx((turn_x, turn_y), abs=1e-7)


def oracle(points, heights, k, touch):
    """Minimise sum k d^2/2 + wrist + F z with d >= 0, d >= h - zeta; over z, the tilts and d."""
    n = len(k)
    x, y = points.T
    wrist = np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad])
    P = sp.block_diag([sp.diags(wrist), sp.diags(k)], "csc")
    q = np.r_[touch.force_n, -wrist[1:] * [touch.tilt_x_rad, touch.tilt_y_rad], np.zeros(n)]
    rows = np.stack([-np.ones(n), -y, x], axis=1)
    A = sp.vstack([sp.hstack([rows, -sp.eye(n)]), sp.hstack([np.zeros((n, 3)), -sp.eye(n)])])
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    cones = [clarabel.NonnegativeConeT(2 * n)]
    b = np.r_[-heights, np.zeros(n)]
    solver = clarabel.DefaultSolver(
        sp.triu(P, format="csc"), q, sp.csc_matrix(A), b, cones, settings
    )
    return np.array(solver.solve().x[:3])


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


def test_far_from_the_origin_nothing_is_lost():
    near, far = (rest(POINTS, np.full(256, z), NeoHooke(0.6, 2.0), load()) for z in (0.0, 2.0**20))
    np.testing.assert_array_equal(far.forces_n, near.forces_n)


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
