"""Image -> places where what is felt begins: Sobel's slopes, thresholded and thinned.

A sample is an edge point where the slope is large and larger than that of its neighbours up
and down the slope; a parabola through the three says where between the samples it is largest.
Image frame, mm. Thesis 4.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.thesis.filters import sobel
from recognizer.thesis.settings import EDGE_SEARCH
from recognizer.touch.tactile_image import TactileImage

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class EdgePoints:
    """Places on edges."""

    at_mm: Array  #: (n, 2)
    normals: Array  #: (n, 2) unit vectors up the slope: to where more is felt
    slopes: Array  #: (n,) how steep, per mm

    def __len__(self) -> int:
        return len(self.at_mm)

    def chosen(self, mask: NDArray[np.bool_] | NDArray[np.intp]) -> EdgePoints:
        """Return some of them."""
        return EdgePoints(self.at_mm[mask], self.normals[mask], self.slopes[mask])


def edge_points(image: TactileImage, steep: float = EDGE_SEARCH.steep) -> EdgePoints:
    """Return the edge points of an image over its bias, in reading order.

    Samples with an undefined one beside them have no slope, and those at the rim none across it.
    """
    from scipy.ndimage import binary_erosion, map_coordinates

    x, y = sobel(image)
    slope = np.hypot(x, y)
    known = binary_erosion(image.defined, np.ones((3, 3)), border_value=1)
    slope[~known] = 0.0
    if not slope.any():
        return EdgePoints(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0))
    least = steep * np.quantile(slope[slope > 0], 0.95)
    rows, columns = np.nonzero(slope > least)
    at = slope[rows, columns]
    normals = np.stack([x[rows, columns], y[rows, columns]], axis=-1) / at[:, None]
    beside = [
        map_coordinates(
            slope,
            [rows - side * normals[:, 1], columns + side * normals[:, 0]],
            order=1,
            mode="constant",
        )
        for side in (-1, 1)
    ]
    highest = (at >= beside[0]) & (at > beside[1])
    rows, columns, normals, at = rows[highest], columns[highest], normals[highest], at[highest]
    before, after = beside[0][highest], beside[1][highest]
    bend = before - 2 * at + after
    between = np.where(bend < 0, (before - after) / np.where(bend < 0, 2 * bend, 1.0), 0.0)
    offsets = np.clip(between, -0.5, 0.5)[:, None] * normals * image.step_mm
    return EdgePoints(image.xy_mm(rows, columns) + offsets, normals, at)
