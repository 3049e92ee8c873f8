"""A tactile image: samples of one touch or of a mosaic, on a square grid. Thesis 4.3.

Image frame: x right along columns, y up against rows, mm; for one touch the sensor frame, for a
mosaic its own. Undefined samples (bad tactels, places without a touch) stay out of every filter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.errors import RecognizerError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class ImageError(RecognizerError):
    """A tactile image that cannot be filtered."""


@dataclass(frozen=True, slots=True, eq=False)
class TactileImage:
    """Samples of one touch or of a mosaic (the thesis's TPI and GTI)."""

    values: Array  #: (h, w) newtons, counts, or anything proportional; 0 where undefined
    defined: Mask  #: (h, w)
    step_mm: float  #: from sample to sample, both ways
    corner_mm: tuple[float, float]  #: image frame, x and y of sample (0, 0), the upper left one

    def xy_mm(self, rows: ArrayLike, columns: ArrayLike) -> Array:
        """Return the places (..., 2) of (fractional) rows and columns."""
        x = self.corner_mm[0] + np.asarray(columns, np.float64) * self.step_mm
        y = self.corner_mm[1] - np.asarray(rows, np.float64) * self.step_mm
        return np.stack([x, y], axis=-1)


def tactile_image(
    values: ArrayLike,
    *,
    step_mm: float,
    defined: ArrayLike | None = None,
    corner_mm: tuple[float, float] | None = None,
) -> TactileImage:
    """Return an image, checked; without a corner its middle is the origin.

    `values` (h, w) must be finite where `defined`, which is everywhere if not given.

    Raises
    ------
    ImageError
        If it is no image, its step is no length, or a value is NaN or infinite.
    """
    given = np.array(values, np.float64)
    known = np.ones(given.shape, np.bool_) if defined is None else np.array(defined, np.bool_)
    if given.ndim != 2 or given.size == 0 or known.shape != given.shape:
        raise ImageError(
            f"values of shape {given.shape} with a mask of shape {known.shape}",
            fix="give two (h, w) arrays of one shape",
        )
    if not (0 < step_mm < np.inf):
        raise ImageError(f"a step of {step_mm} mm", fix="give the distance of two samples")
    bad = known & ~np.isfinite(given)
    if bad.any():
        row, column = np.argwhere(bad)[0].tolist()
        raise ImageError(
            f"{int(bad.sum())} readings are NaN or infinite, the first at ({row}, {column})",
            fix="mark them as undefined",
        )
    given[~known] = 0.0
    given.setflags(write=False)
    known.setflags(write=False)
    if corner_mm is None:
        h, w = given.shape
        corner_mm = (-(w - 1) / 2 * step_mm, (h - 1) / 2 * step_mm)
    return TactileImage(given, known, float(step_mm), corner_mm)


def touch_image(
    sensor: SensorType, readings: ArrayLike, trust: ArrayLike | None = None
) -> TactileImage:
    """Return the image of one touch, in the sensor frame; tactels without trust are undefined.

    Raises
    ------
    ImageError
        Rows stand farther apart than columns.
    """
    if sensor.row_pitch_mm:
        raise ImageError(
            f"rows are {sensor.row_pitch_mm:g} mm apart, columns {sensor.pitch_mm:g} mm",
            fix="read single touches (Reader); images and mosaics need one pitch",
        )
    defined = None if trust is None else np.asarray(trust) > 0
    return tactile_image(readings, step_mm=sensor.pitch_mm, defined=defined)
