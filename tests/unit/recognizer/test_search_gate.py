"""Before and after a search: which touches it cannot help, and where to touch next."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from recognizer.touch.next_touch import FORCE_N, next_limits, propose_next
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import (
    AMBIGUOUS,
    BY_CHANCE,
    NO_CONTACT,
    NOT_ENCODED,
    TOO_FEW,
    refusal,
)
from recognizer.touch.search_gate import gap_share, is_nearly_chance, may_find_more, shows_strokes
from recognizer.touch.signal import signal_of
from recognizer.touch.verdict import Evidence

STROKES = ((np.indices((16, 16)) % 4) < 2).any(axis=0)


def reader(small, pitch=7.0, kind="tab", radii=(), second=None):
    """A reader of one array, or of another flat one of a `second` pitch as well."""
    embossed = small.two_faces().embossed
    arrays = [
        replace(
            embossed, radii_mm=bent,
            style=SimpleNamespace(pitch_mm=pitch_mm, height_mm=1.0, stroke_mm=1.4),
        )
        for pitch_mm, bent in ((pitch, radii), (second, ())) if pitch_mm
    ]  # fmt: skip
    return SimpleNamespace(
        sensor=SensorType(overlay=Overlay(kind=kind)), options=ReaderOptions(),
        lab=SimpleNamespace(arrays=tuple(arrays)),
    )  # fmt: skip


def plate(spread, seed=3):
    gains = np.exp(spread * np.random.default_rng(seed).standard_normal((16, 16)))
    return signal_of(200 * gains + 8)


def test_a_plate_shows_no_strokes_and_symbols_do(small):
    symbols = signal_of(np.where(STROKES, 200.0, 8.0))
    for spread in (0.05, 0.15):
        assert not shows_strokes(reader(small), plate(spread))
    assert gap_share(symbols) == pytest.approx(64 / 256, abs=0.05)
    symbols = signal_of(np.where(STROKES & (np.indices((16, 16)).sum(axis=0) % 4 > 0), 200.0, 8.0))
    assert gap_share(symbols) > 0.3
    assert shows_strokes(reader(small), symbols)


@pytest.mark.parametrize(
    "given", [{"kind": "pad"}, {"pitch": 4.5}, {"pitch": 12.0}, {"second": 4.5}, {"second": 12.0}]
)
def test_where_gaps_were_not_measured_nothing_is_refused(small, given):
    assert shows_strokes(reader(small, **given), plate(0.05))


def test_gaps_tactel_by_tactel():
    rng = np.random.default_rng(5)
    trust = (rng.random((16, 16)) > 0.2).astype(float)
    signal = replace(signal_of(rng.gamma(0.7, 60.0, (16, 16)) + 8), trust=trust)
    forces = signal.forces * trust
    wide = np.pad(forces, 2, mode="edge")
    pressed = 0.15 * np.sort(forces, axis=None)[-12:].mean()
    near = np.array([np.quantile(wide[r : r + 5, c : c + 5], 0.85) for r, c in np.ndindex(16, 16)])
    adjacent = (near > pressed) & (trust.ravel() > 0)
    weak = adjacent & (forces.ravel() < 0.35 * near)
    assert gap_share(signal) == pytest.approx(weak.sum() / adjacent.sum())


def touch_of(tactels):
    counts = np.full(256, 8.0)
    counts[np.linspace(0, 255, tactels).round().astype(int)] = 200.0
    return signal_of(counts.reshape(16, 16))  # as many tactels are pressed


@pytest.fixture
def asked(small):
    """Ask for a wide search after a first try; four symbols and 48 cells: three name one."""

    def ask(
        *, tactels=160, reason=NOT_ENCODED, judged=None, doubt=None, lab=None, order=4, **speaks
    ):
        answer = refusal(0, reason, doubt=doubt)
        if not reason:
            answer = replace(answer, object="Thing")
        found = SimpleNamespace(
            embossed=replace(small.two_faces().embossed, array=SimpleNamespace(order=order)),
            evidence=replace(Evidence(5.0, 5, 10.0, 0, explained=0.9), **speaks),
        )
        given = answer if judged is None else judged
        return may_find_more(reader(small, **(lab or {})), touch_of(tactels), answer, given, found)

    return ask


PAD, ROUND, SOME_ROUND = {"kind": "pad"}, {"radii": (20.0,)}, {"radii": (20.0,), "second": 7.0}


@pytest.mark.parametrize(
    ("given", "wide"),
    [
        # 48 cells over a doubt of 1e-4, a sixteenth by the border: 7.4 letters of four, each 0.44
        # of the 19.4 tactels of a cell: 63.6; a round face presses a strip
        ({"tactels": 63}, False), ({"tactels": 64}, True), ({"tactels": 63, "lab": ROUND}, True),
        ({"tactels": 63, "lab": SOME_ROUND}, True),
        ({"tactels": 64, "lab": {"second": 7.9}}, True),  # the smaller symbols are fewer tactels
        # no stroke shows
        ({"tactels": 160}, True), ({"tactels": 256}, False), ({"tactels": 256, "lab": PAD}, True),
        # whatever the place that a first search found
        ({"inliers": 0, "log_likelihood_ratio": -9.0, "explained": 0.1}, True),
        ({"inliers": 9, "log_likelihood_ratio": 90.0, "explained": 0.1}, True),
        # an image that is explained shows no more
        ({"reason": AMBIGUOUS, "inliers": 2}, False), ({"reason": AMBIGUOUS, "inliers": 3}, True),
        ({"reason": AMBIGUOUS, "inliers": 5, "order": 2}, False),  # six of two kinds name a cell
        ({"reason": NOT_ENCODED, "inliers": 5, "order": 2}, True),
        # an answer is given; where that was not measured it is confirmed if chance nearly allows it
        *(({"reason": "", "doubt": 1e-5, "lab": lab}, False) for lab in ({}, ROUND, PAD)),
        *(({"reason": "", "doubt": 1.1e-5, "lab": lab}, bool(lab)) for lab in ({}, ROUND, PAD)),
        *(({"reason": "", "lab": lab}, bool(lab)) for lab in ({}, ROUND, PAD)),
    ],
)  # fmt: skip
def test_which_touches_are_searched_widely(asked, given, wide):
    assert asked(**given) == wide


@pytest.mark.parametrize(
    ("judged", "again"),
    [
        (refusal(0, BY_CHANCE, doubt=1.0e-3), True),
        (refusal(0, BY_CHANCE, doubt=1.1e-3), False),
        (refusal(0, TOO_FEW, doubt=1.1), False),
    ],
)
def test_an_answer_that_is_refused_is_sought_again_where_little_is_missing(asked, judged, again):
    assert asked(reason="", judged=judged) == again
    assert asked(reason="", judged=judged, lab={"radii": (20.0,)})


def test_without_a_hypothesis_the_search_goes_on(small):
    nothing = refusal(0, NOT_ENCODED)
    assert may_find_more(reader(small), touch_of(10), nothing, nothing, None)


@pytest.mark.parametrize(("doubt", "again"), [(None, False), (1e-5, False), (1.01e-5, True)])
def test_what_chance_nearly_allows_is_confirmed(doubt, again):
    judged = replace(refusal(0, ""), object="Thing", doubt=doubt)
    assert is_nearly_chance(judged) is again


SENSOR = SensorType()
X = SENSOR.centres_mm()[..., 0]
FEW = refusal(0, TOO_FEW)
EVERYWHERE = np.full((16, 16), True)


def felt(where):
    """An image with strokes two tactels wide, four apart, where something is under the sensor."""
    noise = np.random.default_rng(1).uniform(0, 6, (16, 16))
    return signal_of(np.where(where & STROKES, 200.0, 0.0) + noise)


@pytest.fixture
def proposed(small):
    """Return what is proposed after a touch that was loaded here, and its step, mm."""
    lab = SimpleNamespace(arrays=(small.two_faces().embossed,))
    reader = SimpleNamespace(sensor=SENSOR, options=ReaderOptions(), lab=lab)

    def proposed(where, answer=FEW, earlier=()):
        found = propose_next(reader, felt(where), answer, (), earlier)
        return found, found and np.array([found.dx_mm, found.dy_mm])

    return proposed


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
