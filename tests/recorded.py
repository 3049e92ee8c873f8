"""Frames and recordings for tests."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from probe.frame import Frame, frame_from
from probe.recording.record import Recorder

HZ = 220


def pose_at(x: float) -> np.ndarray:
    """Return a pose (4, 4) at x, mm."""
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def frames(
    count: int, *, first: int = 0, pose: np.ndarray | None = None, shape: tuple[int, int] = (16, 16)
) -> list[Frame]:
    """Return frames from number `first` on, 220 a second, each made from its number alone."""
    made = []
    for i in range(first, first + count):
        rng = np.random.default_rng(i)
        counts, wrist = rng.integers(0, 1024, shape), rng.integers(0, 1024, 4)
        made.append(frame_from(counts, t_ns=i * 10**9 // HZ, seq=i, wrist=wrist, pose=pose))
    return made


def record(path: Path, given: Iterable[Frame], **options: object) -> Recorder:
    """Record frames, and return the closed recorder."""
    with Recorder(path, **options) as recorder:
        for frame in given:
            recorder.append(frame)
    return recorder


def same(a: Frame, b: Frame) -> bool:
    """Tell whether two frames are alike in all that they hold."""
    poses = (a.pose is None) == (b.pose is None) and (a.pose is None or (a.pose == b.pose).all())
    numbers = (a.t_ns, a.seq) == (b.t_ns, b.seq)
    return bool(numbers and poses and (a.counts == b.counts).all() and (a.wrist == b.wrist).all())
