"""`recognize-object` in one process: what it prints, writes, and refuses."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from PIL import Image
from reference.drawn_fsr import read_sequence

from encoded_objects.base.sensor_type import SensorType
from probe.calibration import calibration_from, even_load, write_calibration
from probe.circuit import Electronics, fsr_of, read_counts
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.frame import frame_from
from probe.recording.record import Recorder
from probe.simulate.registered import registered_surface
from probe.wrist import Wrist, counts_of, distances_at
from recognizer.command import run
from recognizer.command.scanning import ScanError, pose_during, read_joints
from recognizer.picture import winning_lattice
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.robot import Seating
from recognizer.touch.signal import signal_of
from recognizer.touch.source import TouchImage

AT = Touch(20.0, 19.0, math.radians(25), 80.0)
BESIDE = Touch(17.0, 22.0, math.radians(-60), 60.0)
T_BASE_SENSOR = np.diag([1.0, -1.0, -1.0, 1.0])
T_BASE_SENSOR[:3, 3] = 300, 50, 20


@pytest.fixture(scope="module")
def lab(make_lab):
    """A database with one object."""
    return make_lab("name: Cube\nshape: {cube: 40 mm}\n", formats=("stl",))


def forces_of(lab, touch):
    scene = registered_surface(str(lab / "lab.db"), "Cube", "F1")
    return press(scene.surface, SensorType(), touch).forces_n


def recorded(path, images, *, wrist=None, pose=None, **named):
    with Recorder(path, **named) as recorder:
        for seq, counts in enumerate(images):
            recorder.append(frame_from(counts, t_ns=seq * 4_545_455, seq=seq, wrist=wrist,
                                       pose=pose))  # fmt: skip
    return path


@pytest.fixture(scope="module")
def images(lab):
    """Counts of two places."""
    rng = np.random.default_rng(4)
    forces = [forces_of(lab, touch) for touch in (AT, BESIDE)]
    return [read_counts(f, Electronics(), fsr_of(16, 16), None, rng)[0] for f in forces]


@pytest.fixture
def asked(ask, lab, monkeypatch):
    """Run the command beside the database."""
    monkeypatch.chdir(lab)
    return partial(ask, run)


def test_reading_loads_no_library_that_it_does_not_need(lab, images):
    words = [str(recorded(lab / "light.h5", images[:1])), "--database", str(lab / "lab.db")]
    assert run(words) == 0  # templates may have to be worked out
    names = ["matplotlib", "skimage", "scipy", "skfem", "serial", "build123d", "manifold3d"]
    script = f"from recognizer.command import run; assert run({words}) == 0; import sys\n"
    script += f"print([name for name in {names} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr


def test_the_calibration_that_a_recording_names_is_found_and_another_refused(asked, lab):
    rng, board, fsr = np.random.default_rng(3), Electronics(), fsr_of(16, 16)
    dead = (slice(3, 4), slice(2, 9))
    (lab / "calibrated").mkdir()
    file, path = (lab / "calibrated" / name for name in ("bench.json", "touch.h5"))

    def read(forces, number):
        felt = forces.copy()
        felt[dead] = 0.0
        return read_sequence(np.stack([felt] * number), board, fsr, None, rng)[0]

    loads = {f: read(np.full((16, 16), f / 256), 60) for f in (0, 60, 120, 240, 400)}
    made = calibration_from(
        loads[0], [even_load(loads[f], f, name=f"{f} N") for f in (60, 120, 240, 400)],
        sensor="bench/0", made="2026-01-01", board=board,
    )  # fmt: skip
    assert made.bad[dead].all()
    digest = write_calibration(made, file)
    recorded(path, read(forces_of(lab, AT), 10), sensor="bench/0", calibration=digest)
    code, out, err = asked(path, "--json")
    assert (code, err) == (0, "")
    entry = json.loads(out)[0]
    assert (entry["object"], entry["face"], entry["reason"]) == ("Cube", "F1", "")
    assert math.hypot(entry["x_mm"] - AT.x_mm, entry["y_mm"] - AT.y_mm) < 0.15
    assert entry["theta_deg"] == pytest.approx(math.degrees(AT.theta_rad), abs=0.6)
    assert asked(path, "--calibration", file, "--json")[1] == out
    other = recorded(lab / "other.h5", np.zeros((1, 16, 16)), calibration="ab" * 32)
    code, _, err = asked(other, "--calibration", file)
    assert code == 2
    assert "made with calibration abababababab..." in err


def test_the_object_in_the_robots_base(asked, lab, images):
    path = recorded(lab / "posed.h5", images[:1], pose=T_BASE_SENSOR)
    assert "object in the robot's base at (" in asked(path)[1]
    entry = json.loads(asked(path, "--json")[1])[0]
    pressed = np.eye(4)
    pressed[2, 3] = Seating().depth_mm(math.inf)  # amid the face
    known = T_BASE_SENSOR @ pressed @ np.linalg.inv(entry["T_object_probe"])
    assert np.array(entry["T_robot_object"]) == pytest.approx(known)
    assert np.linalg.eigvalsh(entry["robot_covariance"]).min() >= 0
    usual = entry["covariance"][0][0]
    entry = json.loads(asked(path, "--as-designed", "--json")[1])[0]
    assert entry["part"] == "as designed"
    assert entry["covariance"][0][0] < usual
    wrist = Wrist()
    hung = recorded(lab / "hung.h5", images[:1],
                    wrist=counts_of(wrist, distances_at(wrist, 5.0, 0.0, 0.0)))  # fmt: skip
    entry = json.loads(asked(hung, "--joints", "0,-30,60,-30,0", "--json")[1])[0]
    assert np.array(entry["T_robot_object"]).shape == (4, 4)


def test_the_mounting_is_checked_at_a_registered_object_alone(asked):
    code, out, err = asked("check", "none.h5", "--at", "Nope/F2")
    assert (code, out) == (2, "")
    assert "lab.db: error: no object with symbols is called 'Nope'\n  fix: objects: Cube" in err


def test_pictures(asked, lab, images):
    path = recorded(lab / "drawn.h5", images)
    assert asked(path, "--plot", lab / "one.png")[0] == 0
    assert sorted(file.name for file in lab.glob("one*.png")) == ["one-0.png", "one-1.png"]
    code, _, err = asked(path, "--plot", lab / "one.png")
    assert code == 2
    assert "the file is there already" in err
    assert "replace it with --replace" in err
    assert asked(path, "--touches", 1, "--plot", lab / "one.png", "--replace")[0] == 0
    assert (lab / "one.png").read_bytes() == (lab / "one-0.png").read_bytes()
    with Image.open(lab / "one.png") as picture:
        assert picture.size == (1500, 520)


def test_the_symbols_of_the_picture_are_those_of_the_touch(lab, images):
    """A symbol's centre, from the lattice and from the face, seen by the sensor."""
    reader = Reader(open_lab(str(lab / "lab.db")))
    signal = signal_of(images[0].astype(np.float64))
    won, found = winning_lattice(reader, signal), recognise(reader, signal)
    pitch, place = won.encoding.style.pitch_mm, won.place
    face = won.encoding.face(place.face)
    assert face.face == found.face
    known = {
        (row, column): (label, (np.linalg.inv(found.T_face_probe) @ [*centre, 0, 1])[:2])
        for row, column, label, centre in zip(
            face.rows, face.columns, face.labels, face.centres_mm, strict=True
        )
    }
    seen = won.registered >= 0
    assert seen.sum() >= 9
    for (i, j), registered in zip(won.cells[seen], won.registered[seen], strict=True):
        label, at = known[place.row - j, place.column + i]
        # the answer's pose is fitted once more, and corrected for how prints come out
        assert won.on_sensor((np.array([i, j]) + 0.5) * pitch) == pytest.approx(at, abs=0.1)
        assert label == registered
    assert won.matched[seen].mean() > 0.8
    assert winning_lattice(reader, signal_of(np.zeros((16, 16)))) is None


