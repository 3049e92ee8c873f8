"""The bench without a server: files, watch, images, messages, touches, time line, sheets."""

from __future__ import annotations

import asyncio
import hashlib
import json
import struct
import time
from dataclasses import replace
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from hostile_recordings import write_zeros
from recorded import record
from starlette.requests import ClientDisconnect

from encoded_objects.base.sensor_type import SensorType
from generator.database.open import open_database
from generator.database.read import read_object
from generator.database.registered import RegisteredPart
from generator.database.transaction import read_transaction
from probe.calibration.guide import LONGEST
from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording.read import Recording
from recognizer.bench.answers import answer_json
from recognizer.bench.broker import Broker, Subscriber
from recognizer.bench.errors import BenchError, BusyError, UnknownError
from recognizer.bench.feed import PAUSE_S, ProbeFeed, ReplayFeed
from recognizer.bench.files import (
    Uploads,
    checked_name,
    find_file,
    folder_bytes,
    list_files,
    part_to_send,
)
from recognizer.bench.frames import FrameHandler, page_guide
from recognizer.bench.lab_json import drawn_faces, face_sheets, symbol_poses
from recognizer.bench.message import FILTERS, filter_image, mosaic_message
from recognizer.bench.reading import AGAIN_S, RESTLESS_S, ReadTrigger, RecognitionThread
from recognizer.bench.touch_log import TouchLog
from recognizer.scan.mosaic.canvas import GlobalImage
from recognizer.sensor.wiring import wiring_named
from recognizer.touch.lab import Lab
from recognizer.touch.recognition import EDGE, NO_LOAD, Cause, refusal


def pressed(value, seq=0):
    image = np.full((16, 16), 3)
    image[4:9, 4:9] += value
    return frame_from(image, t_ns=seq * 10_000_000, seq=seq)


def recorded(path, counts):
    record(path, [pressed(value, seq) for seq, value in enumerate(counts)], sensor="bench/0")
    return path


def test_a_refusal_is_told_by_its_cause():
    for reason, cause, because, advice in (
        ("not an encoded surface", Cause(EDGE, {"loaded": 0.5, "symbols": 4.0}), "at an edge",
         "50 % of the sensor is loaded, 4 symbols are read; move towards the loaded part"),
        ("no contact", Cause(NO_LOAD, {}), "no contact",
         "no contact; press the probe onto the object"),
        ("ambiguous", None, "ambiguous", "two places look alike here; touch a little beside it"),
    ):  # fmt: skip
        answer = replace(refusal(0, reason), cause=cause)
        told = answer_json(answer, Lab("", ()), SensorType())
        assert (told["because"], told["advice"]) == (because, advice)


@pytest.mark.parametrize(
    "name",
    ["", ".h5", "../x.h5", "a/../x.h5", "/etc/x.h5", "a\\b.h5", "a\0.h5", "x.txt", "a..h5",
     "x" * 200 + ".h5", "x.h5\n", "~.h5"],
)  # fmt: skip
def test_names_that_could_mean_another_place_are_refused(name):
    with pytest.raises(UnknownError):
        checked_name(name, ".h5")


def test_files_of_the_folder_and_no_others(tmp_path):
    folder = tmp_path / "recordings"
    folder.mkdir()
    (tmp_path / "secret.h5").write_text("secret")
    (folder / "link.h5").symlink_to(tmp_path / "secret.h5")
    (folder / "touch-001.h5").write_text("")
    assert find_file(folder, "touch-001.h5", ".h5") == folder / "touch-001.h5"
    for name in ("link.h5", "none.h5"):
        with pytest.raises(UnknownError):
            find_file(folder, name, ".h5")
    (folder / "live.part.h5").write_text("")
    (folder / "gone.h5").symlink_to(tmp_path / "nowhere.h5")  # ended the thread of the bench
    assert folder_bytes(folder) == len("secret")
    assert set(list_files(folder, ".h5")) == {"touch-001.h5", "link.h5"}
    assert list_files(tmp_path / "nowhere", ".h5") == []


async def pieces(content, size=700):
    for start in range(0, len(content), size):
        yield content[start : start + size]


