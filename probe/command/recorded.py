"""`probe-sensor record | replay | export | import`: frames of a port or a file -> files, a pipe."""

from __future__ import annotations

import dataclasses
import json
import sys
import time
from dataclasses import asdict
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.console import INTERRUPTED, interruption
from encoded_objects.base.errors import EncodedObjectsError, require
from encoded_objects.base.files import refuse_taken, staged_file
from encoded_objects.base.output import (
    ProgressBar,
    count_of,
    message,
    progress_bar,
    write,
    write_json,
)
from encoded_objects.base.sensor_type import Overlay, SensorType, choose_sensor_type
from probe.calibration import Calibration, calibrate_image, calibration_hash, read_calibration
from probe.client.client import Client, name_of
from probe.command.options import ExportOptions, RecordOptions
from probe.errors import CalibrationError, PortError, RecordingError
from probe.frame import Frame, median_filter
from probe.port.url import typed_port
from probe.recording.files import check_name
from probe.recording.read import Recording
from probe.recording.record import Recorder
from probe.recording.table import table_header

_SLICE_S = 0.1  #: longest wait for frames between two looks at what else happened
_SILENT_S = 5.0  #: without a frame for so long, the host's clock ends a recording too


def record_port(options: RecordOptions) -> int:
    """Record a port; returns the exit code.

    Raises PortError: the probe is not there, or went away for good (then the file holds the frames
    that came); RecordingError: the file cannot be written; CalibrationError, SensorTypeError: none,
    or of another sensor.
    """
    url, calibration = options.url, options.calibration
    check_output(options.output, replace=options.replace)
    known = None if calibration is None else read_calibration(calibration)
    total = options.seconds if options.frames is None else options.frames
    port, kind = typed_port(url, options.sensor_type)
    client = Client(port, sensor=options.sensor, bits=options.bits)
    with interruption() as interrupted, client:
        first: list[Frame] = []
        while not (first or client.ended or interrupted.is_set()):
            first = client.take(_SLICE_S)
        if not first:
            if interrupted.is_set():
                message("\nprobe-sensor: interrupted; nothing was recorded")
                return INTERRUPTED
            raise PortError("it ended before a frame came", fix="see whether it holds frames",
                            place=url)  # fmt: skip
        rows, columns = first[0].counts.shape
        kind = choose_sensor_type(kind, "", (rows, columns), url)
        name = _sensor(client, url, known, calibration)
        recorder = Recorder(
            options.output, sensor=name, sensor_type=kind,
            calibration=calibration_hash(known) if known else "",
            attributes={"url": url}, replace=options.replace
        )  # fmt: skip
        try:
            with recorder, progress_bar("recording", total) as bar:
                ended, seconds = _run(client, recorder, first, options, interrupted, bar)
        except EncodedObjectsError:
            files = ", ".join(map(str, recorder.files))
            kept = count_of(recorder.frames, "frame")
            message(f"{files} is complete and holds {kept}")
            raise
        result = _result(client, recorder, name, ended, seconds)
    _say(result, options.as_json)
    if ended == "silence":
        early = PortError(
            f"the recording ended early: {seconds:.1f} of {options.seconds:g} s, then nothing came",
            fix="see whether the probe is plugged in, and record again",
            place=url,
        )
        message(early.as_text())  # the result stands on stdout already
        return early.exit_code
    return INTERRUPTED if ended == "interrupted" and total is not None else 0


def check_output(output: Path, *, replace: bool) -> None:
    """Refuse a name for a recording (RecordingError), with --replace as the way out."""
    try:
        check_name(output, replace=replace)
    except RecordingError as error:
        if not replace and output.suffix in (".h5", ".hdf5"):
            fix = f"{error.fix}, or replace it with --replace"
            raise RecordingError(error.cause, fix=fix, place=error.place) from error
        raise


def _sensor(client: Client, url: str, known: Calibration | None, calibration: Path | None) -> str:
    """Return the sensor's name; refuse a calibration of another one."""
    name = name_of(client.wait_for_ident(), url)
    if known is not None and calibration is not None and name and known.sensor != name:
        read_calibration(calibration, sensor=name)
    return name