def test_joint_angles_of_each_touch_say_where_it_stood(tmp_path):
    file = tmp_path / "joints.txt"
    file.write_text("# degrees\n0, -30, 60, 0, 0\n\n5 -30 60 0 0  # the second\n")
    joints = read_joints(file)
    assert joints == ((0, -30, 60, 0, 0), (5, -30, 60, 0, 0))
    wrist = counts_of(Wrist(), np.full(4, 5.0))
    touch = TouchImage(0, 0, 1, np.zeros((16, 16)), wrist.astype(float), None)
    first, second = (pose_during(touch, number, joints, 0.1) for number in (1, 2))
    turn = first.T_base_sensor[:3, :3].T @ second.T_base_sensor[:3, :3]
    assert math.degrees(math.acos((np.trace(turn) - 1) / 2)) == pytest.approx(5, abs=1e-6)
    assert first.covariance.any()
    with pytest.raises(ScanError, match="there is touch 3"):
        pose_during(touch, 3, joints, 0.1)
    for readings, said in ((np.zeros(4), "no readings of the wrist"), (wrist * 2.0, "mm, the end")):
        with pytest.raises(ScanError, match=rf"a\.h5: touch 2 of the scan: .*{said}") as caught:
            pose_during(replace(touch, wrist=readings), 2, joints, 0.1, "a.h5")
        assert caught.value.fix
