"""`recognize-object` in one process: what it prints, writes, and refuses."""

import json
import math
import subprocess
import sys
from functools import partial

import numpy as np
import pytest
from PIL import Image
from reference.drawn_fsr import read_sequence

from encoded_objects.base.sensor_type import Overlay, SensorType
from generator.pipeline import encode
from generator.spec import read_specs
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
from recognizer.touch.robot import Seating
from recognizer.touch.source import TouchImage

SPEC = "name: Cube\nshape: {cube: 40 mm}\n"
AT = Touch(20.0, 19.0, math.radians(25), 80.0)
BESIDE = Touch(17.0, 22.0, math.radians(-60), 60.0)
DEAD = (slice(3, 4), slice(2, 9))  # tactels of the calibrated sensor
T_BASE_SENSOR = np.diag([1.0, -1.0, -1.0, 1.0])
T_BASE_SENSOR[:3, 3] = 300, 50, 20


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A database with one object."""
    folder = tmp_path_factory.mktemp("lab")
    (folder / "cube.yaml").write_text(SPEC)
    encode(
        read_specs([folder / "cube.yaml"]), folder=folder / "out",
        database=f"sqlite:///{folder / 'lab.db'}", formats=("stl",),
    )  # fmt: skip
    return folder


def forces_of(lab, touch, overlay="tab", face="F1"):
    scene = registered_surface(str(lab / "lab.db"), "Cube", face)
    sensor = SensorType(overlay=Overlay(kind=overlay))
    return press(scene.surface, sensor, touch).forces_n


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


def assert_at(entry, touch, face="F1", mm=0.15, degrees=0.6):
    assert (entry["object"], entry["face"], entry["reason"]) == ("Cube", face, "")
    assert math.hypot(entry["x_mm"] - touch.x_mm, entry["y_mm"] - touch.y_mm) < mm
    assert entry["theta_deg"] == pytest.approx(math.degrees(touch.theta_rad), abs=degrees)


@pytest.mark.parametrize(
    ("module", "calls", "expected"),
    [
        ("recognizer.command", [["--help"], ["-h"], [], ["--follow", "x.h5"]], [0, 0, 2, 2]),
        ("recognizer.validation.command", [["--help"], ["repeat", "-h"], ["--version"]], [0] * 3),
        ("recognizer.bench.command", [["--help"]], [0]),
    ],
)
def test_the_help_loads_nothing_heavy(module, calls, expected):
    script = (
        "import sys\n"
        f"from {module} import main\n"
        "codes = []\n"
        f"for words in {calls}:\n"
        "    try:\n"
        "        main(words)\n"
        "    except SystemExit as end:\n"
        "        codes.append(end.code)\n"
        "heavy = 'numpy scipy matplotlib h5py skimage sqlalchemy serial skfem pyarrow jinja2 '\n"
        "heavy += 'distributed fastapi'\n"
        "print([name for name in heavy.split() if name in sys.modules], codes)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines()[-1] == f"[] {expected}"


def test_reading_loads_no_library_that_it_does_not_need(lab, images):
    path = recorded(lab / "light.h5", images[:1])
    script = (
        "import sys\n"
        "from recognizer.command import run\n"
        f"code = run([{str(path)!r}, '--database', {str(lab / 'lab.db')!r}])\n"
        "heavy = 'matplotlib skimage scipy skfem serial build123d manifold3d'.split()\n"
        "print([name for name in heavy if name in sys.modules], code)\n"
    )
    for _ in range(2):  # the first time templates may have to be worked out
        done = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True
        )
    assert done.stdout.splitlines()[-1] == "[] 0"


@pytest.fixture(scope="module")
def calibrated_touch(lab):
    """A sensor with dead tactels, its calibration, and touches that name it."""
    rng, board, fsr = np.random.default_rng(3), Electronics(), fsr_of(16, 16)
    folder = lab / "calibrated"
    folder.mkdir()

    def read(forces, number):
        felt = forces.copy()
        felt[DEAD] = 0.0
        return read_sequence(np.stack([felt] * number), board, fsr, None, rng)[0]

    loads = {f: read(np.full((16, 16), f / 256), 60) for f in (0, 60, 120, 240, 400)}
    made = calibration_from(
        loads[0], [even_load(loads[f], f, name=f"{f} N") for f in (60, 120, 240, 400)],
        sensor="bench/0", made="2026-01-01", board=board,
    )  # fmt: skip
    assert made.bad[DEAD].all()
    digest = write_calibration(made, folder / "bench.json")
    touch = read(forces_of(lab, AT), 10)
    recorded(folder / "touch.h5", touch, sensor="bench/0", calibration=digest)
    return folder


def test_the_calibration_that_a_recording_names_is_found(asked, calibrated_touch):
    code, out, err = asked(calibrated_touch / "touch.h5", "--json")
    assert (code, err) == (0, "")
    assert_at(json.loads(out)[0], AT)
    given = asked(calibrated_touch / "touch.h5", "--calibration", calibrated_touch / "bench.json",
                  "--json")  # fmt: skip
    assert given[1] == out


def test_a_calibration_that_is_missing_or_another_one(asked, lab, calibrated_touch):
    away = lab / "away"
    away.mkdir()
    (away / "touch.h5").write_bytes((calibrated_touch / "touch.h5").read_bytes())
    (away / "other.json").write_text("{}")
    _, _, err = asked(away / "touch.h5")
    assert "which is not beside it: read as counts" in err
    other = recorded(
        lab / "other.h5", [np.zeros((16, 16))], sensor="bench/0", calibration="ab" * 32
    )
    code, _, err = asked(other, "--calibration", calibrated_touch / "bench.json")
    assert code == 2
    assert "made with calibration abababababab..." in err


def test_parts_of_a_simulator_are_as_designed(asked, lab, images):
    path = recorded(lab / "designed.h5", images[:1])
    usual, known = (
        json.loads(asked(path, *more, "--json")[1])[0] for more in ((), ["--as-designed"])
    )
    assert (usual["part"], known["part"]) == ("not measured", "as designed")
    assert known["covariance"][0][0] < usual["covariance"][0][0]


def test_the_object_in_the_robots_base(asked, lab, images):
    path = recorded(lab / "posed.h5", images[:1], pose=T_BASE_SENSOR)
    code, out, _ = asked(path)
    assert code == 0
    assert "object in the robot's base at (" in out
    entry = json.loads(asked(path, "--json")[1])[0]
    pressed = np.eye(4)
    pressed[2, 3] = Seating().depth_mm(math.inf)  # amid the face
    known = T_BASE_SENSOR @ pressed @ np.linalg.inv(entry["T_object_probe"])
    assert np.array(entry["T_robot_object"]) == pytest.approx(known)
    assert np.linalg.eigvalsh(entry["robot_covariance"]).min() >= 0
    wrist = Wrist()
    hung = recorded(lab / "hung.h5", images[:1],
                    wrist=counts_of(wrist, distances_at(wrist, 5.0, 0.0, 0.0)))  # fmt: skip
    entry = json.loads(asked(hung, "--joints", "0,-30,60,-30,0", "--json")[1])[0]
    assert np.array(entry["T_robot_object"]).shape == (4, 4)
    code, out, err = asked(path, "--joints", "0,-30,60,-30,0")
    assert code == 0
    assert "robot" not in out
    assert "the place in the robot's base is not known" in err
    assert "end stops" in err


def test_pictures(asked, lab, images):
    path = recorded(lab / "drawn.h5", images)
    assert asked(path, "--plot", lab / "one.png")[0] == 0
    assert sorted(file.name for file in lab.glob("one*.png")) == ["one-0.png", "one-1.png"]
    code, _, err = asked(path, "--touches", 1, "--plot", lab / "one.png")
    assert code == 2
    assert "one-0.png: error: the file is there already" in err.replace("one-1", "one-0")
    assert "replace it with --replace" in err
    assert asked(path, "--touches", 1, "--plot", lab / "one.png", "--replace")[0] == 0
    assert (lab / "one.png").read_bytes() == (lab / "one-0.png").read_bytes()
    with Image.open(lab / "one.png") as picture:
        assert picture.size == (1500, 520)


def test_the_symbols_of_the_picture_are_those_of_the_touch(lab, images):
    from recognizer.command.picture import winning_lattice
    from recognizer.touch.lab import open_lab
    from recognizer.touch.reader import Reader
    from recognizer.touch.recognise import recognise
    from recognizer.touch.signal import signal_of

    reader = Reader(open_lab(str(lab / "lab.db")), SensorType())
    signal = signal_of(images[0].astype(np.float64))
    won, found = winning_lattice(reader, signal), recognise(reader, signal)
    face = won.encoding.face(won.place.face)
    assert face.face == found.face
    cells = np.array([[0.0, 0.0], [3.0, -4.0]])
    at = won.on_array(won.on_sensor(cells * won.encoding.style.pitch_mm))
    assert at == pytest.approx(cells * (1, -1) + (won.place.column, won.place.row + 1))
    # a symbol's centre, from the lattice and from the face, seen by the sensor
    seen = {}
    for cell, label in zip(won.cells, won.registered, strict=True):
        if label >= 0:
            at = won.on_sensor((cell + 0.5) * won.encoding.style.pitch_mm)
            seen[(won.place.row - cell[1], won.place.column + cell[0])] = (at, label)
    T_probe_face = np.linalg.inv(found.T_face_probe)
    near = 0
    for row, column, label, centre in zip(
        face.rows, face.columns, face.labels, face.centres_mm, strict=True
    ):
        if (row, column) in seen:
            at, expected = seen[(row, column)]
            # the answer's pose is fitted once more, and corrected for how prints come out
            assert at == pytest.approx((T_probe_face @ [*centre, 0, 1])[:2], abs=0.1)
            assert label == expected
            near += 1
    assert near >= 9
    assert won.matched[won.registered >= 0].mean() > 0.8
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
    assert pose_during(touch, 1, (), 0.1) is None
