"""Where the sensor stands: truths by complex numbers, and outlines measured by hand."""

import cmath
import math
from types import SimpleNamespace

import numpy as np
import pytest

from recognizer.touch.pose import face_covariance, face_pose, felt_scale, inside_mm, pose_on_object

PITCH, HEIGHT = 7.0, 1.2
ROWS, COLUMNS = 8, 10  # a small torus, so that a wrong way round it shows


def touch(w, turn, rotation, first, cell, steps):
    """Return what `face_pose` takes of a sensor at w (complex, face, mm), turned by `turn`.

    The symbol at `first` (complex, face) is array cell `cell`, and lies `steps` = (i, j) cells
    right of and above lattice cell (0, 0). Five more stand beside it: 6 of the array's 10 columns.
    """
    row, column = cell
    i, j = steps
    centre = PITCH * complex(i + 0.5, j + 0.5)  # of the first symbol, lattice
    at = centre + cmath.exp(1j * rotation) * (w - first)
    run = [first + PITCH * k * cmath.exp(-1j * rotation) for k in range(6)]
    return (
        SimpleNamespace(
            array=SimpleNamespace(rows=ROWS, columns=COLUMNS),
            style=SimpleNamespace(pitch_mm=PITCH, height_mm=HEIGHT),
        ),
        SimpleNamespace(
            rows=np.full(len(run), row),
            columns=(column + np.arange(len(run))) % COLUMNS,
            centres_mm=np.array([[at.real, at.imag] for at in run]),
            rotation_rad=rotation,
        ),
        SimpleNamespace(row=(row + j) % ROWS, column=(column - i) % COLUMNS),
        SimpleNamespace(x_mm=at.real, y_mm=at.imag, theta_rad=turn + rotation),
    )


@pytest.mark.parametrize("rotation", [0.0, 0.4, -2.0, math.pi / 2])
@pytest.mark.parametrize("turn", [0.0, 1.1, -0.7])
@pytest.mark.parametrize(
    ("cell", "steps"), [((2, 3), (0, 0)), ((7, 9), (2, -1)), ((0, 0), (-3, 4)), ((5, 1), (13, -21))]
)
def test_the_pose_on_the_face_is_where_the_sensor_was_put(rotation, turn, cell, steps):
    for w in (20 + 30j, 31.5 + 19j, 11 + 41j):
        pose = face_pose(*touch(w, turn, rotation, 22.0 + 28.5j, cell, steps))
        axis = cmath.exp(1j * turn)
        truth = [
            [axis.real, -axis.imag, 0, w.real],
            [axis.imag, axis.real, 0, w.imag],
            [0, 0, 1, HEIGHT],
            [0, 0, 0, 1],
        ]
        np.testing.assert_allclose(pose, truth, atol=1e-9)


@pytest.mark.parametrize("dx", [-1.4, 0.2, 3.0, 5.4, 6.9])
@pytest.mark.parametrize("dy", [-3.4, 0.0, 3.4])
def test_on_a_face_longer_than_half_of_the_array_the_nearest_symbol_tells_the_place(dx, dy):
    w = PITCH * complex(dx, dy)
    for rotation in (0.0, math.pi / 2):
        pose = face_pose(*touch(w * cmath.exp(-1j * rotation), 0.0, rotation, 0j, (4, 5), (0, 0)))
        at = w * cmath.exp(-1j * rotation)
        assert pose[:2, 3] == pytest.approx([at.real, at.imag])


def test_the_symbol_that_is_nearest_both_ways_tells_the_place():
    embossed, face, place, fit = touch(0j, 0.0, 0.0, 0j, (2, 3), (0, 0))
    # in turn: 2 right and 3 up, 3 right and 2 up, 2 left and 2 down, 3 right and 3 down
    cells = [(5, -1), (6, 0), (1, 4), (6, 5)]
    face.rows, face.columns = np.array([2 - 3, 2 - 2, 2 + 2, 2 + 3]), np.array([5, 6, 1, 6])
    assert len(cells) == len(face.rows)
    marks = np.array([[100.0, 0.0], [200.0, 0.0], [300.0, 0.0], [400.0, 0.0]])
    face.centres_mm = marks
    pose = face_pose(embossed, face, place, fit)
    assert abs(pose[0, 3] - 300.0) < 50.0


@pytest.mark.parametrize("rotation", [0.5, -1.3, math.pi / 2])
def test_errors_of_the_scale_are_turned_as_those_of_the_place_are(rotation):
    face, z = SimpleNamespace(rotation_rad=rotation), 0.3 - 0.2j
    on_face = z * cmath.exp(-1j * rotation)
    fit = SimpleNamespace(nuisance=np.array([1.0, 2.0, 3.0, 0.05, 5.0]), with_scale=None)
    assert felt_scale(face, fit, 0.02) is None
    fit.with_scale = np.array([z.real, z.imag, 0.7, 0.9])
    found = felt_scale(face, fit, 0.02)
    assert (found.excess, found.expected) == (0.05, 0.02)
    np.testing.assert_allclose(found.covariance, [on_face.real, on_face.imag, 0.7, 0.9])


