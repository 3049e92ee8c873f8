"""Where to touch next: towards what is loaded, never off the face, to what was not seen."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.hypothesis import Hypothesis, PlaceHypothesis
from recognizer.touch.lab import EncodedFace
from recognizer.touch.next_touch import FORCE_N, EarlierTouch, propose_next
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, NO_CONTACT, TOO_FEW, NextTouch, refusal
from recognizer.touch.signal import signal_of

SENSOR = SensorType()
X, Y = SENSOR.centres_mm().reshape(16, 16, 2).transpose(2, 0, 1)


def reader(small):
    lab = SimpleNamespace(arrays=(small.two_faces().embossed,))
    return SimpleNamespace(sensor=SENSOR, options=ReaderOptions(), lab=lab)


def felt(where, counts=200.0, seed=1):
    """An image with strokes two tactels wide, four apart, where something is under the sensor."""
    strokes = ((np.indices((16, 16)) % 4) < 2).any(axis=0)
    noise = np.random.default_rng(seed).uniform(0, 6, (16, 16))
    return signal_of(np.where(where & strokes, counts, 0.0) + noise)


def step_of(small, where, reason=TOO_FEW, **given):
    found = propose_next(
        reader(small), felt(where), refusal(0, reason), given.pop("known", ()), **given
    )
    return np.array([found.dx_mm, found.dy_mm]), found


@pytest.mark.parametrize("turn", range(0, 360, 30))
def test_a_step_goes_towards_the_loaded_half_and_stays_on_it(small, turn):
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    step, found = step_of(small, c * X + s * Y > 3.0)
    along, across = step @ (c, s), abs(step @ (-s, c))
    assert 7.0 <= along <= 14.0
    assert across <= along
    assert (np.abs(step) < SENSOR.half_mm).all()  # there the face was felt
    assert "towards the loaded part" in found.why
    assert found.force_n == FORCE_N


@pytest.mark.parametrize(("right", "up"), [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_at_a_corner_a_step_goes_inwards_along_both_edges(small, right, up):
    step, _ = step_of(small, (right * X > 0) & (up * Y > 0))
    assert step[0] * right >= 5
    assert step[1] * up >= 5


def test_along_a_narrow_face_the_sensor_is_turned_and_keeps_to_the_middle(small):
    _, found = step_of(small, np.abs(Y) < 4.0)
    assert found.dy_mm == pytest.approx(0.0, abs=2.0)
    assert found.turn_deg == 45.0


def test_what_was_seen_before_is_not_sought_again(small):
    inside = np.full((16, 16), True)
    right = np.array([[x, y, 0.0] for x in (9.0, 18.0) for y in (-20.0, 0.0, 20.0)])
    before = [EarlierTouch(pose, felt(inside)) for pose in right]
    assert step_of(small, inside, earlier=before)[0][0] < -4
    before = [EarlierTouch(-pose, felt(inside)) for pose in right]
    assert step_of(small, inside, earlier=before)[0][0] > 4


def test_what_a_touch_before_did_not_feel_is_no_face(small):
    inside = np.full((16, 16), True)
    for side in (-1, 1):  # there the touch before was loaded on its near side alone
        before = [EarlierTouch(np.array([14.0 * side, 0.0, 0.0]), felt(side * X < -4))]
        assert step_of(small, inside, earlier=before)[0][0] * side <= 0


def test_without_contact_the_same_place_is_pressed_harder(small):
    nothing = signal_of(np.full((16, 16), 8.0))
    found = propose_next(reader(small), nothing, refusal(0, NO_CONTACT), ())
    assert (found.dx_mm, found.dy_mm, found.turn_deg) == (0.0, 0.0, 0.0)
    assert found.force_n == FORCE_N
    assert "nothing is felt" in found.why


def test_a_weak_touch_asks_for_more_force_and_a_strong_one_does_not(small):
    weak = propose_next(reader(small), felt(X < 99, 30.0), refusal(0, TOO_FEW), ())
    strong = propose_next(reader(small), felt(X < 99, 300.0), refusal(0, TOO_FEW), ())
    assert "more force" in weak.why
    assert "more force" not in strong.why


def test_a_sure_answer_needs_no_other_touch_and_an_unsure_one_does(small):
    answer = replace(refusal(0, ""), object="Thing", face="F1", margin=15.0, doubt=1e-6)
    for changed, asks in [({}, False), ({"margin": 13.0}, True), ({"doubt": 5e-5}, True)]:
        found = propose_next(reader(small), felt(X < 99), replace(answer, **changed), ())
        assert (found is not None) == asks


def known_face(small, x_mm, y_mm):
    """A hypothesis of a face of 42 x 42 mm; the sensor's centre stands at (x, y) on it."""
    embossed = small.two_faces().embossed
    i, j = np.meshgrid(np.arange(6), np.arange(6))
    embossed.known[0] = EncodedFace(
        object="Thing", face="F1", T_object_face=np.eye(4), rotation_rad=0.0, rows=np.array([6]),
        columns=np.array([2]), labels=np.array([0]),
        polygon_mm=(np.array([(0, 0), (42, 0), (42, 42), (0, 42)], float),),
        centres_mm=np.stack([i, j], axis=-1).reshape(-1, 2) * 7.0 + 3.5,
    )  # fmt: skip
    fit = small.fit_of([(0, 0)], [[0.0] * 5], x_mm=x_mm, y_mm=y_mm)
    return PlaceHypothesis(embossed, Hypothesis(0, 6, 2, 0, 0.0), fit, 0.0)


@pytest.mark.parametrize(("x", "sign"), [(8.0, 1), (34.0, -1)])
def test_where_several_places_are_left_their_borders_count(small, x, sign):
    all_over = np.full((16, 16), True)
    step, _ = step_of(small, all_over, AMBIGUOUS, known=[known_face(small, x, 21.0)])
    assert step[0] * sign > 3
    assert 2.5 < x + step[0] < 39.5


def test_hypotheses_of_what_is_no_encoded_surface_know_no_border(small):
    all_over = np.full((16, 16), True)
    plain, _ = step_of(small, all_over)
    told, _ = step_of(small, all_over, known=[known_face(small, 8.0, 21.0)])
    assert told == pytest.approx(plain)


def test_a_step_reads_well_and_stands_in_the_json():
    step = NextTouch(7.0, -3.5, 45.0, 80.0, "because")
    assert str(step) == "7 mm along x, -3.5 mm along y, turned by 45 degrees, 80 N (because)"
    answer = replace(refusal(3, TOO_FEW), next=step)
    assert answer.as_json()["next"] == {
        "dx_mm": 7.0, "dy_mm": -3.5, "turn_deg": 45.0, "force_n": 80.0, "why": "because",
    }  # fmt: skip
    assert refusal(3, TOO_FEW).as_json()["next"] is None
    assert str(step) in str(answer)
