"""The journal of a recording: torn, damaged or hostile ones, and a disk without space for HDF5."""

from __future__ import annotations

import json
import struct
import zlib

import numpy as np
import pytest

from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording import record
from probe.recording.read import Recording
from probe.recording.record import Recorder
from probe.recording.repair import repair

COUNTS = np.random.default_rng(3).integers(0, 65536, (200, 6, 5)).astype(np.uint16)
HEAD = {
    "version": 1, "tool_version": "0", "piece": 1, "shape": [6, 5], "sensor": "", "more": {},
    "calibration": "", "units": "counts", "sensor_type": "",
}  # fmt: skip


@pytest.fixture
def journal(tmp_path):
    """The part file of a writer that was killed after 200 frames, every third with a pose."""
    path = tmp_path / "written" / "touch.h5"
    path.parent.mkdir()
    recorder = Recorder(path, sensor="bench 1", attributes={"force_n": np.float64(80), "of": "a"})
    for i, counts in enumerate(COUNTS):
        recorder.append(
            frame_from(
                counts, t_ns=i * 10**6, seq=i, wrist=[1, 2, 3, i], pose=np.eye(4) if i % 3 else None
            )
        )
    recorder.flush()
    left = tmp_path / "touch.part.h5"
    left.write_bytes(path.with_name("touch.part.h5").read_bytes())
    recorder.close()
    assert [*path.parent.iterdir()] == [path]
    return left


def size_of(journal):
    """Bytes of its head and of a record."""
    length = struct.unpack_from("<I", journal.read_bytes(), 8)[0]
    return 16 + length, 2 * 30 + 8 + 16 + 128 + 4


def check(frames, count):
    read = list(frames)
    assert [frame.seq for frame in read] == list(range(count))
    for i, frame in enumerate(read):
        assert (frame.counts == COUNTS[i]).all()
        assert (frame.t_ns, frame.wrist.tolist()) == (i * 10**6, [1, 2, 3, i])
        assert (frame.pose is None) == (i % 3 == 0)


def test_it_is_read_as_it_is_under_both_names(journal):
    for name in (journal, journal.with_name("touch.h5")):
        recording = Recording(name)
        check(recording.frames(), 200)
        check(Recording(name, live=True).frames(), 200)
        assert recording.shape == (6, 5)
        assert recording.origin.sensor == "bench 1"
        assert dict(recording.origin.more) == {"force_n": 80.0, "of": "a"}
        assert [(file.path, file.poses) for file in recording.files] == [(journal, True)]


@pytest.mark.parametrize("cut", [0, 1, 100, 215])
def test_a_torn_record_ends_it(journal, cut):
    start, size = size_of(journal)
    journal.write_bytes(journal.read_bytes()[: start + 150 * size + cut])
    check(Recording(journal).frames(), 150)
    content = bytearray(journal.read_bytes())
    content[-1 - cut] ^= 1  # of the last whole record
    journal.write_bytes(content)
    check(Recording(journal).frames(), 149)


def test_a_damaged_record_costs_its_block(journal):
    start, size = size_of(journal)
    content = bytearray(journal.read_bytes())
    content[start + 70 * size + 5] ^= 8
    journal.write_bytes(content)
    with pytest.raises(RecordingError, match=r"damaged: cannot read it; .*`repair`"):
        list(Recording(journal).frames())
    result = repair(journal)
    assert (result.frames, result.lost) == (136, 64)
    kept = journal.with_name("touch.damaged.h5")
    assert kept.read_bytes() == content
    assert Recording(result.path).origin.more["frames_lost"] == 64


@pytest.mark.parametrize(
    "head",
    [
        HEAD | {"version": 2},
        HEAD | {"shape": [1 << 20, 1 << 20]},
        HEAD | {"shape": [-6, 5]},
        HEAD | {"more": 3},
        [],
        "[" * 100_000,
    ],
    ids=lambda head: str(head)[:20],
)
def test_heads_that_mean_harm_are_damage(tmp_path, head):
    text = (head if isinstance(head, str) else json.dumps(head)).encode()
    path = tmp_path / "touch.h5"
    path.write_bytes(b"TOUCHLOG" + struct.pack("<II", len(text), zlib.crc32(text)) + text)
    for attempt in (Recording, repair):
        with pytest.raises(RecordingError, match="damaged: cannot read it"):
            attempt(path)
    content = b"TOUCHLOG" + struct.pack("<II", 1 << 31, 0)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="damaged: cannot read it"):
        Recording(path)
    assert path.read_bytes() == content


def test_a_disk_without_space_for_hdf5_leaves_the_journal(tmp_path, monkeypatch):
    def refuse(*_):
        raise RecordingError("cannot write it: No space left on device", fix="free some space")

    recorder = Recorder(tmp_path / "touch.h5")
    recorder.append(frame_from(COUNTS[0], t_ns=0, seq=0))
    monkeypatch.setattr(record, "write_hdf5", refuse)
    with pytest.raises(RecordingError, match="free some space, then run `repair`"):
        recorder.close()
    assert recorder.files == [tmp_path / "touch.part.h5"]
    assert len(Recording(tmp_path / "touch.h5")) == 1
    monkeypatch.undo()
    assert repair(tmp_path / "touch.h5").path == tmp_path / "touch.h5"
    assert len(Recording(tmp_path / "touch.h5")) == 1
