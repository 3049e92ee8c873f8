"""What engines that press meshes share: the part under the sensor, and the plate at rest.

Surface + touch -> corners and triangles under the sensor: a written part is cut, heights alone (a
print, a registered face) become a mesh. Forces that an engine feels at a pose of the plate -> the
pose at which forces and moments balance those of the touch and the wrist. mm, N.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import STEEPEST_RAD, Contact, Touch, heights_under, nothing_under
from probe.contact.plate import check_load
from probe.errors import ContactError, SurfaceError
from probe.surface.body import (
    body_of,
    close_below,
    indexed_triangles,
    manifold_from,
    manifold_of,
    mesh_heights,
)
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]  #: corners (n, 3) mm and triangles (m, 3)
ForcesAt = Callable[[Array], tuple[Array, Array]]
"""Plate (z mm, tilt x, tilt y) -> force on each point (n,), N, and how it grows (n,), N / mm."""

STEP_MM = 0.3  # at most, of the advance and of the rim by a tilt
HALVINGS = 8  # of a step that does not help
MOST_STEPS = 60  # of Newton's method; 5-12 are usual
DAMPED = 1e-9  # of the stiffness: one row of points that bears all is not singular
AROUND_MM = 5.0  #: of the part, kept around the sensor's square: domes of 2 degrees tilt
DEEP_MM = 2.5  #: of the part, kept under its highest point: symbols of 1 mm and some of the wall
CELLS = 256  # along a side, of heights: .14 mm; narrower grooves are filled
HEIGHT_TOLERANCE_MM = 0.03
MOVED_MM = 0.05  # by which the mesh of heights may move, to need fewer triangles


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Imbalance at a pose of the plate, and the force on every point."""

    wrong_n: Array  #: (1 to 3,) force and moments (over the half width) that do not balance
    forces_n: Array  #: (n,)
    slopes: Array  #: (n,) N / mm, of the points in contact


def rest_on(
    forces_at: ForcesAt, top_mm: float, at: Array, touch: Touch, shape: tuple[int, int],
    engine: str, *, deep_mm: float = DEEP_MM, halvings: int = 12, tolerance: float = 1e-4,
) -> Contact:  # fmt: skip
    """Advance and tilt the plate until it balances: damped Newton on force and moments.

    `at` (n, 2) are the points of all tips, row by row, `top_mm` the highest place of the part. A
    level plate is looked for down to `deep_mm` below it, by `halvings`; the balance is missed by
    at most `tolerance` of the force.

    Raises `ContactError` if there is no rest.
    """
    half = float(np.abs(at).max())
    rows = np.stack([np.ones(len(at)), at[:, 1] / half, -at[:, 0] / half])  # of pressing
    unloaded = np.array([touch.tilt_x_rad, touch.tilt_y_rad]) * half
    stiffness = np.array([touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad]) / half**2
    held = np.isinf(stiffness)
    stiffness = np.where(held, 0.0, stiffness)
    free = np.array([True, *~held])

    def balance(plate: Array) -> Balance:
        forces, slopes = forces_at(np.array([plate[0], plate[1] / half, plate[2] / half]))
        wrist = np.array([touch.force_n, *(stiffness * (plate[1:] - unloaded))])
        return Balance((rows @ forces - wrist)[free], forces, slopes)

    lift = float(np.abs(unloaded).sum())
    plate = np.array([top_mm + lift, *unloaded])
    plate[0], now = _advance(balance, plate, lift + deep_mm, halvings)
    for step in range(1, MOST_STEPS + 1):
        if np.abs(now.wrong_n).max() <= tolerance * touch.force_n:
            tilts = plate[1:] / half
            if np.abs(tilts).max() > STEEPEST_RAD:
                break
            per_tab = now.forces_n.reshape(shape[0] * shape[1], -1).sum(axis=1)
            return Contact(
                per_tab.reshape(shape), float(plate[0]), float(tilts[0]), float(tilts[1]),
                engine, step,
            )  # fmt: skip
        stiff = ((rows * now.slopes) @ rows.T + np.diag([0.0, *stiffness]))[np.ix_(free, free)]
        move = np.zeros(3)
        damped = stiff + DAMPED * np.trace(stiff) * np.eye(len(stiff))
        move[free] = np.linalg.solve(damped, now.wrong_n)
        move *= min(1.0, STEP_MM / max(float(np.abs(move).max()), STEP_MM))
        for _ in range(HALVINGS):
            then = balance(plate + move)
            if np.linalg.norm(then.wrong_n) < np.linalg.norm(now.wrong_n):
                break
            move /= 2
        plate, now = plate + move, then
    raise ContactError(
        f"the plate finds no rest in engine {engine}",
        fix="press with less force, or nearer to the middle of the face",
    )


