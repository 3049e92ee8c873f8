"""A calibration, and its file: what a sensor's counts mean.

    force = break + (conductance / gain)^(1 / exponent)

per tactel, conductance from counts by the board's own equations (`probe.circuit.inverse`);
without a board the counts above the bias stand for the conductance.

The file is JSON that a person can read, byte for byte the same for the same laws. The sha256 at
the end is that of the text before it, names the calibration in recordings, and shows a file that
was changed by hand.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from dataclasses import asdict, dataclass, fields
from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import exit_code_of_write
from encoded_objects.base.files import whole_file
from encoded_objects.base.foreign import DAMAGE, foreign_json
from probe.circuit import Electronics, Noise
from probe.errors import CalibrationError, CircuitError

Image = NDArray[np.float64]

VERSION = 1  #: of the calibration's content and file
DIGITS = 7  #: significant digits of every number that is kept


class Condition(IntEnum):
    """Condition of a tactel; the letter is the file's."""

    SOUND = 0
    DEAD = 1
    STUCK = 2
    PRELOADED = 3
    HIDDEN = 4

    @property
    def letter(self) -> str:
        """One character: . D S P H."""
        return ".DSPH"[self.value]


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """The laws of one sensor. Arrays are (rows, columns), rounded, read-only."""

    sensor: str  #: name of the sensor
    made: str  #: when, as the operator wrote it (ISO 8601)
    board: Electronics | None  #: None: counts above the bias stand for the conductance
    full: int  #: highest count of the ADC
    loads: tuple[str, ...]  #: names of the loads, as a record
    condition: NDArray[np.uint8]  #: `Condition` of each tactel
    bias_counts: Image  #: reading at conductance 0
    rest_counts: Image  #: reading without load; above the bias where preloaded or stuck
    noise_counts: Image  #: standard deviation of one frame without load
    gain_s: Image  #: S (or counts) at 1 N above the break force; nan where the tactel is bad
    exponent: Image
    break_n: Image  #: N; negative where preloaded
    covariance: NDArray[
        np.float64
    ]  #: (rows, columns, 6): ln gain, exponent, break; 11 12 13 22 23 33
    most_n: Image  #: N, largest load that took part
    scatter: float  #: root mean square of (read - law) over the errors of the loads
    repeat: float  #: share of a force that hysteresis and creep leave open

    def __post_init__(self) -> None:
        shape = np.shape(self.condition)
        for item in fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, np.ndarray):
                continue
            array = np.array(value, np.uint8 if item.name == "condition" else np.float64)
            if array.shape[:2] != shape or array.ndim != (3 if item.name == "covariance" else 2):
                raise CalibrationError(
                    f"{item.name} has shape {array.shape}, the sensor {shape}",
                    fix="give one value per tactel",
                )
            if item.name != "condition":
                array = round_digits(array)
            array.setflags(write=False)
            object.__setattr__(self, item.name, array)
        for name in ("scatter", "repeat"):
            object.__setattr__(self, name, float(f"{getattr(self, name):.{DIGITS}g}"))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.condition.shape
        return rows, columns

    @property
    def bad(self) -> NDArray[np.bool_]:
        """(rows, columns) tactels that give no force: dead, stuck or hidden."""
        return ~np.isin(self.condition, (Condition.SOUND, Condition.PRELOADED))


def round_digits(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return values with `DIGITS` significant digits, as the file holds them."""
    flat = [float(f"{v:.{DIGITS}g}") for v in values.ravel()]
    return np.array(flat, dtype=np.float64).reshape(values.shape)


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

    Raises CalibrationError: the file cannot be written.
    """
    text, name = _text(calibration), Path(path)
    digest = hashlib.sha256(text.encode()).hexdigest()
    content = f'{text.removesuffix(chr(10) + "}" + chr(10))},\n  "sha256": "{digest}"\n}}\n'
    try:
        with whole_file(name) as file:
            file.write(content.encode())
    except OSError as error:
        raise CalibrationError(
            f"cannot be written: {error.strerror}",
            fix="choose another folder",
            exit_code=exit_code_of_write(error),
            place=name,
        ) from error
    return digest


def read_calibration(path: str | os.PathLike[str], *, sensor: str | None = None) -> Calibration:
    """Read a calibration, of the sensor that is named if one is.

    Raises CalibrationError: the file is none, is of a newer version, was changed, or is another
    sensor's.
    """
    place = str(path)
    document = foreign_json(
        path, CalibrationError, fix="give a file that `probe-sensor calibrate` wrote"
    )
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
    except (*DAMAGE, CircuitError, CalibrationError) as error:
        raise CalibrationError(
            f"is damaged: {error}", fix="calibrate again", place=place
        ) from error
    if document.get("sha256") != calibration_hash(calibration):
        raise CalibrationError(
            "was changed: its content does not give its sha256", fix="calibrate again", place=place
        )
    if sensor is not None and sensor != calibration.sensor:
        raise CalibrationError(
            f"is of sensor {calibration.sensor!r}, not of {sensor!r}",
            fix="use the file of the sensor that is connected",
            place=place,
        )
    return calibration


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
    for name, kind in (("sensor", str), ("made", str), ("full", int)):
        if type(document[name]) is not kind:
            raise ValueError(f"{name} is no {'text' if kind is str else 'whole number'}")
    if not 1 <= document["full"] <= 65535:
        raise ValueError(f"a full scale of {document['full']}")
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