def taken_in(uploads, name, content):
    return asyncio.run(uploads.take(name, pieces(content)))


def test_a_recording_that_is_sent_in_is_kept_only_if_it_is_one(tmp_path):
    content = recorded(tmp_path / "mine.h5", [0, 9]).read_bytes()
    uploads = Uploads(tmp_path / "kept")
    assert taken_in(uploads, "a.h5", content) == 2
    with pytest.raises(BenchError, match="already"):
        taken_in(uploads, "a.h5", content)
    for bad in (b"", b"no recording", content[:-900]):
        with pytest.raises(RecordingError):
            taken_in(uploads, "b.h5", bad)
    assert [path.name for path in (tmp_path / "kept").iterdir()] == ["a.h5"]
    assert (tmp_path / "kept" / "a.h5").read_bytes() == content


def test_a_page_that_leaves_or_sends_what_costs_much_leaves_nothing(tmp_path, monkeypatch):
    async def leaving():
        yield b"the first bytes"
        raise ClientDisconnect

    content, kept = recorded(tmp_path / "mine.h5", [0, 9]).read_bytes(), tmp_path / "kept"
    with pytest.raises(BenchError, match="left after 15 bytes"):
        asyncio.run(Uploads(kept).take("a.h5", leaving()))
    with pytest.raises(BusyError, match="ends"):
        taken_in(Uploads(kept, lambda: True), "a.h5", content)
    monkeypatch.setattr("recognizer.bench.convert._MEMORY", 1 << 26)
    with pytest.raises(RecordingError, match=r"a.h5: it takes more memory or time"):
        taken_in(Uploads(kept), "a.h5", content)
    assert list(kept.iterdir()) == []


def test_recordings_that_cannot_be_played_are_not_read(tmp_path, monkeypatch):
    path = write_zeros(tmp_path / "a.h5", 2_000_001)
    monkeypatch.setattr(Recording, "blocks", None)
    for attempt in (
        lambda: ReplayFeed(Recording(path)),
        lambda: taken_in(Uploads(tmp_path / "kept"), "a.h5", path.read_bytes()),
    ):
        with pytest.raises(BenchError, match=r"a.h5: a recording of 2,000,001 frames of 16 x 16"):
            attempt()
    assert list((tmp_path / "kept").iterdir()) == []


def test_recordings_that_are_sent_in_have_a_quota_a_number_and_a_time(tmp_path, monkeypatch):
    content = recorded(tmp_path / "mine.h5", [0, 9]).read_bytes()
    kept = tmp_path / "kept"
    taken_in(Uploads(kept), "a.h5", content)
    assert folder_bytes(kept) == len(content)
    for name, value in (("AT_ONCE", 1), ("SILENT_S", 0.05), ("QUOTA", 2 * len(content) - 1)):
        monkeypatch.setattr(f"recognizer.bench.files.{name}", value)
    with pytest.raises(BenchError, match="GB already"):
        taken_in(Uploads(kept), "b.h5", content)

    async def stuck():
        yield content[:500]
        await asyncio.sleep(60)
        yield b""

    async def two_at_once():
        uploads = Uploads(kept)
        first = asyncio.create_task(uploads.take("c.h5", stuck()))
        await asyncio.sleep(0)
        with pytest.raises(BusyError):
            await uploads.take("d.h5", pieces(content))
        with pytest.raises(BenchError, match="came in"):
            await first
        monkeypatch.setattr("recognizer.bench.files.QUOTA", 10**9)
        return await uploads.take("d.h5", pieces(content))

    assert asyncio.run(two_at_once()) == 2
    assert sorted(path.name for path in kept.iterdir()) == ["a.h5", "d.h5"]


