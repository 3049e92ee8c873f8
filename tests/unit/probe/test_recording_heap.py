"""Strings of a recording that a hurt file never ends."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording.guard import strings_end
from probe.recording.read import Recording, read_frames
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


def test_strings_behind_the_images_are_looked_at_too(tmp_path):
    with h5py.File(tmp_path / "touch.h5", "w") as file:
        file["frames"] = np.zeros((8000, 16, 16), np.uint16)
        file.attrs["sensor"] = "mat 3"
    content = bytearray((tmp_path / "touch.h5").read_bytes())
    at = content.index(b"GCOL")
    assert at > 4_000_000
    content[at + 16 : at + 528] = bytes(512)
    (tmp_path / "touch.h5").write_bytes(content)
    with pytest.raises(RecordingError, match="it is damaged: cannot read it"):
        Recording(tmp_path / "touch.h5")


def test_collections_in_one_another_are_damage(tmp_path):
    head = b"GCOL\x01\0\0\0" + (1 << 20).to_bytes(8, "little")
    (tmp_path / "touch.h5").write_bytes(head * (1 << 16))
    assert not strings_end(tmp_path / "touch.h5")  # which would be looked at 65,536 times


@pytest.mark.parametrize("length", range(0, 20, 4))
def test_free_space_counts_its_own_head(recording, length):
    content = bytearray(recording.read_bytes())
    at = content.index(b"GCOL") + 16
    content[at : at + 2] = bytes(2)
    content[at + 8 : at + 16] = length.to_bytes(8, "little")
    recording.write_bytes(content)
    assert strings_end(recording) == (length == 16)
