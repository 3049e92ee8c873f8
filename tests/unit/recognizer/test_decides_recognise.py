"""Which touches are answered, and why others are not: each bound from both sides."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import recognizer.touch.recognise
from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognise import (
    read_touch,
    recognise,
)
from recognizer.touch.recognition import (
    AMBIGUOUS,
    BY_CHANCE,
    EXCHANGED,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    UNCLEAR,
    Cause,
    RunnerUp,
)
from recognizer.touch.signal import Signal
from recognizer.touch.verdict import Evidence

TOUCHED = SimpleNamespace(contact=True, state=None)
BARE = SimpleNamespace(contact=True, state=None)  # no strokes show
BITS = 40.0
READER = SimpleNamespace(
    sensor=SensorType(), options=ReaderOptions(), lab=SimpleNamespace(arrays=("one", "two"))
)
#: Limits of margins, nats: 10 and 14 but for rounding.
TEN, FOURTEEN = READER.options.margin, READER.options.margin_by_few
SURE = Evidence(
    log_likelihood_ratio=19.9,
    explained=0.95,
    inliers=16,
    bits=32.0,
    contradictions=0,
    strong_contradictions=0,
    stroke_excess=0.0,
    worn=0,
)
T_OBJECT_FACE = np.array([[0.0, 0, 1, 5], [1, 0, 0, 6], [0, 1, 0, 7], [0, 0, 0, 1]])


@dataclass
class Found:
    """What verification hands over; places are as they are named."""

    embossed: object
    place: str
    score: float
    fit: object
    speaks: Evidence = SURE
    face: int = 0
    index: tuple = (3, 4)
    shift: int = 0  # pitches
    last: object = None  # the fit that poses it; None: the same

    def last_fit(self):
        return self.last or self.fit

    @property
    def hypothesis(self):
        return Hypothesis(0, 6, 2, self.face, self.score)

    def same_place(self, other):
        return self.place == other.place

    def coincides(self, other):
        return self.place == other.place and self.shift == other.shift

    @property
    def evidence(self):
        return self.speaks

    @property
    def runner_up(self):
        face = self.embossed.face(self.face)
        return RunnerUp(face.object, face.face, self.index)


@pytest.fixture
def lab(small):
    """Two faces of 42 x 42 mm."""
    made = small.two_faces().embossed
    for number, name in enumerate(("F1", "F2")):
        made.known[number] = small.known_face("Thing", name, T_object_face=T_OBJECT_FACE)
    return made


def wide_unless_sure(reader, signal, answer, judged, best):
    """Ask for the second try as under a pad: `test_search_gate` has when it is asked for."""
    assert reader is READER
    assert answer or judged is answer
    return not judged or best.evidence.inliers < 11


@pytest.fixture
def reads(small, lab, monkeypatch):
    """Return a function that reads a touch of which the two tries find what is given."""
    centre = small.fit_of(
        [(0, 0)], [[0.0] * 5], x_mm=17.0, y_mm=10.0, theta_rad=0.3, noise=0.07,
        covariance=np.diag([1.0, 2.0, 3.0]),
    )  # fmt: skip

    def read(first, second=None, signal=TOUCHED, doubt=1e-5, by_border=math.inf):
        tries = []
        doubts = doubt if isinstance(doubt, tuple) else (doubt, doubt)  # of the two tries

        def matches(arrays, embossed, fit, hypothesis):
            assert arrays == READER.lab.arrays
            judged = first if len(tries) == 1 else second
            best = judged[0]
            assert (embossed, fit, hypothesis) == (best.embossed, best.fit, best.hypothesis)
            return doubts[len(tries) - 1]

        def matches_by_border(arrays, best, tip_mm):
            assert arrays == READER.lab.arrays
            assert best is (first if len(tries) == 1 else second)[0]
            assert tip_mm == READER.sensor.overlay.tab_diameter_mm
            return by_border

        def tells_more(reader, given, answer, judged, best):
            assert best is (first[0] if first else None)
            return wide_unless_sure(reader, given, answer, judged, best)

        def shows(reader, given, least):
            assert (reader, given, least) == (READER, signal, 0.25)
            return signal is not BARE

        def found(touch, effort):
            assert touch.reader is READER
            assert touch.signal is signal
            tries.append(effort)
            return first if len(tries) == 1 else second

        monkeypatch.setattr(recognizer.touch.recognise, "verify_hypotheses", found)
        monkeypatch.setattr(recognizer.touch.recognise, "expected_matches", matches)
        monkeypatch.setattr(recognizer.touch.recognise, "expected_by_border", matches_by_border)
        monkeypatch.setattr(recognizer.touch.recognise, "place_bits", lambda *_: BITS)
        monkeypatch.setattr(recognizer.touch.recognise, "shows_strokes", shows)
        monkeypatch.setattr(recognizer.touch.recognise, "propose_next", lambda *_: None)
        monkeypatch.setattr(recognizer.touch.recognise, "diagnose", lambda *_: None)
        monkeypatch.setattr(recognizer.touch.recognise, "may_find_more", tells_more)
        monkeypatch.setattr(recognizer.touch.recognise, "has_residual", lambda *_: False)
        reading = read_touch(READER, signal, 7)
        answer, judged = reading.answer, reading.best
        assert any(reading.found is tried for tried in (first, second)) or reading.found == []
        assert answer.seq == 7
        assert tries == [READER.options.first, READER.options.thorough][: len(tries)]
        count = len(tries)
        tries.clear()
        assert recognise(READER, signal, 7).reason == answer.reason
        return answer, judged, count

    def one(place="here", score=0.0, inliers=16, embossed=lab, face=0, index=(3, 4), **changed):
        fit = {name: changed.pop(name) for name in ("x_mm", "y_mm", "nuisance") if name in changed}
        speaks = replace(SURE, inliers=inliers, **changed)
        return Found(embossed, place, score, replace(centre, **fit), speaks, face, index)

    return SimpleNamespace(read=read, one=one, lab=lab)


def test_without_contact_nothing_is_tried(reads):
    answer, judged, tries = reads.read([], signal=SimpleNamespace(contact=False))
    assert (answer.reason, judged, tries) == (NO_CONTACT, None, 0)
    assert answer.object is None


def test_of_a_bare_plate_nothing_is_tried(reads):
    answer, judged, tries = reads.read([reads.one()], signal=BARE)
    assert (answer.reason, judged, tries) == (NOT_ENCODED, None, 0)


def test_a_touch_that_is_not_numbered_is_the_first(reads):
    nothing = SimpleNamespace(contact=False)
    assert recognise(READER, nothing).seq == 0
    assert read_touch(READER, nothing).answer.seq == 0


@pytest.mark.parametrize(
    ("behind", "reason", "margin"),
    [(3.0, AMBIGUOUS, 3.0), (9.9, AMBIGUOUS, 9.9), (13.9, "", 13.9), (FOURTEEN, "", math.inf)],
)
def test_a_place_one_pitch_beside_is_a_rival_where_it_comes_near(reads, behind, reason, margin):
    best, beside = reads.one(inliers=16), replace(reads.one(score=-behind), shift=1)
    answer, _, _ = reads.read([best, beside], [best, beside])
    assert (answer.reason, answer.margin) == (reason, pytest.approx(margin))


def test_two_tries_one_pitch_apart_are_no_answer(reads):
    best = reads.one(inliers=8)
    answer, _, _ = reads.read([best], [replace(best, shift=1)])
    assert (answer.reason, answer.margin) == (AMBIGUOUS, 0.0)


def test_where_nothing_is_found_there_are_too_few_symbols(reads):
    answer, judged, tries = reads.read([], [])
    assert (answer.reason, judged, tries) == (TOO_FEW, None, 2)
    assert (answer.margin, answer.runner_up) == (None, None)


def test_an_answer_that_many_cells_speak_for_is_given_at_once(reads):
    best = reads.one(inliers=11)
    answer, judged, tries = reads.read([best])
    assert tries == 1
    assert judged is best
    assert (answer.object, answer.face, answer.reason) == ("Thing", "F1", "")
    assert answer.margin == math.inf
    assert answer.runner_up is None
    assert answer.index == (5, 4)  # 17 and 10 mm are column 2 and row 1 of the lattice
    c, s = math.cos(0.3), math.sin(0.3)
    pose = np.array([[c, -s, 0, 17.0], [s, c, 0, 10.0], [0, 0, 1, 1.2], [0, 0, 0, 1]])
    np.testing.assert_allclose(answer.T_face_probe, pose)
    np.testing.assert_allclose(answer.T_object_probe, T_OBJECT_FACE @ pose)
    np.testing.assert_allclose(answer.covariance, np.diag([1.0, 2.0, 3.0]))
    assert answer.noise == 0.07


def test_what_few_cells_speak_for_and_what_is_refused_the_second_try_decides(reads):
    few, refused_ = reads.one(inliers=10), reads.one("there", explained=0.1)
    for first, second, reason in (
        (few, reads.one(inliers=10), ""), (refused_, reads.one("there"), ""),
        (few, refused_, NOT_ENCODED), (few, None, TOO_FEW),
    ):  # fmt: skip
        answer, judged, tries = reads.read([first], [second] if second else [])
        assert (answer.reason, bool(answer), tries) == (reason, not reason, 2)
        assert judged is second


@pytest.mark.parametrize("inliers", [10, 16])
def test_if_the_second_try_says_another_place_neither_is_believed(reads, inliers):
    first = [reads.one(inliers=10), reads.one("rival", -30.0, face=1, index=(9, 12))]
    second = [reads.one("there", inliers=inliers), reads.one("elsewhere", -50.0)]
    answer, judged, _ = reads.read(first, second)
    assert (answer.reason, answer.margin) == (AMBIGUOUS, 0.0)
    assert (answer.runner_up.face, answer.runner_up.index) == ("F2", (9, 12))
    assert judged is second[0]


@pytest.mark.parametrize(
    ("bits", "margin", "reason"),
    [
        # ten nats before the best other place, fourteen where symbols say less than 22 bits
        (32.0, TEN, ""), (32.0, 9.99, AMBIGUOUS), (22.0, TEN, ""),
        (21.9, FOURTEEN, ""), (21.9, 13.99, AMBIGUOUS),
    ],
)  # fmt: skip
def test_how_far_before_others_the_best_place_is(reads, bits, margin, reason):
    found = [
        reads.one(bits=bits),
        reads.one(score=-1.0),  # the same place again
        reads.one("rival", -margin, face=1, index=(9, 12)),
        reads.one("other", -margin - 1.0),
    ]
    answer, judged, tries = reads.read(found, found)
    assert answer.reason == reason
    assert answer.margin == pytest.approx(margin)
    assert judged is found[0]
    assert tries == (2 if reason else 1)
    runner_up = answer.runner_up
    assert (runner_up.object, runner_up.face, runner_up.index) == ("Thing", "F2", (9, 12))


@pytest.mark.parametrize(
    ("x", "y", "reason"),
    [(20.0, -1.99, ""), (20.0, -2.01, OUTSIDE), (44.0, 20.0, ""), (44.01, 20.0, OUTSIDE)],
)
def test_the_centre_lies_at_most_two_mm_beyond_the_face(reads, x, y, reason):
    found = [reads.one(x_mm=x, y_mm=y), reads.one("rival", -40.0)]
    answer, _, _ = reads.read(found, found)
    assert answer.reason == reason
    assert answer.margin == 40.0
    assert answer.runner_up.face == "F1"


def test_an_answer_says_how_the_print_was_felt(reads):
    found = [reads.one(nuisance=np.array([-0.5, 0.2, 0.1, 0.01])), reads.one("rival", -40.0)]
    answer, _, _ = reads.read(found, found)
    assert answer.scale == pytest.approx(1 / 1.01)  # a lattice that looks large is a small print
    assert answer.stroke_mm == pytest.approx(1.4 - 0.05)
    assert (refused(reads).scale, refused(reads).stroke_mm) == (None, None)


@pytest.mark.parametrize(("doubt", "reason"), [(0.0, ""), (1e-4, ""), (1.01e-4, BY_CHANCE)])
@pytest.mark.parametrize("inliers", [16, 10])
def test_what_many_places_match_by_chance_is_refused(reads, doubt, reason, inliers):
    found = [reads.one(inliers=inliers), reads.one("rival", -40.0, face=1, index=(9, 12))]
    answer, judged, tries = reads.read(found, found, doubt=doubt)
    assert (answer.reason, answer.doubt, bool(answer)) == (reason, doubt, not reason)
    missing = pytest.approx(math.log2(1.01)) if reason else None
    assert (answer.bits, answer.bits_missing) == (BITS, missing)
    assert (answer.margin, answer.runner_up.face) == (40.0, "F2")
    assert judged is found[0]
    assert tries == (1 if inliers == 16 and doubt == 0.0 else 2)


@pytest.mark.parametrize(("first", "tries"), [(1e-5, 1), (1.01e-5, 2), (1e-4, 2)])
def test_what_chance_nearly_allows_is_looked_at_again(reads, first, tries):
    found, again = [reads.one(), reads.one("rival", -40.0)], [reads.one(x_mm=17.5)]
    answer, judged, tried = reads.read(found, again, doubt=(first, 1e-3))
    assert (tried, judged is found[0]) == (tries, True)
    assert (answer.reason, answer.doubt, answer.margin) == ("", first, 40.0)
    assert answer.x_mm == pytest.approx(17.0)  # as the first try has it


def test_what_speaks_plainly_for_a_place_is_not_looked_at_again(reads):
    found = [reads.one(log_likelihood_ratio=20.0), reads.one("rival", -40.0)]
    answer, judged, tried = reads.read(found, [], doubt=1e-4)
    assert (tried, judged is found[0], bool(answer)) == (1, True, True)


@pytest.mark.parametrize(
    ("again", "reason", "margin", "doubt"),
    [
        ({}, BY_CHANCE, 40.0, 1.01e-3),
        ({"place": "there"}, AMBIGUOUS, 0.0, None),
        (None, AMBIGUOUS, 0.0, None),
    ],
)
def test_a_wide_search_may_take_it_back(reads, again, reason, margin, doubt):
    first = [reads.one(), reads.one("rival", -40.0, face=1, index=(9, 12))]
    second = [] if again is None else [reads.one(**again)]
    answer, judged, _ = reads.read(first, second, doubt=(1e-4, 1.01e-3))
    assert (answer.reason, answer.margin, answer.doubt) == (reason, margin, doubt)
    assert answer.runner_up.face == "F2"
    assert judged is (second[0] if second else None)


@pytest.fixture
def exchanged(reads, monkeypatch):
    """Read a touch that leaves much over; by axis, what is found with halves exchanged."""

    def read(by_axis, state=None, leaves=True):
        asked = []
        best = reads.one(score=-100.0)

        def verified(touch, effort):
            if isinstance(touch.signal.forces, int):
                assert effort is READER.options.first
                assert touch.signal.trust == touch.signal.forces  # both are swapped
                asked.append(touch.signal.forces)
                return by_axis[touch.signal.forces]
            return [best, reads.one("rival", -200.0)]

        def leaves_much(found):
            assert found is best
            return leaves

        for name, value in (
            ("verify_hypotheses", verified), ("has_residual", leaves_much),
            ("swap_halves", lambda _, axis: axis), ("expected_matches", lambda *_, **__: 1e-9),
            ("may_find_more", lambda *_: False), ("place_bits", lambda *_: BITS),
            ("shows_strokes", lambda *_: True),
        ):  # fmt: skip
            monkeypatch.setattr(recognizer.touch.recognise, name, value)
        image = np.zeros((2, 2))
        touch = Signal(image, image, contact=True, newtons=False, state=state)
        for name in ("propose_next", "diagnose"):
            monkeypatch.setattr(recognizer.touch.recognise, name, lambda *_: None)
        reading = read_touch(READER, touch, 7)
        answer, judged = reading.answer, reading.best
        assert judged is best
        assert (answer.seq, answer.reason, answer.margin) in (
            (7, "", 100.0), (7, AMBIGUOUS, 0.0),
        )  # fmt: skip
        found = recognise(READER, touch, 7)
        assert found.cause == answer.cause
        if answer:
            assert answer.cause is None
            return True, asked[: len(asked) // 2]
        assert answer.cause == Cause(EXCHANGED, {"columns": float(asked[-1])})
        assert answer.way_out == answer.cause.way_out
        return False, asked[: len(asked) // 2]

    return read


def test_what_is_read_better_with_halves_exchanged_is_no_answer(reads, exchanged):
    better = [reads.one("there", -99.9), reads.one("rival", -150.0)]
    worse = [reads.one("there", -100.0), reads.one("rival", -150.0)]
    other = [reads.one("there", -50.0, explained=0.1)]
    assert exchanged(([], better)) == (False, [0, 1])
    assert exchanged((better, [])) == (False, [0])
    assert exchanged((worse, worse)) == (True, [0, 1])
    assert exchanged((other, other)) == (True, [0, 1])


def test_halves_are_exchanged_only_where_that_may_be(reads, exchanged, monkeypatch):
    better = [reads.one("there", -99.9)]
    assert exchanged((better, better), leaves=False) == (True, [])
    assert exchanged((better, better), state="learned") == (True, [])
    monkeypatch.setattr(READER, "sensor", SensorType().with_overlay("pad"))
    assert exchanged((better, better)) == (True, [])


def test_only_what_is_refused_has_a_cause(reads, monkeypatch):
    other = [reads.one(explained=0.1)]
    why = Cause(UNCLEAR, {})
    for found, cause in (([reads.one()], None), (other, why)):
        reads.read(found, found, doubt=0.0)
        monkeypatch.setattr(recognizer.touch.recognise, "diagnose", lambda *_: why)
        monkeypatch.setattr(
            recognizer.touch.recognise, "verify_hypotheses", lambda *_, found=found: found
        )
        monkeypatch.setattr(recognizer.touch.recognise, "expected_matches", lambda *_, **__: 0.0)
        monkeypatch.setattr(recognizer.touch.recognise, "place_bits", lambda *_: BITS)
        monkeypatch.setattr(recognizer.touch.recognise, "shows_strokes", lambda *_: True)
        assert recognise(READER, TOUCHED, 7).cause == cause


def test_a_print_is_posed_by_the_scale_that_is_felt(reads, monkeypatch):
    class Print:
        part = "as printed"

        @staticmethod
        def pose(pose, covariance, felt):
            assert felt == ("felt", READER.options.scale_sd)
            return 2 * pose, 3 * covariance

    found = reads.one()
    plain, _, _ = reads.read([found])
    monkeypatch.setattr(
        recognizer.touch.recognise, "felt_scale", lambda face, fit, prior: ("felt", prior)
    )
    reads.lab.known[0].printed = Print
    answer, _, _ = reads.read([found])
    assert (answer.T_face_probe == 2 * plain.T_face_probe).all()
    assert (answer.covariance == 3 * plain.covariance).all()
    assert (plain.part, answer.part) == ("as designed", "as printed")


def test_only_flat_faces_say_how_far_inside_a_touch_lies(reads, monkeypatch):
    found = reads.one()
    assert reads.read([found])[0].inside_mm == pytest.approx(10.0)
    reads.lab.known[0].round = "a cylinder"
    monkeypatch.setattr(recognizer.touch.recognise, "pose_on_object", lambda *_: np.eye(4))
    assert reads.read([found])[0].inside_mm is None


@pytest.mark.parametrize(
    ("changed", "rival", "by_border", "doubt"),
    [
        ({}, -40.0, 1e-4, 1e-4),
        ({}, -40.0, 1.01e-4, 1.01e-4),
        ({}, -40.0, 0.5, 0.3),  # never more than by symbols alone
        ({"worn": 1}, -40.0, 1e-5, 1e-5),
        ({"worn": 2}, -40.0, 1e-5, 0.3),
        ({"contradictions": 1}, -40.0, 1e-5, 0.3),
        ({}, -FOURTEEN, 1e-5, 1e-5),
        ({}, -13.9, 1e-5, 0.3),
    ],
)
def test_the_border_of_a_plain_place_counts(reads, changed, rival, by_border, doubt):
    found = [reads.one(**changed), reads.one("rival", rival, face=1, index=(9, 12))]
    answer, _, _ = reads.read(found, found, doubt=0.3, by_border=by_border)
    assert answer.doubt == doubt
    assert answer.reason == ("" if doubt <= 1e-4 else BY_CHANCE)


def test_borders_are_felt_by_tabs_alone(reads, monkeypatch):
    found = [reads.one()]
    assert reads.read(found, found, doubt=0.3, by_border=1e-5)[0]
    monkeypatch.setattr(READER, "sensor", SensorType().with_overlay("pad"))
    assert reads.read(found, found, doubt=0.3, by_border=1e-5)[0].reason == BY_CHANCE


def test_an_answer_is_where_its_last_fit_lies_and_a_refusal_needs_none(reads):
    found = reads.one()
    found.last = replace(found.fit, x_mm=17.02, covariance=np.diag([4.0, 5.0, 6.0]))
    answer, _, _ = reads.read([found])
    assert answer.x_mm == pytest.approx(17.02)
    np.testing.assert_allclose(answer.covariance, found.last.covariance)
    found.last = "not asked for"
    found.speaks = replace(SURE, explained=0.1)
    assert reads.read([found], [found])[0].reason == NOT_ENCODED


def test_what_is_refused_for_another_reason_has_no_doubt(reads):
    assert refused(reads).doubt is None
    assert reads.read([], [])[0].doubt is None


def refused(reads):
    found = [reads.one(explained=0.1)]
    return reads.read(found, found)[0]


def test_where_the_print_is_known_the_pose_is_that_on_the_print(reads):
    def pose(read, covariance, felt):
        assert felt is None  # the fit says nothing of it
        moved = read.copy()
        moved[0, 3] += 1.5
        return moved, 2 * covariance

    plain, _, _ = reads.read([reads.one()])
    reads.lab.known[0].printed = SimpleNamespace(pose=pose, part="")
    answer, _, _ = reads.read([reads.one()])
    assert answer.x_mm == plain.x_mm + 1.5
    np.testing.assert_array_equal(answer.covariance, 2 * plain.covariance)
    np.testing.assert_allclose(answer.T_object_probe, T_OBJECT_FACE @ answer.T_face_probe)
    outside = reads.read([reads.one(x_mm=44.01)], [reads.one(x_mm=44.01)])[0]
    assert outside.reason == OUTSIDE  # of the face as designed
