"""Frames -> files -> frames: names, series, damaged ones and their repair; the journal."""

import json
import struct
import time
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from recorded import frames, record, same

from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.read import Recording
from probe.recording.record import Recorder
from probe.recording.repair import repair

COUNTS = np.random.default_rng(3).integers(0, 1024, (600, 16, 16)).astype(np.uint16)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def foreign(path: Path, **datasets) -> Path:
    with h5py.File(path, "w") as file:
        for name, values in datasets.items():
            file[name] = values
    return path


def refused(path: Path, match: str) -> None:
    with pytest.raises(RecordingError, match=match) as caught:
        list(Recording(path).frames())
    assert caught.value.fix
    assert str(path) in str(caught.value)


def test_a_recording_is_a_file():
    with pytest.raises(RecordingError, match="list is no file; give the path of a recording"):
        Recording([np.zeros((16, 16))])


def test_the_file_is_plain_hdf5_with_its_origin(tmp_path):
    path = tmp_path / "touch.h5"
    record(path, frames(70), sensor="bench 1", calibration="ab12", attributes={"force_n": 80.0})
    with h5py.File(path) as file:
        assert sorted(file) == ["frames", "seq", "t_ns", "wrist"]
        assert (file["frames"].dtype, file["frames"].shape) == (np.uint16, (70, 16, 16))
        said = dict(file.attrs)
    assert said.pop("tool_version")
    assert said == {
        "format": "tactile recording", "format_version": 1, "sensor": "bench 1",
        "calibration": "ab12", "units": "counts", "piece": 1, "force_n": 80.0,
    }  # fmt: skip


def test_a_probe_whose_clock_restarts_neither_rolls_over_nor_stalls(tmp_path):
    again = [Frame(f.counts, f.t_ns, f.seq + 500, f.wrist) for f in frames(100)]
    given = frames(500) + again
    recorder = record(tmp_path / "touch.h5", given, roll_over_s=2.0)
    assert [len(Recording(file)) for file in recorder.files] == [440, 160]
    assert all(map(same, Recording(tmp_path / "touch.h5").frames(), given))


def test_flushed_frames_are_read_while_others_are_written(tmp_path):
    path = tmp_path / "touch.h5"
    with Recorder(path) as recorder:
        for frame in frames(100):
            recorder.append(frame)
        assert names(tmp_path) == ["touch.part.h5"]
        for name in (path, tmp_path / "touch.part.h5"):
            with pytest.raises(RecordingError, match=r"still being written; .*live"):
                Recording(name)
            with pytest.raises(RecordingError, match="still being written; stop the recording"):
                repair(name)
            assert len(Recording(name, live=True)) == 64
        recorder.flush()
        assert all(map(same, Recording(path, live=True).frames(), frames(100)))
        assert len(Recording(path, live=True)) == 100
    assert len(Recording(path, live=True)) == 100
    with Recorder(tmp_path / "slow.h5", flush_s=0.05) as recorder:
        for frame in frames(12):  # 11 periods of 1/220 s are 0.05 s
            recorder.append(frame)
        assert len(Recording(tmp_path / "slow.h5", live=True)) == 12


def test_a_series_is_read_while_its_next_file_is_blank(tmp_path):
    path = tmp_path / "touch.h5"
    given = frames(230)
    with Recorder(path, roll_over_s=1.0) as recorder:
        for frame in given:
            recorder.append(frame)
        assert names(tmp_path) == ["touch-0001.h5", "touch.part.h5"]
        assert len(Recording(path, live=True)) == 220
        for name, live in ((path, False), (tmp_path / "touch.part.h5", True)):
            with pytest.raises(RecordingError, match="nothing in it has reached the disk yet; w"):
                Recording(name, live=live)
        recorder.flush()
        assert all(map(same, Recording(path, live=True).frames(), given))
    assert all(map(same, Recording(path).frames(), given))


def test_a_recording_is_replaced_only_when_asked(tmp_path):
    path = tmp_path / "touch.h5"
    record(path, frames(10))
    with pytest.raises(RecordingError, match="exists; take another name"):
        Recorder(path)
    for count, left in ((500, 3), (300, 2)):
        record(path, frames(count), roll_over_s=1.0, replace=True)
        assert names(tmp_path) == [f"touch-{n:04d}.h5" for n in range(1, left + 1)]
        with pytest.raises(RecordingError, match="exists"):
            Recorder(path)
    record(path, frames(7), replace=True)
    assert names(tmp_path) == ["touch.h5"]
    assert len(Recording(path)) == 7


def test_a_name_that_was_taken_meanwhile_loses_nothing(tmp_path):
    path = tmp_path / "touch.h5"
    recorder = Recorder(path)
    recorder.append(frames(1)[0])
    path.write_text("mine")
    with pytest.raises(RecordingError, match=r"took the name.*repair"):
        recorder.close()
    assert path.read_text() == "mine"
    assert len(Recording(tmp_path / "touch.part.h5")) == 1


def test_two_recorders_cannot_write_one_file_and_a_closed_one_takes_no_frames(tmp_path):
    with Recorder(tmp_path / "touch.h5") as recorder:
        with pytest.raises(RecordingError, match="another process is writing it"):
            Recorder(tmp_path / "touch.h5")
        recorder.append(frames(1)[0])
    assert len(Recording(tmp_path / "touch.h5")) == 1
    with pytest.raises(RecordingError, match="is closed"):
        recorder.append(frames(1)[0])


