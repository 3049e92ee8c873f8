"""Frames, through a filter, and mosaics as bytes for the pages, little endian. Thesis 4.3.

frame    "F", unit (0 counts, 1 N), filter (its number), 0, seq u32, device time f64 (s),
         received f64 (ms since 1970, the server's clock), largest f32, sum f32 of the readings
         over their bias; from byte 32 on a value f32 for each tactel, row 0 on top
mosaic   "M", 0, 0, 0, rows u32, columns u32, touches u32, step f32 (mm), corner x and y f32 (mm,
         of the upper left cell), largest f32; from byte 32 on rows x columns u8: 0 not
         touched, 1 ... 255 from 0 to the largest
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.scan.mosaic.canvas import GlobalImage
from recognizer.thesis.filters import median, sobel, subtract_bias
from recognizer.touch.tactile_image import tactile_image

Array = NDArray[np.float64]

FILTERS = ("raw", "bias-free", "median", "sobel")  #: each works on the result of the one before
MOSAIC_CELLS = 512  #: rows or columns of a mosaic that is sent; beyond, cells are left out

_FRAME = struct.Struct("<cBBBIddff")
_MOSAIC = struct.Struct("<cBBBIIIffff")


@dataclass(slots=True, eq=False)
class FrameMessage:
    """A frame for the pages; each filter is computed when the first page asks for it."""

    readings: Array  #: (rows, columns) counts or N
    sensor: SensorType
    bias: Array | None
    newtons: bool
    seq: int
    t_s: float
    received_ms: float
    _made: dict[str, bytes] = field(default_factory=dict)

    def as_bytes(self, filter_name: str, /) -> bytes:
        """Return the message with the image through a filter."""
        if filter_name not in self._made:
            values = filter_image(self.readings, self.sensor, filter_name, self.bias)
            over = values if filter_name == "bias-free" else filter_image(
                self.readings, self.sensor, "bias-free", self.bias
            )  # fmt: skip
            head = _FRAME.pack(
                b"F", self.newtons, FILTERS.index(filter_name), 0, self.seq % 2**32, self.t_s,
                self.received_ms, float(values.max()), float(over.sum()),
            )  # fmt: skip
            self._made[filter_name] = head + values.astype("<f4").tobytes()
        return self._made[filter_name]


def mosaic_message(image: GlobalImage, touches: int) -> bytes:
    """Return a mosaic's image, thinned where it is large."""
    thin = max(1, -(-max(image.values.shape, default=0) // MOSAIC_CELLS))
    values, known = image.values[::thin, ::thin], image.known[::thin, ::thin]
    top = float(values.max(initial=0.0))
    scaled = np.clip(np.rint(values * (254 / top if top > 0 else 0.0)), 0, 254).astype(np.uint8)
    head = _MOSAIC.pack(
        b"M", 0, 0, 0, *values.shape, touches, image.step_mm * thin, *image.corner_mm, top
    )
    return head + np.where(known, scaled + 1, 0).astype(np.uint8).tobytes()


def filter_image(
    readings: Array, sensor: SensorType, filter_name: str, bias: Array | None = None
) -> Array:
    """Return an image (rows, columns), counts or newtons, through one of `FILTERS`.

    `bias` is the reading at rest; the lowest twentieth of the image if not given. The result has
    the same unit; that of Sobel is a slope per mm.
    """
    if filter_name == "raw":
        return readings
    over = readings if bias is None else np.maximum(readings - bias, 0.0)
    image = tactile_image(over, step_mm=sensor.pitch_mm)
    image = subtract_bias(image) if bias is None else image
    if filter_name == "bias-free":
        return image.values
    image = median(image)
    if filter_name == "median":
        return image.values
    return np.hypot(*sobel(image))