def test_parts_are_sent_from_their_folder_alone(tmp_path):
    lab = tmp_path / "lab"
    lab.mkdir()
    (tmp_path / "secret.stl").write_text("secret")
    (lab / "ok.stl").write_text("solid")
    (lab / "link.stl").symlink_to(tmp_path / "secret.stl")

    def part(file):
        content = (lab / file).read_bytes() if (lab / file).is_file() else b""
        return RegisteredPart("p", "stl", file, hashlib.sha256(content).hexdigest(), np.eye(4))

    database, folder = str(lab / "lab.db"), lab.resolve()
    assert part_to_send(database, folder, part("ok.stl")) == lab / "ok.stl"
    for file in ("../secret.stl", "link.stl", "/etc/passwd", "none.stl", "."):
        with pytest.raises(UnknownError):
            part_to_send(database, folder, part(file))
    with pytest.raises(UnknownError):
        part_to_send(database, None, part("ok.stl"))
    registered = part("ok.stl")
    (lab / "ok.stl").write_text("another file")
    with pytest.raises(UnknownError, match="is changed"):
        part_to_send(database, folder, registered)


TOUCH, OTHER = np.random.default_rng(0).random((2, 16, 16))


def test_a_touch_is_read_once_it_is_steady_and_again_when_it_has_changed():
    watch = ReadTrigger()
    for number, (image, phase) in enumerate((
        (0 * TOUCH, "none"), (0.3 * TOUCH, "felt"), (TOUCH, "felt"), (TOUCH, "read"),
        (TOUCH, "held"), (0.6 * TOUCH, "held"), (0.6 * TOUCH, "held"),  # it is lifted
        (OTHER, "moving"), (OTHER, "read"),  # it has been moved
        (0 * TOUCH, "none"),
    )):  # fmt: skip
        now_s = 0.01 * number
        assert watch.phase(image, contact=image.any(), now_s=now_s) == phase
        if number == 3:
            watch.read(TOUCH, answered=True, now_s=now_s)


def test_restless_and_unanswered_touches_are_read_all_the_same():
    rng = np.random.default_rng(0)
    watch, now_s = ReadTrigger(), 0.0
    while watch.phase(rng.random((16, 16)), contact=True, now_s=now_s) != "read":
        now_s += 0.01
    assert now_s == pytest.approx(RESTLESS_S, abs=0.02)
    watch.read(TOUCH, answered=False, now_s=now_s)
    for after_s, phase in ((0.0, "held"), (0.9 * AGAIN_S, "held"), (1.1 * AGAIN_S, "again")):
        assert watch.phase(TOUCH, contact=True, now_s=now_s + after_s) == phase


def frame_of(value, t_ns=0):
    return frame_from(np.full((16, 16), value), t_ns=t_ns, seq=0)


def touched(log, value):
    log.begin(frame_of(value, t_ns=value), 1e3)
    log.read(frame_of(value, t_ns=value))


def test_touches_are_named_deleted_told_as_a_table_and_forgotten(monkeypatch):
    monkeypatch.setattr("recognizer.bench.touch_log.KEPT", 3)
    log = TouchLog(Broker())
    for value in (5, 6):
        touched(log, value)
        log.conclude({"object": "Cube", "face": "F1", "place": {"x_mm": 1.5}}, answered=True)
        log.lift()
    assert log.rename(1, "by hand, once")["name"] == "by hand, once"
    lines = log.as_csv().split("\r\n")
    assert lines[1].startswith('1,"by hand, once",1000,0.0,answered,Cube,F1,1.5,')
    log.conclude({"reason": "not an encoded surface", "because": "at an edge"}, answered=False)
    assert f",at an edge,{6 * 256}" in log.as_csv()  # as the page says it
    log.delete(1)
    for number in (1, 9):
        with pytest.raises(UnknownError):
            log.one(number)
        with pytest.raises(UnknownError):
            log.delete(number)
    with pytest.raises(BenchError, match="81 characters"):
        log.rename(2, "x" * 81)
    log.begin(frame_of(1), 1e3)
    log.lift()  # it was only brushed
    assert [one["number"] for one in log.all()] == [2]
    for value in range(3):
        touched(log, value)
    assert [one["number"] for one in log.all()] == [4, 5, 6]


