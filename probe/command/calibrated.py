"""`probe-sensor calibrate bias | loads | port`: recordings of loads -> the laws of a sensor.

Loads come from the command line, from a table (CSV), or are asked for one after another at a
terminal (`port`). Recordings and table of these stay, so that the fit can be repeated, or loads
added, by `probe-sensor calibrate loads DIR/loads.csv`.
"""

from __future__ import annotations

import csv
import datetime
import io
import math
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.console import FAILED, interruption
from encoded_objects.base.errors import without_password
from encoded_objects.base.files import refuse_taken
from encoded_objects.base.foreign import MOST_TEXT, foreign_bytes
from encoded_objects.base.output import message, pairs, warning, write, write_json
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.calibration import (
    Calibration,
    Condition,
    calibrate_image,
    calibration_from,
    calibration_hash,
    drift_of,
    even_load,
    expected_counts,
    read_calibration,
    write_calibration,
)
from probe.calibration.condition import common_bias, raised_tactels, tactel_words
from probe.calibration.guide import CalibrationGuide
from probe.calibration.load import average_frames
from probe.circuit import Electronics
from probe.client.client import Client, name_of
from probe.command.options import GuideOptions, LoadsOptions
from probe.errors import CalibrationError, CircuitError, PortError
from probe.port.url import means_port, typed_port
from probe.recording.layout import FrameBlock
from probe.recording.read import Recording
from probe.recording.record import Recorder

Counts = NDArray[np.uint16]


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

    Raises PortError, RecordingError: no such source, or it gives no frame; SensorTypeError.
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
        "raised": tactel_words(high) if high.any() else "none",
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
    given: list[LoadRecording], options: LoadsOptions | GuideOptions, sensor: str
) -> int:
    """Calibrate from recordings and write the file; returns the exit code.

    Raises CalibrationError: loads are missing (it names the one to add) or of different sensors;
    RecordingError: a recording cannot be read.
    """
    output, board = options.output, board_from(options.board)
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
        even_load(_counts(load), load.newtons,
                  even if load.footprint is None else load.footprint, f"{load.newtons:g} N")
        for load in given
        if load.newtons > 0
    ]  # fmt: skip
    when = options.made or datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    found = calibration_from(counts, loads, sensor=name, made=when, board=board, full=kind.full)
    digest = write_calibration(found, output)
    values, lines = describe_laws(found, digest, str(output))
    if options.as_json:
        write_json(values)
    else:
        pairs(lines)
        if found.bad.any():
            letters = (" ".join(Condition(int(one)).letter for one in row)
                       for row in found.condition)  # fmt: skip
            rows = "\n".join(letters)
            write(f"\n{rows}\n. sound  D dead  S stuck  P preloaded  H hidden")
    return 0


def board_from(text: str) -> Electronics | None:
    """Read a board from the command line; CircuitError when a name or value is none."""
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
        if names == {""}:
            fix = "say which one it is: --sensor NAME"
            raise CalibrationError("the recordings do not name their sensor", fix=fix)
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
    with interruption() as interrupted, Client(port, sensor=sensor) as client:
        counts = _listen(client, seconds)
        if interrupted.is_set():
            raise KeyboardInterrupt
        if not len(counts):
            raise PortError("no frame came", fix="see probe-sensor info", place=source)
        kind = choose_sensor_type(kind, "", counts.shape[1:], source)
        return counts, name_of(client.wait_for_ident(), source), kind


def _listen(client: Client, seconds: float) -> Counts:
    """Return the counts of the next seconds of a probe (device time), (N, rows, columns)."""
    images: list[Counts] = []
    began_ns: int | None = None
    while not client.ended:
        frames = client.take(1.0)
        for notice in client.notices():
            message(notice)
        for frame in frames:
            began_ns = frame.t_ns if began_ns is None else began_ns
            if frame.t_ns - began_ns > seconds * 1e9:
                return np.stack(images)
            images.append(frame.counts)
    return np.stack(images) if images else FrameBlock.empty().counts


_COLUMNS = ("recording", "newtons", "footprint")


