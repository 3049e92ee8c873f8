"""Strings of a recording that a hurt file never ends."""

from __future__ import annotations

import numpy as np
import pytest

from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording.heap import strings_end
from probe.recording.read import read_frames
from probe.recording.record import Recorder
from probe.recording.repair import repair


@pytest.fixture
def recording(tmp_path):
    with Recorder(tmp_path / "touch.h5") as recorder:
        recorder.append(
            frame_from(np.zeros((16, 16), int), t_ns=0, seq=0, wrist=np.zeros(4, int), pose=None)
        )
    return recorder.files[0]


def test_what_was_recorded_has_an_end(recording):
    assert recording.read_bytes().count(b"GCOL") >= 1
    assert strings_end(recording)


@pytest.mark.parametrize("attempt", [lambda path: list(read_frames(path)), repair])
def test_strings_without_end_are_damage(recording, attempt):
    content = bytearray(recording.read_bytes())
    at = content.index(b"GCOL") + 16
    content[at : at + 512] = bytes(512)  # a sector that was lost
    recording.write_bytes(content)
    assert not strings_end(recording)
    with pytest.raises(RecordingError, match="it is damaged: cannot read it"):
        attempt(recording)


@pytest.mark.parametrize("length", range(0, 20, 4))
def test_free_space_counts_its_own_head(recording, length):
    content = bytearray(recording.read_bytes())
    at = content.index(b"GCOL") + 16
    content[at : at + 2] = bytes(2)
    content[at + 8 : at + 16] = length.to_bytes(8, "little")
    recording.write_bytes(content)
    assert strings_end(recording) == (length == 16)
