"""Calibrate from recordings, and say what came out: laws, unsound tactels, uncertainty."""

from __future__ import annotations

import datetime
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.console import FAILED
from encoded_objects.base.files import refuse_taken
from encoded_objects.base.output import pairs, warning, write, write_json
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
from probe.command.laws import condition_map, describe_laws, places
from probe.command.listen import Counts, frames_of
from probe.command.loads import LoadRecording
from probe.errors import CalibrationError, CircuitError
from probe.recording.read import Recording


def report_bias(
    source: str,
    sensor: int | None,
    seconds: float,
    calibration: Path | None,
    *,
    sensor_type: str = "",
    as_json: bool,
) -> int:
    """Say what an unloaded sensor reads; returns the exit code."""
    counts, name, kind = frames_of(source, sensor, seconds, sensor_type)
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


def calibrate_loads(
    given: list[LoadRecording],
    output: Path,
    board: Electronics | None,
    *,
    sensor: str = "",
    sensor_type: str = "",
    made: str = "",
    replace: bool = False,
    as_json: bool = False,
) -> int:
    """Calibrate from recordings and write the file; returns the exit code.

    Raises
    ------
    CalibrationError
        When loads are missing or of different sensors; the message names the load to add.
    RecordingError
        When a recording cannot be read.
    """
    refuse_taken(output, ".json", replace=replace)
    rest = [load for load in given if load.newtons == 0]
    if not rest:
        raise CalibrationError("none of the recordings is of the unloaded sensor",
                               fix="add one with 0 N: rest.h5=0")  # fmt: skip
    name = sensor or _one_sensor(given)
    counts = np.concatenate([_counts(load) for load in rest])
    kind = Recording(rest[0].recording).sensor_type(sensor_type)
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
    if as_json:
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
