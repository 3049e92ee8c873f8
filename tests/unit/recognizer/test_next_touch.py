"""Where to touch next: towards what is loaded, never off the face, to what was not seen."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import GEL_IMPRINT_MM, Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from recognizer.touch.hypothesis import Hypothesis, PlaceHypothesis
from recognizer.touch.lab import EncodedFace
from recognizer.touch.next_touch import FORCE_N, NextLimits, next_limits, propose_next
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, NO_CONTACT, TOO_FEW, refusal
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
    before = [(pose, felt(inside)) for pose in right]
    assert step_of(small, inside, earlier=before)[0][0] < -4
    before = [(-pose, felt(inside)) for pose in right]
    assert step_of(small, inside, earlier=before)[0][0] > 4


def test_what_a_touch_before_did_not_feel_is_no_face(small):
    inside = np.full((16, 16), True)
    for side in (-1, 1):  # there the touch before was loaded on its near side alone
        before = [(np.array([14.0 * side, 0.0, 0.0]), felt(side * X < -4))]
        assert step_of(small, inside, earlier=before)[0][0] * side <= 0


def test_without_contact_the_same_place_is_pressed_harder(small):
    nothing = signal_of(np.full((16, 16), 8.0))
    found = propose_next(reader(small), nothing, refusal(0, NO_CONTACT), ())
    assert (found.dx_mm, found.dy_mm, found.turn_deg) == (0.0, 0.0, 0.0)
    assert found.force_n == FORCE_N
    assert "nothing is felt" in found.why


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


USUAL = next_limits(SensorType())


def test_the_usual_sensor_keeps_every_number():
    assert NextLimits(
        lengths_mm=(4.0, 7.0, 10.0, 14.0), clear_mm=2.5, force_n=80.0,
        least_counts=16.0, soft_counts=40.0, gap=5,
    ) == USUAL  # fmt: skip
    stiff = replace(SensorType(), overlay=replace(Overlay(), young_mpa=3.0))
    assert next_limits(stiff) == USUAL  # of a gel alone the material counts


@pytest.mark.parametrize("name", shipped_names())
def test_steps_are_no_longer_for_the_sensor_and_the_pressure_is_the_same(name):
    sensor = sensor_type_named(name)
    limits = next_limits(sensor)
    area = 4 * math.prod(sensor.half_mm)
    size = min(1.0, math.sqrt(area) / 25.4)
    assert limits.lengths_mm == pytest.approx([size * length for length in USUAL.lengths_mm])
    assert limits.clear_mm == pytest.approx(size * USUAL.clear_mm)
    if sensor.overlay.kind == "tab":
        assert limits.force_n / area == pytest.approx(80.0 / 25.4**2, rel=1e-3)


def test_a_gel_is_imprinted_as_deep_whatever_it_is_made_of():
    gel = sensor_type_named("gel-24x32")
    force_n = next_limits(gel).force_n
    area = 4 * math.prod(gel.half_mm)
    assert force_n / (gel.overlay.young_mpa / gel.overlay.height_mm * area) == pytest.approx(
        GEL_IMPRINT_MM, rel=0.01
    )
    stiff = replace(gel, overlay=replace(gel.overlay, young_mpa=0.6))
    assert next_limits(stiff).force_n == pytest.approx(2 * force_n, abs=0.1)
    thick = replace(gel, overlay=replace(gel.overlay, height_mm=6.0))
    assert next_limits(thick).force_n == pytest.approx(force_n / 2, abs=0.1)


def test_noise_and_full_scale_say_what_is_felt():
    gel, narrow = sensor_type_named("gel-24x32"), sensor_type_named("flexitac-12x32")
    assert next_limits(gel).least_counts == max(USUAL.least_counts * 4095 / 1023, 4 * gel.noise)
    assert next_limits(replace(gel, noise=100.0)).least_counts == 400.0
    assert next_limits(narrow).least_counts == USUAL.least_counts * 255 / 1023
    assert next_limits(narrow).soft_counts == USUAL.soft_counts * 255 / 1023


@pytest.mark.parametrize(("pitch_mm", "gap"), [(0.5, 5), (1.5875, 5), (2.0, 5), (3.0, 3), (6.0, 3)])
def test_gaps_are_closed_no_wider_where_tactels_are_coarse(pitch_mm, gap):
    assert next_limits(replace(SensorType(), pitch_mm=pitch_mm)).gap == gap