def test_filters_build_on_each_other():
    image = np.full((16, 16), 7.0)
    image[4:10, 4:10] = 107.0
    image[2, 12] = 300.0
    made = {wish: filter_image(image, SensorType(), wish) for wish in FILTERS}
    assert made["raw"][0, 0] == 7
    assert made["bias-free"][[0, 6], [0, 6]].tolist() == [0, 100]
    assert made["median"][[2, 6], [12, 6]].tolist() == [0, 100]  # without the spike
    assert made["sobel"][6, 6] == 0 < made["sobel"][6, 3]
    assert filter_image(image, SensorType(), "bias-free", image).max() == 0


def test_a_mosaic_is_packed_thinned_and_tells_what_was_not_felt():
    values = np.linspace(0, 10, 700 * 30).reshape(700, 30)
    count = np.ones(values.shape, np.int64)
    count[0, 0] = 0
    data = mosaic_message(GlobalImage(values, count, 0.4, (1.0, 2.0)), 3)
    _, _, _, _, rows, columns, touches, *places, top = struct.unpack("<cBBBIIIffff", data[:32])
    assert (rows, columns, touches) == (350, 15, 3)
    assert places == pytest.approx((0.8, 1.0, 2.0))
    cells = np.frombuffer(data, np.uint8, offset=32).reshape(rows, columns)
    assert cells[0, :2].tolist() == [0, 1]
    assert np.allclose((cells[1:] - 1.0) * top / 254, values[2::2, ::2], atol=top / 254)
    empty = GlobalImage(np.zeros((0, 0)), np.zeros((0, 0), np.int64), 0.4, (0.0, 0.0))
    assert len(mosaic_message(empty, 0)) == 32


def test_a_page_gets_the_newest_of_every_topic_and_nothing_twice():
    async def told():
        board, page = Broker(), Subscriber()
        board.attach(asyncio.get_running_loop())
        board.subscribers.add(page)
        for i in range(3):
            board.publish("status", {"i": i})
        board.publish("answer", {"face": "F1"})
        await asyncio.wait_for(page.news.wait(), 5)
        return [json.loads(text) for text in board.news(page)], board.news(page)

    newest = [{"topic": "status", "i": 2}, {"topic": "answer", "face": "F1"}]
    assert asyncio.run(told()) == (newest, [])


def taken(feed):
    frames, end_s = [], time.monotonic() + 5.0
    while time.monotonic() < end_s and feed.as_json()["playing"]:
        frames += feed.take(0.05)
    frames += feed.take(0.0)
    return [frame.seq for frame in frames]


def test_a_recording_plays_in_order_goes_where_it_is_told_and_pauses_at_its_end(tmp_path):
    feed = ReplayFeed(Recording(recorded(tmp_path / "x.h5", [0] * 20 + [200] * 20 + [0] * 20)))
    assert feed.seconds == pytest.approx(0.59)
    assert taken(feed) == list(range(60))
    assert feed.as_json()["at"] == pytest.approx(feed.seconds, abs=1e-3)
    feed.play(playing=None, speed=None, at_s=0.305)
    assert [frame.seq for frame in feed.take(0.0)] == [30]  # shown although it pauses
    assert feed.take(0.0) == []
    for at_s, first in ((0.205, 20), (None, 0)):  # from its beginning again
        feed.play(playing=True, speed=20.0, at_s=at_s)
        assert taken(feed) == list(range(first, 60))
    strength = np.array(feed.overview())
    assert (strength[22:38].min(), strength[:18].max(), strength[42:].max()) == (1.0, 0.0, 0.0)
    with pytest.raises(BenchError, match="speed"):
        feed.play(playing=None, speed=1e9, at_s=None)


def test_an_empty_recording_and_one_whose_clock_jumps(tmp_path):
    feed = ReplayFeed(Recording(recorded(tmp_path / "empty.h5", [])))
    assert (feed.take(0.0), feed.overview(), feed.as_json()["playing"]) == ([], [], False)
    times_ns = (0, 10**7, 10**13, 10**13 + 10**7, 5, 10**7)
    frames = [
        frame_from(np.zeros((16, 16)), t_ns=t_ns, seq=seq) for seq, t_ns in enumerate(times_ns)
    ]
    record(tmp_path / "jump.h5", frames)
    feed = ReplayFeed(Recording(tmp_path / "jump.h5"))
    assert feed.seconds == pytest.approx(PAUSE_S + 0.03, abs=1e-3)


