"""The global tactile image: what a face feels like as a whole, and how sure that is. Thesis 4.3.

Canvas -> means of all touches with their standard deviations. Values are readings (newtons, or
counts) of a touch of median strength: a touch's gain against its neighbours is taken out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.scan.mosaic.canvas import COUNT, SQUARE, VALUE, WEIGHT, Canvas, rectangle_sums
from recognizer.scan.mosaic.settings import CANVAS
from recognizer.touch.tactile_image import TactileImage, tactile_image

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class GlobalImage:
    """Cells of the plane; 0 where nothing was felt. Cell (0, 0) is the upper left one."""

    values: Array  #: (h, w) weighted means
    deviation: Array  #: (h, w) standard deviation of the touches about their mean
    error: Array  #: (h, w) standard deviation of the mean
    count: NDArray[np.int64]  #: (h, w) touches
    step_mm: float
    corner_mm: tuple[float, float]  #: x and y of cell (0, 0), frame of the mosaic

    @property
    def known(self) -> NDArray[np.bool_]:
        """(h, w) cells that were felt."""
        return self.count > 0


def image_of(canvas: Canvas) -> GlobalImage:
    """Return the image of a canvas, as large as what lies on it; (0, 0) if nothing does."""
    h = canvas.cell_mm
    if not canvas.tiles:
        none = np.zeros((0, 0))
        return GlobalImage(none, none, none, none.astype(np.int64), h, (0.0, 0.0))
    at = np.array(list(canvas.tiles))
    low, high = at.min(axis=0) * CANVAS.tile, (at.max(axis=0) + 1) * CANVAS.tile
    sums = rectangle_sums(canvas, low[0], low[1], *(high - low).tolist())
    rows, columns = (np.flatnonzero((sums[COUNT] > 0.5).any(axis=axis)) for axis in (1, 0))
    sums = sums[:, rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    count = np.rint(sums[COUNT]).astype(np.int64)
    weight = np.where(count > 0, sums[WEIGHT], 1.0)
    mean = np.where(count > 0, sums[VALUE] / weight, 0.0)
    rest = np.maximum(sums[SQUARE] / weight - mean**2, 0.0)
    # touches that scatter more than they should are trusted less
    excess = np.maximum(rest * weight / np.maximum(count - 1, 1), 1.0)
    error = np.where(count > 0, np.sqrt(excess / weight), 0.0)
    corner = (float(low[1] + columns[0] + 0.5) * h, -float(low[0] + rows[0] + 0.5) * h)
    deviation = np.where(count > 1, np.sqrt(rest), 0.0)
    return GlobalImage(mean, deviation, error, count, h, corner)


def as_tactile_image(image: GlobalImage, *, touches: int = 1) -> TactileImage:
    """Return the image for the thesis's filters; cells with fewer touches are undefined."""
    return tactile_image(
        image.values,
        step_mm=image.step_mm,
        defined=image.count >= touches,
        corner_mm=image.corner_mm,
    )
