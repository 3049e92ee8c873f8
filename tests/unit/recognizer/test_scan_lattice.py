"""Which touches of a scan lie on one lattice, and what they say together."""

import math
from dataclasses import replace

import numpy as np
import pytest

from recognizer.scan.lattice import (
    AGREEMENT_NATS,
    CORRELATION,
    LEFT_OUT_NATS,
    accumulate,
    predicted_fit,
    refine_agreement,
    same_lattice,
    seed_lattice,
)
from recognizer.scan.mosaic.planar import compose_poses
from recognizer.scan.views import LatticeView, TouchPoses, stack_views
from recognizer.touch.symbols.fit import Fit

PITCH = 12.0
T_PLANE_LATTICE = np.array([40.0, -25.0, 0.7])


def label(cells):
    """Symbol 0 or 1 of cells (m, 2)."""
    return (3 * cells[:, 0] + 5 * cells[:, 1] + cells[:, 0] * cells[:, 1]) % 7 % 2


def fit_at(pose, origin, value=-100.0, sure=5.0, flipped=()):
    """A fit of the nine cells about a pose in the lattice, counted from another origin."""
    about = np.floor(pose[:2] / PITCH).astype(int)
    cells = about + np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    shown = label(cells)
    shown[list(flipped)] = 1 - shown[list(flipped)]
    scores = np.full((9, 3), -sure)
    scores[np.arange(9), shown] = 0.0
    x, y, theta = pose - np.append(PITCH * np.asarray(origin), 0.0)
    return Fit(
        x_mm=float(x),
        y_mm=float(y),
        theta_rad=float(theta),
        nuisance=np.zeros(4),
        gain=np.zeros(4),
        cells=cells - origin,
        scores=scores,
        seen=np.full(9, 20.0),
        noise=0.1,
        value=value,
        covariance=np.diag([0.05, 0.05, 0.003]) ** 2,
    )


def a_scan(number=6, sigma_mm=0.3, seed=1):
    """True poses in the lattice, where the arm believes them, and fits from origins at random."""
    rng = np.random.default_rng(seed)
    true = np.column_stack(
        [7.0 * np.arange(number), 4.0 * np.arange(number) % 11, np.zeros(number)]
    )
    true[:, 2] = 0.3
    plane = compose_poses(T_PLANE_LATTICE, true)
    believed = plane + rng.normal(0, sigma_mm, (number, 3)) * [1, 1, 0.01]
    spread = np.tile(np.diag([sigma_mm, sigma_mm, 0.01 * sigma_mm]) ** 2, (number, 1, 1))
    fits = [fit_at(pose, rng.integers(-9, 9, 2)) for pose in true]
    return true, TouchPoses(believed, spread, None), fits


def views_from(fits):
    return stack_views([tuple(LatticeView(f, predicted=False) for f in each) for each in fits])


def test_touches_on_one_lattice_agree_and_their_cells_meet():
    true, touch_poses, fits = a_scan()
    views = views_from([(f,) for f in fits])
    found = refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, 0), PITCH)
    assert (found.chosen == np.arange(6)).all()
    both = accumulate(views, touch_poses, found, PITCH)
    assert both is not None
    # counted from the origin of the first touch, every cell has its own symbol, once
    origin = np.round((true[0, :2] - [fits[0].x_mm, fits[0].y_mm]) / PITCH).astype(int)
    cells = both.fit.cells + origin
    assert (both.fit.scores.argmax(axis=1) == label(cells)).all()
    assert both.fit.scores.max() == 0
    expected = {tuple(c + np.round((true[k, :2] - [f.x_mm, f.y_mm]) / PITCH).astype(int))
                for k, f in enumerate(fits) for c in f.cells}  # fmt: skip
    assert {tuple(cell) for cell in cells} == expected
    # and its pose is that of the last touch
    assert both.fit.x_mm + PITCH * origin[0] == pytest.approx(true[-1, 0], abs=1e-6)
    assert both.fit.y_mm + PITCH * origin[1] == pytest.approx(true[-1, 1], abs=1e-6)


