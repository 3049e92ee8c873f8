"""The reader as a program uses it: counts and recordings in, answers that print out."""

import math
from dataclasses import replace

import numpy as np
import pytest

from encoded_objects.base.sensor_type import Overlay, SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.frame import frame_from
from probe.recording.read import Recording
from probe.recording.record import Recorder
from probe.simulate.registered import registered_surface
from recognizer.errors import TouchError
from recognizer.touch.lab import open_lab
from recognizer.touch.options import ReaderOptions
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

AT = Touch(20.0, 19.0, math.radians(25), 80.0)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "cube.yaml").write_text("name: Cube\nshape: {cube: 40 mm}\n")
    encode(read_specs([folder / "cube.yaml"]), folder=folder / "out",
           database=f"sqlite:///{folder / 'lab.db'}", formats=("stl",))  # fmt: skip
    return folder


@pytest.fixture(scope="module")
def reader(lab):
    return Reader(open_lab(lab / "lab.db"))


@pytest.fixture(scope="module")
def counts(lab):
    surface = registered_surface(str(lab / "lab.db"), "Cube", "F1").surface
    forces = press(surface, SensorType(), AT).forces_n
    return np.rint(100 * forces)


def film(path, images, **named):
    with Recorder(path, **named) as recorder:
        for seq, image in enumerate(images):
            recorder.append(frame_from(image, t_ns=seq * 4_545_455, seq=seq))
    return path


def test_counts_give_an_answer_that_prints(reader, counts):
    answer = reader.read(counts.tolist(), seq=7)
    assert answer
    assert (answer.object, answer.face, answer.seq) == ("Cube", "F1", 7)
    assert math.hypot(answer.x_mm - AT.x_mm, answer.y_mm - AT.y_mm) < 0.15
    assert answer.theta_deg == pytest.approx(25, abs=0.5)
    assert 0 < answer.spread_mm < 0.2
    where = f"Cube/F1 at ({answer.x_mm:.2f}, {answer.y_mm:.2f}) mm +- {answer.spread_mm:.2f}"
    assert str(answer).startswith(f"{where} turned {answer.theta_deg:.1f} degrees; array (")
    assert str(answer).endswith("no other place comes near")
    assert str(replace(answer, margin=62.7)).endswith("; margin 63 nats")


def test_a_recording_is_read_touch_by_touch_or_frame_by_frame(reader, lab, counts):
    rest = np.zeros((16, 16))
    path = film(lab / "film.h5", [rest] * 3 + [counts] * 30 + [rest] * 3)
    (answer,) = reader.read_all(path)
    assert (answer.seq, answer.face) == (3, "F1")
    every = list(reader.read_all(Recording(path), every=True))
    assert [one.seq for one in every] == list(range(36))
    assert [bool(one) for one in every] == [False] * 3 + [True] * 30 + [False] * 3


def test_a_recording_says_through_which_overlay_it_was_felt(reader, lab, counts, monkeypatch):
    path = film(lab / "pad.h5", [counts], sensor="probe/pad")
    sensors = []
    monkeypatch.setattr(Reader, "read", lambda self, counts, **_: sensors.append(self.sensor))
    list(reader.read_all(path, every=True))
    own = SensorType(overlay=Overlay(kind="pad", height_mm=3.0))
    list(Reader(reader.lab, own).read_all(path, every=True))
    assert [sensor.overlay.kind for sensor in sensors] == ["pad", "pad"]
    assert sensors[1] == own  # a pad of one's own stays as it is


def test_a_calibration_that_is_not_beside_the_recording_is_said(reader, lab, counts):
    path = film(lab / "lost.h5", [counts], calibration="f" * 64)
    with pytest.warns(UserWarning, match="names calibration ffffffffffff"):
        answers = list(reader.read_all(path, every=True))
    assert answers[0].face == "F1"


@pytest.mark.parametrize(
    ("image", "said"),
    [
        (np.zeros((8, 16)), r"shape \(8, 16\), of a sensor with 16 rows, 16 columns"),
        (np.zeros(256), "shape"),
        (np.full((16, 16), np.nan), "NaN or infinite"),
    ],
)
def test_what_is_no_image_of_the_sensor_is_refused(reader, image, said):
    with pytest.raises(TouchError, match=said):
        reader.read(image)


def test_trust_must_fit_and_bad_tactels_are_not_believed(reader, counts):
    with pytest.raises(TouchError, match=r"shape \(2, 2\)"):
        reader.read(counts, trust=np.ones((2, 2)))
    spoiled, trust = counts.copy(), np.ones((16, 16))
    spoiled[3:5, 4:9], trust[3:5, 4:9] = 5000.0, 0.0
    assert reader.read(spoiled, trust=trust).face == "F1"


def test_every_reason_has_a_way_out():
    for reason in (NO_CONTACT, TOO_FEW, AMBIGUOUS, BY_CHANCE, NOT_ENCODED, OUTSIDE):
        assert refusal(0, reason).way_out
        assert str(refusal(0, reason)).startswith(f"not recognised: {reason}; ")
    doubt = refusal(0, AMBIGUOUS, runner_up=RunnerUp("Prism", "F2", (0, 0)))
    assert str(doubt).startswith("not recognised: ambiguous, Prism/F2 among others; ")
    chance = refusal(0, BY_CHANCE, runner_up=RunnerUp("Prism", "F2", (0, 0)), doubt=0.0312)
    assert str(chance).startswith(
        "not recognised: ambiguous by chance, as 0.03 places would match;"
    )
    assert chance.as_json()["doubt"] == 0.0312
    assert math.isnan(doubt.x_mm)
    assert math.isnan(doubt.theta_deg)


def test_an_answer_says_what_would_match_by_chance(reader, counts):
    answer = reader.read(counts)
    assert 0 < answer.doubt < 1e-4
    assert answer.as_json()["doubt"] == answer.doubt
    refused = replace(reader, options=ReaderOptions(doubt=1e-30)).read(counts)
    assert (refused.reason, refused.face) == (BY_CHANCE, None)
    assert 1e-30 < refused.doubt <= answer.doubt  # its border counts where symbols are too few


def test_a_reader_decides_by_its_settings(reader, counts):
    strict = ReaderOptions(margin=1e6, margin_by_few=1e6)
    assert replace(reader, options=strict).read(counts).reason in ("", AMBIGUOUS)
    deaf = ReaderOptions(contact_counts=1e6)
    assert replace(reader, options=deaf).read(counts).reason == NO_CONTACT
    assert replace(reader, options=deaf).prepared[0][1] is reader.prepared[0][1]  # not made anew


def test_a_lab_says_what_it_holds(lab):
    held = open_lab(lab / "lab.db")
    assert str(held).endswith("lab.db: 1 object, 6 faces, 294 symbols")
    assert repr(Reader(held)) == f"Reader({held}; fsr-16, tab)"
