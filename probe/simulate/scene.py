"""What a simulated touch meets: a surface, where on it a sensor may stand, and whose it is.

The surface frame of a registered face is its face frame (origin at the first vertex, x along
the first edge, z outward); of a part alone it is the frame of its file. A round face is touched
in the plane that is tangent where the touch is: `Scene.under` gives the scene of that touch.

A `Touch` is its own truth: where the sensor stands, how it is turned and pressed. Thesis 4.2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Contact, Touch, WristStiffness
from probe.errors import SurfaceError
from probe.surface.contract import HeightMap
from probe.surface.polygon import FaceRegion, polygon

BLOCKED_MM = 3.0  #: over a flat face; symbols are 1 mm high
GRID = 64  #: points each way among which the inmost of a region is chosen
BARE_MM = 100.0  #: half the side of the region of a surface of no object
TRIES = 16_000  #: draws for one touch: a region that fills 0.1 % of its box is still found
AT_ONCE = 16  #: draws


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

    def meets_another_face(self, z_mm: float) -> bool:
        """Whether a plate at rest so high over a flat face stands on another one of its part."""
        flat = self.T_object_surface is not None and self.scene_at is None  # and its frame known
        return flat and BLOCKED_MM < z_mm < math.inf

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


@dataclass(frozen=True, slots=True)
class TouchRanges:
    """Ranges of random touches; any rotation."""

    force_n: tuple[float, float] = (20.0, 120.0)
    tilt_rad: float = math.radians(2.0)  #: largest tilt of the unloaded wrist, in any direction
    margin_mm: float = 0.0  #: least distance of the sensor's centre from the region's edges
    wrist: WristStiffness = field(default_factory=WristStiffness)


def random_touches(
    region: FaceRegion, rng: np.random.Generator, ranges: TouchRanges | None = None
) -> Iterator[Touch]:
    """Yield touches without end, their centres uniform over a region (surface frame).

    Raises `SurfaceError` when the region has no place so far from its edges, or a range is no
    range.
    """
    given = ranges or TouchRanges()
    low_n, high_n = given.force_n
    if not (0 <= low_n <= high_n < math.inf and given.tilt_rad >= 0 and given.margin_mm >= 0):
        raise SurfaceError(
            f"forces {low_n:g} ... {high_n:g} N, tilt {math.degrees(given.tilt_rad):g} degrees, "
            f"margin {given.margin_mm:g} mm",
            fix="give rising forces, tilt and margin of 0 or more",
        )
    while True:
        x, y = _place(region, rng, given.margin_mm)
        theta, towards = rng.uniform(-math.pi, math.pi, 2)
        tilt = given.tilt_rad * math.sqrt(rng.random())
        yield Touch(
            x_mm=x,
            y_mm=y,
            theta_rad=float(theta),
            force_n=float(rng.uniform(low_n, high_n)),
            tilt_x_rad=tilt * math.cos(towards),
            tilt_y_rad=tilt * math.sin(towards),
            wrist=given.wrist,
        )


def pose_of(touch: Touch, contact: Contact) -> NDArray[np.float64]:
    """Return T_surface_sensor (4, 4) of the plate at rest, mm.

    The plate is turned by theta about z, then by its tilts about its own x and y.
    """
    c, s = math.cos(touch.theta_rad), math.sin(touch.theta_rad)
    a, b = contact.tilt_x_rad, contact.tilt_y_rad
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, math.cos(a), -math.sin(a)], [0, math.sin(a), math.cos(a)]])
    about_y = np.array([[math.cos(b), 0, math.sin(b)], [0, 1, 0], [-math.sin(b), 0, math.cos(b)]])
    T_surface_sensor = np.eye(4)
    T_surface_sensor[:3, :3] = about_z @ about_x @ about_y
    T_surface_sensor[:3, 3] = touch.x_mm, touch.y_mm, contact.z_mm
    return T_surface_sensor


def _place(region: FaceRegion, rng: np.random.Generator, margin_mm: float) -> tuple[float, float]:
    """Draw a point of a region, uniform in the part that lies a margin inside its edges."""
    low, high = region.box_mm
    for _ in range(TRIES // AT_ONCE):
        points = low + (high - low) * rng.random((AT_ONCE, 2))
        points = points[region.contains(points)]
        if margin_mm > 0:
            points = points[region.distance_mm(points) >= margin_mm]
        if len(points):
            return float(points[0, 0]), float(points[0, 1])
    raise SurfaceError(
        f"no place lies {margin_mm:g} mm inside the edges of a face of "
        f"{high[0] - low[0]:.3g} x {high[1] - low[1]:.3g} mm",
        fix="take a smaller margin, or a larger face",
    )
