"""Calibration files: JSON that a person can read, byte for byte the same for the same laws.

The sha256 at the end is that of the text before it, names the calibration in recordings, and
shows a file that was changed by hand. Written beside the file and moved over it.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.files import whole_file
from probe.calibration.value import VERSION, Calibration, Condition
from probe.circuit import Electronics, Noise
from probe.errors import CalibrationError, CircuitError

FORMAT = "tactile calibration"
_ARRAYS = tuple(
    name for name in (f.name for f in fields(Calibration))
    if name.endswith(("_counts", "_s", "_n")) or name in ("exponent", "covariance")
)  # fmt: skip
_LETTERS = {condition.letter: condition.value for condition in Condition}


def calibration_hash(calibration: Calibration) -> str:
    """Return the sha256 (hexadecimal) that names a calibration."""
    return hashlib.sha256(_text(calibration).encode()).hexdigest()


def write_calibration(calibration: Calibration, path: str | os.PathLike[str]) -> str:
    """Write a calibration, whole or not at all, and return its hash.

    Raises
    ------
    CalibrationError
        If the file cannot be written.
    """
    text, name = _text(calibration), Path(path)
    digest = hashlib.sha256(text.encode()).hexdigest()
    content = f'{text.removesuffix(chr(10) + "}" + chr(10))},\n  "sha256": "{digest}"\n}}\n'
    try:
        with whole_file(name) as file:
            file.write(content.encode())
    except OSError as error:
        raise CalibrationError(
            f"cannot be written: {error.strerror}", fix="choose another folder", place=str(name)
        ) from error
    return digest


def read_calibration(
    path: str | os.PathLike[str],
    *,
    sensor: str | None = None,
    shape: tuple[int, int] | None = None,
) -> Calibration:
    """Read a calibration.

    Parameters
    ----------
    path
        The file.
    sensor, shape
        Of the sensor that it shall serve; not compared if not given.

    Raises
    ------
    CalibrationError
        If the file is none, is of a newer version, was changed, or is another sensor's.
    """
    place = str(path)
    try:
        document = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise CalibrationError(
            f"cannot be read: {error.strerror}", fix="give a calibration file", place=place
        ) from error
    except ValueError as error:
        raise CalibrationError(
            f"is no JSON: {error}", fix="give a file that `probe-sensor calibrate` wrote",
            place=place,
        ) from error  # fmt: skip
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise CalibrationError(
            "is no calibration", fix="give a file that `probe-sensor calibrate` wrote", place=place
        )
    if document.get("version") != VERSION:
        raise CalibrationError(
            f"is of version {document.get('version')}, this program reads {VERSION}",
            fix="update the program, or calibrate again",
            place=place,
        )
    try:
        calibration = _calibration_of(document)
    except (KeyError, TypeError, ValueError, CircuitError, CalibrationError) as error:
        raise CalibrationError(
            f"is damaged: {error}", fix="calibrate again", place=place
        ) from error
    if document.get("sha256") != calibration_hash(calibration):
        raise CalibrationError(
            "was changed: its content does not give its sha256", fix="calibrate again", place=place
        )
    _check_sensor(calibration, sensor, shape, place)
    return calibration


def _check_sensor(
    calibration: Calibration, sensor: str | None, shape: tuple[int, int] | None, place: str
) -> None:
    if sensor is not None and sensor != calibration.sensor:
        raise CalibrationError(
            f"is of sensor {calibration.sensor!r}, not of {sensor!r}",
            fix="use the file of the sensor that is connected",
            place=place,
        )
    if shape is not None and shape != calibration.shape:
        raise CalibrationError(
            f"is for {calibration.shape} tactels, not {shape}",
            fix="use the file of the sensor that is connected",
            place=place,
        )


def _text(calibration: Calibration) -> str:
    """Return the content as text, every row of a matrix on a line of its own."""
    c = calibration
    rows = ["".join(Condition(int(v)).letter for v in row) for row in c.condition]
    head: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "sensor": c.sensor,
        "made": c.made,
        "shape": list(c.shape),
        "full": c.full,
        "scatter": c.scatter,
        "repeat": c.repeat,
        "board": None if c.board is None else asdict(c.board),
        "loads": list(c.loads),
        "condition": rows,
    }
    parts = [f'  "{key}": {_to_json(value)}' for key, value in head.items()]
    for name in _ARRAYS:
        array = getattr(c, name)
        lines = ",\n".join("    " + json.dumps(_json_numbers(row)) for row in array)
        parts.append(f'  "{name}": [\n{lines}\n  ]')
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _to_json(value: Any) -> str:
    """Return a value in JSON, lists of names in a line, the rest indented."""
    flat = isinstance(value, list) and not any(len(str(item)) >= 16 for item in value)
    return json.dumps(value, indent=None if flat else 2).replace("\n", "\n  ")


def _json_numbers(row: np.ndarray) -> list[Any]:
    """Return numbers as JSON has them: null for nan."""
    if row.ndim > 1:
        return [_json_numbers(part) for part in row]
    return [None if math.isnan(v) else v for v in row.tolist()]


def _calibration_of(document: dict[str, Any]) -> Calibration:
    board = document["board"]
    if board is not None:
        board = Electronics(**{**board, "noise": Noise(**board["noise"])})
    arrays = {name: np.array(document[name], dtype=np.float64) for name in _ARRAYS}
    return Calibration(
        sensor=document["sensor"],
        made=document["made"],
        board=board,
        full=document["full"],
        loads=tuple(document["loads"]),
        condition=np.array([[_LETTERS[letter] for letter in row] for row in document["condition"]]),
        scatter=float(document["scatter"]),
        repeat=float(document["repeat"]),
        **arrays,
    )
