"""The reader as a program uses it, its stages, and why a touch is not answered."""

import math
from dataclasses import replace

import numpy as np
import pytest
from recorded import record

from encoded_objects import encode, simulate
from encoded_objects.base.errors import UsageError
from encoded_objects.base.sensor_type import Overlay, SensorType, SensorTypeError
from encoded_objects.base.sensor_type_file import sensor_type_named
from generator.command import run
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.contact.tabs import tabs
from probe.frame import frame_from
from probe.simulate.registered import registered_surface
from recognizer.errors import LabError, SensorStateError, TouchError
from recognizer.touch import recognition as cause
from recognizer.touch.diagnose import diagnose
from recognizer.touch.lab import Lab, open_lab
from recognizer.touch.options import Effort, ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Cause, RunnerUp, refusal
from recognizer.touch.search_gate import GAPS, gap_share
from recognizer.touch.signal import signal_of
from recognizer.touch.verify import TouchImages

SENSOR = SensorType()
X, Y = np.moveaxis(SENSOR.centres_mm(), -1, 0)


@pytest.fixture(scope="module")
def url(make_lab):
    specs = "{name: Cube, shape: {cube: 60 mm}}", "{name: Tetra, shape: {tetrahedron: 80 mm}}"
    return f"sqlite:///{make_lab(*specs) / 'lab.db'}"


@pytest.fixture(scope="module")
def reader(url):
    return Reader(open_lab(url), SENSOR)


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
    surface = registered_surface(url, "Cube", "F1").surface
    return np.rint(100 * tabs(surface, SENSOR, Touch(20.0, 19.0, math.radians(25), 80.0)).forces_n)


@pytest.fixture(scope="module")
def frame(counts):
    return frame_from(counts, t_ns=0, seq=0)


def test_a_recording_says_through_which_overlay_it_was_felt(reader, frame, tmp_path, monkeypatch):
    path = tmp_path / "pad.h5"
    record(path, [frame], sensor="probe/pad")
    sensors = []
    monkeypatch.setattr(Reader, "read", lambda self, counts, **_: sensors.append(self.sensor))
    list(reader.read_all(path, every=True))
    own = SensorType(overlay=Overlay(kind="pad", height_mm=3.0))
    list(Reader(reader.lab, own).read_all(path, every=True))
    assert [sensor.overlay.kind for sensor in sensors] == ["pad", "pad"]
    assert sensors[1] == own  # a pad of one's own stays as it is


def test_a_calibration_that_is_not_beside_the_recording_is_said(reader, frame, tmp_path):
    record(tmp_path / "lost.h5", [frame], calibration="f" * 64)
    with pytest.warns(UserWarning, match="names calibration ffffffffffff"):
        answers = list(reader.read_all(tmp_path / "lost.h5", every=True))
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


def test_a_frame_is_read_by_its_counts(reader, frame):
    assert str(reader.read(frame)) == str(reader.read(frame.counts))
    assert "no contact" in str(reader.read(frame.counts * 1e-160))  # whose squares are 0


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
    reasons = cause.NO_CONTACT, cause.TOO_FEW, cause.AMBIGUOUS, cause.BY_CHANCE
    for reason in (*reasons, cause.NOT_ENCODED, cause.OUTSIDE):
        assert str(refusal(0, reason)).startswith(f"not recognised: {reason}; ")
    doubt = refusal(0, cause.AMBIGUOUS, runner_up=RunnerUp("Prism", "F2", (0, 0)))
    assert str(doubt).startswith("not recognised: ambiguous, Prism/F2 among others; ")
    assert math.isnan(doubt.x_mm)
    assert math.isnan(doubt.theta_deg)


def bars(rng, high=200.0):
    """Readings of strokes, one tactel wide, on a face: noise of 2, a background of 8."""
    image = np.where((np.arange(16) % 4 == 0)[:, None] | (np.arange(16) % 5 == 0), high, 0.0)
    return 8.0 + image * np.exp(rng.normal(0, 0.1, (16, 16))) + rng.normal(0, 2, (16, 16))


def code_of(reader, image):
    signal = signal_of(np.asarray(image, float))
    return diagnose(TouchImages(reader, signal), []).code


