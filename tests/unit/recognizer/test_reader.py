"""The reader as a program uses it, and its stages: touches in, object, face and pose out."""

import math
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects import encode
from encoded_objects.base.errors import UsageError
from encoded_objects.base.sensor_type import Overlay, SensorType, SensorTypeError
from encoded_objects.base.sensor_type_file import sensor_type_named
from generator.command import run
from probe.contact.contract import Touch
from probe.contact.tabs import tabs
from probe.frame import frame_from
from probe.recording.record import Recorder
from probe.simulate.registered import registered_surface
from recognizer.errors import LabError, SensorStateError, TouchError
from recognizer.touch.lab import Lab, open_lab
from recognizer.touch.options import Effort, ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import (
    AMBIGUOUS,
    BY_CHANCE,
    NO_CONTACT,
    NOT_ENCODED,
    OUTSIDE,
    TOO_FEW,
    RunnerUp,
    refusal,
)


@pytest.fixture(scope="module")
def url(make_lab):
    specs = "{name: Cube, shape: {cube: 60 mm}}", "{name: Tetra, shape: {tetrahedron: 80 mm}}"
    return f"sqlite:///{make_lab(*specs) / 'lab.db'}"


@pytest.fixture(scope="module")
def reader(url):
    return Reader(open_lab(url), SensorType())


def felt(url, name, face, touch):
    return tabs(registered_surface(url, name, face).surface, SensorType(), touch).forces_n


def test_a_print_keeps_the_middle_of_its_symbols(reader):
    for number in range(len(reader.lab.arrays[0].faces)):
        face = reader.lab.arrays[0].face(number)
        about, middle = face.printed.T_part_face, face.centres_mm.mean(axis=0)
        np.testing.assert_allclose(about @ [*middle, 0.0, 1.0], [0, 0, 0, 1], atol=1e-9)
        if face.T_part_face is not None:
            np.testing.assert_array_equal(about[:3, :3], face.T_part_face[:3, :3])
        pose = np.eye(4)
        pose[:2, 3] = middle + np.array([10.0, 0.0])
        tenth = replace(face.printed.as_built, scale_x=0.9, scale_y=0.9)
        at, _ = replace(face.printed, as_built=tenth).pose(pose, np.eye(3))
        assert at[:2, 3] == pytest.approx(middle + np.array([9.0, 0.0]))


@pytest.fixture(scope="module")
def counts(url):
    return np.rint(100 * felt(url, "Cube", "F1", Touch(20.0, 19.0, math.radians(25), 80.0)))


def film(path, images, **named):
    with Recorder(path, **named) as recorder:
        for seq, image in enumerate(images):
            recorder.append(frame_from(image, t_ns=seq * 4_545_455, seq=seq))
    return path


def test_a_recording_says_through_which_overlay_it_was_felt(reader, counts, tmp_path, monkeypatch):
    path = film(tmp_path / "pad.h5", [counts], sensor="probe/pad")
    sensors = []
    monkeypatch.setattr(Reader, "read", lambda self, counts, **_: sensors.append(self.sensor))
    list(reader.read_all(path, every=True))
    own = SensorType(overlay=Overlay(kind="pad", height_mm=3.0))
    list(Reader(reader.lab, own).read_all(path, every=True))
    assert [sensor.overlay.kind for sensor in sensors] == ["pad", "pad"]
    assert sensors[1] == own  # a pad of one's own stays as it is


def test_a_calibration_that_is_not_beside_the_recording_is_said(reader, counts, tmp_path):
    path = film(tmp_path / "lost.h5", [counts], calibration="f" * 64)
    with pytest.warns(UserWarning, match="names calibration ffffffffffff"):
        answers = list(reader.read_all(path, every=True))
    assert answers[0].face == "F1"


@pytest.mark.parametrize(
    ("image", "said"),
    [
        (np.zeros((8, 16)), r"shape \(8, 16\), of a sensor with 16 rows, 16 columns"),
        (np.zeros(256), "shape"),
        (np.full((16, 16), np.nan), "NaN or of 1e"),
        (np.full((16, 16), -1e200), "NaN or of 1e"),
        (np.ones((16, 16), complex), "no matrix of numbers"),
        ("abc", "no matrix of numbers"),
        ([[1, 2], [3]], "no matrix of numbers"),
    ],
)
def test_what_is_no_image_of_the_sensor_is_refused(reader, image, said):
    with pytest.raises(TouchError, match=said):
        reader.read(image)


