"""Where to touch next: towards what is loaded, never off the face, to what was not seen.

What is proposed to touches of every world and sensor type is in the corpus `answers`.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from recognizer.touch.next_touch import FORCE_N, next_limits, propose_next
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import NO_CONTACT, TOO_FEW, refusal
from recognizer.touch.signal import signal_of

SENSOR = SensorType()
X, Y = SENSOR.centres_mm().reshape(16, 16, 2).transpose(2, 0, 1)
FEW = refusal(0, TOO_FEW)
EVERYWHERE = np.full((16, 16), True)


def felt(where):
    """An image with strokes two tactels wide, four apart, where something is under the sensor."""
    strokes = ((np.indices((16, 16)) % 4) < 2).any(axis=0)
    noise = np.random.default_rng(1).uniform(0, 6, (16, 16))
    return signal_of(np.where(where & strokes, 200.0, 0.0) + noise)


@pytest.fixture
def proposed(small):
    """Return what is proposed after a touch that was loaded here, and its step, mm."""
    lab = SimpleNamespace(arrays=(small.two_faces().embossed,))
    reader = SimpleNamespace(sensor=SENSOR, options=ReaderOptions(), lab=lab)

    def proposed(where, answer=FEW, earlier=()):
        found = propose_next(reader, felt(where), answer, (), earlier)
        return found, found and np.array([found.dx_mm, found.dy_mm])

    return proposed


@pytest.mark.parametrize("turn", range(0, 360, 30))
def test_a_step_goes_towards_the_loaded_half_and_stays_on_it(proposed, turn):
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    found, step = proposed(c * X + s * Y > 3.0)
    along, across = step @ (c, s), abs(step @ (-s, c))
    assert 7.0 <= along <= 14.0
    assert across <= along
    assert (np.abs(step) < SENSOR.half_mm).all()  # there the face was felt
    assert "towards the loaded part" in found.why
    assert found.force_n == FORCE_N


@pytest.mark.parametrize("inwards", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_at_a_corner_a_step_goes_inwards_along_both_edges(proposed, inwards):
    _, step = proposed((inwards[0] * X > 0) & (inwards[1] * Y > 0))
    assert (step * inwards >= 5).all()


def test_along_a_narrow_face_the_sensor_is_turned_and_keeps_to_the_middle(proposed):
    found, _ = proposed(np.abs(Y) < 4.0)
    assert (found.dy_mm, found.turn_deg) == (pytest.approx(0.0, abs=2.0), 45.0)


@pytest.mark.parametrize("side", [1, -1])
def test_earlier_touches_tell_what_was_seen_and_where_no_face_is(proposed, side):
    places = [(9.0, -20.0), (9.0, 0.0), (9.0, 20.0), (18.0, -20.0), (18.0, 0.0), (18.0, 20.0)]
    before = [(np.array([side * x, y, 0.0]), felt(EVERYWHERE)) for x, y in places]
    assert proposed(EVERYWHERE, earlier=before)[1][0] * side < -4
    before = [(np.array([14.0 * side, 0.0, 0.0]), felt(side * X < -4))]  # its near side alone
    assert proposed(EVERYWHERE, earlier=before)[1][0] * side <= 0


def test_without_contact_the_same_place_is_pressed_harder(proposed):
    found, step = proposed(~EVERYWHERE, refusal(0, NO_CONTACT))
    assert (*step, found.turn_deg, found.force_n) == (0.0, 0.0, 0.0, FORCE_N)
    assert "nothing is felt" in found.why


@pytest.mark.parametrize(
    ("changed", "asks"), [({}, False), ({"margin": 13.0}, True), ({"doubt": 5e-5}, True)]
)
def test_a_sure_answer_needs_no_other_touch_and_an_unsure_one_does(proposed, changed, asks):
    answer = replace(refusal(0, ""), object="Thing", face="F1", margin=15.0, doubt=1e-6)
    assert (proposed(EVERYWHERE, replace(answer, **changed))[0] is not None) == asks


def test_noise_says_what_is_felt():
    gel = replace(sensor_type_named("gel-24x32"), noise=100.0)
    assert next_limits(gel).least_counts == 400.0
