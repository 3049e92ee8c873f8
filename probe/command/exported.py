"""`probe-sensor export | import`: table, array, picture, messages; each whole or not there."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.files import refuse_taken, staged_file
from encoded_objects.base.output import count_of, write, write_json
from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.calibration import Calibration, calibrate_image, calibration_hash, read_calibration
from probe.command.options import ExportOptions
from probe.errors import CalibrationError, RecordingError
from probe.frame import median_filter
from probe.recording.read import Recording


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
    write(f"{made.path}: {count_of(len(made), 'frame')} of {source}{scaled}")
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
            place=str(path),
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
