"""Which touches of a scan lie on one lattice, and paths of touches without measured motion."""

import math
from dataclasses import replace

import numpy as np
import pytest

from recognizer.scan.lattice import (
    AGREEMENT_NATS,
    CELL_NATS,
    CORRELATION,
    LEFT_OUT_NATS,
    accumulate,
    predicted_fit,
    refine_agreement,
    same_lattice,
    seed_lattice,
)
from recognizer.scan.mosaic.planar import BY_HAND_SD, PlacedTouch, compose_poses, planar_belief
from recognizer.scan.path import (
    PLACED_SD,
    SHIFTS,
    follow_path,
    known_steps,
    path_ambiguity,
    step_between,
)
from recognizer.scan.views import LatticeView, TouchPoses, stack_views
from recognizer.touch.lab import open_lab
from recognizer.touch.signal import signal_of
from recognizer.touch.symbols.fit import Fit

PITCH = 12.0
T_PLANE_LATTICE = np.array([40.0, -25.0, 0.7])


def label(cells):
    """Symbol 0 or 1 of cells (m, 2)."""
    return (3 * cells[:, 0] + 5 * cells[:, 1] + cells[:, 0] * cells[:, 1]) % 7 % 2


def fit_of(pose, cells, scores, value, covariance):
    x, y, theta = map(float, pose)
    return Fit(
        x_mm=x, y_mm=y, theta_rad=theta, nuisance=np.zeros(4), gain=np.zeros(4), cells=cells,
        scores=scores, seen=np.full(len(cells), 25.0), noise=0.1, value=value,
        covariance=covariance,
    )  # fmt: skip


def fit_at(pose, origin, value=-100.0, sure=5.0, flipped=()):
    """A fit of the nine cells about a pose in the lattice, counted from another origin."""
    about = np.floor(pose[:2] / PITCH).astype(int)
    cells = about + np.array([[i, j] for i in (-1, 0, 1) for j in (-1, 0, 1)])
    shown = label(cells)
    shown[list(flipped)] = 1 - shown[list(flipped)]
    scores = np.full((9, 3), -sure)
    scores[np.arange(9), shown] = 0.0
    x, y, theta = pose - np.append(PITCH * np.asarray(origin), 0.0)
    spread = np.diag([0.05, 0.05, 0.003]) ** 2
    return fit_of((x, y, theta), cells - origin, scores, value, spread)


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


def agreed(views, touch_poses, first=0):
    return refine_agreement(views, touch_poses, seed_lattice(views, touch_poses, first), PITCH)


def at_rest(number, sigma_mm=0.3):
    """Return true poses of touches of one place, and where the arm believes them."""
    true, touch_poses, _fits = a_scan(number, sigma_mm)
    still = true[:1].repeat(number, axis=0)
    plane = compose_poses(T_PLANE_LATTICE, still)
    return still, TouchPoses(plane, touch_poses.covariances, None)


def test_touches_on_one_lattice_agree_and_their_cells_meet():
    true, touch_poses, fits = a_scan()
    views = views_from([(f,) for f in fits])
    found = agreed(views, touch_poses)
    assert (found.chosen == np.arange(6)).all()
    both = accumulate(views, touch_poses, found, PITCH)
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
    found = agreed(views, touch_poses)
    assert found.chosen.tolist() == [0, 1, 3, 4, 5, 6]
    other = agreed(views, touch_poses, 2)
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
    seed = seed_lattice(views, touch_poses, 0)
    found = refine_agreement(views, TouchPoses(touch_poses.poses, wide, None), seed, PITCH)
    assert found.chosen.tolist() == [0, 1, 2, 3, -1, 5]
    both = accumulate(views, touch_poses, found, PITCH)
    assert (both.fit.scores.max(axis=1) == 0).all()


def test_touches_of_one_cell_share_errors():
    still, touch_poses = at_rest(30, sigma_mm=0.1)
    views = views_from([(fit_at(pose, (0, 0), sure=2.0),) for pose in still])
    found = agreed(views, touch_poses)
    both = accumulate(views, touch_poses, found, PITCH)
    assert -both.fit.scores.min() == pytest.approx(2.0 * 30 / (1 + 29 * CORRELATION))
    assert -both.fit.scores.min() < 2.0 / CORRELATION


