"""Readings that arrive at other places than the sensor has them: detected, and undone on request.

A matrix that is wired mirrored, by swapped halves, or whose readings fall with force shows symbols
of no database. Undone, they appear: if several refused touches are recognised under one change,
that is the wiring of the sensor. It is reported, and never applied unasked: a mirrored image is
recognised under a flip of columns, of rows and transposed alike, a quarter or half turn apart.

A touch placed by hand, with known face and direction, distinguishes them: of the eight ways in
which a square image can lie, one shows the named face in the named direction (`find_mounting`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration import Calibration
from probe.frame import Frame
from recognizer.errors import WiringError
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.sensor_state import invert_floating
from recognizer.touch.signal import swap_halves
from recognizer.touch.source import TouchImage

Array = NDArray[np.float64]
#: Image (rows, columns) and the highest reading -> image.
Change = Callable[[NDArray[np.generic], int], NDArray[np.generic]]

#: Each undoes itself, but for `quarter`, which turns the image by a quarter to the left.
CHANGES: dict[str, Change] = {
    "columns": lambda image, _: image[:, ::-1],
    "rows": lambda image, _: image[::-1],
    "transpose": lambda image, _: image.T,
    "column-halves": lambda image, _: swap_halves(image, 1),
    "row-halves": lambda image, _: swap_halves(image, 0),
    "values": lambda image, full: full - np.minimum(image, full),
    "quarter": lambda image, _: np.rot90(image),
}
#: Changes that refused touches can show, with a message; the others are a turn of one of these.
HINTS = {
    "columns": "columns or rows seem reversed, or the image transposed: `--flip columns` (rows, "
    "transpose); `recognize-object check` tells which",
    "values": "readings seem to fall with force: `--flip values`",
    "column-halves": "the halves of the columns seem swapped: `--flip column-halves`",
    "row-halves": "the halves of the rows seem swapped: `--flip row-halves`",
    "floating": "rows seem to float while another is read: `--learn FILE` inverts the network",
}

#: The eight ways in which a square image can lie, each undone, and their words; a matrix that is
#: not square has the first four.
WORDS: dict[tuple[str, ...], str] = {
    (): "as drawn",
    ("quarter", "quarter"): "half a turn off",
    ("columns",): "with its columns reversed",
    ("rows",): "with its rows reversed",
    ("quarter",): "a quarter turn off",
    ("quarter", "quarter", "quarter"): "a quarter turn off, the other way",
    ("transpose",): "transposed",
    ("transpose", "quarter", "quarter"): "transposed across the other diagonal",
}
WAYS = tuple(WORDS)

TRIED = 6  #: refused touches that are read under each change
FACING_DEG = 40.0  #: largest error of a direction that a person places by hand


@dataclass(frozen=True, slots=True)
class Wiring:
    """Changes that bring readings back to where the sensor has them, one after another.

    Examples
    --------
    >>> wiring_named("columns,values").apply(np.array([[0, 1], [2, 3]]), full=3).tolist()
    [[2, 3], [0, 1]]
    """

    changes: tuple[str, ...] = ()

    def apply(self, image: NDArray[np.generic], full: int) -> NDArray[np.generic]:
        """Return an image (rows, columns) with every reading at its place on the sensor.

        Raises
        ------
        WiringError
            The changes would give it another shape.
        """
        found = image
        for change in self.changes:
            found = CHANGES[change](found, full)
        if found.shape != image.shape:
            raise WiringError(
                f"{' and '.join(self.changes)} of {image.shape[0]} x {image.shape[1]} tactels",
                fix="flip columns, rows or halves: the matrix is not square",
                place="--flip",
            )
        return np.ascontiguousarray(found)

    def check(self, shape: tuple[int, int]) -> None:
        """Raise `WiringError` if an image (rows, columns) would have another shape."""
        self.apply(np.zeros(shape), 0)

    def frame(self, frame: Frame, full: int) -> Frame:
        """Return a frame with every reading at its place on the sensor."""
        if not self.changes:
            return frame
        return replace(frame, counts=self.apply(frame.counts, full).astype(frame.counts.dtype))


@dataclass(frozen=True, slots=True, eq=False)
class FoundMounting:
    """The mounting by a touch that was placed by hand."""

    wiring: Wiring  #: that undoes it
    answer: Recognition  #: under it
    turn_deg: float  #: from the direction that was asked for

    def __str__(self) -> str:
        words = WORDS[self.wiring.changes]
        step = f"; read with --flip {','.join(self.wiring.changes)}" if self.wiring.changes else ""
        return (
            f"the sensor is mounted {words}: {self.answer.object}/{self.answer.face} at "
            f"({self.answer.x_mm:.1f}, {self.answer.y_mm:.1f}) mm, {self.turn_deg:.0f} degrees "
            f"off the asked direction{step}"
        )


def wiring_named(text: str) -> Wiring:
    """Return the wiring of an option such as `columns,values`; `WiringError` for unknown names."""
    names = tuple(filter(None, (part.strip() for part in text.split(","))))
    for name in names:
        if name not in CHANGES:
            raise WiringError(
                f"'{name}' is no change", fix=f"give one of {', '.join(CHANGES)}", place="--flip"
            )
    return Wiring(names)


def wiring_hint(
    reader: Reader,
    refused: Sequence[TouchImage | ArrayLike],
    *,
    calibration: Calibration | None = None,
) -> str:
    """Return a message on the likely wiring; empty where refused touches do not show it."""
    images = [
        np.asarray(one.counts if isinstance(one, TouchImage) else one, np.float64)
        for one in refused[:TRIED]
    ]
    full = reader.sensor.full
    best, count = "", 0
    for name in HINTS:
        if name == "floating" and calibration is not None:
            continue
        change = CHANGES.get(name, lambda image, _: invert_floating(image))
        read = sum(bool(reader.read(change(one, full), calibration=calibration)) for one in images)
        if read > count:
            best, count = name, read
        if 2 * count > len(images):
            break
    if not count or 2 * count < len(images) or (len(images) > 1 and count < 2):
        return ""
    if len(images) == 1:
        return f"one touch says it alone, so it may be chance: {HINTS[best]}"
    return f"{count} of {len(images)} touches that were refused are recognised so: {HINTS[best]}"


def simplify_turns(wiring: Wiring, shape: tuple[int, int]) -> Wiring:
    """Return the one of the eight ways that equals a wiring; the wiring itself if none does.

    Examples
    --------
    >>> simplify_turns(Wiring(("quarter",) * 5), (16, 16)).changes
    ('quarter',)
    """
    image = np.arange(shape[0] * shape[1]).reshape(shape)
    wanted = wiring.apply(image, 0)
    for way in _ways(shape):
        if np.array_equal(Wiring(way).apply(image, 0), wanted):
            return Wiring(way)
    return wiring


def _ways(shape: tuple[int, ...]) -> tuple[tuple[str, ...], ...]:
    """Return the ways in which an image of so many rows and columns can lie."""
    return WAYS if shape[0] == shape[1] else WAYS[:4]


def find_mounting(
    reader: Reader,
    image: ArrayLike,
    face: tuple[str, str],
    *,
    calibration: Calibration | None = None,
) -> FoundMounting | Recognition:
    """Return the mounting of a sensor; the plain answer, where none of the ways fits.

    The image (rows, columns) is a touch of `face` (object and face), placed by hand with the
    sensor's x axis along that of the face, within `FACING_DEG`.
    """
    readings = np.asarray(image, np.float64)
    plain = reader.read(readings, calibration=calibration)
    found: list[FoundMounting] = []
    for changes in _ways(readings.shape):
        wiring = Wiring(changes)
        answer = plain
        if changes:
            turned = wiring.apply(readings, reader.sensor.full)
            answer = reader.read(turned, calibration=calibration)
        if (answer.object, answer.face) == face:
            turn = math.remainder(answer.theta_deg, 360.0)
            found.append(FoundMounting(wiring, answer, turn))
    near = [one for one in found if abs(one.turn_deg) < FACING_DEG]
    return min(near, key=lambda one: abs(one.turn_deg)) if near else plain