def read_for(seconds, frames):
    """Return how many frames of (time, ms; reading) a load takes, and what is said of them."""
    guide = page_guide("bench/0", [80], seconds, None)
    guide.read()
    for taken, (t_ms, value) in enumerate(frames):
        if not guide.as_json()["reading"]:
            return taken, guide.guide.described[0]
        guide.guide.take([frame_from(np.full((16, 16), value), t_ns=t_ms * 1_000_000, seq=0)])
    return len(frames), ""


def test_a_load_is_read_until_enough_was_told():
    told = [(10 * i, i) for i in range(1000)]
    assert read_for(0.5, told)[0] == 51
    assert read_for(0.5, [(t, i // 5) for t, i in told])[0] == 19 * 5 + 1  # each is sent five times
    assert read_for(0.5, [(t, 7) for t, _ in told])[0] == round(0.5 * LONGEST * 100) + 1
    assert read_for(0.5, [(10 * t, i) for t, i in told[:9]])[0] == 9  # slow, and not done yet
    again = [(5000 + t, i) for t, i in told[:20]] + [(t, t) for t, _ in told[:40]]
    taken, said = read_for(0.3, again)  # the board starts again
    assert (taken, said[:9]) == (51, "31 frames")
    for bad in ([], [0.0], [float("nan")], [1e9], [1.0] * 99):
        with pytest.raises(BenchError):
            page_guide("bench/0", bad, 0.2, None)


@pytest.fixture
def thread():
    """A thread that reads nothing: there is no database."""
    thread = RecognitionThread("", SensorType(), Broker())
    yield thread
    thread.close()


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


def test_a_probe_that_nobody_wants_is_let_go_and_comes_back():
    feed = ProbeFeed("sim:?rate=100")
    try:
        assert any(feed.take(0.05) for _ in range(200))
        assert feed.as_json()["state"] == "live"
        for _ in range(2):
            feed.rest(wanted=False)
        assert feed.take(0.01) == []
        assert feed.as_json()["state"] == "waiting"
        assert feed.as_json()["frames"] > 0
        feed.rest(wanted=True)
        assert any(feed.take(0.05) for _ in range(200))
        assert feed.as_json()["state"] == "live"
    finally:
        feed.close()


SHAPES = {"Cube": "{cube: 30 mm}", "Can": "{cylinder: {diameter: 40 mm, height: 30 mm}}"}


@pytest.fixture(scope="module")
def held(make_lab):
    """Registered objects by their names."""
    folder = make_lab(*(f"name: {name}\nshape: {shape}\n" for name, shape in SHAPES.items()))
    with read_transaction(open_database(f"{folder}/lab.db", writable=False)) as connection:
        return {name: read_object(connection, name) for name in SHAPES}


@pytest.mark.parametrize("name", SHAPES)
def test_sheets_close_a_surface_and_symbols_stand_on_it(held, name):
    area = 0.0
    for number in drawn_faces(held[name]):
        face = held[name].faces[number]
        poses = symbol_poses(face, held[name].layout.faces[number].centres_mm)
        assert np.allclose(np.linalg.norm(poses[:, :3, 2], axis=1), 1.0)
        for outer, *_ in face_sheets(face):
            cross = np.cross(outer - outer[0], np.roll(outer, -1, axis=0) - outer[0]).sum(axis=0)
            area += np.linalg.norm(cross) / 2
    wanted = 6 * 30**2 if name == "Cube" else np.pi * 40 * 30 + 2 * np.pi * 20**2
    assert area == pytest.approx(wanted, rel=5e-3)


def test_the_page_is_built_of_its_sources():
    bench = Path(str(resources.files("recognizer.bench")))
    web, static = bench / "web", bench / "static"
    built = json.loads((static / "built.json").read_text())
    sources = [web / "package-lock.json", web / "build.mjs", *(web / "src").iterdir()]
    page = [path for path in static.iterdir() if path.name != "built.json"]
    for there, files in (("sources", sources), ("page", page)):
        found = {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
        assert found == built[there], "npm ci && npm run build in recognizer/bench/web"
