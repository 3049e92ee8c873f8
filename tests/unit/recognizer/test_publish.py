"""Answers over zenoh: what its own client receives, how soon, and what a slow one misses."""

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
from recognizer.command.answers import Answer
from recognizer.command.publish import PublishSink, endpoint_of
from recognizer.touch.recognition import Recognition

RNG = np.random.default_rng(4)
COUNTS = RNG.integers(0, 1024, (16, 16))

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
    T = np.eye(4)
    found = Recognition(
        seq, "Cube", "F1", (3, 4), T, T, np.diag([0.04, 0.05, 0.003]) ** 2, 40.0, None, ""
    )
    return Answer(SimpleNamespace(t_ns=5 * seq, seq=seq, frames=1), found, None)


class Client:
    """The client, started and connected."""

    def __init__(self, port, wanted, hold=0.0):
        words = [sys.executable, "-c", CLIENT, str(port), str(wanted), str(hold)]
        pipes = dict.fromkeys(("stdin", "stdout"), subprocess.PIPE)
        self.process = subprocess.Popen(words, text=True, **pipes)
        assert self.process.stdout.readline() == "ready\n"
        time.sleep(0.3)  # what it subscribes to is told to the publisher

    def told(self):
        said, _ = self.process.communicate("\n", timeout=60)
        return json.loads(said)


@pytest.fixture
def published(request):
    port = free_port()
    with PublishSink(f"zenoh://127.0.0.1:{port}") as sink:
        yield sink, port


def test_images_at_the_sensors_rate_and_answers_at_once(published):
    sink, port = published
    client = Client(port, 10)
    known, images, start = {}, 220, time.monotonic()
    for i in range(images):
        sink.frame(frame_from(COUNTS, t_ns=i, seq=i))
        if i % 22 == 0:
            known[i] = time.monotonic_ns()
            sink.answer(answer_of(i))
        time.sleep(max(0.0, start + (i + 1) / 220 - time.monotonic()))
    time.sleep(0.2)
    told = client.told()
    assert [seq for seq, _ in told["answers"]] == list(known)
    assert told["images"] >= 0.9 * images  # a machine that is busy elsewhere may hold some up
    late_ms = sorted((at - known[seq]) / 1e6 for seq, at in told["answers"])
    print("answers after ms:", [round(ms, 2) for ms in late_ms], "images", told["images"])
    assert late_ms[0] < 5.0


def test_a_slow_client_misses_images_and_no_answer(published):
    sink, port = published
    client = Client(port, 30, hold=0.01)
    for i in range(3000):
        sink.frame(frame_from(np.full((16, 16), i), t_ns=i, seq=i))
        if i % 100 == 0:
            sink.answer(answer_of(i))
        if i % 20 == 0:
            time.sleep(0.001)
    told = client.told()
    assert {seq for seq, _ in told["answers"]} == set(range(0, 3000, 100))
    assert told["images"] < 1500
    print("slow client: images", told["images"], "of 3000")


def test_a_client_that_comes_late_gets_the_answers_before(published):
    sink, port = published
    for i in range(5):
        sink.answer(answer_of(i))
    time.sleep(0.2)
    assert sorted({seq for seq, _ in Client(port, 5).told()["answers"]}) == list(range(5))


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
