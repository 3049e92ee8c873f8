"""From a spec to an answer by the commands that people use: make, touch, recognise."""

import json
import lzma
import math
import queue
import signal
from pathlib import Path

import h5py
import numpy as np
import pytest
import zenoh
from corpora.commands import DATA
from postgres import free_port
from programs import started
from reference.emulated_probe import emulated_port
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from encoded_objects.base.sensor_type import SensorType
from generator.command import run as encode_object
from probe.circuit import Electronics, Noise, fsr_of, read_counts
from probe.command import run as probe_sensor
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.recording.read import Recording
from probe.surface.face import FaceSurface
from probe.surface.polygon import polygon
from recognizer.command import run as recognize_object
from recognizer.sensor.file import read_state
from recognizer.touch.robot import Seating

CUBE = Path(__file__).parents[2] / "fixtures" / "cube.yaml"
SHORT_S = 30.0  #: for anything, on a busy machine


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lab")
    words = (CUBE, "-o", folder / "out", "--format", "stl", "--database", folder / "lab.db")
    assert encode_object([str(word) for word in words]) == 0
    return folder


@pytest.fixture
def asked(ask, lab, monkeypatch):
    """Run a command in the lab's folder; its exit code and what it printed."""
    monkeypatch.chdir(lab)
    return lambda *words: ask(*words)[:2]


def test_how_the_sensor_is_mounted_is_checked_once_and_known_from_then_on(ask, asked, tmp_path):
    words = ("lab.db#Cube/F1", "--x", 29, "--y", 31, "--theta", -12, "--force", 80)
    assert asked(probe_sensor, "simulate", *words, "-o", tmp_path / "drawn.h5")[0] == 0
    images = np.stack([one.counts for one in Recording(tmp_path / "drawn.h5").frames()])
    with h5py.File(tmp_path / "turned.h5", "w") as file:
        file["frames"] = np.rot90(images, axes=(1, 2))
    state = tmp_path / "sensor.json"
    read = ("--database", "lab.db", "--sensor-state", state)
    hint = "was never checked"

    def answer(*more):
        code, out = asked(recognize_object, tmp_path / "turned.h5", *more, "--json")
        assert code == 0
        (entry,) = json.loads(out)
        return entry["mounting"], round(entry["theta_deg"])

    assert answer("--database", "lab.db") == ("unchecked", -102)  # wrong, and it says so
    for method in ("--scan", "--every"):
        _, _, err = ask(recognize_object, tmp_path / "turned.h5", "--database", "lab.db", method)
        assert err.count(hint) == (method == "--every")  # once; one touch is no scan
    check = ("check", tmp_path / "turned.h5", "--at", "Cube/F1", *read)
    assert asked(recognize_object, *check)[0] == 1  # not as drawn
    assert read_state(state).mounting == ("quarter", "quarter", "quarter")
    assert answer(*read) == ("checked", -12)  # and undone
    code, _, err = ask(recognize_object, tmp_path / "turned.h5", *read)
    assert (code, hint in err) == (0, False)
    assert answer(*read, "--flip", "quarter,quarter,quarter") == ("checked", -12)
    assert answer(*read, "--flip", "quarter") == ("unchecked", 168)  # mounted anew


def test_the_thesis_says_which_edges_a_touch_feels(asked):
    """A cube without symbols at its edge x = 0: where the edge runs, against the truth."""
    Path("thesis.db").write_bytes(lzma.decompress((DATA / "labs" / "thesis.db.xz").read_bytes()))
    face = FaceSurface(None, polygon([np.array([[0.0, 0], [80, 0], [80, 80], [0, 80]])]))
    board, fsr, rng = Electronics(noise=Noise()), fsr_of(16, 16), np.random.default_rng(4)
    places = [(1.0, 40.0, 0.0), (3.0, 35.0, 0.5)]
    felt = [press(face, SensorType(), Touch(*place, 70.0)).forces_n for place in places]
    with h5py.File("edge.h5", "w") as file:
        file["frames"] = [read_counts(force, board, fsr, None, rng)[0] for force in felt]
    words = ("edge.h5", "--database", "thesis.db", "--method", "thesis", "--every")
    entries = json.loads(asked(recognize_object, *words, "--json")[1])
    for (x, _, theta), entry in zip(places, entries, strict=True):
        (edge,) = entry["edges"]
        normal = np.array([math.cos(theta), -math.sin(theta)])  # of the face's inside, sensor frame
        assert abs(normal @ edge["position_mm"] + x) < max(0.25, 4 * edge["position_sd_mm"])
        assert abs(edge["direction_deg"] + 90 + math.degrees(theta)) < 3
        assert 0 < edge["position_sd_mm"] < 0.3
        assert 0 < edge["direction_sd_deg"] < 2
    assert asked(recognize_object, *words)[1].count("an edge at (") == 2