def _run(
    client: Client,
    recorder: Recorder,
    frames: list[Frame],
    options: RecordOptions,
    interrupted: Event,
    bar: ProgressBar,
) -> tuple[str, float]:
    """Record until something ends it; returns its name, and the seconds recorded."""
    limit_s, limit = options.seconds, options.frames
    began_s = heard_s = time.monotonic()
    began_ns = last_ns = frames[0].t_ns
    ended = ""
    while not ended:
        for frame in frames[: None if limit is None else limit - recorder.frames]:
            if limit_s is not None and frame.t_ns - began_ns >= limit_s * 1e9:
                ended = "seconds"
                break
            recorder.append(frame)
            last_ns = frame.t_ns
        seconds = (last_ns - began_ns) * 1e-9
        _show_progress(client, bar, recorder.frames, seconds if limit is None else None)
        now_s = time.monotonic()
        heard_s = now_s if frames else heard_s
        silent = limit_s is not None and now_s - heard_s > _SILENT_S
        if recorder.frames == limit:
            ended = "frames"
        elif interrupted.is_set():
            ended = "interrupted"
        elif client.ended:
            ended = "end"
        elif silent and now_s - began_s > (limit_s or 0.0):
            ended = "silence"
        elif not ended:
            if not frames:
                recorder.flush()
            frames = client.take(_SLICE_S)
    return ended, seconds


def _show_progress(client: Client, bar: ProgressBar, frames: int, seconds: float | None) -> None:
    """Show counts and notices; the bar runs by seconds, or by frames if None."""
    for notice in client.notices():
        bar.say(notice)
    counts = client.statistics()
    text = f"{frames:,} frames  {counts.rate:5.1f}/s  lost {counts.lost}  failed {counts.failed}"
    bar.show(frames if seconds is None else seconds, text)


def _result(
    client: Client, recorder: Recorder, name: str, ended: str, seconds: float
) -> dict[str, Any]:
    counts = asdict(client.statistics())
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


def pipe_frames(url: str, *, as_json: bool) -> int:
    """Write the frames of a port to stdout, a line each; returns the exit code."""
    with interruption() as interrupted, Client(url) as client:
        first = True
        while not client.ended and not interrupted.is_set():
            frames = client.take(0.1)
            if frames and first and not as_json:
                rows, columns = frames[0].counts.shape
                sys.stdout.write(",".join(table_header((rows, columns))) + "\n")
            first = first and not frames
            sys.stdout.write("".join(_line(frame, as_json=as_json) for frame in frames))
            sys.stdout.flush()
        return INTERRUPTED if interrupted.is_set() else 0


def _line(frame: Frame, *, as_json: bool) -> str:
    if as_json:
        values = {
            "seq": frame.seq,
            "t_ns": frame.t_ns,
            "counts": frame.counts.tolist(),
            "wrist": frame.wrist.tolist(),
        }
        return json.dumps(values, separators=(",", ":")) + "\n"
    numbers = [frame.seq, frame.t_ns, *frame.counts.ravel().tolist(), *frame.wrist.tolist()]
    return ",".join(map(str, numbers)) + "\n"


def export_files(options: ExportOptions) -> int:
    """Write the files that were asked for; returns the exit code.

    Raises RecordingError: the recording cannot be read, or has no such frame; CalibrationError: of
    another sensor; ContactError: the blur of a pad so high cannot be taken back;
    EncodedObjectsError: a file is there already.
    """
    if (out := options.output) is not None:
        named: dict[str, Any] = {"output": None, out.suffix[1:]: out}
        options = dataclasses.replace(options, **named)
    csv, npy, png, mcap = options.csv, options.npy, options.png, options.mcap
    outputs = []
    for out, suffix in ((csv, ".csv"), (npy, ".npy"), (png, ".png"), (mcap, ".mcap")):
        if out is not None:
            refuse_taken(out, suffix, replace=options.replace)
            outputs.append(out)
    if png is not None:
        require("matplotlib", extra="report", purpose="--png")
    recording = Recording(options.recording, live=options.live)
    sensor = None
    if png is not None or options.deblur is not None:  # tables and arrays are as they are
        sensor = recording.sensor_type(options.sensor_type)
    known = None
    if options.calibration is not None:
        known = calibration_for(options.calibration, recording)
    pad = None
    if options.deblur is not None and sensor is not None:
        overlay = Overlay(kind="pad", height_mm=options.deblur)
        pad = dataclasses.replace(sensor, overlay=overlay)
    if png is not None:
        _picture(recording, png, options, known, pad, sensor)
    if npy is not None:
        _array(recording, npy, known, pad)
    if csv is not None:
        from probe.recording.table import export_csv

        export_csv(options.recording, csv, live=options.live)
    if mcap is not None:
        from probe.recording.mcap import export_mcap

        with staged_file(mcap) as draft:
            export_mcap(recording, draft)
    if options.as_json:
        names = [str(out) for out in outputs]
        write_json({"file": str(options.recording), "frames": len(recording), "written": names})
    else:
        for out in outputs:
            what = "picture" if out is png else count_of(len(recording), "frame")
            write(f"{out}: {what}")
    return 0