@pytest.mark.parametrize("worse", [0.0, 200.0])
def test_a_wrong_lattice_of_one_touch_is_passed_over(worse):
    _true, touch_poses, fits = a_scan()
    wrong = replace(fits[2], x_mm=fits[2].x_mm + 4.0, theta_rad=fits[2].theta_rad + 1.2)
    each = [(f,) for f in fits]
    each[2] = (wrong, replace(fits[2], value=fits[2].value - worse))
    views = views_from(each)
    found = refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, 0), PITCH)
    assert found.chosen.tolist() == [0, 1, 3, 4, 5, 6]
    other = refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, 2), PITCH)
    assert (other.chosen >= 0).sum() == 1
    assert other.score < found.score - 40
    assert not same_lattice(found.lattice, other.lattice, touch_poses.poses[2], PITCH)
    # however much better it explains its image, it costs what leaving it out costs
    assert found.score > 5 * AGREEMENT_NATS - LEFT_OUT_NATS - 10


def test_a_touch_with_ambiguous_whole_pitches_is_left_out():
    _true, touch_poses, fits = a_scan()
    views = views_from([(f,) for f in fits])
    wide = touch_poses.covariances.copy()
    wide[4] = np.diag([PITCH / 2, PITCH / 2, 0.01]) ** 2
    found = refine_agreement(
        views, TouchPoses(touch_poses.poses, wide, None), seed_lattice(views, touch_poses, 0), PITCH
    )
    assert found.chosen.tolist() == [0, 1, 2, 3, -1, 5]
    both = accumulate(views, touch_poses, found, PITCH)
    assert both is not None
    assert (both.fit.scores.max(axis=1) == 0).all()


def test_touches_of_one_cell_share_errors():
    true, touch_poses, _fits = a_scan(number=30, sigma_mm=0.1)
    still = true[:1].repeat(30, axis=0)
    touch_poses = TouchPoses(compose_poses(T_PLANE_LATTICE, still), touch_poses.covariances, None)
    views = views_from([(fit_at(pose, (0, 0), sure=2.0),) for pose in still])
    found = refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, 0), PITCH)
    both = accumulate(views, touch_poses, found, PITCH)
    assert both is not None
    assert -both.fit.scores.min() == pytest.approx(2.0 * 30 / (1 + 29 * CORRELATION))
    assert -both.fit.scores.min() < 2.0 / CORRELATION


def test_a_touch_that_contradicts_all_others_is_left_out():
    true, touch_poses, _fits = a_scan(number=8)
    still = true[:1].repeat(8, axis=0)
    touch_poses = TouchPoses(compose_poses(T_PLANE_LATTICE, still), touch_poses.covariances, None)
    each = [(fit_at(pose, (0, 0), flipped=range(9) if k == 7 else ()),)
            for k, pose in enumerate(still)]  # fmt: skip
    views = views_from(each)
    found = refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, 0), PITCH)
    assert found.chosen[7] == 7  # by its pose it agrees
    both = accumulate(views, touch_poses, found, PITCH)
    assert both is not None
    assert both.agreement.chosen.tolist() == [0, 1, 2, 3, 4, 5, 6, -1]
    assert both.agreement.score == pytest.approx(both.agreement.scores.sum())
    assert (both.fit.scores.argmax(axis=1) == label(both.fit.cells)).all()
    # it stands where the others and the arm say
    there = predicted_fit(both, touch_poses)
    assert math.hypot(there.x_mm - both.fit.x_mm, there.y_mm - both.fit.y_mm) < 1e-9


def test_fits_with_an_indefinite_pose_are_no_views():
    _true, touch_poses, fits = a_scan(number=2)
    lost = replace(fits[1], covariance=np.zeros((3, 3)))
    vague = replace(fits[1], covariance=np.diag([900.0, 0.01, 1e-4]))
    none = replace(fits[1], covariance=np.full((3, 3), np.nan))
    views = views_from([(fits[0],), (lost, vague, none)])
    assert views.touch.tolist() == [0]
    assert np.isfinite(views.values).all()
    found = refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, 0), PITCH)
    assert found.chosen.tolist() == [0, -1]
