"""Surfaces: a height over a plane, evaluated at points.

Surface frame: a plane near the touched material, z out of it; for a part's face it is the
face frame (origin at the face's first vertex, x along its first edge). The sensor looks
along -z, so at each (x, y) only the highest matter counts: neighbouring faces beyond an edge
are lower parts of the same surface. mm throughout.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class HeightMap(Protocol):
    """A height field; its cost is per point, not per face."""

    @property
    def top_mm(self) -> float:
        """An upper bound of all heights (tops of the symbols)."""
        ...

    def heights_mm(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return z (n,) of the highest matter at points (n, 2); -inf where there is none."""
        ...
