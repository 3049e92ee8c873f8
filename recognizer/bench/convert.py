"""A recording that a page sent in -> a recording of our own writing, by a process of its own.

What a stranger wrote is opened by the HDF5 library there alone, with limits of memory, time, room
and open files; the server opens the copy. Prints `{"frames": N}`, or the error, as JSON::

    python -m recognizer.bench.convert SENT COPY
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.foreign import run_limited
from probe.errors import RecordingError
from probe.recording.hdf5 import write_hdf5
from probe.recording.read import Recording
from recognizer.bench.errors import BenchError, BusyError
from recognizer.bench.feed import playable_blocks

_MEMORY: Final = 3 << 29  #: bytes of address space; libraries take .1 GB, a block .1 GB a copy
_LEAST_S: Final = 20.0  #: of processor time, 1 s of it to start
_SECONDS_MB: Final = 60.0  #: more by the file's size: 2,000,000 packed images take 5 MB and 100 s
_MOST_S: Final = 300.0


def convert_recording(
    sent: Path, copy: Path, name: str, *, room: int, ending: Callable[[], bool]
) -> int:
    """Write a copy of a recording that was sent in as `name`; returns its frames.

    The copy takes at most `room` bytes.

    Raises RecordingError, BenchError: it is none, or too long to be played; it takes more memory,
    time or room than it may; BusyError: `ending` says that the server ends.
    """
    seconds = min(_MOST_S, _LEAST_S + _SECONDS_MB * sent.stat().st_size / 1e6)
    try:
        code, printed = run_limited(
            __name__, [str(sent), str(copy)],
            memory_bytes=_MEMORY, cpu_s=seconds, written_bytes=room, ending=ending,
        )  # fmt: skip
    except TimeoutError:
        code, printed = 1, b""
    if ending():
        raise BusyError("open-bench ends", fix="start it again")
    if code or not printed:
        raise RecordingError(
            "it takes more memory or time than a recording may, or it is damaged",
            fix="read it with recognize-object, or save it again in smaller pieces",
            place=name,
        )
    found = json.loads(printed)
    if "cause" in found:
        kind = BenchError if found["kind"] == BenchError.__name__ else RecordingError
        raise kind(found["cause"], fix=found["fix"], place=name)
    return int(found["frames"])


def main(sent: str, copy: str) -> None:
    """Copy a recording frame by frame, and say how many there were, or what is wrong."""
    try:
        recording = Recording(sent)
        write_hdf5(
            Path(copy), recording.origin, playable_blocks(recording, lambda: False), Path(copy)
        )
        said = {"frames": len(recording)}
    except EncodedObjectsError as error:
        said = error.as_json()
    json.dump(said, sys.stdout)


if __name__ == "__main__":
    main(*sys.argv[1:])