def test_a_port_is_followed_until_it_is_interrupted(lab):
    port = "sim:lab.db#Cube/F2?period=0.6&seed=5"
    with started("recognizer", "--port", port, "--follow", "--json", cwd=lab) as process:
        lines = [json.loads(process.stdout.readline()) for _ in range(2)]
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=SHORT_S)
    assert process.returncode == 130
    assert "recognize-object: interrupted" in err
    assert lines[0]["seq"] < lines[1]["seq"]
    assert {line["object"] for line in lines} <= {"Cube", None}
    assert any(line["face"] == "F2" for line in lines)


def test_the_probes_firmware_is_read(asked):
    with emulated_port("sim:lab.db#Cube/F1?x=30&y=30&theta=20&rate=50&period=1.5") as probe:
        code, out = asked(recognize_object, "--port", probe.url, "--json")
    (entry,) = json.loads(out)
    assert code == 0
    assert (entry["object"], entry["face"]) == ("Cube", "F1")
    assert (entry["x_mm"], entry["y_mm"]) == pytest.approx((30, 30), abs=0.3)


def test_a_recording_is_played_as_a_port(asked):
    words = ("lab.db#Cube/F3", "--frames", 8, "-o", "played.h5")
    assert asked(probe_sensor, "simulate", *words)[0] == 0
    code, out = asked(recognize_object, "--port", "file:played.h5?speed=0", "--follow")
    assert code == 0
    assert out.startswith("0: Cube/F3 at (")
    assert asked(recognize_object, "played.h5") == (code, out)


def test_images_and_answers_are_kept_as_ros_messages(asked, lab):
    words = ("lab.db#Cube/F2", "--touches", 3, "--frames", 6, "--seed", 5, "-o", "kept.h5")
    assert asked(probe_sensor, "simulate", *words)[0] == 0
    words = ("kept.h5", "--json", "--mcap", "kept.mcap")
    code, said = asked(recognize_object, *words)
    assert code == 0
    answers = json.loads(said)
    assert asked(recognize_object, *words)[0] == 2  # the file is there
    types = get_typestore(Stores.ROS2_HUMBLE)
    with AnyReader([lab / "kept.mcap"], default_typestore=types) as reader:
        seen = [
            (connection.topic, reader.deserialize(raw, connection.msgtype))
            for connection, _, raw in reader.messages()
        ]
    told = [message for topic, message in seen if topic == "/touch/answer"]
    assert [json.loads(message.json)["T_object_probe"] for message in told] == [
        answer["T_object_probe"] for answer in answers
    ]
    placed = {m.header.stamp.sec * 10**9 + m.header.stamp.nanosec: m for t, m in seen
              if t == "/touch/object"}  # fmt: skip
    for answer in (answer for answer in answers if answer["object"]):
        message = placed.pop(answer["t_ns"])
        T = np.linalg.inv(answer["T_object_probe"])
        at = message.pose.pose.position
        assert np.allclose([at.x, at.y], T[:2, 3] / 1000, atol=1e-12)
        pressed_mm = 1000 * at.z - T[2, 3]  # the tips stand below the tops, deepest at a border
        seating = Seating()
        assert seating.pressed_mm <= pressed_mm + 1e-9
        assert pressed_mm <= seating.pressed_mm + seating.pressed_border_mm + 1e-9
    assert not placed
    assert [topic for topic, _ in seen].count("/touch/image") == 18


def test_what_is_followed_is_published(lab):
    """Over zenoh, to its own client: images and answers of the command."""
    port = free_port()
    words = ("--port", "sim:lab.db#Cube/F1?x=28&y=31&period=1", "--follow", "--publish",
             f"zenoh://127.0.0.1:{port}/bench")  # fmt: skip
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    came = {"bench/image": queue.Queue(), "bench/answer": queue.Queue()}
    with started("recognizer", *words, cwd=lab) as process:
        while not process.stderr.readline().startswith("publishing"):
            assert process.poll() is None
        with zenoh.open(config) as session:
            held = [session.declare_subscriber(key, one.put) for key, one in came.items()]
            said = json.loads(came["bench/answer"].get(timeout=SHORT_S).payload.to_bytes())
            assert held
            assert came["bench/image"].get(timeout=SHORT_S)
        process.send_signal(signal.SIGINT)
        assert process.wait(SHORT_S) == 130
    assert said["object"] == "Cube"
    assert np.hypot(said["x_mm"] - 28, said["y_mm"] - 31) < 0.5