def test_a_frame_is_read_by_its_counts(reader, counts):
    frame = frame_from(counts, t_ns=0, seq=0)
    assert str(reader.read(frame)) == str(reader.read(frame.counts))
    assert "no contact" in str(reader.read(counts * 1e-160))  # whose squares are 0


def test_trust_must_fit_and_bad_tactels_are_not_believed(reader, counts):
    with pytest.raises(TouchError, match=r"shape \(2, 2\)"):
        reader.read(counts, trust=np.ones((2, 2)))
    spoiled, trust = counts.copy(), np.ones((16, 16))
    spoiled[3:5, 4:9], trust[3:5, 4:9] = 5000.0, 0.0
    assert reader.read(spoiled, trust=trust).face == "F1"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"margin": math.nan}, "margin nan; give a finite number of 0 or more"),
        ({"rim_mm": math.inf}, "rim_mm inf"),
        ({"contact_n": -0.1}, "contact_n -0.1"),
        ({"margin_by_few": "14"}, "margin_by_few '14'"),
        ({"doubt": 0.0}, "doubt 0.0; give a finite number above 0"),
        ({"scale_sd": 0}, "scale_sd 0; "),
        ({"scale_most": 1.0}, "scale_most 1.0; give a share below 1"),
        ({"as_designed": 1}, "as_designed 1; give True or False"),
        ({"first": (4, 2)}, "an Effort"),
    ],
)
def test_knobs_that_mean_nothing_are_refused(wrong, said):
    with pytest.raises(UsageError, match=said):
        ReaderOptions(**wrong)


@pytest.mark.parametrize(
    ("given", "error", "said"),
    [
        ({"lab": "lab.db"}, LabError, "'lab.db' is no open lab"),
        ({"sensor": "fsr-9"}, SensorTypeError, "there is no sensor type 'fsr-9'"),
        ({"sensor": 16}, SensorTypeError, "16 is no sensor type"),
        ({"options": {"margin": 3}}, UsageError, "options {'margin': 3}"),
        ({"state": "left.json"}, SensorStateError, "'left.json' is no state of a sensor"),
    ],
)
def test_a_reader_takes_an_open_lab_and_a_type(reader, given, error, said):
    with pytest.raises(error, match=said):
        Reader(**{"lab": reader.lab} | given)


def test_a_reader_takes_the_name_of_a_type(reader):
    assert Reader(reader.lab, "fsr-8x8").sensor == sensor_type_named("fsr-8x8")


def test_a_lab_that_was_changed_meanwhile_says_so(tmp_path):
    url = str(tmp_path / "lab.db")
    spec = {"name": "Plate", "shape": {"box": [40, 30, 20]}}
    encode(spec, database=url, formats=())
    labs = [open_lab(url) for _ in range(2)]
    encode({**spec, "shape": {"cube": 50}}, database=url, formats=(), replace=True)
    for lab in labs:
        with pytest.raises(LabError, match="made again after the lab was opened"):
            lab.arrays[0].face(0)
        run(["retire", "Plate", "--free", "--yes", "--database", url])


def test_a_lab_shows_no_password():
    assert "secret" not in repr(Lab("postgresql://lab:secret@host/objects", ()))


def test_an_effort_is_of_whole_numbers():
    with pytest.raises(UsageError, match="candidates 0; give a whole number of 1 or more"):
        Effort(candidates=0)


def test_every_reason_has_a_way_out():
    for reason in (NO_CONTACT, TOO_FEW, AMBIGUOUS, BY_CHANCE, NOT_ENCODED, OUTSIDE):
        assert str(refusal(0, reason)).startswith(f"not recognised: {reason}; ")
    doubt = refusal(0, AMBIGUOUS, runner_up=RunnerUp("Prism", "F2", (0, 0)))
    assert str(doubt).startswith("not recognised: ambiguous, Prism/F2 among others; ")
    assert math.isnan(doubt.x_mm)
    assert math.isnan(doubt.theta_deg)
