"""Calibrate a probe step by step: every load is recorded, then all are fitted.

The recordings and their table stay, so that the fit can be repeated, or loads added, by
`probe-sensor calibrate loads DIR/loads.csv`.
"""

from __future__ import annotations

import math
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from encoded_objects.base.files import refuse_taken
from encoded_objects.base.output import message
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.calibration.load import describe_load
from probe.circuit import Electronics
from probe.client.stream import Stream, name_of
from probe.command.calibrated import calibrate_loads
from probe.command.listen import Counts
from probe.command.loads import LoadRecording, write_list
from probe.errors import CalibrationError, PortError
from probe.frame import Frame
from probe.port.typed import typed_port
from probe.recording.record import Recorder

LIST = "loads.csv"


@dataclass(frozen=True, slots=True)
class CalibrationBench:
    """What the steps share."""

    url: str
    stream: Stream
    folder: Path
    seconds: float
    sensor: str
    sensor_type: SensorType | None


def guide(
    url: str,
    output: Path,
    forces_n: list[float],
    folder: Path,
    seconds: float,
    sensor: int | None,
    board: Electronics | None,
    *,
    sensor_type: str,
    made: str,
    replace: bool,
    as_json: bool,
) -> int:
    """Lead through a calibration; returns the exit code.

    Raises
    ------
    PortError
        When the probe is not there, or goes away.
    CalibrationError
        When the loads do not determine the laws, and no more are given.
    """
    refuse_taken(output, ".json", replace=replace)
    folder.mkdir(parents=True, exist_ok=True)
    refuse_taken(folder / LIST, ".csv", replace=replace)
    port, kind = typed_port(url, sensor_type)
    with Stream(port, sensor=sensor) as stream:
        bench = CalibrationBench(url, stream, folder, seconds, name_of(stream.ident(), url), kind)
        message(f"{bench.sensor or url}; recordings go to {folder}")
        given: list[LoadRecording] = []
        rest: Counts | None = None
        for force in [0.0, *forces_n]:
            load, counts = _step(bench, force, rest, len(given), 1 + len(forces_n))
            rest = counts if rest is None else rest
            given.append(load)
        while True:
            write_list(folder / LIST, given)
            try:
                return calibrate_loads(given, output, board, sensor=bench.sensor,
                                       sensor_type=sensor_type, made=made,
                                       replace=replace, as_json=as_json)  # fmt: skip
            except CalibrationError as error:
                message(f"not yet: {error.cause}\n  {error.fix}")
                more_n = _another_load()
                if more_n is None:
                    raise
                load, _ = _step(bench, more_n, rest, len(given), len(given) + 1)
                given.append(load)


def _step(
    bench: CalibrationBench, force: float, rest: Counts | None, done: int, steps: int
) -> tuple[LoadRecording, Counts]:
    """Have one load put on, record it, and say how it was felt; again if the operator wants."""
    what = f"put {force:g} N on the whole sensor, evenly" if force else "unload the sensor"
    path = bench.folder / f"load-{done}-{force:g}N.h5"
    while True:
        _ask(f"{done + 1}/{steps}  {what}, then press Enter: ")
        counts = _record_load(bench, path)
        message(f"     {describe_load(counts, rest)}")
        if _ask("     Enter goes on, r reads it again: ") != "r":
            return LoadRecording(path, force), counts


def _record_load(bench: CalibrationBench, path: Path) -> Counts:
    """Record what is on the sensor now."""
    stream, frames = bench.stream, list[Frame]()
    while stream.take(0.0):
        pass  # what came while the load was put on
    until_s = time.monotonic() + bench.seconds
    while time.monotonic() < until_s and not stream.ended:
        frames += stream.take(0.1)
        for notice in stream.client.notices():
            message(f"     {notice}")
    if not frames:
        raise PortError("no frame came", fix="see probe-sensor info", place=bench.url)
    rows, columns = frames[0].counts.shape
    kind = choose_sensor_type(bench.sensor_type, "", (rows, columns), bench.url)
    with Recorder(path, sensor=bench.sensor, sensor_type=kind, replace=True) as recorder:
        for frame in frames:
            recorder.append(frame)
    return np.stack([frame.counts for frame in frames])


def _ask(prompt: str) -> str:
    """Return a line of the operator's.

    Raises
    ------
    CalibrationError
        When there is nobody to answer.
    """
    sys.stderr.write(prompt)
    sys.stderr.flush()
    line = sys.stdin.readline()
    if not line:
        raise CalibrationError("the input ended before the calibration did",
                               fix="answer every step, or use `calibrate loads`")  # fmt: skip
    return line.strip()


def _another_load() -> float | None:
    """Return the force of a load that the operator will add; None to give up."""
    while text := _ask("another load: its newtons, or Enter to give up: "):
        with suppress(ValueError):
            if 0 < float(text) < math.inf:
                return float(text)
        message(f"{text!r} is no force above 0")
    return None
