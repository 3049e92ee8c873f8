"""Readings that arrive in other places than the sensor has them: said, and undone on request.

A matrix that is wired mirrored, by swapped halves, or whose readings fall with force shows symbols
that no database holds. Undone, they are there again: if several refused touches are recognised
under one and the same way, that is how the sensor is wired. It is said, and never applied unasked:
a mirrored image is recognised under a flip of columns, of rows and transposed alike, a quarter or
half turn apart, and no touch tells which (`recognizer.sensor.mounting` does).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.calibration import Calibration
from probe.frame import Frame
from recognizer.errors import WiringError
from recognizer.sensor.settings import LEARNING, LearningSettings
from recognizer.touch.reader import Reader
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
#: What touches can tell; the others are a turn of one of these.
TOLD = {
    "columns": "columns or rows seem reversed, or the image transposed: `--flip columns` (rows, "
    "transpose); `recognize-object check` tells which",
    "values": "readings seem to fall with force: `--flip values`",
    "column-halves": "the halves of the columns seem swapped: `--flip column-halves`",
    "row-halves": "the halves of the rows seem swapped: `--flip row-halves`",
    "floating": "rows seem to float while another is read: `--learn FILE` inverts the network",
}


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
        """Return an image (rows, columns) as the sensor has it.

        Raises
        ------
        WiringError
            It would have another shape.
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
        """Refuse changes under which an image (rows, columns) would have another shape.

        Raises
        ------
        WiringError
            It would.
        """
        self.apply(np.zeros(shape), 0)

    def frame(self, frame: Frame, full: int) -> Frame:
        """Return a frame as the sensor has it."""
        if not self.changes:
            return frame
        return replace(frame, counts=self.apply(frame.counts, full).astype(frame.counts.dtype))


def wiring_named(text: str) -> Wiring:
    """Return the wiring of an option such as `columns,values`.

    Raises
    ------
    WiringError
        A name that is none.
    """
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
    settings: LearningSettings = LEARNING,
) -> str:
    """Return in words how a sensor seems to be wired; empty where refused touches do not tell.

    Parameters
    ----------
    refused
        Touches that were not recognised; a few are tried.
    """
    images = [
        np.asarray(one.counts if isinstance(one, TouchImage) else one, np.float64)
        for one in refused[: settings.tried]
    ]
    full = reader.sensor.full
    best, count = "", 0
    for name in TOLD:
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
        return f"one touch says it alone, so it may be chance: {TOLD[best]}"
    return f"{count} of {len(images)} touches that were refused are recognised so: {TOLD[best]}"
