"""A recording whose writer is killed, whose disk is full, and one that is read meanwhile."""

import subprocess
import sys

import numpy as np
import pytest

from probe.errors import RecordingError
from probe.recording.read import Recording
from probe.recording.record import Recorder
from probe.recording.repair import repair

# Frame i is made from i alone. After every frame the writer says how many it has handed in,
# so that what is on the pipe when it dies is what may be expected on the disk.
WRITER = """
import os, resource, sys
import numpy as np
from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.record import Recorder

path, count, limit = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
roll_over_s = float(sys.argv[4])
wrist = np.zeros(4, np.uint16)
if limit:
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
try:
    with Recorder(path, roll_over_s=roll_over_s) as recorder:
        for i in range(count):
            counts = np.random.default_rng(i).integers(0, 1024, (16, 16)).astype(np.uint16)
            recorder.append(Frame(counts, i * 4_545_454, i, wrist))
            os.write(1, b".")
except RecordingError as error:
    print("\\n" + str(error), error.exit_code)
"""


def writer(path, count, *, limit=0, roll_over_s=300.0):
    arguments = [str(path), str(count), str(limit), str(roll_over_s)]
    pipes = dict.fromkeys(("stdout", "stderr"), subprocess.PIPE)
    return subprocess.Popen([sys.executable, "-c", WRITER, *arguments], **pipes)


def check(frames, least):
    """Check that these are the first frames of the writer, at least so many."""
    count = 0
    for i, frame in enumerate(frames):
        assert (frame.seq, frame.t_ns) == (i, i * 4_545_454)
        assert (frame.counts == np.random.default_rng(i).integers(0, 1024, (16, 16))).all()
        count += 1
    assert count >= least
    return count


@pytest.mark.parametrize("moment", [137, 611])
def test_a_killed_writer_loses_the_frames_since_the_last_flush_at_most(tmp_path, moment):
    path = tmp_path / "touch.h5"
    handed = 0
    with writer(path, 1_000_000, roll_over_s=1.4) as process:
        while handed < moment:
            handed += len(process.stdout.read(1))
        process.kill()
        handed += len(process.stdout.read())
    with pytest.raises(RecordingError, match="interrupted stands there; run `repair`"):
        Recorder(path, replace=True)
    left = check(Recording(path).frames(), handed - 64)
    assert check(Recording(path, live=True).frames(), 0) == left
    result = repair(path)
    assert not (tmp_path / "touch.part.h5").exists()
    assert result.lost == 0
    assert check(Recording(path).frames(), handed - 64) == left


def test_a_full_disk_ends_the_recording_with_all_its_frames(tmp_path):
    path = tmp_path / "touch.h5"
    process = writer(path, 1_000_000, limit=2_500_000)
    output, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, b"")
    said = output.decode().split("\n")
    handed = len(said[0])
    recording = Recording(path)
    assert f"File too large; the recording ends after {len(recording)} frames" in said[1]
    assert said[1].endswith(" 1")
    assert len(recording) == handed + 1  # the last one is on the disk, and then it was refused
    check(recording.frames(), handed + 1)
