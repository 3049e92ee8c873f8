"""The rigid plate on tips and wrist: by hand, against an interior-point solver, and refusals."""

import math

import clarabel
import numpy as np
import pytest
import scipy.sparse as sp

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch, WristStiffness
from probe.contact.neo_hooke import Linear, NeoHooke
from probe.contact.plate import PlateLoad, load_of, rest
from probe.errors import ContactError

POINTS = SensorType().centres_mm().reshape(-1, 2)
FREE = WristStiffness(0.0, 0.0)
RIGID = WristStiffness(math.inf, math.inf)


def test_level_springs_share_the_force():
    found = rest(POINTS, np.full(256, 3.0), Linear(2.0), PlateLoad(51.2))
    assert found.pose.z_mm == pytest.approx(3.0 - 51.2 / (256 * 2.0), rel=1e-12)
    assert abs(found.pose.tilt_x_rad) + abs(found.pose.tilt_y_rad) < 1e-15
    np.testing.assert_allclose(found.forces_n, 0.2, rtol=1e-12)


def test_one_tip_off_the_centre_turns_the_plate_against_the_wrist():
    at, force = np.array([[4.0, -3.0]]), 5.0
    found = rest(at, np.zeros(1), Linear(10.0), PlateLoad(force, WristStiffness(3000.0, 2000.0)))
    assert found.pose.tilt_x_rad == pytest.approx(force * -3.0 / 3000, rel=1e-12)
    assert found.pose.tilt_y_rad == pytest.approx(-force * 4.0 / 2000, rel=1e-12)
    # The tip alone is pressed by F/k; there the plate stands that much below the surface.
    assert found.pose.heights_mm(at)[0] == pytest.approx(-force / 10, rel=1e-12)


def test_a_stiff_arm_keeps_its_tilt_and_a_soft_one_gives_way():
    tilted = {"tilt_x_rad": 0.02, "tilt_y_rad": -0.01}
    held = rest(POINTS, np.zeros(256), Linear(1.0), PlateLoad(80.0, RIGID, **tilted)).pose
    assert (held.tilt_x_rad, held.tilt_y_rad) == (0.02, -0.01)
    nearly = rest(
        POINTS, np.zeros(256), Linear(1.0), PlateLoad(80.0, WristStiffness(1e12, 1e12), **tilted)
    ).pose
    assert nearly.z_mm == pytest.approx(held.z_mm, rel=1e-6)
    soft = rest(
        POINTS, np.zeros(256), Linear(1.0), PlateLoad(80.0, WristStiffness(1e-3, 1e-3), **tilted)
    ).pose
    assert math.hypot(soft.tilt_x_rad, soft.tilt_y_rad) < 1e-6


def test_moments_move_the_centre_of_pressure():
    load = PlateLoad(10.0, FREE, moment_x_nmm=-20.0, moment_y_nmm=30.0)
    found = rest(POINTS, np.zeros(256), Linear(1.0), load)
    centre = found.forces_n @ POINTS / found.forces_n.sum()
    np.testing.assert_allclose(centre, [3.0, 2.0], rtol=1e-9)


@pytest.mark.parametrize("force", [1e-9, 1e-3, 1.0, 80.0, 1e6, 1e9])
def test_a_crushed_column_answers_by_its_law(force):
    found = rest(np.zeros((1, 2)), np.array([0.5]), NeoHooke(0.6, 2.0), PlateLoad(force, FREE))
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
        points = POINTS[rng.choice(256, n, replace=False)]
        heights = rng.random(n)
        k = 10 ** rng.uniform(-2, 2, n)
        wrist = WristStiffness(*(10 ** rng.uniform(1, 5, 2)))
        load = PlateLoad(10 ** rng.uniform(-1, 2), wrist, *rng.uniform(-0.05, 0.05, 2))
        found = rest(points, heights, Linear(k), load)
        z, turn_x, turn_y = _oracle(points, heights, k, load)
        assert found.pose.z_mm == pytest.approx(z, abs=1e-6)
        assert found.pose.tilt_x_rad == pytest.approx(turn_x, abs=1e-7)
        assert found.pose.tilt_y_rad == pytest.approx(turn_y, abs=1e-7)


