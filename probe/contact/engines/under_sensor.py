"""What of a surface lies under the sensor, as a closed body of few triangles.

Surface + sensor + touch -> corners and triangles. A written part is cut; of a surface that is
heights alone (a print, a registered face) the square under the sensor becomes a mesh. Engines
whose distance field has a fixed number of cells need little of the part, and all of what is
touched. mm, surface frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.contact.heights import heights_at, nothing_under
from probe.surface.body import body_of, indexed_triangles, manifold_from, manifold_of
from probe.surface.contract import HeightMap
from probe.surface.height_mesh import close_below, mesh_heights

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]  #: corners (n, 3) mm and triangles (m, 3)


@dataclass(frozen=True, slots=True)
class UnderSensor:
    """How much of a surface is kept, and how exactly heights are met."""

    around_mm: float = 5.0  #: around the sensor's square: domes of 2 degrees tilt
    deep_mm: float = 2.5  #: under the highest point: symbols of 1 mm and some of the wall
    cells: int = 256  #: along a side, of heights: .14 mm; grooves as narrow are filled
    tolerance_mm: float = 0.03  #: of these heights
    moved_mm: float = 0.05  #: by which the mesh may move then, to need fewer triangles


UNDER = UnderSensor()


def mesh_under(surface: HeightMap, sensor: SensorType, touch: Touch, settings: UnderSensor) -> Mesh:
    """Return what lies under the sensor: corners (n, 3) and triangles (m, 3).

    Raises
    ------
    ContactError
        There is nothing of it.
    SurfaceError
        The triangles of a part close no body.
    """
    body = body_of(surface)
    if body is None:
        return mesh_heights_under(surface, sensor, touch, settings)
    return cut_under(body, sensor, touch, settings)


def cut_under(solid_mm: Array, sensor: SensorType, touch: Touch, settings: UnderSensor) -> Mesh:
    """Return what of a body (m, 3, 3) lies under the sensor; raises as `mesh_under`."""
    from manifold3d import Manifold

    reach = max(sensor.half_mm) + settings.around_mm
    top = float(solid_mm[:, :, 2].max())
    box = Manifold.cube((2 * reach, 2 * reach, 2 * settings.deep_mm), center=True)
    box = box.rotate((0, 0, math.degrees(touch.theta_rad))).translate((touch.x_mm, touch.y_mm, top))
    corners, triangles = indexed_triangles(manifold_of(solid_mm) ^ box)
    if len(triangles) == 0:
        raise nothing_under(touch)
    return corners, triangles


def mesh_heights_under(
    surface: HeightMap, sensor: SensorType, touch: Touch, settings: UnderSensor
) -> Mesh:
    """Return the heights under the sensor as a body; raises as `mesh_under`.

    Heights are asked twice as densely as they are kept; grooves between beads, narrower than a
    cell, are filled, as rubber does not enter them. Where there is no matter, and below
    `deep_mm`, the body has a floor.
    """
    reach = max(sensor.half_mm) + settings.around_mm
    at = np.linspace(-reach, reach, 2 * settings.cells + 1)
    heights = heights_at(surface, touch, np.stack(np.meshgrid(at, at), axis=-1))
    top = float(heights.max())
    if not math.isfinite(top):
        raise nothing_under(touch)
    heights = grey_closing(np.maximum(heights, top - settings.deep_mm), size=3)[::2, ::2]
    triangles = mesh_heights(heights, settings.tolerance_mm)
    bottom = top - 2 * settings.deep_mm
    body = close_below(heights, triangles, 2 * reach / settings.cells, bottom)
    corners, faces = indexed_triangles(manifold_from(*body).simplify(settings.moved_mm))
    corners[:, :2] = touch.on_surface(corners[:, :2])
    return corners, faces