def report_import(made: Recording, source: Path, *, as_json: bool) -> int:
    """Print what was imported; returns the exit code."""
    more = dict(made.origin.more)
    if as_json:
        values = {"file": str(made.path), "frames": len(made), "units": made.origin.units}
        write_json(values | more)
        return 0
    scaled = ""
    if "scale" in more:
        scaled = f"; value = {more['scale_offset']:g} + {more['scale']:g} * count"
    left = f"; not read: {more['not_read']} (frames come at --rate)" if "not_read" in more else ""
    write(f"{made.path}: {count_of(len(made), 'frame')} of {source}{scaled}{left}")
    return 0


def calibration_for(path: Path, recording: Recording) -> Calibration:
    """Read the calibration of the sensor that made a recording.

    Raises CalibrationError: the recording names another calibration, or another sensor.
    """
    known = read_calibration(path, sensor=recording.origin.sensor or None)
    named = recording.origin.calibration
    if named and named != calibration_hash(known):
        raise CalibrationError(
            f"the recording was made with calibration {named[:12]}..., not with this one",
            fix="give the file whose hash `probe-sensor info` shows as that",
            place=path,
        )
    return known


def _picture(
    recording: Recording,
    out: Path,
    options: ExportOptions,
    known: Calibration | None,
    pad: SensorType | None,
    sensor: SensorType | None,
) -> None:
    from probe.plot.frame import frame_picture

    if options.frame >= len(recording):
        raise RecordingError(
            f"frame {options.frame} was asked for, it holds {len(recording)}",
            fix=f"take 0 ... {len(recording) - 1}" if len(recording) else "record some frames",
            place=str(recording.files[0].path),
        )
    block = recording.block(options.frame, options.frame + 1)
    first = recording.block(0, 1)
    image, unit = block.counts[0].astype(np.float64), recording.origin.units
    if known is not None:
        image, unit = _newtons(block.counts, known, pad)[0], "N"
    if options.median:
        image = median_filter(image)
    title = f"frame {options.frame}, {(block.t_ns[0] - first.t_ns[0]) * 1e-9:.3f} s"
    if options.median:
        title += ", median of 3x3"
    with staged_file(out) as draft:
        frame_picture(image, draft, unit=unit, title=title, sensor=sensor,
                      azimuth_deg=options.azimuth, elevation_deg=options.elevation)  # fmt: skip


def _newtons(
    counts: NDArray[np.uint16], known: Calibration, pad: SensorType | None
) -> NDArray[np.float64]:
    """Return the forces (n, rows, columns) on the tactels, or on top of a pad over them."""
    read = calibrate_image(counts, known)
    if pad is None:
        return read.values
    from probe.contact.deblur import deblur

    noise_n = float(np.sqrt(np.mean(np.square(read.sigma[np.isfinite(read.sigma)]))))
    return np.array([deblur(image, pad, noise_n=noise_n).forces_n for image in read.values])


def _array(
    recording: Recording, out: Path, known: Calibration | None, pad: SensorType | None
) -> None:
    shape = (len(recording), *recording.shape)
    with staged_file(out) as draft, open(draft, "wb") as file:
        dtype = np.dtype("<u2" if known is None else "<f4")
        header = {"descr": dtype.str, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, header)
        for block in recording.blocks():
            values = block.counts if known is None else _newtons(block.counts, known, pad)
            file.write(np.ascontiguousarray(values, dtype).tobytes())