@dataclass(frozen=True, slots=True, eq=False)
class LoadRecording:
    """A recording of one steady load."""

    recording: Path
    newtons: float  #: in all; 0: the unloaded sensor
    footprint: NDArray[np.float64] | None = None  #: (rows, columns) shares covered; None: all


def loads_given(words: list[str]) -> list[LoadRecording]:
    """Read loads as they stand on the command line: recording=newtons, or the name of a table.

    Raises CalibrationError: a word is neither, or a table cannot be read.
    """
    given: list[LoadRecording] = []
    for word in words:
        name, mark, newtons = word.rpartition("=")
        if mark:
            given.append(LoadRecording(Path(name), _newtons(newtons, word)))
        elif Path(word).suffix.lower() == ".csv":
            given += _read_list(Path(word))
        else:
            raise CalibrationError(
                "no load is given with it", fix=f"write {word}=NEWTONS, 0 for the unloaded sensor",
                place=word
            )  # fmt: skip
    return given


def write_list(path: Path, given: Iterable[LoadRecording]) -> None:
    """Write loads as a table; names are those of files in its folder."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS[:2])
        writer.writerows((load.recording.name, f"{load.newtons:g}") for load in given)


def _read_list(path: Path) -> list[LoadRecording]:
    fix = "give a table of loads (CSV)"
    try:
        text = foreign_bytes(path, CalibrationError, most=MOST_TEXT, fix=fix).decode("utf-8-sig")
        rows = list(csv.DictReader(io.StringIO(text, newline="")))
    except (UnicodeError, csv.Error) as error:
        raise CalibrationError(f"cannot be read: {error}", fix=fix, place=path) from error
    given = []
    for number, row in enumerate(rows, 2):
        place = f"{path}:{number}"
        unknown = [str(name) for name in row if name not in _COLUMNS]
        if unknown or not row.get("recording") or not row.get("newtons"):
            raise CalibrationError(
                f"unknown columns {', '.join(unknown)}" if unknown
                else "recording or newtons is missing",
                fix=f"the columns are {', '.join(_COLUMNS)}", place=place
            )  # fmt: skip
        footprint = row.get("footprint") or ""
        given.append(
            LoadRecording(
                path.parent / row["recording"],
                _newtons(row["newtons"], place),
                _footprint(path.parent / footprint) if footprint else None,
            )
        )
    return given


def _newtons(text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value < math.inf:
        raise CalibrationError(f"{text!r} is no force", fix="give newtons, 0 or more", place=place)
    return value


def _footprint(path: Path) -> NDArray[np.float64]:
    fix = "give a line a row of numbers with commas between"
    content = foreign_bytes(path, CalibrationError, most=MOST_TEXT, fix=fix)
    try:
        shares = np.loadtxt(io.BytesIO(content), delimiter=",", ndmin=2, encoding="utf-8")
    except ValueError as error:
        raise CalibrationError(f"cannot be read: {error}", fix=fix, place=path) from error
    return shares


_SHARES = (0.1, 0.3, 1.0)  # of the largest load: where the uncertainty is stated


def describe_laws(
    found: Calibration, digest: str, name: str
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return a calibration as values, and as lines to read."""
    alive = ~found.bad
    most_n = float(np.nanmedian(found.most_n)) if alive.any() else math.nan
    errors = [_uncertainty(found, share * most_n) for share in _SHARES] if alive.any() else []
    unsound = {
        condition.name.lower(): found.condition == condition
        for condition in Condition
        if condition != Condition.SOUND
    }
    values = {
        "file": name,
        "hash": digest,
        "sensor": found.sensor,
        "made": found.made,
        "board": None if found.board is None else found.board.readout,
        "loads": list(found.loads),
        "sound": int((found.condition == Condition.SOUND).sum()),
        **{title: np.argwhere(where) for title, where in unsound.items()},
        "scatter": found.scatter,
        "uncertainty": [
            {"force_n": force, "median": median, "worst_of_95": worst}
            for force, median, worst in errors
        ],
    }
    lines = {
        "calibration": name,
        "hash": digest,
        "sensor": found.sensor or "not named",
        "made": found.made or "not dated",
        "board": "none: counts above the bias" if found.board is None
        else f"{found.board.readout}, {found.board.bits} bits",
        "loads": ", ".join(found.loads),
        "sound": f"{values['sound']} of {alive.size} tactels",
        **{title: tactel_words(where) for title, where in unsound.items() if where.any()},
        "fit": f"{found.scatter:.2f} (loads miss the law by so many of their errors)"
    }  # fmt: skip
    for force, median, worst in errors:
        lines[f"at {force:.2g} N"] = (
            f"+-{100 * median:.1f} % in one frame, of 95 % of the tactels +-{100 * worst:.1f} %"
        )
    return values, lines


