"""Whatever is recorded is read again; what happens to files: `test_foreign.py`."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import record, same

from probe.frame import Frame, frame_from
from probe.recording.read import Recording


def stream(seed: int, count: int, gaps: float, poses: float) -> list[Frame]:
    rng = np.random.default_rng(seed)
    t, seq, frames = 0, 0, []
    for _ in range(count):
        t += int(rng.integers(0, 10**8))
        seq += 1 + int(rng.geometric(0.5)) * bool(rng.random() < gaps)
        pose = np.eye(4)
        pose[:3, 3] = rng.normal(0, 400, 3)
        frames.append(
            frame_from(rng.integers(0, 65536, (16, 16)) * (rng.random((16, 16)) < 0.1),
                       t_ns=t, seq=seq, wrist=rng.integers(0, 65536, 4),
                       pose=pose if rng.random() < poses else None)
        )  # fmt: skip
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
