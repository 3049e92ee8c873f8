"""Files that are no recording, others' recordings, damaged ones and their repair, tables."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import h5py
import numpy as np
import pytest

from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording.files import is_locked
from probe.recording.guard import superblock_of
from probe.recording.read import Recording, read_frames
from probe.recording.record import Recorder
from probe.recording.repair import repair
from probe.recording.table import export_csv

COUNTS = np.random.default_rng(3).integers(0, 1024, (600, 16, 16)).astype(np.uint16)


def recorded(path: Path, count: int = len(COUNTS), pose=None, **options) -> Path:
    with Recorder(path, **options) as recorder:
        for i in range(count):
            recorder.append(frame_from(COUNTS[i], t_ns=i * 4_545_454, seq=i, pose=pose))
    return path


def foreign(path: Path, **datasets) -> Path:
    with h5py.File(path, "w") as file:
        for name, values in datasets.items():
            file[name] = values
    return path


def refused(path: Path, match: str) -> None:
    with pytest.raises(RecordingError, match=match) as caught:
        list(read_frames(path))
    assert caught.value.fix
    assert str(path) in str(caught.value)


def test_what_is_no_recording_is_told_apart(tmp_path):
    refused(tmp_path / "none.h5", "no such recording")
    refused(tmp_path, "Is a directory; this is a folder")
    (tmp_path / "empty.h5").touch()
    refused(tmp_path / "empty.h5", "it is empty; delete it")
    (tmp_path / "text.h5").write_text("seq,t_ns\n" * 100)
    refused(tmp_path / "text.h5", "no HDF5 file")
    refused(foreign(tmp_path / "a.h5"), "no dataset /frames, but nothing")
    refused(foreign(tmp_path / "b.h5", data=COUNTS, more=1), "/frames, but data, more; import")
    refused(foreign(tmp_path / "c.h5", frames=np.zeros((5, 32))), r"\(5, 32\); import")
    refused(foreign(tmp_path / "d.h5", frames=["a"]), "must hold numbers")
    refused(foreign(tmp_path / "e.h5", frames=COUNTS, t_ns=np.zeros((3, 3))), "/t_ns must hold")
    with h5py.File(tmp_path / "f.h5", "w") as file:
        file.create_group("frames")
    refused(tmp_path / "f.h5", "it is no array")


def test_values_that_are_no_counts_are_refused_and_where(tmp_path):
    for number, bad in enumerate((-1.0, 65536.0, 0.5, np.nan, np.inf)):
        values = COUNTS.astype(float)
        values[300, 2, 3] = bad
        path = foreign(tmp_path / f"{number}.h5", frames=values)
        refused(path, "other things than counts 0 ... 65535 in frames 256 ... 511; import")
        assert len(list(Recording(path).frames(0, 256))) == 256
    poses = np.tile(2.0 * np.eye(4), (600, 1, 1))
    refused(
        foreign(tmp_path / "p.h5", frames=COUNTS, pose=poses), "other things than rigid transforms"
    )


def test_any_file_with_frames_is_a_recording(tmp_path):
    for number, dtype in enumerate((np.uint8, np.int32, np.float32, ">u2", np.int64)):
        path = foreign(tmp_path / f"{number}.h5", frames=(COUNTS % 250).astype(dtype))
        block = Recording(path).block()
        assert block.counts.dtype == np.uint16
        assert (block.counts == COUNTS % 250).all()
        assert block.seq.tolist() == list(range(600))
        assert block.t_ns[220] == 1_000_000_000
        assert not block.wrist.any()
    recording = Recording(path)
    assert recording.tool_version == ""
    assert recording.origin.units == "counts"


def test_attributes_of_others_are_kept(tmp_path):
    path = foreign(tmp_path / "a.h5", frames=COUNTS)
    with h5py.File(path, "a") as file:
        file.attrs.update({"sensor": np.bytes_(b"mat 3"), "piece": np.array([4]), "format": "own"})
    origin = Recording(path).origin
    assert origin.sensor == "mat 3"
    assert dict(origin.more) == {"piece": 4, "format": "own"}


def test_a_newer_format_is_refused(tmp_path):
    path = recorded(tmp_path / "touch.h5", 3)
    with h5py.File(path, "a") as file:
        file.attrs["format_version"] = 2
    refused(path, "its format is 2, this programme knows 1; install a newer version")


def test_a_user_block_does_not_matter(tmp_path):
    path = tmp_path / "touch.h5"
    with h5py.File(path, "w", userblock_size=1024) as file:
        file["frames"] = COUNTS
    assert len(Recording(path)) == 600
    assert superblock_of(path).whole


def test_a_file_that_may_not_be_read(tmp_path):
    path = recorded(tmp_path / "touch.h5", 3)
    path.chmod(0)
    if os.access(path, os.R_OK):  # root may read all
        assert len(Recording(path)) == 3
    else:
        refused(path, "Permission denied; choose a folder that you may read and write")


# --- truncated and damaged ------------------------------------------------------------


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9, 0.999])
def test_a_truncated_recording_gives_the_frames_that_are_there(tmp_path, share):
    path = recorded(tmp_path / "touch.h5")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    refused(path, rf"truncated: {int(share * len(whole))} of {len(whole)} bytes")
    result = repair(path)
    assert result.path == path
    assert result.frames + result.lost == 600
    assert result.frames >= share * 600 - 2 * 64
    block = Recording(path).block()
    assert len(block) == result.frames
    assert (block.counts == COUNTS[block.seq]).all()
    assert Recording(path).origin.more["frames_lost"] == result.lost
    kept = tmp_path / "touch.damaged.h5"
    assert kept.read_bytes() == whole[: int(share * len(whole))]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["touch.damaged.h5", "touch.h5"]


def test_a_recording_of_which_nothing_is_left(tmp_path):
    path = recorded(tmp_path / "touch.h5")
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(RecordingError, match=r"damaged|no frame in it can be read"):
        repair(path)
    assert [p.name for p in tmp_path.iterdir()] == ["touch.h5"]
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(RecordingError, match="damaged"):
        repair(path)


def test_a_damaged_block_costs_that_block(tmp_path):
    path = recorded(tmp_path / "touch.h5")
    with h5py.File(path) as file:
        chunk = file["frames"].id.get_chunk_info(4)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 0x10
    path.write_bytes(content)
    refused(path, "damaged: cannot read it")
    result = repair(path)
    assert (result.frames, result.lost) == (536, 64)
    block = Recording(path).block()
    assert (block.counts == COUNTS[block.seq]).all()
    assert repair(path) == type(result)(path, 536, 0, changed=False)


def test_datasets_of_different_lengths_are_cut(tmp_path):
    path = recorded(tmp_path / "touch.h5", 100)
    with h5py.File(path, "a") as file:
        file["seq"].resize(90, axis=0)
    refused(path, "different lengths; run `repair`")
    result = repair(path)
    assert (result.frames, result.lost, result.changed) == (90, 0, True)
    assert len(Recording(path)) == 90


def test_a_whole_recording_is_left_alone(tmp_path):
    path = recorded(tmp_path / "touch.h5", 100)
    before = (path.read_bytes(), path.stat().st_ino)
    assert not repair(path).changed
    assert (path.read_bytes(), path.stat().st_ino) == before


def test_others_files_stay_beside_the_repaired_one(tmp_path):
    path = foreign(tmp_path / "a.h5", frames=COUNTS, seq=np.arange(500), notes="keep me")
    assert repair(path).frames == 500
    with h5py.File(tmp_path / "a.damaged.h5") as file:
        assert file["notes"][()] == b"keep me"


def test_a_recording_that_is_written_is_not_repaired(tmp_path):
    with Recorder(tmp_path / "touch.h5") as recorder:
        recorder.append(frame_from(COUNTS[0], t_ns=0, seq=0))
        assert is_locked(tmp_path / "touch.part.h5")
        with pytest.raises(RecordingError, match="still being written; stop"):
            repair(tmp_path / "touch.h5")
    assert not is_locked(tmp_path / "touch.h5")


# --- tables -----------------------------------------------------------------------------


def test_a_table_has_a_row_a_frame(tmp_path):
    path = recorded(tmp_path / "touch.h5", 300)
    assert export_csv(path, tmp_path / "touch.csv") == 300
    with open(tmp_path / "touch.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0])[:4] == ["seq", "t_ns", "r0c0", "r0c1"]
    assert list(rows[0])[-1] == "wrist3"
    assert [int(row["seq"]) for row in rows] == list(range(300))
    assert int(rows[299]["r15c2"]) == COUNTS[299, 15, 2]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["touch.csv", "touch.h5"]


def test_a_table_with_poses_tells_them_exactly(tmp_path):
    pose = np.eye(4)
    pose[:3, 3] = 1 / 3, -1e-17, 400.1
    with Recorder(tmp_path / "touch.h5") as recorder:
        recorder.append(frame_from(COUNTS[0], t_ns=0, seq=0))
        recorder.append(frame_from(COUNTS[1], t_ns=1, seq=1, pose=pose))
    export_csv(tmp_path / "touch.h5", tmp_path / "touch.csv")
    with open(tmp_path / "touch.csv", newline="") as stream:
        first, second = csv.DictReader(stream)
    assert first["p00"] == first["p33"] == ""
    assert [float(second[f"p{i}3"]) for i in range(3)] == [1 / 3, -1e-17, 400.1]


def test_a_table_that_cannot_be_made_leaves_nothing(tmp_path):
    path = recorded(tmp_path / "touch.h5", 10)
    (tmp_path / "old.csv").write_text("old")
    with pytest.raises(RecordingError, match="make the folder first"):
        export_csv(path, tmp_path / "no" / "touch.csv")
    content = bytearray(path.read_bytes())
    with h5py.File(path) as file:
        at = file["frames"].id.get_chunk_info(0).byte_offset
    content[at + 100] ^= 1
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="damaged"):
        export_csv(path, tmp_path / "old.csv")
    assert (tmp_path / "old.csv").read_text() == "old"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["old.csv", "touch.h5"]
