"""Where the sensor stands: truths by complex numbers, and outlines measured by hand."""

import cmath
import math
from types import SimpleNamespace

import numpy as np
import pytest

from recognizer.touch.pose import face_pose, inside_mm

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
@pytest.mark.parametrize("steps", [(0, 0), (2, -1), (-3, 4), (13, -21)])
def test_the_pose_on_the_face_is_where_the_sensor_was_put(rotation, steps):
    for turn, w in ((0.0, 20 + 30j), (1.1, 31.5 + 19j), (-0.7, 11 + 41j)):
        pose = face_pose(*touch(w, turn, rotation, 22.0 + 28.5j, (7, 9), steps))
        axis = cmath.exp(1j * turn)
        np.testing.assert_allclose(pose[:2, 0], [axis.real, axis.imag], atol=1e-9)
        np.testing.assert_allclose(pose[:3, 3], [w.real, w.imag, HEIGHT], atol=1e-9)


@pytest.mark.parametrize("dx", [-1.4, 0.2, 3.0, 5.4, 6.9])
@pytest.mark.parametrize("dy", [-3.4, 0.0, 3.4])
def test_on_a_face_longer_than_half_of_the_array_the_nearest_symbol_tells_the_place(dx, dy):
    for rotation in (0.0, math.pi / 2):
        at = PITCH * complex(dx, dy) * cmath.exp(-1j * rotation)
        pose = face_pose(*touch(at, 0.0, rotation, 0j, (4, 5), (0, 0)))
        assert pose[:2, 3] == pytest.approx([at.real, at.imag])


def test_the_symbol_that_is_nearest_both_ways_tells_the_place():
    embossed, face, place, fit = touch(0j, 0.0, 0.0, 0j, (2, 3), (0, 0))
    # in turn: 2 right and 3 up, 3 right and 2 up, 2 left and 2 down, 3 right and 3 down
    face.rows, face.columns = np.array([2 - 3, 2 - 2, 2 + 2, 2 + 3]), np.array([5, 6, 1, 6])
    face.centres_mm = np.array([[100.0, 0.0], [200.0, 0.0], [300.0, 0.0], [400.0, 0.0]])
    assert abs(face_pose(embossed, face, place, fit)[0, 3] - 300.0) < 50.0


SQUARE = [(0, 0), (10, 0), (10, 8), (0, 8)]
HOLE = [(3, 3), (3, 5), (6, 5), (6, 3)]
DIAMOND = [(5, 0), (10, 5), (5, 10), (0, 5)]
ROOT = math.sqrt(2)


@pytest.mark.parametrize(
    ("loops", "points"),
    [
        ([SQUARE], [
            (1, 4, 1), (9.5, 4, 0.5), (5, 0.25, 0.25), (5, 7, 1), (5, 4, 4), (0.5, 7.5, 0.5),
            (-2, 4, -2), (13, 4, -3), (5, -1, -1), (5, 12, -4), (-3, -4, -5), (13, 12, -5),
            (13, -4, -5), (-3, 12, -5), (-2, 0, -2), (12, 8, -2), (-2, 8, -2), (12, 0, -2),
        ]),
        ([SQUARE, HOLE], [
            (4.5, 4, -1), (2, 4, 1), (7.5, 4, 1.5), (-1, 4, -1), (2, 2, ROOT), (4, 5.5, 0.5),
        ]),
        # a level through two corners crosses each once
        ([DIAMOND], [
            (5, 5, 5 / ROOT), (1, 5, 1 / ROOT), (9, 5, 1 / ROOT), (-1, 5, -1), (11, 5, -1),
            (5, -2, -2), (5, 13, -3), (1, 1, -3 / ROOT), (9, 9, -3 / ROOT), (9, 1, -3 / ROOT),
            (1, 9, -3 / ROOT), (4, 3, 2 / ROOT), (6, 7, 2 / ROOT), (7, 4, 2 / ROOT),
        ]),
        # of a steep edge, y = 4 (x - 10), a hundredth of a mm along x either side of it
        ([[(0, 0), (10, 0), (20, 40), (0, 40)]], [
            (10 + up / 4 - away, up, away * 4 / math.sqrt(17))
            for up in (4.0, 20.0, 36.0) for away in (0.01, -0.01)
        ]),
    ],
)  # fmt: skip
def test_how_far_a_point_lies_inside_an_outline(loops, points):
    turned = [one[1:] + one[:1] for one in loops]
    for way in (loops, loops[::-1], [one[::-1] for one in loops], turned):
        outline = SimpleNamespace(polygon_mm=tuple(np.array(loop, float) for loop in way))
        found = [inside_mm(outline, x, y) for x, y, _ in points]
        assert found == pytest.approx([inside for *_, inside in points])
