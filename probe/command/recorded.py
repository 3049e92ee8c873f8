"""Record a probe: frames to the file, counts to the bar, what happens to stderr."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Event
from typing import Any

from encoded_objects.base.console import INTERRUPTED, interruption
from encoded_objects.base.errors import EncodedObjectsError
from encoded_objects.base.output import (
    ProgressBar,
    count_of,
    message,
    progress_bar,
    write,
    write_json,
)
from encoded_objects.base.sensor_type import choose_sensor_type
from probe.calibration import Calibration, calibration_hash, read_calibration
from probe.client.stream import Stream, name_of
from probe.command.settings import COMMAND
from probe.errors import PortError, RecordingError
from probe.frame import Frame
from probe.port.typed import typed_port
from probe.recording.files import check_name
from probe.recording.record import Recorder


@dataclass(frozen=True, slots=True)
class RecordingLimits:
    """When a recording ends by itself."""

    seconds: float | None = None  #: s, device time
    frames: int | None = None

    @property
    def total(self) -> float | None:
        """What the bar runs to: frames, or else seconds."""
        return self.frames if self.frames is not None else self.seconds

    def left(self, frames: int) -> int | None:
        """Return how many frames may still come; None: any number."""
        return None if self.frames is None else self.frames - frames


def record_port(
    url: str,
    output: Path,
    limits: RecordingLimits,
    *,
    sensor: int | None,
    bits: int | None,
    sensor_type: str,
    calibration: Path | None,
    replace: bool,
    as_json: bool,
) -> int:
    """Record a port; returns the exit code.

    Raises
    ------
    PortError
        When the probe is not there, or went away for good; then the file holds what came.
    RecordingError
        When the file cannot be written.
    CalibrationError
        When the calibration is none, or another sensor's.
    SensorTypeError
        No such type, or frames of another shape.
    """
    check_output(output, replace=replace)
    known = None if calibration is None else read_calibration(calibration)
    port, kind = typed_port(url, sensor_type)
    with interruption() as interrupted, Stream(port, sensor=sensor, bits=bits) as stream:
        first = _first(stream, interrupted)
        if not first:
            if interrupted.is_set():
                message("\nprobe-sensor: interrupted; nothing was recorded")
                return INTERRUPTED
            raise PortError("it ended before a frame came", fix="see whether it holds frames",
                            place=url)  # fmt: skip
        rows, columns = first[0].counts.shape
        kind = choose_sensor_type(kind, "", (rows, columns), url)
        name = _sensor(stream, url, known, calibration)
        recorder = Recorder(
            output, sensor=name, sensor_type=kind,
            calibration=calibration_hash(known) if known else "",
            attributes={"url": url}, replace=replace,
        )  # fmt: skip
        try:
            with recorder, progress_bar("recording", limits.total) as told:
                ended, seconds = _run(stream, recorder, first, limits, interrupted, told)
        except EncodedObjectsError:
            files = ", ".join(map(str, recorder.files))
            kept = count_of(recorder.frames, "frame")
            message(f"{files} is complete and holds {kept}")
            raise
        result = _result(stream, recorder, name, ended, seconds)
    _say(result, as_json)
    limited = limits.total is not None
    return INTERRUPTED if ended == "interrupted" and limited else 0


def check_output(output: Path, *, replace: bool) -> None:
    """Refuse a name for a recording before anything else is done.

    Raises
    ------
    RecordingError
        When it is no name for one, or is taken.
    """
    try:
        check_name(output, replace=replace)
    except RecordingError as error:
        if not replace and output.suffix in (".h5", ".hdf5"):
            fix = f"{error.fix}, or replace it with --replace"
            raise RecordingError(error.cause, fix=fix, place=error.place) from error
        raise


def _first(stream: Stream, interrupted: Event) -> list[Frame]:
    frames: list[Frame] = []
    while not frames and not stream.ended and not interrupted.is_set():
        frames = stream.take(COMMAND.slice_s)
    return frames


def _sensor(stream: Stream, url: str, known: Calibration | None, calibration: Path | None) -> str:
    """Return the sensor's name; refuse a calibration of another one."""
    name = name_of(stream.ident(), url)
    if known is not None and calibration is not None and name and known.sensor != name:
        read_calibration(calibration, sensor=name)
    return name


def _run(
    stream: Stream,
    recorder: Recorder,
    frames: list[Frame],
    limits: RecordingLimits,
    interrupted: Event,
    told: ProgressBar,
) -> tuple[str, float]:
    """Record until something ends it; returns what did, and the seconds recorded."""
    began_s = heard_s = time.monotonic()
    began_ns = last_ns = frames[0].t_ns
    ended = ""
    while not ended:
        for frame in frames[: limits.left(recorder.frames)]:
            if limits.seconds is not None and frame.t_ns - began_ns >= limits.seconds * 1e9:
                ended = "seconds"
                break
            recorder.append(frame)
            last_ns = frame.t_ns
        seconds = (last_ns - began_ns) * 1e-9
        _tell(stream, told, recorder.frames, seconds if limits.frames is None else None)
        now_s = time.monotonic()
        heard_s = now_s if frames else heard_s
        silent = limits.seconds is not None and now_s - heard_s > COMMAND.silent_s
        if limits.left(recorder.frames) == 0:
            ended = "frames"
        elif interrupted.is_set():
            ended = "interrupted"
        elif stream.ended:
            ended = "end"
        elif silent and now_s - began_s > (limits.seconds or 0.0):
            ended = "silence"
        elif not ended:
            if not frames:
                recorder.flush()
            frames = stream.take(COMMAND.slice_s)
    return ended, seconds


def _tell(stream: Stream, told: ProgressBar, frames: int, seconds: float | None) -> None:
    """Show counts and notices; the bar runs by seconds, or by frames if None."""
    for notice in stream.client.notices():
        told.say(notice)
    counts = stream.client.statistics()
    text = f"{frames:,} frames  {counts.rate:5.1f}/s  lost {counts.lost}  failed {counts.failed}"
    told.show(frames if seconds is None else seconds, text)


def _result(
    stream: Stream, recorder: Recorder, name: str, ended: str, seconds: float
) -> dict[str, Any]:
    counts = asdict(stream.client.statistics())
    del counts["frames"], counts["rate"]
    return {
        "files": [str(file) for file in recorder.files],
        "frames": recorder.frames,
        "seconds": seconds,
        "rate": (recorder.frames - 1) / seconds if seconds > 0 else 0.0,
        "sensor": name,
        "ended": ended,
        **counts,
    }


def _say(result: dict[str, Any], as_json: bool) -> None:
    if as_json:
        write_json(result)
        return
    files = ", ".join(result["files"])
    trouble = ", ".join(
        f"{name} {result[name]}"
        for name in ("failed", "doubtful", "reboots", "reopenings", "overruns")
        if result[name]
    )
    write(
        f"{files}: {count_of(result['frames'], 'frame')} in {result['seconds']:.2f} s "
        f"({result['rate']:.1f} a second), lost {result['lost']}"
        + (f", {trouble}" if trouble else "")
    )