def test_what_the_image_shows_by_itself(reader, monkeypatch):
    rng = np.random.default_rng(1)
    image = bars(rng)
    assert code_of(reader, image) == cause.UNCLEAR  # nothing is the matter with it
    assert code_of(reader, np.full((16, 16), 8.0)) == cause.NO_LOAD
    assert code_of(reader, 8 + (image - 8) * np.clip((X + 14) / 26, 0, 1)) == cause.TILTED
    assert code_of(reader, bars(rng, high=18.0)) == cause.SOFT
    even = 100 * np.exp(rng.normal(0, 0.15, (16, 16)))
    even[0, :13] = 8.0
    assert code_of(reader, even) == cause.PLAIN
    smeared = 8 + np.mean([np.roll(image - 8, k, axis=1) for k in range(5)], axis=0)
    signal = signal_of(smeared)
    monkeypatch.setattr("recognizer.touch.diagnose.SMEARED", 1.5)
    found = diagnose(TouchImages(reader, signal), [])
    assert found.code == cause.MOVING
    away = (found.evidence["direction_deg"] + 90) % 180 - 90
    assert away == pytest.approx(0, abs=10)  # along the columns
    hard = diagnose(TouchImages(reader, signal_of(2.0 * smeared)), [])
    assert hard.code == cause.HARD
    assert str(hard).startswith("pressed too hard: readings add up to ")
    assert hard.way_out == "press with 30 to 120 N"
    for share, code in ((1.01, cause.HARD), (0.99, cause.MOVING)):
        newtons = signal_of(smeared * share * 250 / smeared.sum(), floor=0.0, newtons=True)
        assert diagnose(TouchImages(reader, newtons), []).code == code


def test_weak_is_told_in_newtons_where_they_are_known(reader):
    rng = np.random.default_rng(2)
    image = np.where(bars(rng) > 50, rng.uniform(0.99, 1.0, (16, 16)), 0.0)
    for high, code in ((0.14, cause.SOFT), (0.16, cause.UNCLEAR)):
        signal = signal_of(high * image, floor=0.0, newtons=True)
        found = diagnose(TouchImages(reader, signal), [])
        assert found.code == code
        assert str(found).startswith("pressed too softly: readings reach 0.14 N") == (high < 0.15)


@pytest.fixture(scope="module")
def keyed(make_lab):
    """A lab whose symbols are known, so that places can be named where the readings are even."""
    spec = "{name: Cube, shape: {cube: 40 mm}, symbols: {alphabet: dense-4}}"
    return f"{make_lab(spec, lab_key='0123-4567-89AB-CDER')}/lab.db"


def test_symbols_along_the_rows_are_read_however_few_gaps_they_show(keyed):
    reader, at = Reader(open_lab(keyed)), Touch(18.4, 18.4, np.pi / 2, 300.0)
    surface = registered_surface(keyed, "Cube", "F5").surface
    counts = np.rint(100 * press(surface, SENSOR, at).forces_n)
    assert gap_share(signal_of(counts)) < GAPS  # as of a plain plate
    answer = reader.read(counts)
    assert (answer.face, answer.x_mm, answer.y_mm) == (
        "F5", pytest.approx(18.4, abs=0.2), pytest.approx(18.4, abs=0.2),
    )  # fmt: skip


def test_symbols_that_are_plainly_there_are_no_plain_face(keyed):
    touch = simulate(f"{keyed}#Cube/F4", x=17.5, y=16.5, theta=90, force=350)
    refused = Reader(open_lab(keyed)).read(touch.counts)
    assert refused.reason_code == cause.UNCLEAR
    assert refused.cause.evidence["surprise"] > 20


def test_every_cause_has_words_and_a_way_out():
    numbers = dict.fromkeys(
        ("plateau", "signal_to_noise", "newtons", "loaded", "symbols", "direction_deg",
         "sharpness", "silent", "explained", "explained_anywhere", "symbols_anywhere", "slope",
         "width_mm", "variation", "columns", "pitch_mm", "best_mm", "sum", "most", "least_n",
         "most_n"), 0.5
    )  # fmt: skip
    others = {*cause.WAYS_OUT, cause.CHECKED, cause.UNCHECKED}
    others |= {cause.AS_DESIGNED, cause.AS_BUILT, cause.NOT_MEASURED}
    named = [value for name, value in vars(cause).items() if name.isupper() and name[0] != "_"]
    codes = {one for one in named if isinstance(one, str)} - others
    assert len(codes) == 14
    for code in codes:
        assert str(Cause(code, numbers))
        assert Cause(code, numbers).way_out
