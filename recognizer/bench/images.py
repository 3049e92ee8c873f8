"""A frame as the page shows it: raw, bias-free, median, or Sobel. Thesis 4.3.

Each filter works on the result of the one before it, as the thesis's does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.thesis.filters import median, sobel, subtract_bias
from recognizer.touch.tactile_image import tactile_image

Array = NDArray[np.float64]

FILTERS = ("raw", "bias-free", "median", "sobel")


def filter_image(
    readings: Array, sensor: SensorType, filter_name: str, bias: Array | None = None
) -> Array:
    """Return an image through a filter.

    Parameters
    ----------
    readings
        (rows, columns) counts or newtons.
    filter_name
        One of `FILTERS`.
    bias
        (rows, columns) reading at rest; the lowest twentieth of the image if not given.

    Returns
    -------
    (rows, columns) in the same unit; Sobel: its slope per mm.
    """
    if filter_name == "raw":
        return readings
    image = subtract_bias(tactile_image(readings, step_mm=sensor.pitch_mm), bias)
    if filter_name == "bias-free":
        return image.values
    image = median(image)
    if filter_name == "median":
        return image.values
    return np.hypot(*sobel(image))
