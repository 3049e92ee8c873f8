"""Frames -> files -> frames: what is written, what the files are called, what is read."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from probe.errors import RecordingError
from probe.frame import Frame, frame_from
from probe.recording.read import Recording, read_frames
from probe.recording.record import Recorder

HZ = 220


def pose_at(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def frames(count, *, first=0, pose=None):
    rng = np.random.default_rng([count, first])
    return [
        frame_from(
            rng.integers(0, 1024, (16, 16)),
            t_ns=i * 1_000_000_000 // HZ,
            seq=i,
            wrist=rng.integers(0, 1024, 4),
            pose=pose,
        )
        for i in range(first, first + count)
    ]


def record(path, given, **options):
    with Recorder(path, **options) as recorder:
        for frame in given:
            recorder.append(frame)
    return recorder


def same(a: Frame, b: Frame) -> bool:
    poses = (a.pose is None) == (b.pose is None) and (a.pose is None or (a.pose == b.pose).all())
    numbers = (a.t_ns, a.seq) == (b.t_ns, b.seq)
    return bool(numbers and poses and (a.counts == b.counts).all() and (a.wrist == b.wrist).all())


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_frames_come_back_as_they_were(tmp_path):
    given = frames(200)
    recorder = record(tmp_path / "touch.h5", given)
    assert recorder.files == [tmp_path / "touch.h5"]
    assert names(tmp_path) == ["touch.h5"]
    read = list(read_frames(tmp_path / "touch.h5"))
    assert len(read) == 200
    assert all(map(same, read, given))
    assert not read[0].counts.flags.writeable


def test_the_file_is_plain_hdf5_with_its_origin(tmp_path):
    path = tmp_path / "touch.h5"
    given = frames(70)
    record(path, given, sensor="bench 1", calibration="ab12", attributes={"force_n": 80.0})
    with h5py.File(path) as file:
        assert sorted(file) == ["frames", "seq", "t_ns", "wrist"]
        assert file["frames"].dtype == np.uint16
        assert file["frames"].shape == (70, 16, 16)
        assert file["frames"].compression == "gzip"
        assert (file["frames"][69] == given[69].counts).all()
        said = dict(file.attrs)
    assert said.pop("tool_version")
    assert said == {
        "format": "tactile recording",
        "format_version": 1,
        "sensor": "bench 1",
        "calibration": "ab12",
        "units": "counts",
        "piece": 1,
        "force_n": 80.0,
    }
    recording = Recording(path)
    assert len(recording) == 70
    assert (recording.origin.sensor, recording.origin.calibration) == ("bench 1", "ab12")
    assert dict(recording.origin.more) == {"force_n": 80.0}


def test_the_same_frames_give_the_same_bytes(tmp_path):
    for name in ("a.h5", "b.h5"):
        record(tmp_path / name, frames(100, pose=pose_at(1)))
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()


def test_a_recording_without_frames_is_one(tmp_path):
    record(tmp_path / "touch.h5", [])
    assert list(read_frames(tmp_path / "touch.h5")) == []
    assert len(Recording(tmp_path / "touch.h5").block()) == 0


def test_any_slice_of_a_series(tmp_path):
    given = frames(1000)
    recorder = record(tmp_path / "touch.h5", given, roll_over_s=1.0)
    expected = [f"touch-{number:04d}.h5" for number in range(1, 6)]
    assert [file.name for file in recorder.files] == names(tmp_path) == expected
    recording = Recording(tmp_path / "touch.h5")
    assert [file.frames for file in recording.files] == [220, 220, 220, 220, 120]
    for start, stop in ((0, 1000), (219, 221), (100, 100), (430, 900), (999, 2000), (1200, 1300)):
        assert all(map(same, recording.frames(start, stop), given[start:stop]))
        block = recording.block(start, stop)
        assert block.seq.tolist() == [frame.seq for frame in given[start:stop]]
    only = list(read_frames(tmp_path / "touch-0003.h5"))
    assert (len(only), only[0].seq) == (220, 440)


def test_poses_may_come_and_go(tmp_path):
    given = frames(10) + frames(60, first=10, pose=pose_at(2)) + frames(10, first=70)
    record(tmp_path / "a.h5", given)
    assert all(map(same, read_frames(tmp_path / "a.h5"), given))
    late = frames(300) + frames(300, first=300, pose=pose_at(3))
    recorder = record(tmp_path / "b.h5", late)
    assert recorder.files == [tmp_path / "b.h5"]
    recording = Recording(tmp_path / "b.h5")
    assert all(map(same, recording.frames(), late))
    joined = recording.block()
    assert np.isnan(joined.pose[:256]).all()
    assert (joined.pose[-1] == pose_at(3)).all()


def test_a_probe_whose_clock_begins_anew_neither_rolls_over_nor_stalls(tmp_path):
    given = frames(500) + [
        Frame(f.counts, f.t_ns, f.seq + 500, f.wrist) for f in frames(100)
    ]  # restarted
    recorder = record(tmp_path / "touch.h5", given, roll_over_s=2.0)
    assert [len(Recording(file)) for file in recorder.files] == [440, 160]
    assert all(map(same, read_frames(tmp_path / "touch.h5"), given))


def test_what_was_flushed_is_read_while_it_is_written(tmp_path):
    path = tmp_path / "touch.h5"
    with Recorder(path) as recorder:
        for frame in frames(100):
            recorder.append(frame)
        assert names(tmp_path) == ["touch.part.h5"]
        for name in (path, tmp_path / "touch.part.h5"):
            with pytest.raises(RecordingError, match=r"still being written; .*live"):
                Recording(name)
            assert len(Recording(name, live=True)) == 64
        recorder.flush()
        read = list(read_frames(path, live=True))
        assert all(map(same, read, frames(100)))
        assert len(read) == 100
    assert len(Recording(path, live=True)) == 100


def test_a_series_is_read_while_its_next_file_is_blank(tmp_path):
    path = tmp_path / "touch.h5"
    given = frames(230)
    with Recorder(path, roll_over_s=1.0) as recorder:
        for frame in given:
            recorder.append(frame)
        assert names(tmp_path) == ["touch-0001.h5", "touch.part.h5"]
        assert len(Recording(path, live=True)) == 220
        with pytest.raises(RecordingError, match="nothing in it has reached the disk yet; wait"):
            Recording(path)
        with pytest.raises(RecordingError, match="nothing in it has reached the disk yet; wait"):
            Recording(tmp_path / "touch.part.h5", live=True)
        recorder.flush()
        assert all(map(same, read_frames(path, live=True), given))
    assert all(map(same, read_frames(path), given))


def test_a_slow_stream_is_flushed_by_time(tmp_path):
    with Recorder(tmp_path / "touch.h5", flush_s=0.05) as recorder:
        for frame in frames(12):
            recorder.append(frame)
        recording = Recording(tmp_path / "touch.h5", live=True)
        assert len(recording) == 12  # 11 periods of 1/220 s are 0.05 s


def test_a_recording_is_replaced_only_when_asked(tmp_path):
    path = tmp_path / "touch.h5"
    record(path, frames(10))
    with pytest.raises(RecordingError, match="exists; take another name"):
        Recorder(path)
    record(path, frames(500), roll_over_s=1.0, replace=True)
    assert names(tmp_path) == ["touch-0001.h5", "touch-0002.h5", "touch-0003.h5"]
    with pytest.raises(RecordingError, match="exists"):
        Recorder(path)
    record(path, frames(300), roll_over_s=1.0, replace=True)
    assert names(tmp_path) == ["touch-0001.h5", "touch-0002.h5"]
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


@pytest.mark.parametrize("name", ["touch", "touch.csv", "touch.part.h5"])
def test_other_names_are_refused(tmp_path, name):
    with pytest.raises(RecordingError, match="is no name for a recording"):
        Recorder(tmp_path / name)
    assert names(tmp_path) == []


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(RecordingError, match="make the folder first"):
        Recorder(tmp_path / "no" / "touch.h5")


def test_two_recorders_cannot_write_one_file(tmp_path):
    with Recorder(tmp_path / "touch.h5") as recorder:
        with pytest.raises(RecordingError, match="another process is writing it"):
            Recorder(tmp_path / "touch.h5")
        recorder.append(frames(1)[0])
    assert len(Recording(tmp_path / "touch.h5")) == 1


def test_a_closed_recorder_takes_no_frames(tmp_path):
    recorder = record(tmp_path / "touch.h5", frames(1))
    recorder.close()
    with pytest.raises(RecordingError, match="is closed"):
        recorder.append(frames(1)[0])


def test_an_error_of_the_caller_keeps_the_frames(tmp_path):
    def careless():
        with Recorder(tmp_path / "touch.h5") as recorder:
            recorder.append(frames(1)[0])
            raise KeyError

    with pytest.raises(KeyError):
        careless()
    assert len(Recording(tmp_path / "touch.h5")) == 1


def test_hdf5_is_not_loaded_before_a_file_is_opened():
    modules = "record read repair table imported"
    code = "import sys\n" + "".join(f"import probe.recording.{name}\n" for name in modules.split())
    code += "print(sorted({'h5py', 'scipy'} & set(sys.modules)))"
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout == "[]\n"