def _uncertainty(found: Calibration, force_n: float) -> tuple[float, float, float]:
    """Return a force, and its relative error in one frame: median, and 95 % of the tactels."""
    forces = np.full(found.shape, force_n)
    read = calibrate_image(expected_counts(forces, found), found)
    errors = (read.sigma / force_n)[~read.bad]
    if not errors.size:
        return force_n, math.inf, math.inf
    return force_n, float(np.median(errors)), float(np.quantile(errors, 0.95))


LIST: Final = "loads.csv"
_SILENT_S: Final = 5.0  #: without a frame for so long, a load is not read any further


def guide_loads(options: GuideOptions) -> int:
    """Lead through a calibration; returns the exit code.

    Raises PortError: the probe is not there, or goes away; CalibrationError: the loads do not
    determine the laws, and no more are given.
    """
    output, folder = options.output, options.folder or options.output.with_suffix("")
    board_from(options.board)  # refuses a wrong one before anything is read
    refuse_taken(output, ".json", replace=options.replace)
    folder.mkdir(parents=True, exist_ok=True)
    refuse_taken(folder / LIST, ".csv", replace=options.replace)
    port, kind = typed_port(options.url, options.sensor_type)
    guide = CalibrationGuide(options.forces_n, options.seconds)
    with Client(port, sensor=options.sensor) as client:
        sensor = name_of(client.wait_for_ident(), options.url)
        message(f"{sensor or without_password(options.url)}; recordings go to {folder}")
        given: list[LoadRecording] = []
        while True:
            while not guide.done:
                path = folder / f"load-{guide.step}-{guide.newtons:g}N.h5"
                given.append(LoadRecording(path, guide.newtons))
                _lead_through_step(guide, client, options.url)
                kind = choose_sensor_type(kind, "", guide.taken[-1].shape[1:], options.url)
                with Recorder(path, sensor=sensor, sensor_type=kind, replace=True) as recorder:
                    for frame in guide.frames:
                        recorder.append(frame)
            write_list(folder / LIST, given)
            try:
                return calibrate_loads(given, options, sensor)
            except CalibrationError as error:
                message(f"not yet: {error.cause}\n  {error.fix}")
                more_n = _another_load()
                if more_n is None:
                    raise
                guide.forces_n.append(more_n)


def _lead_through_step(guide: CalibrationGuide, client: Client, url: str) -> None:
    """Have one load put on, read it, and describe it; again if the operator wants."""
    force, number = guide.newtons, f"{guide.step + 1}/{guide.steps}"
    what = f"put {force:g} N on the whole sensor, evenly" if force else "unload the sensor"
    while True:
        _ask(f"{number}  {what}, then press Enter: ")
        while client.take(0.0):
            pass  # what came while the load was put on
        guide.read()
        heard_s = time.monotonic()
        while guide.reading:
            frames = client.take(0.1)
            guide.take(frames)
            now_s = time.monotonic()
            heard_s = now_s if frames else heard_s
            for notice in client.notices():
                message(f"     {notice}")
            if guide.reading and (client.ended or now_s - heard_s > _SILENT_S):
                if not guide.frames:
                    raise PortError("no frame came", fix="see probe-sensor info", place=url)
                guide.end_step()
        message(f"     {guide.described[-1]}")
        if _ask("     Enter goes on, r reads it again: ") != "r":
            return
        guide.again()


def _ask(prompt: str) -> str:
    """Return a line of the operator's; CalibrationError when there is nobody to answer."""
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
