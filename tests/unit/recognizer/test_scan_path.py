"""Touches without measured motion, followed along registered places."""

import math

import numpy as np
import pytest

from generator.pipeline import encode
from generator.spec import read_specs
from recognizer.scan.lattice import CELL_NATS
from recognizer.scan.mosaic.planar import BY_HAND_SD, PlacedTouch, planar_belief
from recognizer.scan.path import (
    PLACED_SD,
    SHIFTS,
    follow_path,
    known_steps,
    path_ambiguity,
    step_between,
)
from recognizer.scan.views import LatticeView
from recognizer.touch.lab import open_lab
from recognizer.touch.signal import signal_of
from recognizer.touch.symbols.fit import Fit

SURE = 12.0  # nats
UNKNOWN = planar_belief(np.zeros(3), BY_HAND_SD)


@pytest.fixture(scope="module")
def encoding(tmp_path_factory):
    folder = tmp_path_factory.mktemp("path")
    (folder / "cube.yaml").write_text("{name: Cube, shape: {cube: 80 mm}, profile: thesis}")
    url = f"sqlite:///{folder / 'lab.db'}"
    encode(read_specs([folder / "cube.yaml"]), folder=folder, database=url, formats=())
    return open_lab(url).arrays[0]


def view(labels, origin=(0, 0), at=(0.0, 0.0), order=2, value=0.0):
    """A touch that shows labels (n, n), rows from below, -1 for none; at: mm in the first cell."""
    rows, columns = np.shape(labels)
    cells = np.array([(i, j) for j in range(rows) for i in range(columns)]) + origin
    scores = np.full((cells.shape[0], order + 1), -SURE)
    scores[np.arange(len(cells)), [order if each < 0 else each for each in np.ravel(labels)]] = 0.0
    fit = Fit(
        x_mm=12.0 * origin[0] + at[0], y_mm=12.0 * origin[1] + at[1], theta_rad=0.3,
        nuisance=np.zeros(4), gain=np.zeros(4), cells=cells, scores=scores,
        seen=np.full(len(cells), 30.0), noise=0.1, value=value, covariance=1e-4 * np.eye(3),
    )  # fmt: skip
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
