"""`probe-sensor calibrate bias | loads`: recordings of loads -> the laws of a sensor."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.console import FAILED, interruption
from encoded_objects.base.files import refuse_taken
from encoded_objects.base.output import message, pairs, warning, write, write_json
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.calibration import (
    calibration_from,
    calibration_hash,
    drift_of,
    even_load,
    read_calibration,
    write_calibration,
)
from probe.calibration.condition import common_bias, raised_tactels
from probe.calibration.load import average_frames
from probe.circuit import Electronics
from probe.client.stream import Stream, name_of
from probe.command.laws import condition_map, describe_laws, places
from probe.command.loads import LoadRecording
from probe.errors import CalibrationError, CircuitError, PortError
from probe.port.url import means_port, typed_port
from probe.recording.layout import FrameBlock
from probe.recording.read import Recording

Counts = NDArray[np.uint16]


@dataclass(frozen=True, slots=True)
class LawOptions:
    """How laws are fitted, and where they go."""

    output: Path
    board: Electronics | None
    sensor_type: str = ""
    made: str = ""  #: ISO 8601; empty: now
    replace: bool = False
    as_json: bool = False


def report_bias(
    source: str,
    sensor: int | None,
    seconds: float,
    calibration: Path | None,
    sensor_type: str,
    *,
    as_json: bool,
) -> int:
    """Print the readings of an unloaded sensor; returns the exit code.

    Raises
    ------
    PortError, RecordingError
        The source is not there, or gives no frame.
    SensorTypeError
        No such type, or one of another shape.
    """
    counts, name, kind = _frames_of(source, sensor, seconds, sensor_type)
    rest = average_frames(counts, source)
    high = raised_tactels(rest, kind.full)
    values: dict[str, Any] = {
        "source": source,
        "sensor": name,
        "frames": rest.frames,
        "bias_counts": common_bias(rest),
        "noise_counts": float(np.median(rest.noise)),
        "raised": np.argwhere(high),
    }
    lines = {
        "sensor": name or "not named",
        "bias": f"{values['bias_counts']:.2f} counts, median of {rest.mean.size} tactels",
        "noise": f"{values['noise_counts']:.2f} counts a frame",
        "raised": places(high) or "none",
    }
    trouble = ""
    if calibration is not None:
        known = read_calibration(calibration, sensor=name or None)
        drift = drift_of(known, counts)
        shift = float(np.abs(drift.bias_counts[~known.bad]).max(initial=0.0))
        trouble = drift.warning
        values |= {"calibration": calibration_hash(known), "shift_counts": shift,
                   "warning": trouble}  # fmt: skip
        lines["shift"] = f"{shift:.2f} counts at most since {known.made or 'the calibration'}"
    if as_json:
        write_json(values)
    else:
        pairs(lines)
        if trouble:
            warning(trouble)
    return FAILED if trouble else 0


def calibrate_loads(given: list[LoadRecording], options: LawOptions, sensor: str = "") -> int:
    """Calibrate from recordings and write the file; returns the exit code.

    Raises
    ------
    CalibrationError
        Loads are missing or of different sensors; the message names the load to add.
    RecordingError
        A recording cannot be read.
    """
    output, board, made = options.output, options.board, options.made
    refuse_taken(output, ".json", replace=options.replace)
    rest = [load for load in given if load.newtons == 0]
    if not rest:
        raise CalibrationError("none of the recordings is of the unloaded sensor",
                               fix="add one with 0 N: rest.h5=0")  # fmt: skip
    name = sensor or _one_sensor(given)
    counts = np.concatenate([_counts(load) for load in rest])
    kind = Recording(rest[0].recording).sensor_type(options.sensor_type)
    even = kind.present().astype(np.float64) if kind.missing else None
    loads = [
        even_load(
            _counts(load),
            load.newtons,
            even if load.footprint is None else load.footprint,
            f"{load.newtons:g} N",
        )
        for load in given
        if load.newtons > 0
    ]
    when = made or datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    found = calibration_from(counts, loads, sensor=name, made=when, board=board, full=kind.full)
    digest = write_calibration(found, output)
    values, lines = describe_laws(found, digest, str(output))
    if options.as_json:
        write_json(values)
    else:
        pairs(lines)
        if found.bad.any():
            write("\n" + condition_map(found))
    return 0


def board_from(text: str) -> Electronics | None:
    """Read a board from the command line.

    Raises
    ------
    CircuitError
        When a name is unknown, or a value is none.
    """
    if text in ("", "none"):
        return None
    if text == "simulated":
        return Electronics()
    known = {item.name: item.type for item in fields(Electronics) if item.name != "noise"}
    values: dict[str, Any] = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        if name not in known:
            raise CircuitError(f"a board has no '{name}'", fix=f"it has {', '.join(known)}",
                               place="--board")  # fmt: skip
        try:
            values[name] = value if name == "readout" else int(value) if name == "bits" \
                else float(value)  # fmt: skip
        except ValueError:
            raise CircuitError(f"{name}={value!r} is no number", fix=f"write {name}=NUMBER",
                               place="--board") from None  # fmt: skip
    return Electronics(**values)


def _one_sensor(given: list[LoadRecording]) -> str:
    names = {Recording(load.recording).origin.sensor for load in given}
    if len(names) != 1 or "" in names:
        shown = ", ".join(sorted(name or "not named" for name in names))
        raise CalibrationError(
            f"the recordings are of these sensors: {shown}",
            fix="calibrate one sensor at a time, or name it with --sensor",
        )
    return names.pop()


def _counts(load: LoadRecording) -> Counts:
    return Recording(load.recording).block().counts


def _frames_of(
    source: str, sensor: int | None, seconds: float, sensor_type: str
) -> tuple[Counts, str, SensorType]:
    """Return counts (N, rows, columns) of a port or a recording, and its sensor: name and type."""
    if not means_port(source):
        recording = Recording(source)
        return recording.block().counts, recording.origin.sensor, recording.sensor_type(sensor_type)

    port, kind = typed_port(source, sensor_type)
    with interruption() as interrupted, Stream(port, sensor=sensor) as stream:
        counts = _listen(stream, seconds)
        if interrupted.is_set():
            raise KeyboardInterrupt
        if not len(counts):
            raise PortError("no frame came", fix="see probe-sensor info", place=source)
        kind = choose_sensor_type(kind, "", counts.shape[1:], source)
        return counts, name_of(stream.ident(), source), kind


def _listen(stream: Stream, seconds: float) -> Counts:
    """Return the counts of the next seconds of a probe (device time), (N, rows, columns)."""
    images: list[Counts] = []
    began_ns: int | None = None
    while not stream.ended:
        frames = stream.take(1.0)
        for notice in stream.client.notices():
            message(notice)
        for frame in frames:
            began_ns = frame.t_ns if began_ns is None else began_ns
            if frame.t_ns - began_ns > seconds * 1e9:
                return np.stack(images)
            images.append(frame.counts)
    return np.stack(images) if images else FrameBlock.empty().counts
