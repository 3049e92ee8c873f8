"""Which touches are answered, and why others are not: each bound from both sides."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

import recognizer.touch.recognise
from encoded_objects.base.sensor_type import SensorType
from probe.surface.polygon import polygon
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognise import has_residual, read_touch, recognise
from recognizer.touch.recognition import (
    AMBIGUOUS,
    BY_CHANCE,
    EXCHANGED,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    Cause,
    RunnerUp,
)
from recognizer.touch.signal import Signal, swap_halves
from recognizer.touch.verdict import Evidence

LAB = SimpleNamespace(arrays=("one", "two"))
READER = SimpleNamespace(sensor=SensorType(), options=ReaderOptions(), lab=LAB)
PAD = SensorType().with_overlay("pad")
BITS = 40.0
INF = math.inf
#: Limits of margins, nats: 10 and 14 but for rounding.
TEN, FOURTEEN = READER.options.margin, READER.options.margin_by_few
SURE = Evidence(19.9, inliers=16, bits=32.0, contradictions=0, explained=0.95)


@dataclass
class Found:
    """What verification hands over; places are as they are named."""

    place: str
    score: float
    shift: int  #: pitches
    at: tuple
    evidence: Evidence
    face: int
    embossed: object = None
    fit: object = None

    def last_fit(self):
        return self.fit

    @property
    def hypothesis(self):
        return Hypothesis(0, 6, 2, self.face, self.score)

    def same_place(self, other):
        return self.place == other.place

    def coincides(self, other):
        return self.place == other.place and self.shift == other.shift

    @property
    def runner_up(self):
        face = self.embossed.face(self.face)
        return RunnerUp(face.object, face.face, (9, 12))


def one(place="here", score=0.0, *, shift=0, at=(17.0, 10.0), face=0, **evidence):
    return Found(place, score, shift, at, replace(SURE, **evidence), face)


def rival(score=-40.0):
    return one("rival", score, face=1)


@pytest.fixture
def reads(small, monkeypatch):
    """Return a function that reads a touch of which two searches find what is given."""
    labs = small.two_faces().embossed, small.two_faces().embossed  # rivals are of the second
    for lab in labs:
        for number, name in enumerate(("F1", "F2")):
            lab.known[number] = small.known_face("Thing", name)

    def known(found):
        for each in found:
            fit = small.fit_of([(0, 0)], [[0.0] * 5], x_mm=each.at[0], y_mm=each.at[1])
            each.embossed, each.fit = labs[each.face], fit
        return found

    def read(first, second=None, doubt=1e-5, by_border=INF, signal=None, **changed):
        searches = [known(found) for found in (first, second or [])]
        doubts = iter(doubt if isinstance(doubt, tuple) else (doubt, doubt))
        tries = []

        def search(_, effort):
            tries.append(effort)
            return searches[len(tries) - 1]

        def matches(arrays, embossed, fit, hypothesis):
            best = searches[len(tries) - 1][0]
            assert (arrays, embossed, fit) == (READER.lab.arrays, best.embossed, best.fit)
            assert hypothesis == best.hypothesis
            return next(doubts)

        def bits(arrays, embossed, doubt):
            assert (arrays, embossed) == (READER.lab.arrays, labs[0])
            return BITS

        def wide_unless_sure(reader, signal, answer, judged, best):
            """Ask for the second try as under a pad: `test_search_gate` has when it is asked."""
            return not judged or best.evidence.inliers < 11

        stubs = {
            "verify_hypotheses": search,
            "expected_matches": matches,
            "expected_by_border": lambda *_: by_border,
            "may_find_more": wide_unless_sure,
            "place_bits": bits,
            "shows_strokes": lambda *_: True,
            "has_residual": lambda *_: False,
            "propose_next": lambda *_: None,
            "diagnose": lambda *_: None,
        }
        for name, stub in (stubs | changed).items():
            monkeypatch.setattr(recognizer.touch.recognise, name, stub)
        reading = read_touch(READER, signal or SimpleNamespace(contact=True, state=None), 7)
        assert reading.answer.seq == 7
        assert tries == [READER.options.first, READER.options.thorough][: len(tries)]
        judged = next((n for n, found in enumerate(searches) if reading.found is found), None)
        assert reading.best is (reading.found[0] if reading.found else None)
        return reading.answer, len(tries), judged

    return read


@pytest.mark.parametrize(
    ("first", "second", "given", "answer"),
    [
        # reason, margin, doubt; how many searches, and which of them is judged
        ([], [], {}, (TOO_FEW, None, None, 2, 1)),
        ([one(inliers=11)], None, {}, ("", INF, 1e-5, 1, 0)),
        # what few cells speak for, and what is refused, the second search decides
        ([one(inliers=10)], [one(inliers=10)], {}, ("", INF, 1e-5, 2, 1)),
        ([one("there", explained=0.1)], [one("there")], {}, ("", INF, 1e-5, 2, 1)),
        ([one(inliers=10)], [one(explained=0.1)], {}, (NOT_ENCODED, INF, None, 2, 1)),
        ([one(inliers=10)], [], {}, (TOO_FEW, None, None, 2, 1)),
        # if it says another place, or one a pitch beside, neither is believed
        ([one(inliers=10)], [one("there", inliers=10)], {}, (AMBIGUOUS, 0.0, None, 2, 1)),
        ([one(inliers=10)], [one("there")], {}, (AMBIGUOUS, 0.0, None, 2, 1)),
        ([one(inliers=8)], [one(inliers=8, shift=1)], {}, (AMBIGUOUS, 0.0, None, 2, 1)),
        # chance
        *(([one(inliers=16), rival()], None, {"doubt": doubt}, ("", 40.0, doubt, tries, 0))
          for doubt, tries in ((0.0, 1), (1e-5, 1))),
        *(([one(inliers=n), rival()], [one(inliers=n), rival()], {"doubt": 1.01e-4},
           (BY_CHANCE, 40.0, 1.01e-4, 2, 1)) for n in (16, 10)),
        # what chance nearly allows is looked at again
        ([one(), rival()], [one()], {"doubt": (1.01e-5, 1e-3)}, ("", 40.0, 1.01e-5, 2, 0)),
        ([one(), rival()], [one()], {"doubt": (1e-4, 1e-3)}, ("", 40.0, 1e-4, 2, 0)),
        ([one(), rival()], [one(), rival()], {"doubt": (1e-4, 1.01e-3)},
         (BY_CHANCE, 40.0, 1.01e-3, 2, 1)),
        ([one(), rival()], [one("there")], {"doubt": 1e-4}, (AMBIGUOUS, 0.0, None, 2, 1)),
        ([one(), rival()], [], {"doubt": 1e-4}, (AMBIGUOUS, 0.0, None, 2, 1)),
        # of a plain place the border counts, never more than symbols alone do
        *(([one(**changed), rival(by)], [one(**changed), rival(by)],
           {"doubt": alone, "by_border": border}, (reason, -by, told, 2, n))
          for changed, by, alone, border, told, reason, n in (
              ({}, -40.0, 0.3, 1e-4, 1e-4, "", 0),
              ({}, -40.0, 0.3, 1.01e-4, 1.01e-4, BY_CHANCE, 1),
              ({}, -40.0, 0.3, 0.5, 0.3, BY_CHANCE, 1),
              ({"worn": 2}, -40.0, 0.3, 1e-5, 0.3, BY_CHANCE, 1),
              ({"contradictions": 1}, -40.0, 0.3, 1e-5, 0.3, BY_CHANCE, 1),
              ({}, -13.9, 0.3, 1e-5, 0.3, BY_CHANCE, 1))),
        ([one(worn=1), rival()], None, {"doubt": 0.3, "by_border": 1e-5}, ("", 40.0, 1e-5, 1, 0)),
    ],
)  # fmt: skip
def test_which_search_decides_and_what_chance_leaves_of_it(reads, first, second, given, answer):
    found, tries, judged = reads(first, second, **given)
    assert (found.reason, found.margin, found.doubt, tries, judged) == answer
    assert bool(found) == (not found.reason)
    assert found.bits == (None if found.doubt is None else BITS)
    if found.reason == BY_CHANCE:
        assert found.bits_missing == pytest.approx(math.log2(found.doubt / 1e-4))
    if first[1:]:
        assert (found.runner_up.object, found.runner_up.face) == ("Thing", "F2")


@pytest.mark.parametrize(
    ("found", "reason", "margin"),
    [
        # ten nats before the best other place, fourteen where symbols say less than 22 bits
        *(([one(bits=bits), one(score=-1.0), rival(-behind), one("other", -behind - 1.0)], reason,
           behind)
          for bits, behind, reason in (
              (32.0, TEN, ""), (32.0, 9.99, AMBIGUOUS), (22.0, TEN, ""), (21.9, FOURTEEN, ""),
              (21.9, 13.99, AMBIGUOUS))),
        # a place one pitch beside is a rival where it comes near
        *(([one(), one(score=-behind, shift=1)], reason, margin)
          for behind, reason, margin in (
              (3.0, AMBIGUOUS, 3.0), (9.9, AMBIGUOUS, 9.9), (13.9, "", 13.9), (FOURTEEN, "", INF))),
        # the centre lies at most two mm beyond the face of 42 x 42 mm
        *(([one(at=at), rival()], reason, 40.0)
          for at, reason in (((20.0, -1.99), ""), ((20.0, -2.01), OUTSIDE), ((44.0, 20.0), ""),
                             ((44.01, 20.0), OUTSIDE))),
    ],
)  # fmt: skip
def test_how_far_before_others_and_how_far_inside_the_best_place_is(reads, found, reason, margin):
    answer, tries, _ = reads(found, found)
    assert (answer.reason, answer.margin) == (reason, pytest.approx(margin))
    assert tries == (2 if reason else 1)


def test_without_contact_and_on_a_bare_plate_nothing_is_searched(reads):
    untouched = SimpleNamespace(contact=False)
    answer, tries, _ = reads([one()], signal=untouched)
    assert (answer.reason, answer.object, tries) == (NO_CONTACT, None, 0)
    assert recognise(READER, untouched).seq == read_touch(READER, untouched).answer.seq == 0
    answer, tries, _ = reads([one()], shows_strokes=lambda reader, signal, least: least != 0.25)
    assert (answer.reason, tries) == (NOT_ENCODED, 0)


def test_borders_are_felt_by_tabs_alone(reads, monkeypatch):
    assert reads([one()], [one()], doubt=0.3, by_border=1e-5)[0]
    monkeypatch.setattr(READER, "sensor", PAD)
    assert reads([one()], [one()], doubt=0.3, by_border=1e-5)[0].reason == BY_CHANCE


@pytest.mark.parametrize(
    ("columns", "rows", "given", "tried", "swapped"),
    [
        # a touch that is read better with halves swapped is no answer
        ([], [one("there", -99.9), rival(-150.0)], {}, [0, 1], 1),
        ([one("there", -99.9), rival(-150.0)], [], {}, [0], 0),
        ([one("there", -100.0)], [one("there", -100.0)], {}, [0, 1], None),
        ([one("there", -50.0, explained=0.1)], [], {}, [0, 1], None),
        # which is tried where that may be
        ([one("there", -99.9)], [], {"leaves": False}, [], None),
        ([one("there", -99.9)], [], {"state": "learned"}, [], None),
        ([one("there", -99.9)], [], {"sensor": PAD}, [], None),
    ],
)
def test_halves_that_may_be_swapped(reads, monkeypatch, columns, rows, given, tried, swapped):
    asked = []
    best = [one(score=-100.0), rival(-200.0)]
    searches = (columns, rows)
    reads(columns), reads(rows), reads(best)  # which puts them into the lab

    def search(touch, effort):
        if not isinstance(touch.signal.forces, int):
            return best
        assert effort is READER.options.first
        assert touch.signal.trust == touch.signal.forces  # both are swapped
        asked.append(touch.signal.forces)
        return searches[touch.signal.forces]

    monkeypatch.setattr(READER, "sensor", given.get("sensor", READER.sensor))
    image = np.zeros((2, 2))
    touch = Signal(image, image, contact=True, newtons=False, state=given.get("state"))
    answer, *_ = reads(
        best, signal=touch, verify_hypotheses=search, swap_halves=lambda _, axis: axis,
        has_residual=lambda _: given.get("leaves", True), expected_matches=lambda *_: 1e-9,
        may_find_more=lambda *_: False,
    )  # fmt: skip
    assert asked == tried
    assert (answer.reason, answer.margin) == (("", 100.0) if swapped is None else (AMBIGUOUS, 0.0))
    assert answer.cause == (None if swapped is None else Cause(EXCHANGED, {"columns": swapped}))


SQUARE = polygon([np.array([(0, 0), (40, 0), (40, 40), (0, 40)], float)])


def first(count, value, other=1.0):
    """One value of the first tactels of 120, and another one of the rest."""
    return np.where(np.arange(120) < count, value, other)


@pytest.mark.parametrize(
    ("changed", "leaves"),
    [
        ({}, False),
        # of 100 pressed tactels so many so far beyond the face
        ({"beyond": 3}, True), ({"beyond": 2}, False), ({"beyond": 15, "mm": 1.51}, True),
        ({"beyond": 15, "mm": 1.5}, False), ({"beyond": 15, "round_": "a cylinder"}, False),
        ({"beyond": 15, "noise": 0.0334}, True),
        # what reads little is not pressed; what is half trusted is pressed half
        ({"beyond": 15, "forces": first(15, 0.2)}, False),
        ({"beyond": 15, "forces": first(15, 0.21)}, True),
        ({"beyond": 15, "trust": first(15, 0.19)}, False),
        ({"beyond": 15, "trust": first(15, 0.21)}, True),
        ({"beyond": 15, "forces": first(12, 2.0), "trust": first(12, 0.25, 0.3)}, True),
        # of 20 symbols that are felt, so many more are not
        ({"inliers": 20, "worn": 7}, True), ({"inliers": 20, "worn": 6}, False),
        # symbols that explain little leave much, but soft ones explain little for noise
        ({"log_likelihood_ratio": 24.9, "explained": 0.859}, True),
        ({"log_likelihood_ratio": 25.0, "explained": 0.859}, False),
        ({"log_likelihood_ratio": 24.9, "explained": 0.86}, False),
        ({"log_likelihood_ratio": 24.9, "explained": 0.85, "forces": 30.0, "noise": 1.0}, True),
        ({"log_likelihood_ratio": 24.9, "explained": 0.85, "forces": 29.9, "noise": 1.0}, False),
    ],
)  # fmt: skip
def test_which_answers_leave_much_of_a_touch(changed, leaves, monkeypatch):
    given = {"beyond": 0, "mm": 3.0, "forces": 1.0, "round_": None, "noise": 0.0, "trust": 1.0}
    speaks = {name: value for name, value in changed.items() if name not in given}
    at = SimpleNamespace(**(given | changed))
    points = np.full((120, 2), 20.0)
    points[: at.beyond, 0] = 40.0 + at.mm
    points[100:] = 60.0  # not pressed: never counted
    monkeypatch.setattr("recognizer.touch.recognise.points_on_face", lambda *_: points)
    image = SimpleNamespace(
        forces=np.where(np.arange(120) < 100, at.forces, 0.1), trust=np.full(120, at.trust),
        noise=at.noise,
    )  # fmt: skip
    face = SimpleNamespace(round=at.round_, region=SQUARE)
    evidence = replace(SURE, **({"log_likelihood_ratio": 40.0} | speaks))
    assert has_residual(SimpleNamespace(image=image, face=face, evidence=evidence)) is leaves


@pytest.mark.parametrize("axis", [0, 1])
def test_halves_are_swapped_along_an_axis_and_back(axis):
    forces = np.arange(256.0).reshape(16, 16)
    swapped = swap_halves(forces, axis)
    assert (swap_halves(swapped, axis) == forces).all()
    assert swapped[0, 0] == (forces[8, 0] if axis == 0 else forces[0, 8])
