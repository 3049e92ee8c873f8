"""Answers as ROS 2 messages, and over zenoh: what its own client receives."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

from encoded_objects.base.errors import EncodedObjectsError
from probe.frame import frame_from
from recognizer.command import run
from recognizer.command.answers import Answer
from recognizer.command.publish import PublishSink, endpoint_of
from recognizer.command.ros import object_message, recognition_message
from recognizer.touch.recognition import AMBIGUOUS, Recognition, refusal
from recognizer.touch.robot import ObjectPose, Seating


def turned(angle, at):
    c, s = np.cos(angle), np.sin(angle)
    T = np.eye(4)
    T[:2, :2] = [[c, -s], [s, c]]
    T[:3, 3] = at
    return T


def found(seq):
    T = turned(0.5, [20, 30, 0])
    covariance = np.diag([0.04, 0.05, 0.003]) ** 2
    return Recognition(seq, "Cube", "F1", (3, 4), T, T, covariance, 40.0, None, "", doubt=1e-6)


def test_without_a_base_the_object_is_told_in_the_sensors_frame():
    message = object_message(found(7), None, 2_000_000_001)
    assert message["header"] == {"stamp": {"sec": 2, "nanosec": 1}, "frame_id": "sensor"}
    expected = -turned(0.5, [0, 0, 0])[:3, :3].T @ [0.02, 0.03, 0]
    expected[2] = Seating().depth_mm(None) / 1000
    assert np.allclose(list(message["pose"]["pose"]["position"].values()), expected)
    turn = message["pose"]["pose"]["orientation"]
    assert np.allclose([turn["z"], turn["w"]], [-np.sin(0.25), np.cos(0.25)])
    spread = np.array(message["pose"]["covariance"]).reshape(6, 6)
    assert np.allclose(spread, spread.T)
    # The turn of the probe, 3 mrad, moves the object's origin, 36 mm away, by .108 mm; tilts move
    # it by as much as the probe is pressed in.
    tips = Seating().spread_rad(None) * Seating().depth_mm(None)
    assert np.sqrt(np.trace(spread[:2, :2])) == pytest.approx(
        1e-3 * np.sqrt(0.04**2 + 0.05**2 + (0.003 * np.hypot(20, 30)) ** 2 + 2 * tips**2), rel=1e-6
    )
    placed = ObjectPose(turned(1.0, [300, 0, 50]), np.eye(6))
    message = object_message(found(7), placed, 0)
    assert message["header"]["frame_id"] == "base"
    assert message["pose"]["pose"]["position"] == {"x": 0.3, "y": 0.0, "z": 0.05}


def test_a_refusal_names_no_object_and_says_why():
    none = refusal(9, AMBIGUOUS, doubt=0.5)
    assert object_message(none, None, 0) is None
    message = recognition_message(Answer(SimpleNamespace(t_ns=5, seq=9, frames=1), none, None))
    assert (message["object"], message["row"], message["reason"]) == ("", -1, AMBIGUOUS)
    assert (message["doubt"], json.loads(message["json"])["object"]) == (0.5, None)
    assert np.isnan(message["margin"])


#: A client in a process of its own: takes `answers` answers, each held `hold` s, then tells.
CLIENT = """
import json, sys, time, zenoh
from zenoh import ext
port, wanted, hold = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}#so_rcvbuf=65536"]))
config.insert_json5("scouting/multicast/enabled", "false")
images, answers = [], []
def image(sample):
    images.append((sample.payload.to_bytes()[-64:].hex(), time.monotonic_ns()))
    time.sleep(hold)
def answer(sample):
    answers.append((json.loads(sample.payload.to_bytes())["seq"], time.monotonic_ns()))
with zenoh.open(config) as session:
    a = session.declare_subscriber("touch/image", image)
    b = ext.declare_advanced_subscriber(session, "touch/answer", answer,
        history=ext.HistoryConfig(detect_late_publishers=True),
        recovery=ext.RecoveryConfig(heartbeat=True))
    print("ready", flush=True)
    until = time.monotonic() + 40
    while len({s for s, _ in answers}) < wanted and time.monotonic() < until:
        time.sleep(0.02)
    sys.stdin.readline()
    print(json.dumps({"images": len(images), "answers": answers}), flush=True)
