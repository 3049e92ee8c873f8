"""Which recordings show which loads: from the command line or from a table (CSV)."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from probe.errors import CalibrationError

COLUMNS_OF_LIST = ("recording", "newtons", "footprint")


@dataclass(frozen=True, slots=True, eq=False)
class LoadRecording:
    """A recording of one steady load."""

    recording: Path
    newtons: float  #: in all; 0: the unloaded sensor
    footprint: NDArray[np.float64] | None = None  #: (rows, columns) shares covered; None: all


def loads_given(words: list[str]) -> list[LoadRecording]:
    """Read loads as they stand on the command line.

    Parameters
    ----------
    words
        recording=newtons, or the name of a table.

    Raises
    ------
    CalibrationError
        When a word is neither, or a table cannot be read.
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
                place=word,
            )  # fmt: skip
    return given


def write_list(path: Path, given: Iterable[LoadRecording]) -> None:
    """Write loads as a table; names are those of files in its folder."""
    with open(path, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS_OF_LIST[:2])
        writer.writerows((load.recording.name, f"{load.newtons:g}") for load in given)


def _read_list(path: Path) -> list[LoadRecording]:
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise CalibrationError(
            f"cannot be read: {reason}", fix="give a table of loads (CSV)", place=str(path)
        ) from error
    given = []
    for number, row in enumerate(rows, 2):
        place = f"{path}:{number}"
        unknown = [str(name) for name in row if name not in COLUMNS_OF_LIST]
        if unknown or not row.get("recording") or not row.get("newtons"):
            raise CalibrationError(
                f"unknown columns {', '.join(unknown)}" if unknown
                else "recording or newtons is missing",
                fix=f"the columns are {', '.join(COLUMNS_OF_LIST)}", place=place,
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
    try:
        shares = np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise CalibrationError(
            f"cannot be read: {error}", fix="give a line a row of numbers with commas between",
            place=str(path),
        ) from error  # fmt: skip
    return shares
