"""From a spec to the answer of a scan by the commands that people use; face and pose are right."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from generator.command import run as encode_object
from probe.circuit import Electronics, Noise, fsr_of, read_counts
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.frame import frame_from
from probe.recording.record import Recorder
from probe.scan import raster, surface_to_sensor
from probe.simulate.registered import registered_surface
from probe.simulate.scene import pose_of
from probe.surface.face import FaceSurface
from probe.surface.polygon import polygon
from recognizer.command import run as recognize_object

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
SENSOR = SensorType()
FRAMES = 3  # of a touch
T_BASE_FACE = surface_to_sensor(300, 20, 0.4, 100) @ np.diag([1.0, -1.0, -1.0, 1.0])
ARM_MM, ARM_RAD = 0.3, 0.003  # standard deviations of recorded poses


def record_scan(path, url, name, face, *, seed, most=None, step=4.25, theta=0.3, poses=True):
    """Scan a face in lines there and back; return the true poses (n, 4, 4) on the face."""
    rng = np.random.default_rng(seed)
    scene = registered_surface(url, name, face)
    plan = raster(
        [scene.region.starts], SENSOR, theta_rad=theta, least_cover=0.9, step_tactels=step
    )
    lines = [plan.places_mm[plan.lines == n] for n in np.unique(plan.lines)]
    places = np.concatenate([line[:: (-1) ** n] for n, line in enumerate(lines)])[:most]
    board, fsr, truth = Electronics(noise=Noise()), fsr_of(SENSOR.rows, SENSOR.columns), []
    about = {"sensor": "simulated/tab", "attributes": {"frames_per_touch": FRAMES}}
    with Recorder(path, roll_over_s=math.inf, **about) as recorder:
        for k, (x, y) in enumerate(places):
            touch = Touch(x, y, theta, float(rng.uniform(60, 100)), *rng.normal(0, 0.006, 2))
            contact = press(scene.surface, SENSOR, touch)
            truth.append(pose_of(touch, contact))
            dx, dy, turn = rng.normal(0, 1, 3) * (ARM_MM, ARM_MM, ARM_RAD)
            believed = surface_to_sensor(x + dx, y + dy, theta + turn, truth[-1][2, 3])
            state = None
            for beat in range(FRAMES):
                counts, state = read_counts(contact.forces_n, board, fsr, state, rng)
                seq = FRAMES * k + beat
                pose = T_BASE_FACE @ believed if poses else None
                recorder.append(
                    frame_from(counts, t_ns=round(seq * board.frame_s * 1e9), seq=seq, pose=pose)
                )
    return np.array(truth)


@pytest.fixture(scope="module")
def labs(tmp_path_factory):
    """Folders with a cube of each profile, what `encode-object` said beside it."""
    made = {}
    for profile in ("thesis", "product"):
        folder = tmp_path_factory.mktemp(profile)
        words = (SPECS / f"{profile}-cube.yaml", "-o", folder / "out", "--format", "stl",
                 "--database", folder / "lab.db")  # fmt: skip
        assert encode_object([str(word) for word in words]) == 0
        made[profile] = folder
    return made


@pytest.fixture
def asked(capsys):
    """Run `recognize-object`; its exit code, entries, and messages."""

    def ask(*words):
        capsys.readouterr()
        code = recognize_object([*map(str, words), "--json"])
        said = capsys.readouterr()
        return code, json.loads(said.out), said.err

    return ask


def check(entries, truth, name, face):
    """Every answer is right; the last entry is one."""
    assert entries[-1]["object"] == name
    for entry in entries:
        if entry["object"] is None:
            assert entry["reason"]
            continue
        assert (entry["object"], entry["face"]) == (name, face)
        away = np.array(entry["T_face_probe"]) - truth[entry["seq"] // FRAMES]
        assert math.hypot(*away[:2, 3]) < 0.4


@pytest.mark.parametrize(
    ("profile", "face", "seed", "most", "poses"),
    [
        ("thesis", "F4", 3, 10, True),
        ("product", "F1", 1005, 10, False),
    ],
)
def test_a_scan_is_recognised(labs, asked, tmp_path, profile, face, seed, most, poses):
    folder, name = labs[profile], f"Cube {profile}"
    url = f"sqlite:///{folder / 'lab.db'}"
    touched = tmp_path / "scan.h5"
    truth = record_scan(touched, url, name, face, seed=seed, most=most, poses=poses)
    code, entries, _ = asked(touched, "--database", url, "--scan")
    assert code == 0
    assert [entry["seq"] for entry in entries[:most]] == [FRAMES * k for k in range(most)]
    assert [entry["touches"] for entry in entries[:most]] == list(range(1, most + 1))
    check(entries, truth, name, face)


def test_the_thesis_says_which_edges_a_touch_feels(labs, asked, capsys, tmp_path):
    """A cube without symbols at its edge x = 0: where the edge runs, against the truth."""
    url = f"sqlite:///{labs['thesis'] / 'lab.db'}"
    face = FaceSurface(None, polygon([np.array([[0.0, 0], [80, 0], [80, 80], [0, 80]])]))
    touched, rng, board = tmp_path / "edge.h5", np.random.default_rng(4), Electronics(noise=Noise())
    places = [(1.0, 40.0, 0.0), (3.0, 35.0, 0.5)]
    with Recorder(touched, sensor="simulated/tab", attributes={"frames_per_touch": 1}) as recorder:
        for seq, place in enumerate(places):
            felt = press(face, SENSOR, Touch(*place, 70.0)).forces_n
            counts, _ = read_counts(felt, board, fsr_of(SENSOR.rows, SENSOR.columns), None, rng)
            recorder.append(frame_from(counts, t_ns=round(seq * board.frame_s * 1e9), seq=seq))
    _, entries, _ = asked(touched, "--database", url, "--method", "thesis")
    assert len(entries) == 2
    for (x, _, theta), entry in zip(places, entries, strict=True):
        (edge,) = entry["edges"]
        normal = np.array([math.cos(theta), -math.sin(theta)])  # of the face's inside, sensor frame
        assert abs(normal @ edge["position_mm"] + x) < max(0.25, 4 * edge["position_sd_mm"])
        direction = -90.0 - math.degrees(theta)
        assert abs(edge["direction_deg"] - direction) < 3.0
        assert 0 < edge["position_sd_mm"] < 0.3
        assert 0 < edge["direction_sd_deg"] < 2
        assert "object_position_mm" not in edge
    recognize_object([str(touched), "--database", url, "--method", "thesis"])
    assert capsys.readouterr().out.count("an edge at (") == 2


def test_the_first_touch_of_a_product_scan_is_not_answered_a_pitch_beside(labs, asked, tmp_path):
    """One row off only a corner of a cell differs: both places are kept, neither is answered."""
    url = f"sqlite:///{labs['product'] / 'lab.db'}"
    touched = tmp_path / "one.h5"
    record_scan(touched, url, "Cube product", "F1", seed=0, most=1)
    code, entries, _ = asked(touched, "--database", url)
    assert (code, entries[0]["object"], entries[0]["reason"]) == (1, None, "ambiguous")
    assert entries[0]["margin"] < 5
