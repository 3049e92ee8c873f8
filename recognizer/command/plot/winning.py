"""The lattice that explains a touch best, and the symbols that are on it.

A touch -> WinningLattice: pose of the lattice under the sensor, and for every cell in view the
symbol that the database holds there and whether it is felt. A touch that is not answered has one
too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.hypothesis import Hypothesis, labels_at
from recognizer.touch.lab import EmbossedArray, EncodedFace
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise_with_hypothesis
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

CLEARLY = 3.0  #: nats


@dataclass(frozen=True, slots=True, eq=False)
class WinningLattice:
    """The best reading of a touch."""

    encoding: EmbossedArray
    place: Hypothesis
    face: EncodedFace
    x_mm: float  #: a sensor point s lies at R(theta) s + (x, y) on the lattice
    y_mm: float
    theta_rad: float
    cells: Ints  #: (m, 2) column and upward row of the lattice
    registered: Ints  #: (m,) symbol that the face holds there; -1: none
    felt: NDArray[np.bool_]  #: (m,) whether nothing else is clearly likelier there

    def on_sensor(self, points_mm: Array) -> Array:
        """Return points (..., 2) of the lattice in the sensor frame, mm."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        away = points_mm - (self.x_mm, self.y_mm)
        turned: Array = away @ np.array([[c, -s], [s, c]])
        return turned

    def on_lattice(self, points_mm: Array) -> Array:
        """Return points (..., 2) of the sensor in the lattice frame, mm."""
        c, s = math.cos(self.theta_rad), math.sin(self.theta_rad)
        turned: Array = points_mm @ np.array([[c, s], [-s, c]]) + (self.x_mm, self.y_mm)
        return turned


def winning_lattice(reader: Reader, signal: Signal) -> WinningLattice | None:
    """Return the best reading of a touch; None where no symbol is seen."""
    _, best = recognise_with_hypothesis(reader, signal)
    if best is None:
        return None
    encoding, place, fit = best.embossed, best.hypothesis, best.fit
    shown = labels_at(encoding, place, fit.cells)
    return WinningLattice(
        encoding=encoding,
        place=place,
        face=encoding.face(place.face),
        x_mm=fit.x_mm,
        y_mm=fit.y_mm,
        theta_rad=fit.theta_rad,
        cells=fit.cells,
        registered=np.where(shown == encoding.array.order, -1, shown),
        felt=fit.scores[np.arange(len(shown)), shown] > -CLEARLY,
    )