def _oracle(points, heights, k, load):
    """Minimise sum k d^2/2 + wrist + F z with d >= 0, d >= h - zeta; over z, the tilts and d."""
    n = len(k)
    x, y = points.T
    wrist = np.array([0.0, load.wrist.tilt_x_nmm_rad, load.wrist.tilt_y_nmm_rad])
    P = sp.block_diag([sp.diags(wrist), sp.diags(k)], "csc")
    q = np.r_[load.force_n, -wrist[1:] * [load.tilt_x_rad, load.tilt_y_rad], np.zeros(n)]
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


@pytest.mark.parametrize(
    ("moment_y", "stands"), [(0.0, True), (11.8, True), (12.0, False), (-12.0, False), (1e9, False)]
)
def test_a_free_plate_tips_where_the_centre_of_pressure_leaves_the_hull(moment_y, stands):
    load = PlateLoad(1.0, FREE, moment_y_nmm=moment_y)
    heights = np.full(256, -1.0)
    heights[[37, 200]] = 0.0
    if stands:
        found = rest(POINTS, heights, Linear(1.0), load)
        assert found.forces_n.sum() == pytest.approx(1.0, rel=1e-9)
        assert found.forces_n @ POINTS[:, 0] == pytest.approx(moment_y, abs=1e-8)
        return
    with pytest.raises(
        ContactError, match=r"tips.*centre of pressure.*hull.*-11\.91 \.\.\. 11\.91"
    ):
        rest(POINTS, heights, Linear(1.0), load)


def test_a_free_plate_on_one_tip_stands_under_it_alone():
    at = np.array([[2.0, 1.0]])
    under = PlateLoad(1.0, FREE, moment_x_nmm=-1.0, moment_y_nmm=2.0)
    assert rest(at, np.zeros(1), Linear(1.0), under).forces_n == pytest.approx(1.0)
    with pytest.raises(ContactError, match="tips"):
        rest(at, np.zeros(1), Linear(1.0), PlateLoad(1.0, FREE))


def test_a_wrist_that_is_free_about_one_axis_needs_the_hull_along_it_alone():
    at = np.array([[2.0, 1.0], [2.0, -1.0]])
    about_y_held = PlateLoad(1.0, WristStiffness(0.0, 100.0))
    assert rest(at, np.zeros(2), Linear(1.0), about_y_held).forces_n.sum() == pytest.approx(1.0)
    with pytest.raises(ContactError, match="tips"):
        rest(at, np.zeros(2), Linear(1.0), PlateLoad(1.0, WristStiffness(100.0, 0.0)))


def test_no_force_is_no_contact():
    found = rest(POINTS, np.zeros(256), Linear(1.0), PlateLoad(0.0, tilt_x_rad=0.1))
    assert not found.forces_n.any()
    assert found.pose.z_mm == math.inf
    assert found.pose.tilt_x_rad == 0.1


def test_far_from_the_origin_nothing_is_lost():
    near = rest(POINTS, np.zeros(256), NeoHooke(0.6, 2.0), PlateLoad(80.0))
    far = rest(POINTS, np.full(256, 2.0**20), NeoHooke(0.6, 2.0), PlateLoad(80.0))
    np.testing.assert_array_equal(far.forces_n, near.forces_n)


@pytest.mark.parametrize(
    "load",
    [
        PlateLoad(-1.0),
        PlateLoad(math.nan),
        PlateLoad(math.inf),
        PlateLoad(1.0, tilt_x_rad=math.nan),
        PlateLoad(1.0, WristStiffness(-1.0, 0.0)),
        PlateLoad(1.0, WristStiffness(math.nan, 1.0)),
        PlateLoad(0.0, moment_x_nmm=1.0),
    ],
)
def test_loads_that_are_none_are_refused(load):
    with pytest.raises(ContactError):
        rest(POINTS, np.zeros(256), Linear(1.0), load)


def test_nothing_under_the_plate_is_refused():
    with pytest.raises(ContactError, match="nothing under the plate to bear 5 N"):
        rest(POINTS, np.full(256, -math.inf), Linear(1.0), PlateLoad(5.0))


def test_a_touch_is_a_load():
    touch = Touch(1.0, 2.0, 0.3, 40.0, 0.01, 0.02, WristStiffness(5.0, 6.0))
    assert load_of(touch) == PlateLoad(40.0, WristStiffness(5.0, 6.0), 0.01, 0.02)