def test_a_touch_that_contradicts_all_others_is_left_out():
    still, touch_poses = at_rest(8)
    each = [(fit_at(pose, (0, 0), flipped=range(9) if k == 7 else ()),)
            for k, pose in enumerate(still)]  # fmt: skip
    views = views_from(each)
    found = agreed(views, touch_poses)
    assert found.chosen[7] == 7  # by its pose it agrees
    both = accumulate(views, touch_poses, found, PITCH)
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
    found = agreed(views, touch_poses)
    assert found.chosen.tolist() == [0, -1]


SURE = 12.0  # nats
UNKNOWN = planar_belief(np.zeros(3), BY_HAND_SD)


@pytest.fixture(scope="module")
def encoding(make_lab):
    folder = make_lab("{name: Cube, shape: {cube: 80 mm}, profile: thesis}")
    return open_lab(folder / "lab.db").arrays[0]


def view(labels, origin=(0, 0), at=(0.0, 0.0), order=2, value=0.0):
    """A touch that shows labels (n, n), rows from below, -1 for none; at: mm in the first cell."""
    rows, columns = np.shape(labels)
    cells = np.array([(i, j) for j in range(rows) for i in range(columns)]) + origin
    scores = np.full((cells.shape[0], order + 1), -SURE)
    scores[np.arange(len(cells)), [order if each < 0 else each for each in np.ravel(labels)]] = 0.0
    pose = (12.0 * origin[0] + at[0], 12.0 * origin[1] + at[1], 0.3)
    fit = fit_of(pose, cells, scores, value, 1e-4 * np.eye(3))
    return LatticeView(fit, predicted=False)


def block(encoding, row, column, rows=2, columns=3):
    """What a face holds from an array cell on, rows from below."""
    down, right = row - np.arange(rows)[:, None], column + np.arange(columns)[None]
    held, label = encoding.at(*np.broadcast_arrays(down, right))
    assert (held == held[0, 0]).all()
    return label.astype(int), int(held[0, 0])


def corner(encoding, face):
    """Array cell of the lower left corner of a face whose columns are the array's."""
    own = np.flatnonzero(encoding.owners[:-1] == face)
    row, column = np.divmod(encoding.keys[own].astype(np.int64), encoding.array.columns)
    return int(row.max()), int(column.min())


def followed(encoding, views, steps=None):
    steps = steps or [UNKNOWN] * len(views)
    return follow_path(encoding, views, steps)


def test_a_path_decides_places_that_one_touch_leaves_open(encoding):
    row, column = corner(encoding, 0)
    true = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (2, 1), (1, 1)]
    views = []
    for n, (i, j) in enumerate(true):  # each touch has a lattice of its own origin
        labels, _ = block(encoding, row - j, column + i, rows=3)
        views.append([view(labels, origin=(5 * n, -n), at=(14.0, 9.0))])
    path = followed(encoding, views)
    assert path.placed.all()
    steps = np.diff(path.poses[:, :2], axis=0) / 12.0
    assert steps == pytest.approx(np.diff(true, axis=0), abs=1e-9)
    assert path.poses[0] == pytest.approx([12 * column + 14, 9 - 12 * row, 0.3])
    assert path.margin > 10
    assert path.ambiguity < 3
    few = [view(block(encoding, row, column)[0])]
    assert followed(encoding, [few]).margin < 1  # six symbols of two kinds stand in many places
    poses = path.touch_poses(UNKNOWN.covariance)
    assert np.sqrt(np.diag(poses.covariances[3])) == pytest.approx(PLACED_SD)


def test_a_touch_that_fits_nowhere_is_left_out(encoding):
    row, column = corner(encoding, 4)
    views = [[view(block(encoding, row, column + i, rows=3)[0])] for i in range(4)]
    views[2] = [view([[-1, 0, -1], [0, -1, 1]])]
    path = followed(encoding, views)
    assert path.placed.tolist() == [True, True, False, True]
    assert (path.poses[3] - path.poses[1])[:2] == pytest.approx([24.0, 0.0])
    assert path.poses[2] == pytest.approx(path.poses[1])
    wide = path.touch_poses(UNKNOWN.covariance).covariances[2]
    assert np.sqrt(wide[0, 0]) == pytest.approx(BY_HAND_SD[0])
    assert not followed(encoding, [[], []]).placed.any()


