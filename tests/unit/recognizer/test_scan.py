"""Scans of simulated faces: the right face, or a reason."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.errors import UsageError
from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.frame import frame_from
from probe.scan import surface_to_sensor
from probe.simulate.registered import registered_surface
from probe.simulate.scene import Scene
from probe.simulate.world.levels import TYPICAL
from probe.simulate.world.sensor import LevelSensor
from probe.surface.polygon import polygon
from recognizer.errors import MosaicError
from recognizer.scan.belief import ScanHypothesis, begin_scan, extend_scan
from recognizer.scan.mosaic.planar import PlacedTouch, compose_poses, planar_belief
from recognizer.scan.session import Scan, TouchPlaces, _Face, join_faces
from recognizer.touch.hypothesis import Hypothesis
from recognizer.touch.lab import open_lab
from recognizer.touch.options import ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import AMBIGUOUS, NOT_ENCODED, TOO_FEW, refusal
from recognizer.touch.signal import signal_of
from recognizer.validation.draw import FOREIGN

SENSOR = SensorType()
SPREAD = (0.4, 0.4, 0.004)


@pytest.fixture(scope="module")
def lab(make_lab):
    return open_lab(make_lab("{name: Cube, shape: {cube: 80 mm}, profile: thesis}") / "lab.db")


@pytest.fixture(scope="module")
def reader(lab):
    return Reader(lab, SENSOR)


#: a face of the cube: its middle is where a print's scale moves nothing
REGION = polygon([np.array([(0, 0), (80, 0), (80, 80), (0, 80)])])
PLACES = [(x, y) for n, y in enumerate((26.0, 40.0, 54.0)) for x in (22, 32, 42, 52)[:: (-1) ** n]]
T_ARM_FACE = np.array([200.0, -70.0, 0.6])


def foreign(reader):
    """Symbols that no object has."""
    return FOREIGN["random symbols"](reader.lab.arrays[0], np.random.default_rng(8))


def scanned(surface, places, theta, others):
    """Touches with places believed in another frame; those of `others` feel another surface."""
    rng, touches = np.random.default_rng(7), []
    for k, (x, y) in enumerate(places):
        scene = Scene(others.get(k, surface), REGION, "")
        touch = Touch(x, y, theta, float(rng.uniform(40, 110)), *rng.normal(0, 0.008, 2))
        counts = LevelSensor(SENSOR, TYPICAL).read(scene, touch, np.random.default_rng(7)).counts
        pose = compose_poses(T_ARM_FACE, np.array([x, y, theta])) + rng.normal(0, SPREAD)
        believed = planar_belief(pose, SPREAD)
        touches.append(PlacedTouch(signal_of(counts.astype(float)), believed, seq=k))
    return touches


def test_touches_of_another_thing_do_not_make_an_answer(lab, reader):
    cube = registered_surface(lab.url, "Cube", "F3").surface
    scan = begin_scan(reader)
    for touch in scanned(cube, PLACES, 0.3, dict.fromkeys((3, 6), foreign(reader))):
        scan = extend_scan(scan, touch)
        assert scan.recognition.object in (None, "Cube")
    assert scan.recognition.face == "F3"
    chosen = scan.best.evidence.agreement.chosen
    assert chosen[3] < 0
    assert chosen[6] < 0


def test_a_surface_that_is_not_registered_is_no_object(reader):
    scan = begin_scan(reader)
    assert scan.recognition.reason == TOO_FEW
    for touch in scanned(foreign(reader), PLACES[:8], 0.5, {}):
        scan = extend_scan(scan, touch)
        assert not scan.recognition


@pytest.fixture(scope="module")
def one_touch(make_lab):
    """Two cubes whose faces one touch can tell, and what touches of them feel."""
    spec = "{name: Cube, shape: {cube: 50 mm}, profile: one-touch, copies: 2}"
    lab = open_lab(make_lab(spec) / "lab.db")

    def felt(name, face, x, y, T_base_object=None):
        scene = registered_surface(lab.url, name, face)
        touch = Touch(x, y, 0.4, 80.0)
        counts = LevelSensor(SENSOR, TYPICAL).read(scene, touch, np.random.default_rng(1)).counts
        if T_base_object is None:
            return counts, None
        return counts, T_base_object @ scene.T_object_surface @ surface_to_sensor(x, y, 0.4)

    return Reader(lab, SENSOR), felt


@pytest.mark.parametrize(
    "pose",
    [np.full((4, 4), np.nan), np.zeros((4, 4)), np.diag([1.0, 1, -1, 1]), np.diag([7.0, 1, 1, 1]),
     np.eye(4)[:3], "pose"],
)  # fmt: skip
def test_a_pose_that_is_no_rigid_transform_is_refused(lab, pose):
    with pytest.raises(MosaicError, match="no rigid transform"):
        TouchPlaces().keep(pose)
    counts = np.zeros((16, 16))
    counts[2:14:3] = 200.0
    scan = Scan(lab)
    scan.add(counts, pose=np.eye(4))
    with pytest.raises(MosaicError, match="no rigid transform"):
        scan.add(counts, pose=pose)


def test_a_frame_brings_its_pose_and_a_reader_its_sensor(lab):
    scan = Scan(lab)
    frame = frame_from(np.zeros((16, 16)), t_ns=0, seq=7, pose=np.eye(4))
    assert scan.add(frame).seq == 7
    with pytest.raises(UsageError, match="a reader has its sensor"):
        Scan(Reader(lab), sensor=SENSOR)


def test_faces_of_one_object_are_one_belief_and_a_moved_object_is_a_new_one(one_touch):
    reader, felt = one_touch
    scan, T = Scan(reader), np.eye(4)
    for face in ("F1", "F2", "F3"):
        answer = scan.add(*felt("Cube-1", face, 24, 26, T))
        assert (answer.object, answer.face) == ("Cube-1", face)
    assert (scan.touches, scan.changes) == (3, 0)
    moved = T.copy()
    moved[:3, 3] = 15.0, -4.0, 8.0
    assert scan.add(*felt("Cube-1", "F2", 24, 26, moved)).face == "F2"
    assert (scan.touches, scan.changes) == (1, 1)


def test_a_slip_on_a_face_is_found_and_the_new_place_is_the_answer(one_touch):
    reader, felt = one_touch
    scan, T = Scan(reader), np.eye(4)
    scan.add(*felt("Cube-1", "F1", 24, 20, T))
    counts, _ = felt("Cube-1", "F1", 24, 31, T)  # though the arm believes 24, 20
    _, pose = felt("Cube-1", "F1", 24, 20, T)
    answer = scan.add(counts, pose)
    assert math.hypot(answer.x_mm - 24, answer.y_mm - 31) < 0.3
    assert (scan.touches, scan.changes) == (1, 1)


@pytest.fixture
def embossed(small):
    """Faces A/F1 and B/F1 of 42 x 42 mm; each stands 30 mm above its object's origin."""
    made = small.two_faces().embossed
    for number, name in enumerate(("A", "B")):
        T = np.eye(4)
        T[2, 3] = 30.0
        made.known[number] = small.known_face(name, "F1", T_object_face=T)
    return made


@pytest.fixture
def touched(small, embossed):
    """Return a face whose touches leave places (number of the face, nats, x)."""

    def one(*places, reason=AMBIGUOUS, at=None):
        found = []
        for face, score, x in places:
            fit = small.fit_of([(0, 0)], [[0.0] * 5], x_mm=x, y_mm=20.0)
            place = Hypothesis(0, 6, 2, face, score)
            found.append(ScanHypothesis(embossed, place, fit, score, None))
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
