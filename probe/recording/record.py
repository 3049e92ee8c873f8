"""Frames -> a recording on the disk, whatever happens meanwhile.

Frames are handed to the disk when 64 of them have gathered or `flush_s` of device time has
passed, whichever comes first; a process that is killed loses those since then. Every
`roll_over_s` of device time another file begins, because a file that loses its end is lost
as a whole to most readers.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NoReturn

import numpy as np

from encoded_objects.base.sensor_type import SensorType, sensor_type_text
from probe.closing import Closing
from probe.errors import RecordingError
from probe.frame import Frame
from probe.recording.layout import CHUNK, FrameBlock, RecordingOrigin
from probe.recording.names import check_name, final_name, part_of
from probe.recording.write import FileWriter

_NO_POSE: Final = np.full((4, 4), np.nan)


class Recorder(Closing):
    """A recording that is being written; a context manager. Not for several threads.

    Parameters
    ----------
    path
        `touch.h5`. The file appears under this name when the recording is closed; one that
        rolled over becomes `touch-0001.h5`, `touch-0002.h5`, ... Until then the frames are
        in `touch.part.h5`, readable with `live`.
    sensor
        Ident of the probe.
    sensor_type
        Of the frames; None where nobody knows.
    calibration
        Hash of the calibration that belongs to the sensor; empty if there is none.
    units
        What the numbers are.
    attributes
        More to be said about the recording: names to texts or numbers.
    flush_s
        Device time (s) that a crash may cost, at most.
    roll_over_s
        Device time (s) in one file.
    replace
        Let the new recording take the place of an older one of the same name.

    Raises
    ------
    RecordingError
        The name is taken or no name for a recording, or the folder cannot be written.

    Examples
    --------
    >>> import tempfile
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
        self._writer: FileWriter | None = self._next_writer()

    def append(self, frame: Frame) -> None:
        """Take a frame.

        Raises
        ------
        RecordingError
            The recording is closed, the frame is of another shape than those before, or the
            disk is full; then it has been closed with all frames so far, this one included.
        """
        self._open_writer()
        self._check_shape(frame)
        if self._piece_began_ns is None:
            self._piece_began_ns = frame.t_ns
        elif not 0 <= frame.t_ns - self._piece_began_ns < self._roll_over_ns:
            self.flush()
            if frame.t_ns > self._piece_began_ns:  # or else the clock of the probe began anew
                self._roll_over()
            self._piece_began_ns = frame.t_ns
        self._waiting.append(frame)
        self.frames += 1
        if len(self._waiting) >= CHUNK or frame.t_ns - self._waiting[0].t_ns >= self._flush_ns:
            self.flush()

    def flush(self) -> None:
        """Bring every frame so far to the disk; worth calling when frames stop coming."""
        writer = self._open_writer()
        if not self._waiting:
            return
        block, self._waiting = block_of(self._waiting), []
        if block.pose is not None and writer.frames and not writer.poses:
            writer = self._roll_over()  # this file has no place for poses
        before = writer.frames
        try:
            writer.write(block)
        except RecordingError as error:
            self.frames -= before + len(block) - writer.frames
            self._give_up(error)

    def close(self) -> None:
        """Bring every frame to the disk and give the file its name; may be called twice."""
        if self._writer is None:
            return
        self.flush()
        self._finish(last=True)

    def _check_shape(self, frame: Frame) -> None:
        """Refuse a frame that is not of the shape of the sensor type, or of the frames before."""
        rows, columns = frame.counts.shape
        self._shape = self._shape or (rows, columns)
        if frame.counts.shape != self._shape:
            raise RecordingError(
                f"a frame of {rows} x {columns} readings in a recording of {self._shape[0]} x "
                f"{self._shape[1]}",
                fix="give the --sensor-type of the sensor, one recording for each",
                place=str(self.path),
            )

    def _open_writer(self) -> FileWriter:
        if self._writer is None:
            raise RecordingError(
                "the recording is closed", fix="begin another one", place=str(self.path)
            )
        return self._writer

    def _next_writer(self) -> FileWriter:
        return FileWriter(part_of(self.path), self._origin, len(self.files) + 1)

    def _roll_over(self) -> FileWriter:
        self._finish(last=False)
        self._writer = self._next_writer()
        return self._writer

    def _finish(self, *, last: bool) -> None:
        """Close the file at hand, and give it its name."""
        writer = self._open_writer()
        self._writer = None
        writer.close()
        self.files.append(
            final_name(writer.path, self.path, self.files, last=last, replace=self._replace)
        )

    def _give_up(self, error: RecordingError) -> NoReturn:
        """Close the recording with what is safe, and say so."""
        self._finish(last=True)
        raise RecordingError(
            f"{error.cause}; the recording ends after {self.frames} frames",
            fix=error.fix,
            place=str(self.files[-1]),
        ) from error


def block_of(frames: list[Frame], *, poses: bool = False) -> FrameBlock:
    """Return frames as a block; with a place for poses if any has one, or if asked for."""
    pose = None
    if poses or any(frame.pose is not None for frame in frames):
        pose = np.stack([_NO_POSE if frame.pose is None else frame.pose for frame in frames])
    return FrameBlock(
        np.stack([frame.counts for frame in frames]),
        np.array([frame.t_ns for frame in frames], np.int64),
        np.array([frame.seq for frame in frames], np.int64),
        np.stack([frame.wrist for frame in frames]),
        pose,
    )
