"""Numbers that decide how a recording is kept safe."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RecordingSettings:
    """What a writer holds ready, so that a full disk loses nothing."""

    spare: int = 512 * 1024  #: bytes for the next small block, HDF5's own tables, and closing
    step: int = 1024 * 1024  #: bytes that are reserved at a time


RECORDING = RecordingSettings()
