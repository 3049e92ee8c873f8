"""A recording -> table, array, picture, messages; each file whole or not there."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.files import refuse_taken, staged_file
from encoded_objects.base.output import count_of, write, write_json
from encoded_objects.base.sensor_type import Overlay, SensorType
from probe.calibration import Calibration, calibrate_image, read_calibration
from probe.errors import CalibrationError, RecordingError
from probe.frame import median_filter
from probe.recording.read import Recording


@dataclass(frozen=True, slots=True)
class PictureView:
    """Which image a picture shows, and how."""

    frame: int = 0
    median: bool = False
    azimuth_deg: float = -60.0
    elevation_deg: float = 40.0


@dataclass(frozen=True, slots=True)
class Outputs:
    """The files that are asked for."""

    csv: Path | None = None
    npy: Path | None = None
    png: Path | None = None
    mcap: Path | None = None


def export_files(
    path: Path,
    wanted: Outputs,
    view: PictureView,
    *,
    sensor_type: str,
    calibration: Path | None,
    pad_mm: float | None,
    live: bool,
    replace: bool,
    as_json: bool,
) -> int:
    """Write the files that were asked for; returns the exit code.

    Raises
    ------
    RecordingError
        When the recording cannot be read, or has no such frame.
    CalibrationError
        When the calibration is none, or of another sensor.
    ContactError
        When the blur of a pad so high cannot be taken back.
    EncodedObjectsError
        When a file is there already.
    """
    outputs = []
    csv, npy, png, mcap = wanted.csv, wanted.npy, wanted.png, wanted.mcap
    for out, suffix in ((csv, ".csv"), (npy, ".npy"), (png, ".png"), (mcap, ".mcap")):
        if out is not None:
            refuse_taken(out, suffix, replace=replace)
            outputs.append(out)
    if png is not None:
        require("matplotlib", extra="report", purpose="--png")
    recording = Recording(path, live=live)
    sensor = None
    if png is not None or pad_mm is not None:  # tables and arrays are as they are
        sensor = recording.sensor_type(sensor_type)
    known = None if calibration is None else calibration_for(calibration, recording)
    pad = None if pad_mm is None or sensor is None else _pad(sensor, pad_mm)
    if png is not None:
        _picture(recording, png, view, known, pad, sensor)
    if npy is not None:
        _array(recording, npy, known, pad)
    if csv is not None:
        from probe.recording.table import export_csv

        export_csv(path, csv, live=live)
    if mcap is not None:
        from probe.recording.mcap import export_mcap

        with staged_file(mcap) as draft:
            export_mcap(recording, draft)
    if as_json:
        names = [str(out) for out in outputs]
        write_json({"file": str(path), "frames": len(recording), "written": names})
    else:
        for out in outputs:
            what = "picture" if out is png else count_of(len(recording), "frame")
            write(f"{out}: {what}")
    return 0


def calibration_for(path: Path, recording: Recording) -> Calibration:
    """Read the calibration of the sensor that made a recording.

    Raises
    ------
    CalibrationError
        When the recording names another calibration, or another sensor.
    """
    from probe.calibration import calibration_hash

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
    view: PictureView,
    known: Calibration | None,
    pad: SensorType | None,
    sensor: SensorType | None,
) -> None:
    from probe.plot.frame import frame_picture

    if view.frame >= len(recording):
        raise RecordingError(
            f"frame {view.frame} was asked for, it holds {len(recording)}",
            fix=f"take 0 ... {len(recording) - 1}" if len(recording) else "record some frames",
            place=str(recording.files[0].path),
        )
    block = recording.block(view.frame, view.frame + 1)
    first = recording.block(0, 1)
    image, unit = block.counts[0].astype(np.float64), recording.origin.units
    if known is not None:
        image, unit = _newtons(block.counts, known, pad)[0], "N"
    if view.median:
        image = median_filter(image)
    title = f"frame {view.frame}, {(block.t_ns[0] - first.t_ns[0]) * 1e-9:.3f} s"
    if view.median:
        title += ", median of 3x3"
    with staged_file(out) as draft:
        frame_picture(image, draft, unit=unit, title=title, sensor=sensor,
                      azimuth_deg=view.azimuth_deg, elevation_deg=view.elevation_deg)  # fmt: skip


def _pad(sensor: SensorType, height_mm: float) -> SensorType:
    """Return a sensor under a pad of a thickness."""
    return dataclasses.replace(sensor, overlay=Overlay(kind="pad", height_mm=height_mm))


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
    shape = (len(recording), *recording.block(0, 0).counts.shape[1:])
    with staged_file(out) as draft, open(draft, "wb") as file:
        dtype = np.dtype("<u2" if known is None else "<f4")
        header = {"descr": dtype.str, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, header)
        for block in recording.blocks():
            values = block.counts if known is None else _newtons(block.counts, known, pad)
            file.write(np.ascontiguousarray(values, dtype).tobytes())
