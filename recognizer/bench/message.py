"""Frames and mosaics as bytes, little endian.

frame    "F", unit (0 counts, 1 N), filter (its number), 0, seq u32, device time f64 (s),
         received f64 (ms since 1970, the server's clock), largest f32, sum f32 of the readings
         over their bias; from byte 32 on 256 values f32, row 0 on top
mosaic   "M", 0, 0, 0, rows u32, columns u32, touches u32, step f32 (mm), corner x and y f32 (mm,
         of the upper left cell), largest f32; from byte 32 on rows x columns u8: 0 not felt,
         1 ... 255 from 0 to the largest
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from probe.sensor import SensorType
from recognizer.bench.images import FILTERS, filtered
from recognizer.scan.mosaic.image import GlobalImage

Array = NDArray[np.float64]

LARGEST = 512  #: rows or columns of a mosaic that is sent; beyond, cells are left out
_FRAME = struct.Struct("<cBBBIddff")
_MOSAIC = struct.Struct("<cBBBIIIffff")


@dataclass(slots=True, eq=False)
class FramePicture:
    """A frame for the pages; each filter is computed when the first page asks for it."""

    readings: Array  #: (16, 16) counts or N
    sensor: SensorType
    bias: Array | None
    newtons: bool
    seq: int
    t_s: float
    received_ms: float
    _made: dict[str, bytes] = field(default_factory=dict)

    def as_bytes(self, wish: str, /) -> bytes:
        """Return the message with the image through a filter."""
        if wish not in self._made:
            values = filtered(self.readings, self.sensor, wish, self.bias)
            over = values if wish == "bias-free" else filtered(
                self.readings, self.sensor, "bias-free", self.bias
            )  # fmt: skip
            head = _FRAME.pack(
                b"F", self.newtons, FILTERS.index(wish), 0, self.seq % 2**32, self.t_s,
                self.received_ms, float(values.max()), float(over.sum()),
            )  # fmt: skip
            self._made[wish] = head + values.astype("<f4").tobytes()
        return self._made[wish]


@dataclass(frozen=True, slots=True, eq=False)
class MosaicPicture:
    """A mosaic for the pages."""

    made: bytes

    def as_bytes(self, _wish: str, /) -> bytes:
        """Return the message, the same for every page."""
        return self.made


def mosaic_picture(image: GlobalImage, touches: int) -> MosaicPicture:
    """Return a mosaic's image, thinned where it is large."""
    thin = max(1, -(-max(image.values.shape, default=0) // LARGEST))
    values, known = image.values[::thin, ::thin], image.known[::thin, ::thin]
    top = float(values.max(initial=0.0))
    scaled = np.clip(np.rint(values * (254 / top if top > 0 else 0.0)), 0, 254).astype(np.uint8)
    head = _MOSAIC.pack(
        b"M", 0, 0, 0, *values.shape, touches, image.step_mm * thin, *image.corner_mm, top
    )
    return MosaicPicture(head + np.where(known, scaled + 1, 0).astype(np.uint8).tobytes())
