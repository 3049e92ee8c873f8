"""Touches of several faces of one object, joined."""

from types import SimpleNamespace

import numpy as np
import pytest

from recognizer.scan.answer import ScanHypothesis
from recognizer.scan.session import TouchPlaces, _Face, _hypotheses_of, contradict, join_faces
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, NOT_ENCODED, refusal


@pytest.fixture
def lab(small):
    """Faces A/F1 and B/F1 of 42 x 42 mm; each stands 30 mm above its object's origin."""
    made = small.two_faces().embossed
    for number, name in enumerate(("A", "B")):
        T = np.eye(4)
        T[2, 3] = 30.0
        made.known[number] = SimpleNamespace(
            object=name, face="F1", round=None, T_object_face=T, printed=None,
            polygon_mm=(np.array([(0, 0), (42, 0), (42, 42), (0, 42)], float),),
            rows=np.array([6]), columns=np.array([2]), rotation_rad=0.0,
            centres_mm=np.array([[3.5, 3.5]]),
        )  # fmt: skip
    return made


@pytest.fixture
def touched(small, lab):
    """Return a face whose touches leave places (number of the face, nats, x)."""

    def one(*places, reason=AMBIGUOUS, at=None):
        found = []
        for face, score, x in places:
            fit = small.fit_of([(0, 0)], [[0.0] * 5], x_mm=x, y_mm=20.0)
            place = Hypothesis(0, 6, 2, face, score)
            found.append(ScanHypothesis(lab, place, fit, score, None))
        belief = SimpleNamespace(
            reader=SimpleNamespace(options=ReaderOptions()),
            places=tuple(found), recognition=refusal(4, reason),
        )  # fmt: skip
        pose = None
        if at is not None:
            pose = np.eye(4)
            pose[:3, 3] = at
        return _Face(belief, TouchPlaces(before=pose))

    return one


def test_one_face_decides_what_another_leaves_open(touched):
    last = touched((0, -40.0, 20.0), (1, -42.0, 20.0))
    assert join_faces(last, []).reason == AMBIGUOUS
    for face, name in ((0, "A"), (1, "B")):
        other = touched((face, -10.0, 9.0), (1 - face, -30.0, 9.0))
        answer = join_faces(last, [other])
        assert (answer.object, answer.face, answer.seq) == (name, "F1", 4)
        assert answer.margin == pytest.approx(20.0 + (2.0 if face == 0 else -2.0))
    weak = touched((0, -10.0, 9.0), (1, -17.0, 9.0))  # 2 and 7 nats are no margin
    assert join_faces(last, [weak]).reason == AMBIGUOUS
    assert join_faces(last, [weak, weak]).object == "A"


def test_the_evidence_of_another_face_is_bounded(touched):
    last = touched((0, -40.0, 20.0), (1, -65.0, 20.0))
    other = touched((1, -10.0, 9.0))  # of B alone; 20 nats at most, and 25 speak for A
    assert join_faces(last, [other]).reason == AMBIGUOUS


def test_other_reasons_stand(touched):
    last = touched((0, -40.0, 20.0), (1, -42.0, 20.0), reason=NOT_ENCODED)
    assert join_faces(last, [touched((0, -10.0, 9.0))]).reason == NOT_ENCODED
    open_ = touched((0, -40.0, 20.0), (1, -42.0, 20.0))
    assert join_faces(open_, [touched((0, -10.0, 9.0), reason=NOT_ENCODED)]).reason == AMBIGUOUS


def test_where_the_motion_is_known_the_object_must_lie_in_one_place(touched):
    last = touched((0, -40.0, 20.0), (0, -41.0, 27.0), at=(100.0, 0.0, 0.0))
    for x, answered in ((20.0, 20.0), (27.0, 27.0)):
        other = touched((0, -10.0, x - 10.0), at=(90.0, 0.0, 0.0))
        assert join_faces(last, [other]).x_mm == pytest.approx(answered)
    far = touched((0, -10.0, 10.0), at=(50.0, 0.0, 0.0))  # neither: the object was moved
    assert join_faces(last, [far]).reason == AMBIGUOUS
    unknown = touched((0, -10.0, 10.0))  # of A, wherever: both places are
    assert join_faces(last, [unknown]).reason == AMBIGUOUS


def test_object_hypotheses_of_a_face(touched):
    found = _hypotheses_of(touched((0, -40.0, 20.0), (1, -42.0, 20.0), at=(100.0, 0.0, 0.0)))
    assert [(one.object, one.score) for one in found] == [("A", 0.0), ("B", -2.0)]
    height = 30.0 + 1.2  # the sensor stands on the tops of the symbols
    assert found[0].T_base_object[:3, 3] == pytest.approx([80.0, -20.0, -height])
    assert not contradict(touched((0, -1.0, 20.0)), touched((1, -1.0, 20.0)))