def test_a_measured_step_holds_a_path(encoding):
    row, column = corner(encoding, 4)
    views = [[view(block(encoding, row, column + i, rows=3)[0])] for i in (0, 1, 2)]
    c, s = math.cos(0.3), math.sin(0.3)
    right = planar_belief([12 * c, -12 * s, 0.0], (0.3, 0.3, 0.01))  # in the touch's axes
    for step, agrees in ((right, True), (planar_belief([0.0, 30.0, 0.0], (0.3, 0.3, 0.01)), False)):
        path = followed(encoding, views, [UNKNOWN, step, step])
        made = np.diff(path.poses[path.placed], axis=0)[:, :2]
        assert (path.placed.all() and np.allclose(made, [12, 0])) == agrees


def test_steps_follow_from_measurements():
    signal = signal_of(np.zeros((16, 16)))
    touches = [
        PlacedTouch(signal, believed=planar_belief([1.0, 2.0, 0.0], (0.3, 0.3, 0.01))),
        PlacedTouch(signal, believed=planar_belief([4.0, 2.0, 0.1], (0.4, 0.4, 0.01))),
        PlacedTouch(signal, stepped=planar_belief([5.0, 0.0, 0.0], (0.1, 0.1, 0.01))),
        PlacedTouch(signal, believed=planar_belief([9.0, 2.0, 0.1], (0.4, 0.4, 0.01))),
    ]
    steps = known_steps(touches)
    assert steps[1].pose == pytest.approx([3.0, 0.0, 0.1])
    assert steps[1].covariance[0, 0] == pytest.approx(0.25)
    assert steps[2].pose == pytest.approx([5.0, 0.0, 0.0])
    assert np.sqrt(np.diag(steps[3].covariance)) == pytest.approx(BY_HAND_SD)
    both = step_between(steps, 0, 2)
    assert both.pose == pytest.approx([3 + 5 * math.cos(0.1), 5 * math.sin(0.1), 0.1])
    assert both.covariance[0, 0] == pytest.approx(0.26, rel=1e-3)


def ambiguity(second, at=(12.0, 0.0), step=UNKNOWN):
    first = view([[0, 1], [1, 1]], at=(12.0, 12.0))
    fits = {0: first.fit, 1: second.fit}
    poses = np.array([[12.0, 12.0, 0.0], [12.0 + at[0], 12.0 + at[1], 0.0]])
    return path_ambiguity(fits, poses, [UNKNOWN, step], 12.0, 2)


def test_the_ambiguity_of_a_path_counts_the_others_that_touches_allow():
    # one column is seen twice and agrees; by hand: all shifts by their lengths and what they agree
    first, second = np.array([[0, 1], [1, 1]]), np.array([[1, 0], [1, 0]])
    total = own = 0.0
    tiny = math.exp(-CELL_NATS)
    same, other = 1 / (1 + 2 * tiny), tiny / (1 + 2 * tiny)
    for i in range(-SHIFTS, SHIFTS + 1):
        for j in range(-SHIFTS, SHIFTS + 1):
            away = np.array([12.0 + 12 * i, 12.0 * j])
            weight = math.exp(-0.5 * (away @ away) / BY_HAND_SD[0] ** 2)
            for x in (0, 1):
                for y in (0, 1):
                    u, v = x + 1 + i, y + j  # on the first one's cells
                    if 0 <= u < 2 and 0 <= v < 2:
                        p, q = (
                            np.array([same if each == label else other for each in range(3)])
                            for label in (first[v, u], second[y, x])
                        )
                        weight *= 2 * float(p @ q)
            total += weight
            own = weight if i == j == 0 else own
    found = ambiguity(view(second, at=(12.0, 12.0)))
    assert found == pytest.approx(math.log(total / own), abs=1e-6)
    # a step that is known leaves nothing open; one that nothing agrees with is worth nothing
    known = planar_belief([12.0, 0.0, 0.0], (0.5, 0.5, 0.01))
    assert ambiguity(view(second, at=(12.0, 12.0)), step=known) == pytest.approx(0.0, abs=1e-9)
    assert ambiguity(view([[0, 0], [0, 0]], at=(12.0, 12.0))) > 15
