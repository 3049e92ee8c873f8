"""Whatever is recorded is read again; whatever happens to a file, nothing else is read."""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import record, same

from probe.errors import RecordingError
from probe.frame import Frame, frame_from
from probe.recording.read import Recording
from probe.recording.repair import repair


def stream(seed: int, count: int, gaps: float, poses: float) -> list[Frame]:
    rng = np.random.default_rng(seed)
    t, seq, frames = 0, 0, []
    for _ in range(count):
        t += int(rng.integers(0, 10**8))
        seq += 1 + int(rng.geometric(0.5)) * bool(rng.random() < gaps)
        pose = np.eye(4)
        pose[:3, 3] = rng.normal(0, 400, 3)
        frames.append(
            frame_from(
                rng.integers(0, 65536, (16, 16)) * (rng.random((16, 16)) < 0.1),
                t_ns=t,
                seq=seq,
                wrist=rng.integers(0, 65536, 4),
                pose=pose if rng.random() < poses else None,
            )
        )
    return frames


@settings(deadline=None, max_examples=15)
@given(
    seed=st.integers(0, 2**32),
    count=st.integers(0, 300),
    poses=st.sampled_from([0.0, 0.01, 0.5, 1.0]),
    flush_s=st.sampled_from([0.0, 0.2, 1e9]),
    roll_over_s=st.sampled_from([2.0, 9.0, 1e9]),
    start=st.integers(0, 320),
    length=st.integers(0, 320),
)
def test_any_stream_is_read_as_it_was(seed, count, poses, flush_s, roll_over_s, start, length):
    frames = stream(seed, count, 0.1, poses)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "touch.h5"
        record(path, frames, flush_s=flush_s, roll_over_s=roll_over_s)
        recording = Recording(path)
        assert len(recording) == count
        assert all(map(same, recording.frames(), frames))
        part = list(recording.frames(start, start + length))
        assert len(part) == len(frames[start : start + length])
        assert all(map(same, part, frames[start : start + length]))
        assert len(recording.block(start, start + length)) == len(part)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32), kind=st.sampled_from(["flip", "zero", "cut", "insert"]))
def test_a_hurt_file_is_refused_or_gives_frames_that_were_recorded(seed, kind):
    frames, whole = recorded()
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "touch.h5"
        content = bytearray(whole)
        at = int(rng.integers(0, len(content)))
        if kind == "flip":
            content[at] ^= 1 << int(rng.integers(8))
        elif kind == "zero":
            content[at : at + 512] = bytes(len(content[at : at + 512]))
        elif kind == "cut":
            del content[at:]
        else:
            content[at:at] = rng.bytes(64)
        path.write_bytes(content)
        by_seq = {frame.seq: frame for frame in frames}
        for attempt in (lambda path: Recording(path).frames(), repaired):
            try:
                read = list(attempt(path))
            except RecordingError:
                continue
            assert all(same(frame, by_seq[frame.seq]) for frame in read)


@cache
def recorded() -> tuple[list[Frame], bytes]:
    """Return frames, and the file that holds them."""
    frames = stream(1, 200, 0.1, 0.5)
    with tempfile.TemporaryDirectory() as folder:
        return frames, record(Path(folder) / "touch.h5", frames).files[0].read_bytes()


def repaired(path: Path):
    return Recording(repair(path).path).frames()