def test_on_a_flat_face_the_pose_goes_through_the_face_on_a_round_one_through_its_tangent():
    T_object_face, T_face_probe, tangent = np.random.default_rng(1).normal(size=(3, 4, 4))
    flat = SimpleNamespace(round=None, T_object_face=T_object_face)
    np.testing.assert_allclose(
        pose_on_object(flat, T_face_probe), np.einsum("ij,jk", T_object_face, T_face_probe)
    )
    asked = []

    def at(x, y):
        asked.append((x, y))
        return tangent

    bent = SimpleNamespace(round=SimpleNamespace(tangent=at), T_object_face=T_object_face)
    np.testing.assert_allclose(
        pose_on_object(bent, T_face_probe), np.einsum("ij,jk", tangent, T_face_probe)
    )
    assert asked == [(T_face_probe[0, 3], T_face_probe[1, 3])]


@pytest.mark.parametrize("rotation", [0.5, -1.3, math.pi / 2, 2.9])
def test_a_covariance_is_turned_as_the_errors_are_that_it_is_of(rotation):
    errors = np.random.default_rng(2).normal(size=(40, 3)) * [3.0, 0.4, 0.1]
    errors[:, 2] += 0.05 * errors[:, 0]
    lattice = [complex(x, y) for x, y in errors[:, :2]]
    on_face = [z * cmath.exp(-1j * rotation) for z in lattice]  # as positions are, above
    turned = np.array([[z.real, z.imag, t] for z, t in zip(on_face, errors[:, 2], strict=True)])
    np.testing.assert_allclose(
        face_covariance(SimpleNamespace(rotation_rad=rotation), errors.T @ errors),
        turned.T @ turned,
        atol=1e-9,
    )


def test_by_a_quarter_turn_what_was_unsure_along_lattice_x_is_unsure_along_face_y():
    covariance = np.diag([9.0, 1.0, 0.01])
    covariance[0, 2] = covariance[2, 0] = 0.2
    found = face_covariance(SimpleNamespace(rotation_rad=math.pi / 2), covariance)
    # lattice x is face -y there: R(90 degrees) takes face (0, -1) to lattice (1, 0)
    np.testing.assert_allclose(found, [[1, 0, 0], [0, 9, -0.2], [0, -0.2, 0.01]], atol=1e-12)


def outline(*loops):
    return SimpleNamespace(polygon_mm=tuple(np.array(loop, float) for loop in loops))


SQUARE = [(0, 0), (10, 0), (10, 8), (0, 8)]
HOLE = [(3, 3), (3, 5), (6, 5), (6, 3)]
DIAMOND = [(5, 0), (10, 5), (5, 10), (0, 5)]


@pytest.mark.parametrize(
    ("x", "y", "inside"),
    [
        (1, 4, 1), (9.5, 4, 0.5), (5, 0.25, 0.25), (5, 7, 1), (5, 4, 4),
        (-2, 4, -2), (13, 4, -3), (5, -1, -1), (5, 12, -4),
        (-3, -4, -5), (13, 12, -5), (13, -4, -5), (-3, 12, -5),
        (-2, 0, -2), (12, 8, -2), (-2, 8, -2), (12, 0, -2), (0.5, 7.5, 0.5),
    ],
)  # fmt: skip
def test_how_far_a_point_lies_inside_a_rectangle(x, y, inside):
    for loop in (SQUARE, SQUARE[::-1], SQUARE[1:] + SQUARE[:1]):
        assert inside_mm(outline(loop), x, y) == pytest.approx(inside)


@pytest.mark.parametrize(
    ("x", "y", "inside"),
    [(4.5, 4, -1), (2, 4, 1), (7.5, 4, 1.5), (-1, 4, -1), (2, 2, math.sqrt(2)), (4, 5.5, 0.5)],
)
def test_a_hole_is_outside(x, y, inside):
    for hole in (HOLE, HOLE[::-1]):
        assert inside_mm(outline(SQUARE, hole), x, y) == pytest.approx(inside)
        assert inside_mm(outline(hole, SQUARE), x, y) == pytest.approx(inside)


@pytest.mark.parametrize(
    ("x", "y", "inside"),
    [
        (5, 5, 5 / math.sqrt(2)), (1, 5, 1 / math.sqrt(2)), (9, 5, 1 / math.sqrt(2)),
        (-1, 5, -1), (11, 5, -1), (5, -2, -2), (5, 13, -3), (1, 1, -3 / math.sqrt(2)),
        (9, 9, -3 / math.sqrt(2)), (9, 1, -3 / math.sqrt(2)), (1, 9, -3 / math.sqrt(2)),
        (4, 3, 2 / math.sqrt(2)), (6, 7, 2 / math.sqrt(2)), (7, 4, 2 / math.sqrt(2)),
    ],
)  # fmt: skip
def test_a_level_through_two_corners_crosses_each_once(x, y, inside):
    for loop in (DIAMOND, DIAMOND[::-1], DIAMOND[2:] + DIAMOND[:2]):
        assert inside_mm(outline(loop), x, y) == pytest.approx(inside)


@pytest.mark.parametrize("low", [0, 7, -9])
def test_a_steep_edge_is_crossed_on_its_own_side(low):
    # y = low + 4 (x - 10): the points lie a hundredth of a mm along x beside it
    loop = [(0, low), (10, low), (20, low + 40), (0, low + 40)]
    normal = 4 / math.sqrt(17)
    for up in (4.0, 20.0, 36.0):
        for away in (0.01, -0.01):
            found = inside_mm(outline(loop), 10 + up / 4 - away, low + up)
            assert found == pytest.approx(away * normal)
