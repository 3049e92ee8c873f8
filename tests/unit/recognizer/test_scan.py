"""Scans of simulated faces: the right face, or a reason."""

import math

import numpy as np
import pytest

from generator.pipeline import encode
from generator.spec import read_specs
from probe.contact.contract import Touch
from probe.sensor import SensorType
from probe.simulate.registered import registered_surface
from recognizer.scan.grow import begun, extended, read_scan
from recognizer.scan.mosaic.touch import PlacedTouch, placed
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import reader_for
from recognizer.touch.recognition import NO_CONTACT, TOO_FEW
from recognizer.touch.signal import signal_of
from recognizer.validation.levels import MISMATCH, TYPICAL, read
from recognizer.validation.surfaces import FOREIGN

SENSOR = SensorType()
SPREAD = (0.4, 0.4, 0.004)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scan")
    (folder / "set.yaml").write_text(
        "objects:\n"
        "- {name: Cube, shape: {cube: 80 mm}, profile: thesis}\n"
        "- name: Prism\n"
        "  shape: {triangular_prism: {side: 90 mm, height: 80 mm}}\n"
        "  profile: thesis\n"
    )
    url = f"sqlite:///{folder / 'lab.db'}"
    encode(read_specs([folder / "set.yaml"]), folder=folder / "out", database=url, formats=())
    return open_lab(url)


@pytest.fixture(scope="module")
def reader(lab):
    return reader_for(lab, SENSOR)


def scanned(surface, places, theta, level, seed):
    """Touches with believed places in another frame, and the true poses."""
    rng = np.random.default_rng(seed)
    c, s = math.cos(0.6), math.sin(0.6)
    touches, true = [], []
    for k, (x, y) in enumerate(places):
        touch = Touch(x, y, theta, float(rng.uniform(40, 110)), *rng.normal(0, 0.008, 2))
        counts, _ = read(surface, SENSOR, touch, level, np.random.default_rng(seed))
        error = rng.normal(0, 1, 3) * SPREAD
        pose = np.array([c * x - s * y + 200, s * x + c * y - 70, theta + 0.6]) + error
        signal = signal_of(counts.astype(float))
        touches.append(PlacedTouch(signal, placed(pose, SPREAD), seq=k))
        true.append((x, y, theta))
    return touches, np.array(true)


PLACES = [(x, y) for n, y in enumerate((26.0, 40.0, 54.0)) for x in (22, 32, 42, 52)[:: (-1) ** n]]


@pytest.mark.parametrize("level", [TYPICAL, MISMATCH], ids=lambda level: level.name)
def test_a_scan_tells_what_one_touch_cannot(lab, reader, level):
    surface = registered_surface(lab.url, "Cube", "F3").surface
    touches, true = scanned(surface, PLACES, 0.8, level, 5)
    scan, answers = begun(reader), []
    assert not scan.recognition
    assert scan.recognition.reason == TOO_FEW
    for touch in touches:
        scan = extended(scan, touch)
        answers.append(scan.recognition)
    assert not answers[0]  # a 25 mm touch of 12 mm symbols
    assert answers[-1]
    for answer, (x, y, theta) in zip(answers, true, strict=True):
        if answer:
            T = answer.T_face_probe
            assert (answer.object, answer.face) == ("Cube", "F3")
            assert math.hypot(T[0, 3] - x, T[1, 3] - y) < 0.5
            turn = math.atan2(T[1, 0], T[0, 0]) - theta
            assert abs(math.degrees(math.remainder(turn, math.tau))) < 2
    assert [answer.seq for answer in answers] == list(range(len(touches)))
    assert read_scan(reader, touches).as_json() == answers[-1].as_json()


def test_a_touch_in_the_air_says_so_and_changes_nothing(lab, reader):
    surface = registered_surface(lab.url, "Cube", "F3").surface
    touches, _ = scanned(surface, PLACES[:3], 0.0, TYPICAL, 2)
    scan = begun(reader)
    for touch in touches:
        scan = extended(scan, touch)
    air = PlacedTouch(signal_of(np.full((16, 16), 8.0)), touches[0].believed, seq=9)
    lifted = extended(scan, air)
    assert lifted.recognition.reason == NO_CONTACT
    assert len(lifted.touches) == 3
    assert lifted.leading is scan.leading


def test_touches_of_another_thing_do_not_make_an_answer(lab, reader):
    cube = registered_surface(lab.url, "Cube", "F3").surface
    prism = registered_surface(lab.url, "Prism", "F2").surface
    touches, _true = scanned(cube, PLACES, 0.3, TYPICAL, 7)
    strange, _ = scanned(prism, [(x - 3.1, y + 4.7) for x, y in PLACES[5:7]], 1.5, TYPICAL, 7)
    mixed = list(touches)
    for k, touch in zip((3, 6), strange, strict=True):
        mixed[k] = PlacedTouch(touch.signal, touches[k].believed, seq=k)
    scan = begun(reader)
    for touch in mixed:
        scan = extended(scan, touch)
        assert scan.recognition.object in (None, "Cube")
    assert scan.recognition.face == "F3"
    chosen = scan.leading.composite.agreement.chosen
    assert chosen[3] < 0
    assert chosen[6] < 0


def test_steps_without_an_arm_are_enough(lab, reader):
    surface = registered_surface(lab.url, "Cube", "F2").surface
    places = [(x, 40.0 + 7 * n) for n in (0, 1) for x in (24, 30, 36, 42, 48)[:: (-1) ** n]]
    touches, true = scanned(surface, places, 0.0, TYPICAL, 4)
    rng = np.random.default_rng(4)
    spread = (0.8, 0.8, 0.01)
    counted = [PlacedTouch(touches[0].signal, placed((0, 0, 0), (0.01, 0.01, 1e-4)))]
    for k in range(1, len(touches)):
        step = true[k] - true[k - 1] + rng.normal(0, 1, 3) * spread
        counted.append(PlacedTouch(touches[k].signal, stepped=placed(step, spread), seq=k))
    scan = begun(reader)
    for touch in counted:
        scan = extended(scan, touch)
        assert scan.recognition.object in (None, "Cube")
        assert scan.recognition.face in (None, "F2")
    assert scan.stands.mosaic is not None
    assert scan.recognition
    assert np.hypot(*(scan.recognition.T_face_probe[:2, 3] - true[-1, :2])) < 0.5


@pytest.mark.parametrize("kind", ["random symbols", "ridges"])
def test_a_surface_that_is_not_registered_is_no_object(reader, kind):
    surface = FOREIGN[kind](reader.lab.arrays[0], np.random.default_rng(8))
    touches, _ = scanned(surface, PLACES[:8], 0.5, TYPICAL, 3)
    scan = begun(reader)
    for touch in touches:
        scan = extended(scan, touch)
        assert not scan.recognition
