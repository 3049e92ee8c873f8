"""Scan mode, loads of a calibration and flipped images at the bench, without a server."""

from __future__ import annotations

import json

import numpy as np
import pytest

from encoded_objects import Reader, open_lab, simulate
from encoded_objects.base.sensor_type import SensorType
from generator.pipeline import encode
from generator.spec import read_specs
from probe.frame import frame_from
from probe.recording.read import Recording
from recognizer.bench.broker import Broker, Subscriber
from recognizer.bench.frames import FrameHandler
from recognizer.bench.reading import PendingFrame, RecognitionThread, ScanMode
from recognizer.sensor.wiring import wiring_named


@pytest.fixture(scope="module")
def database(tmp_path_factory):
    folder = tmp_path_factory.mktemp("checks")
    (folder / "cube.yaml").write_text("{name: Cube, shape: {cube: 40 mm}}")
    specs = read_specs([folder / "cube.yaml"])
    encode(specs, folder=folder, formats=(), database=f"{folder}/lab.db")
    return f"{folder}/lab.db"


@pytest.fixture
def thread():
    """A thread that reads nothing: there is no database."""
    thread = RecognitionThread("", SensorType(), Broker())
    yield thread
    thread.close()


def told(board, topic):
    messages = [json.loads(text) for text in board.news(Subscriber())]
    return next(one for one in messages if one["topic"] == topic)


def test_touches_are_fused_only_while_that_is_wanted(database):
    board = Broker()
    scan, reader = ScanMode(SensorType(), board), Reader(open_lab(database))
    touches = [simulate(f"{database}#Cube/F1", x=x, y=19).counts for x in (19, 22)]
    scan.add(reader, reader.signal(touches[0]), 1)
    assert told(board, "scan") == {
        "topic": "scan", "on": False, "touches": 0, "changes": 0, "answer": None, "steps": [],
    }  # fmt: skip
    scan.switch(on=True)
    for number, counts in enumerate(touches, start=5):
        scan.add(reader, reader.signal(counts), number)
    state = told(board, "scan")
    assert (state["on"], state["touches"], state["answer"]["face"]) == (True, 2, "F1")
    assert [step["touch"] for step in state["steps"]] == [5, 6]
    for step in state["steps"]:
        assert 1 <= step["places"] < 1.1
        assert step["likeliest"][0]["share"] == pytest.approx(1 / step["places"], abs=0.05)
    assert state["steps"][1]["doubt"] < state["steps"][0]["doubt"]
    scan.switch(on=False)
    assert told(board, "scan")["steps"] == []


def frame(value, seq=0):
    image = np.full((16, 16), 3)
    image[4:9, 4:9] += value
    return frame_from(image, t_ns=seq * 10_000_000, seq=seq)


def test_a_load_that_is_still_on_when_the_calibration_ends_is_no_touch(thread):
    def look(value, *, load=False):
        thread._read(PendingFrame(frame(value), None, 0.0, load))
        return [one["contact"] for one in thread.touches.all()]

    assert look(900, load=True) == []
    assert look(900) == []  # the calibration is made, the load still on
    assert look(800) == []
    assert look(0) == []
    assert look(900) == [True]
    assert look(0) == []  # it was not read


def test_a_touch_of_a_recording_tells_when_in_it(thread):
    thread._read(PendingFrame(frame(900), None, 5.0, False, "mine.h5", 1.25))
    (record,) = thread.touches.all()
    assert (record["recording"], record["at_s"]) == ("mine.h5", 1.25)


def test_images_are_flipped_for_all_but_the_recording(thread, tmp_path):
    notes = []
    handler = FrameHandler(SensorType(), Broker(), thread, notes.append)
    image = np.zeros((16, 16), int)
    image[2, 3] = 500
    handler.wiring = wiring_named("columns")
    handler.start_recording(tmp_path, "bench/0", "sim:")
    handler.take([frame_from(image, t_ns=0, seq=0)])
    assert handler.newest()[1][2, 12] == 500
    handler.leave()
    (path,) = tmp_path.glob("*.h5")
    assert next(iter(Recording(path).frames())).counts[2, 3] == 500
    assert handler.wiring.changes == ("columns",)  # the mounting stays as it is