def _advance(
    balance: Callable[[Array], Balance], plate: Array, most_mm: float, halvings: int
) -> tuple[float, Balance]:
    """Return the height at which the plate, tilted as the unloaded wrist, bears the force."""
    high, low, found = plate[0], plate[0] - most_mm, None
    for _ in range(halvings):
        middle = (high + low) / 2
        now = balance(np.array([middle, *plate[1:]]))
        if now.wrong_n[0] > 0:
            low, found = middle, now
        else:
            high = middle
    found = found or balance(np.array([low, *plate[1:]]))
    if found.wrong_n[0] <= 0:
        raise ContactError(
            "there is too little under the sensor to bear the force",
            fix="move the sensor over the object, or press with less force",
        )
    return float(low), found


def check_tabs(engine: str, sensor: SensorType, touch: Touch) -> None:
    """Refuse an overlay that is no tabs, and a load as `check_load` does."""
    if sensor.overlay.kind != "tab":
        raise ContactError(
            f"engine {engine} knows tabs, the overlay is a {sensor.overlay.kind}",
            fix="take --engine own for a pad",
        )
    check_load(touch)


def triangles_under(surface: HeightMap, sensor: SensorType, touch: Touch) -> tuple[int, int] | None:
    """Return how many triangles of a body a touch needs, and how many the body has."""
    body = body_of(surface)
    return None if body is None else (len(mesh_under(surface, sensor, touch)[1]), len(body))


def mesh_under(surface: HeightMap, sensor: SensorType, touch: Touch) -> Mesh:
    """Return the surface under the sensor: corners (n, 3) and triangles (m, 3).

    Triangles that close no body (those around a place of a round face) are taken as heights.
    Raises `ContactError` if there is nothing of it.
    """
    solid_mm = body_of(surface)
    if solid_mm is None:
        return _mesh_heights_under(surface, sensor, touch)
    try:
        solid = manifold_of(solid_mm)
    except SurfaceError:
        return _mesh_heights_under(surface, sensor, touch)
    from manifold3d import Manifold

    reach = max(sensor.half_mm) + AROUND_MM
    top = float(solid_mm[:, :, 2].max())
    box = Manifold.cube((2 * reach, 2 * reach, 2 * DEEP_MM), center=True)
    box = box.rotate((0, 0, math.degrees(touch.theta_rad))).translate((touch.x_mm, touch.y_mm, top))
    corners, triangles = indexed_triangles(solid ^ box)
    if len(triangles) == 0:
        raise nothing_under(touch)
    return corners, triangles


def _mesh_heights_under(surface: HeightMap, sensor: SensorType, touch: Touch) -> Mesh:
    """Return the heights under the sensor as a body; raises as `mesh_under`.

    Heights are sampled twice as densely as they are kept; grooves between beads, narrower than a
    cell, are filled, as rubber does not enter them. Where there is no matter, and below
    `DEEP_MM`, the body has a floor.
    """
    reach = max(sensor.half_mm) + AROUND_MM
    at = np.linspace(-reach, reach, 2 * CELLS + 1)
    heights = heights_under(surface, touch, np.stack(np.meshgrid(at, at), axis=-1))
    top = float(heights.max())
    heights = grey_closing(np.maximum(heights, top - DEEP_MM), size=3)[::2, ::2]
    triangles = mesh_heights(heights, HEIGHT_TOLERANCE_MM)
    bottom = top - 2 * DEEP_MM
    body = close_below(heights, triangles, 2 * reach / CELLS, bottom)
    corners, faces = indexed_triangles(manifold_from(*body).simplify(MOVED_MM))
    corners[:, :2] = touch.on_surface(corners[:, :2])
    return corners, faces
