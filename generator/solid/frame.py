"""Frames of planar facets, and the edges between neighbouring vertices. Lengths in mm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import plane_axes
from generator.polyhedron.winged import Polyhedron

Frame = NDArray[np.float64]  #: (4, 4), T_to_from


def plane_frame(origin: NDArray[np.float64], ahead: NDArray[np.float64],
                normal: NDArray[np.float64]) -> Frame:  # fmt: skip
    """Return the frame at `origin` with z along `normal` and x along `ahead` in the plane."""
    frame = np.eye(4)
    frame[:3, :3] = np.stack(plane_axes(normal, ahead), axis=1)
    frame[:3, 3] = origin
    return frame


def in_frame(T_to_from: Frame, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, 3) points given in the `to` frame in the `from` frame."""
    result: NDArray[np.float64] = (points - T_to_from[:3, 3]) @ T_to_from[:3, :3]
    return result


def edge_numbers(polyhedron: Polyhedron) -> dict[tuple[int, int], int]:
    """Return the edge number of every directed pair of neighbouring vertices."""
    numbers: dict[tuple[int, int], int] = {}
    for number, edge in enumerate(polyhedron.edges):
        numbers[edge.start, edge.end] = number
        numbers[edge.end, edge.start] = number
    return numbers