def test_others_files_that_are_no_recording_are_told_apart(tmp_path):
    refused(tmp_path, "Is a directory; this is a folder")
    refused(foreign(tmp_path / "b.h5", data=COUNTS, more=1), "/frames, but data, more; import")
    refused(foreign(tmp_path / "d.h5", frames=["a"]), "must hold numbers")
    refused(foreign(tmp_path / "e.h5", frames=COUNTS, t_ns=np.zeros((3, 3))), "/t_ns must hold")
    with h5py.File(tmp_path / "f.h5", "w") as file:
        file.create_group("frames")
    refused(tmp_path / "f.h5", "it is no array")


@pytest.mark.parametrize("bad", [65536.0, np.nan, np.inf])
def test_values_that_are_no_counts_are_refused_and_where(tmp_path, bad):
    values = COUNTS.astype(float)
    values[300, 2, 3] = bad
    path = foreign(tmp_path / "a.h5", frames=values)
    refused(path, "other things than counts 0 ... 65535 in frames 256 ... 511; import")
    assert len(list(Recording(path).frames(0, 256))) == 256


def test_a_damaged_record_of_a_journal_costs_its_block(tmp_path):
    given, journal = frames(200), tmp_path / "touch.part.h5"
    with Recorder(tmp_path / "written.h5") as recorder:
        for frame in given:
            recorder.append(frame)
        recorder.flush()
        content = bytearray((tmp_path / "written.part.h5").read_bytes())
    content[content.index(given[70].counts.tobytes())] ^= 8
    journal.write_bytes(content)
    with pytest.raises(RecordingError, match=r"damaged: cannot read it; .*`repair`"):
        list(Recording(journal).frames())
    result = repair(journal)
    assert (result.frames, result.lost) == (136, 64)
    assert journal.with_name("touch.damaged.h5").read_bytes() == content
    assert Recording(result.path).origin.more["frames_lost"] == 64


HEAD = {
    "version": 1, "tool_version": "0", "piece": 1, "shape": [6, 5], "sensor": "", "more": {},
    "calibration": "", "units": "counts", "sensor_type": "",
}  # fmt: skip


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
    with pytest.raises(RecordingError, match=r"damaged: cannot read it; copy .*`repair`"):
        Recording(path)
    with pytest.raises(RecordingError, match=r"nothing in it can be read; copy it again$"):
        repair(path)
    content = b"TOUCHLOG" + struct.pack("<II", 1 << 31, 0)
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="damaged: cannot read it"):
        Recording(path)
    assert path.read_bytes() == content


def test_a_disk_without_space_for_hdf5_leaves_the_journal(tmp_path, monkeypatch):
    def refuse(*_):
        raise RecordingError("cannot write it: No space left on device", fix="free some space")

    recorder = Recorder(tmp_path / "touch.h5")
    recorder.append(frames(1)[0])
    monkeypatch.setattr("probe.recording.record.write_hdf5", refuse)
    with pytest.raises(RecordingError, match="free some space, then run `repair`"):
        recorder.close()
    assert recorder.files == [tmp_path / "touch.part.h5"]
    assert len(Recording(tmp_path / "touch.h5")) == 1
    monkeypatch.undo()
    assert repair(tmp_path / "touch.h5").path == tmp_path / "touch.h5"
    assert len(Recording(tmp_path / "touch.h5")) == 1


@pytest.mark.parametrize(
    ("t_ns", "made"),
    [
        (np.arange(5) * 20_000_000 + 3, np.arange(146) * 20_000_000 + 3),
        ([7], 7 + np.rint(np.arange(146) * (1e9 / 220))),
        (np.empty(0, np.int64), np.rint(np.arange(146) * (1e9 / 220))),
    ],
    ids=["at its rate", "one time", "none"],
)
def test_repair_keeps_every_image_where_its_time_number_or_pose_is_missing(tmp_path, t_ns, made):
    poses = np.tile(np.eye(4), (146, 1, 1))
    path = foreign(
        tmp_path / "a.h5", frames=COUNTS[:146], t_ns=t_ns, seq=np.arange(9, 109),
        wrist=np.full((146, 4), 5), pose=poses[:70],
    )  # fmt: skip
    content = path.read_bytes()
    result = repair(path)
    assert (result.frames, result.lost, result.continued) == (146, 0, ("t_ns", "seq", "pose"))
    assert result.kept.read_bytes() == content
    block = Recording(path).block()
    np.testing.assert_array_equal(block.counts, COUNTS[:146])
    np.testing.assert_array_equal(block.t_ns, made)
    np.testing.assert_array_equal(block.seq, np.arange(9, 155))
    np.testing.assert_array_equal(block.pose[:70], poses[:70])
    assert np.isnan(block.pose[70:]).all()
    assert Recording(path).origin.more["continued"] == "t_ns, seq, pose"


def test_repair_counts_entries_without_an_image_as_lost(tmp_path):
    path = foreign(tmp_path / "a.h5", frames=COUNTS[:5], t_ns=np.arange(146))
    assert (repair(path).lost, len(Recording(path))) == (141, 5)


def test_a_long_word_in_an_attribute_takes_no_time(tmp_path):
    path = foreign(tmp_path / "a.h5", frames=COUNTS[:2])
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "x" * 60_000
    started = time.process_time()
    assert len(Recording(path)) == 2
    assert time.process_time() - started < 5.0  # a minute where each letter began the search again
