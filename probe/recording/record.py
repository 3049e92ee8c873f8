"""Frames -> a recording on the disk, whatever happens meanwhile.

Frames are appended to a journal (`touch.part.h5`) when 64 of them have gathered or `flush_s` of
device time has passed, whichever comes first; a process that is killed loses those since then.
When the recording is closed, the journal is turned into HDF5 and gets its name. Every
`roll_over_s` of device time another file begins, because a file that loses its end is lost
as a whole to most readers.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn, Self

from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.files import check_name, draft_of, explain_errors, final_name, part_of
from probe.recording.hdf5 import write_hdf5
from probe.recording.journal import JournalWriter, open_journal
from probe.recording.layout import CHUNK, FrameBlock, RecordingOrigin, block_of


class Recorder:
    """A recording that is being written; a context manager. Not for several threads.

    Parameters
    ----------
    path
        `touch.h5`. The file appears under this name when the recording is closed; one that
        rolled over becomes `touch-0001.h5`, `touch-0002.h5`, ... Until then the frames are
        in `touch.part.h5`, readable with `live`.
    sensor, sensor_type, calibration, units
        See `RecordingOrigin`; the type is None where nobody knows.
    attributes
        More to be said about the recording: names to texts or numbers.
    flush_s, roll_over_s
        Device time (s) that a crash may cost at most, and that goes into one file.
    replace
        Let the new recording take the place of an older one of the same name.

    Raises
    ------
    RecordingError
        The name is taken or no name for a recording, or the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from probe.frame import frame_from
    >>> path = Path(tempfile.mkdtemp()) / "touch.h5"
    >>> with Recorder(path, sensor="bench 1") as recorder:
    ...     recorder.append(frame_from(np.zeros((16, 16)), t_ns=0, seq=0))
    >>> [file.name for file in recorder.files]
    ['touch.h5']
    """

    def __init__(
        self,
        path: Path | str,
        *,
        sensor: str = "",
        sensor_type: SensorType | None = None,
        calibration: str = "",
        units: str = "counts",
        attributes: Mapping[str, Any] | None = None,
        flush_s: float = 1.0,
        roll_over_s: float = 300.0,
        replace: bool = False,
    ) -> None:
        self.path = Path(path)
        self.files: list[Path] = []  #: closed files, in order
        self.frames = 0  #: handed in so far
        self._origin = RecordingOrigin(
            sensor,
            calibration,
            units,
            "" if sensor_type is None else sensor_type_text(sensor_type),
            MappingProxyType(dict(attributes or {})),
        )
        self._shape = None if sensor_type is None else sensor_type.shape
        self._flush_ns = flush_s * 1e9
        self._roll_over_ns = roll_over_s * 1e9
        self._replace = replace
        self._waiting: list[Frame] = []
        self._piece_began_ns: int | None = None
        check_name(self.path, replace=replace)
        self._journal: JournalWriter | None = self._next_journal()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def append(self, frame: Frame) -> None:
        """Take a frame.

        Raises RecordingError: the recording is closed, the frame is of another shape than those
        before, or the disk is full; then it has been closed with all frames so far, this one
        included.
        """
        self._open_journal()
        rows, columns = frame.counts.shape
        self._shape = self._shape or (rows, columns)
        if frame.counts.shape != self._shape:
            raise RecordingError(
                f"a frame of {rows} x {columns} readings in a recording of {self._shape[0]} x "
                f"{self._shape[1]}",
                fix="give the --sensor-type of the sensor, one recording for each",
                place=self.path,
            )
        if self._piece_began_ns is None:
            self._piece_began_ns = frame.t_ns
        elif not 0 <= frame.t_ns - self._piece_began_ns < self._roll_over_ns:
            self.flush()
            if frame.t_ns > self._piece_began_ns:  # or else the clock of the probe restarted
                self._finish(last=False)
                self._journal = self._next_journal()
            self._piece_began_ns = frame.t_ns
        self._waiting.append(frame)
        self.frames += 1
        if len(self._waiting) >= CHUNK or frame.t_ns - self._waiting[0].t_ns >= self._flush_ns:
            self.flush()

    def flush(self) -> None:
        """Bring every frame so far to the disk; worth calling when frames stop coming."""
        journal = self._open_journal()
        if not self._waiting:
            return
        block, self._waiting = block_of(self._waiting), []
        before = journal.frames
        try:
            journal.append(block)
        except RecordingError as error:
            self.frames -= before + len(block) - journal.frames
            self._give_up(error)

    def close(self) -> None:
        """Bring every frame to the disk and give the file its name; may be called twice."""
        if self._journal is None:
            return
        self.flush()
        self._finish(last=True)

    def _open_journal(self) -> JournalWriter:
        if self._journal is None:
            raise RecordingError(
                "the recording is closed", fix="begin another one", place=self.path
            )
        return self._journal

    def _next_journal(self) -> JournalWriter:
        return JournalWriter(part_of(self.path), self._origin, len(self.files) + 1)

    def _finish(self, *, last: bool) -> None:
        """Turn the journal into HDF5, and give the file its name; the journal stays if it fails."""
        journal = self._open_journal()
        self._journal = None
        part, draft, number = journal.path, draft_of(self.path), len(self.files) + 1
        self.files.append(part)
        try:
            with ExitStack() as stack:
                blocks: Iterator[FrameBlock] = iter(())
                if journal.frames:
                    blocks = stack.enter_context(open_journal(part, live=True)).blocks()
                write_hdf5(draft, self._origin, blocks, part, number)
            with explain_errors(part, "replace"):
                os.replace(draft, part)
        except RecordingError as error:
            fix = f"{error.fix}, then run `repair` on {part.name}"
            raise RecordingError(
                error.cause, fix=fix, place=part, exit_code=error.exit_code
            ) from error
        finally:
            journal.close()
        self.files[-1] = final_name(part, self.path, number, last=last, replace=self._replace)

    def _give_up(self, error: RecordingError) -> NoReturn:
        """Close the recording with the frames that are safe, and say so."""
        fix = error.fix
        try:
            self._finish(last=True)
        except RecordingError as unfinished:
            fix = unfinished.fix
        raise RecordingError(
            f"{error.cause}; the recording ends after {self.frames} frames",
            fix=fix,
            place=str(self.files[-1]),
            exit_code=error.exit_code,
        ) from error
