"""Which tactels lie on something, by hand: strokes, the gaps between them, and what lies beyond."""

from __future__ import annotations

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.image import find_loaded_area

SENSOR = SensorType()
SHAPE = (SENSOR.rows, SENSOR.columns)


def loaded(forces, *, noise=1.0, trust=None, sensor=SENSOR):
    known = np.ones(SHAPE) if trust is None else trust
    return find_loaded_area(sensor, Signal(forces, known, True, False, noise))


def strokes(rows, columns, force=100.0):
    """Every third tactel pressed, from the first to the last of some rows and columns."""
    forces = np.zeros(SHAPE)
    forces[rows.start : rows.stop : 3, columns.start : columns.stop : 3] = force
    return forces


def test_gaps_between_strokes_are_loaded_and_what_lies_beyond_them_is_not():
    found = loaded(strokes(range(10), range(7)))
    truth = np.zeros(SHAPE, np.bool_)
    truth[:10, :7] = True
    np.testing.assert_array_equal(found, truth)


def test_a_gap_wider_than_the_square_is_open():
    forces = strokes(range(16), range(16))
    forces[4:12, 4:12] = 0.0
    assert not loaded(forces)[7:9, 7:9].any()
    assert loaded(forces)[:4].all()


@pytest.mark.parametrize(("force", "is_loaded"), [(5.1, True), (4.9, False)])
def test_noise_is_no_load(force, is_loaded):
    forces = strokes(range(10), range(4), 400.0)
    forces[14, 14] = force  # five deviations of the noise
    assert loaded(forces)[14, 14] == is_loaded


@pytest.mark.parametrize(("force", "is_loaded"), [(17.0, True), (15.0, False)])
def test_what_a_strong_neighbour_bleeds_is_no_load(force, is_loaded):
    forces = np.zeros(SHAPE)
    forces[:8] = strokes(range(8), range(16), 400.0)[:8]
    forces[8, 6] = force  # 4 % of the highest, two rows beside one
    assert loaded(forces)[8, 6] == is_loaded


def test_noise_is_at_most_a_share_of_the_strongest_readings():
    light = strokes(range(16), range(16), 8.0)
    assert loaded(light, noise=3.0).all()  # 15 counts would leave none
    light[8:, :] *= 0.1
    assert not loaded(light, noise=3.0)[12:].any()  # 1.2 is five times 3 % of 8


def test_what_cannot_be_told_is_loaded_all_over():
    assert loaded(np.zeros(SHAPE)).all()
    assert loaded(strokes(range(9), range(9)), trust=np.zeros(SHAPE)).all()
    pad = SENSOR.with_overlay("pad")
    assert loaded(strokes(range(9), range(9)), sensor=pad).all()


def test_bad_tactels_load_nothing():
    forces, trust = strokes(range(10), range(4)), np.ones(SHAPE)
    forces[13, 13], trust[13, 13] = 500.0, 0.0
    assert not loaded(forces, trust=trust)[11:, 11:].any()
