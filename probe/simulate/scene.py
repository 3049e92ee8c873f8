"""What a simulated touch meets: a surface, where on it a sensor may stand, and whose it is.

The surface frame of a registered face is its face frame (origin at the first vertex, x along
the first edge, z outward); of a part alone it is the frame of its file. A round face is touched
in the plane that is tangent where the touch is: `Scene.under` gives the scene of that touch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.surface.contract import HeightMap
from probe.surface.polygon import FaceRegion, polygon

GRID = 64  #: points each way among which the inmost of a region is chosen
BARE_MM = 100.0  #: half the side of the region of a surface of no object


@dataclass(frozen=True, slots=True)
class Scene:
    """A surface with its region and its name."""

    surface: HeightMap
    region: FaceRegion  #: where touches may have their centre, surface frame
    name: str  #: as messages and recordings name it
    object_name: str = ""  #: empty: not known
    face: str = ""  #: empty: not known
    T_object_surface: NDArray[np.float64] | None = None  #: (4, 4) mm; None: not known
    scene_at: Callable[[Touch], Scene] | None = None  #: of a round face: the scene of a touch

    def under(self, touch: Touch) -> Scene:
        """Return the scene of a touch; on a flat face that is always this one."""
        return self if self.scene_at is None else self.scene_at(touch)

    def centre_mm(self) -> NDArray[np.float64]:
        """Return the region's middle (2,): the mean of its area, or its inmost point."""
        x0, x1 = self.region.starts[:, 0], self.region.ends[:, 0]
        y0, y1 = self.region.starts[:, 1], self.region.ends[:, 1]
        low, high = self.region.box_mm
        at = (low + high) / 2
        x0, x1, y0, y1 = x0 - at[0], x1 - at[0], y0 - at[1], y1 - at[1]
        area = x0 * y1 - x1 * y0
        mean = np.array([((x0 + x1) * area).sum(), ((y0 + y1) * area).sum()]) / (3 * area.sum())
        if self.region.contains((at + mean)[None])[0]:
            middle: NDArray[np.float64] = at + mean
            return middle
        points = self._grid()
        inmost: NDArray[np.float64] = points[np.argmax(self.region.distance_mm(points))]
        return inmost

    def inradius_mm(self) -> float:
        """Return how far the inmost point of the region lies from its edges, mm, nearly."""
        return float(self.region.distance_mm(self._grid()).max())

    def _grid(self) -> NDArray[np.float64]:
        """Return points of a grid that lie in the region (n, 2)."""
        low, high = self.region.box_mm
        x, y = (low + (high - low) * np.linspace(0, 1, GRID)[:, None]).T
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        inside: NDArray[np.float64] = points[self.region.contains(points)]
        return inside


def bare_scene(surface: HeightMap, name: str = "") -> Scene:
    """Return the scene of a surface of no object, a square about its origin."""
    corners = BARE_MM * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return Scene(surface, polygon([corners]), name)