"""


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def answer_of(seq):
    return Answer(SimpleNamespace(t_ns=5 * seq, seq=seq, frames=1), found(seq), None)


def started(code, *words):
    """Run a program with its pipes."""
    pipes = dict.fromkeys(("stdin", "stdout"), subprocess.PIPE)
    return subprocess.Popen([sys.executable, "-c", code, *map(str, words)], text=True, **pipes)


class Client:
    """The client, started and connected."""

    def __init__(self, port, wanted, hold=0.0):
        self.process = started(CLIENT, port, wanted, hold)
        assert self.process.stdout.readline() == "ready\n"
        time.sleep(0.3)  # what it subscribes to is told to the publisher

    def told(self):
        said, _ = self.process.communicate("\n", timeout=60)
        return json.loads(said)


@pytest.fixture
def published():
    port = free_port()
    with PublishSink(f"zenoh://127.0.0.1:{port}") as sink:
        yield sink, port


def test_a_quick_client_gets_all_and_a_slow_one_misses_images_but_no_answer(published):
    sink, port = published
    quick, slow = Client(port, 12), Client(port, 12, hold=0.01)
    sent_ns = {}
    for i in range(1200):
        sink.frame(frame_from(np.full((16, 16), i), t_ns=i, seq=i))
        if i % 100 == 0:
            sent_ns[i] = time.monotonic_ns()
            sink.answer(answer_of(i))
        if i % 20 == 0:
            time.sleep(0.02)
    time.sleep(0.2)
    slow, quick = slow.told(), quick.told()
    assert [seq for seq, _ in quick["answers"]] == list(sent_ns)
    assert {seq for seq, _ in slow["answers"]} == set(sent_ns)
    assert slow["images"] < 800 < quick["images"]
    assert min(at_ns - sent_ns[seq] for seq, at_ns in quick["answers"]) < 5e6


@pytest.mark.parametrize(
    "url", ["tcp://h:1", "zenoh://h", "zenoh://h:0", "zenoh://h:70000/k", "zenoh://h:1/a//b", ""]
)
def test_a_url_that_is_none_is_refused(url):
    with pytest.raises(EncodedObjectsError, match="no place to publish"):
        endpoint_of(url)


def test_a_port_that_is_taken_is_refused(published):
    _, port = published
    with pytest.raises(EncodedObjectsError, match="nothing can be published"):
        PublishSink(f"zenoh://127.0.0.1:{port}")


FORGER = """
import json, sys, time, zenoh
config = zenoh.Config()
config.insert_json5("mode", json.dumps(sys.argv[2]))
config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{sys.argv[1]}"]))
config.insert_json5("scouting/multicast/enabled", "false")
with zenoh.open(config) as session:
    publisher = session.declare_publisher("touch/answer")
    answering = session.declare_queryable("touch/**", lambda q: q.reply(q.key_expr, '{"seq": -3}'))
    session.liveliness().declare_token("touch/answer/@adv/pub/1/2/_")
    for _ in range(20):
        session.put("touch/answer", '{"seq": -1}')
        publisher.put('{"seq": -2}')
        time.sleep(0.02)
    print("sent", flush=True)
    sys.stdin.readline()
"""


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_what_a_client_sends_is_passed_on_to_nobody(published, mode):
    sink, port = published
    client = Client(port, 3)
    with started(FORGER, port, mode) as forger:
        assert forger.stdout.readline() == "sent\n"
        for i in range(3):
            sink.answer(answer_of(i))
        late = Client(port, 3).told()  # which comes late, and asks for the answers before
        assert sorted({seq for seq, _ in client.told()["answers"]}) == [0, 1, 2]
        assert sorted({seq for seq, _ in late["answers"]}) == [0, 1, 2]
        forger.communicate("\n", timeout=60)


def test_who_is_asked_for_a_password_gives_it(tmp_path):
    import zenoh

    users, port = tmp_path / "users.txt", free_port()
    users.write_text("robot:eight or more\n".replace(" ", "-"))

    def let_in(**given):
        config = zenoh.Config()
        for path, value in (
            ("mode", "client"), ("connect/endpoints", [f"tcp/127.0.0.1:{port}"]),
            ("scouting/multicast/enabled", False),
            *((f"transport/auth/usrpwd/{name}", value) for name, value in given.items()),
        ):  # fmt: skip
            config.insert_json5(path, json.dumps(value))
        try:
            zenoh.open(config).close()
        except zenoh.ZError:
            return False
        return True

    with PublishSink(f"zenoh://127.0.0.1:{port}", users):
        assert let_in(user="robot", password="eight-or-more")
        assert not let_in(user="robot", password="eight-or-less")
        assert not let_in(user="human", password="eight-or-more")
        assert not let_in()
    for text in ("", "robot", "robot:short", "a:12345678\n\n"):
        users.write_text(text)
        with pytest.raises(EncodedObjectsError, match="no list of users"):
            PublishSink(f"zenoh://127.0.0.1:{port}", users)


@pytest.mark.parametrize("host", ["0.0.0.0", "[::]", "192.0.2.7", "bench.example", "localhost.a"])
def test_others_read_only_where_that_is_said(host):
    with pytest.raises(EncodedObjectsError, match="others than this machine") as refused:
        PublishSink(f"zenoh://{host}:7447")
    assert "--open" in refused.value.fix
    assert refused.value.exit_code == 2


def test_an_open_publisher_says_what_it_opens(capsys):
    for option in (["--publish-users", "us.txt"], ["--open"]):
        assert run(["touch.h5", *option]) == 2
        assert "--publish-users and --open need --publish URL" in capsys.readouterr().err
    with PublishSink(f"zenoh://0.0.0.0:{free_port()}", to_all=True):
        assert "everybody who reaches tcp/0.0.0.0" in capsys.readouterr().err
