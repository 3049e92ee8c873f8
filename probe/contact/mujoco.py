"""MuJoCo's tactile sensor on a surface: an engine that shares no model with ours.

MuJoCo holds the part as a signed distance field on an octree of fixed depth, made of the part under
the sensor alone: a written part is cut, heights alone (a print, a registered face) become a mesh.
Its `tactile` sensor gives the depth of every point of every tip in the part, along the shortest way
out. Each point is a column of the overlay's elastomer (neo-Hookean, its share of the tip's area);
the plate advances and tilts until forces and moments balance those of the touch and the wrist. Left
out: the wall between points of a tip, friction, and depths beyond the half width of a stroke, where
the shortest way out leads through its side. The simulation is never stepped: one touch is a handful
of forward evaluations. SI units are MuJoCo's; mm and N here.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing

from encoded_objects.base.errors import require
from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import (
    STEEPEST_RAD,
    Contact,
    Touch,
    heights_under,
    no_contact,
    nothing_under,
)
from probe.contact.engines import Engine
from probe.contact.neo_hooke import NeoHooke
from probe.contact.plate import check_load
from probe.contact.tips import Tips, tip_points
from probe.errors import ContactError
from probe.surface.body import (
    body_of,
    close_below,
    indexed_triangles,
    manifold_from,
    manifold_of,
    mesh_heights,
)
from probe.surface.contract import HeightMap

require("mujoco", extra="engines", purpose="engine mujoco")

Array = NDArray[np.float64]
Mesh = tuple[Array, NDArray[np.int64]]  #: corners (n, 3) mm and triangles (m, 3)

TOLERANCE = 1e-4  # of the force; MuJoCo's distances are no better
#: Elastomer against the overlay's: 120 N press 0.5 mm deep, not 1 mm, since a distance field knows
#: no depth beyond the half width of a stroke, 0.7 mm.
STIFFER = 8.0
STEP_MM = 0.3  # at most, of the advance and of the rim by a tilt
HALVINGS = 8  # of a step that does not help
MOST_STEPS = 60  # of Newton's method; 5-12 are usual
DAMPED = 1e-9  # of the stiffness: one row of points that bears all is not singular
AROUND_MM = 5.0  #: of the part, kept around the sensor's square: domes of 2 degrees tilt
DEEP_MM = 2.5  #: of the part, kept under its highest point: symbols of 1 mm and some of the wall
CELLS = 256  # along a side, of heights: .14 mm; narrower grooves are filled
HEIGHT_TOLERANCE_MM = 0.03
MOVED_MM = 0.05  # by which the mesh of heights may move, to need fewer triangles


def press(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips) -> Contact:
    """Press a sensor with tabs on a written part, or on heights alone, which are meshed first.

    Raises `ContactError` for an overlay that is no tabs, nothing under the sensor, or no rest;
    `SurfaceError` if the triangles of a part close no body.
    """
    if sensor.overlay.kind != "tab":
        raise ContactError(
            f"engine mujoco knows tabs, the overlay is a {sensor.overlay.kind}",
            fix="take --engine own for a pad",
        )
    check_load(touch)
    if touch.force_n == 0:
        return no_contact(sensor, touch, "mujoco")
    points, drop = tip_points(sensor, tips)
    depths, top_mm = _scene(mesh_under(surface, sensor, touch), sensor, touch, points, drop)
    share = math.pi * sensor.overlay.tab_diameter_mm**2 / 4 / points.shape[1]
    modulus = STIFFER * sensor.overlay.young_mpa
    law = NeoHooke(modulus * share / sensor.overlay.height_mm, sensor.overlay.height_mm)
    return _rest(depths, top_mm, law, points.reshape(-1, 2), touch, sensor.shape)


@dataclass(frozen=True, slots=True, eq=False)
class Balance:
    """Imbalance at a pose of the plate, and the force on every point."""

    wrong_n: Array  #: (1 to 3,) force and moments (over the half width) that do not balance
    forces_n: Array  #: (n,)
    slopes: Array  #: (n,) N / mm, of the points in contact


Depths = Callable[[Array], Array]
"""Plate (z mm, tilt x, tilt y) -> depth of every point in the part, mm, 0 outside."""


def _rest(
    depths: Depths, top_mm: float, law: NeoHooke, at: Array, touch: Touch,
    shape: tuple[int, int],
) -> Contact:  # fmt: skip
    """Advance and tilt the plate until it balances: damped Newton on force and moments."""
    half = float(np.abs(at).max())
    rows = np.stack([np.ones(len(at)), at[:, 1] / half, -at[:, 0] / half])  # of pressing
    unloaded = np.array([touch.tilt_x_rad, touch.tilt_y_rad]) * half
    stiffness = np.array([touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad]) / half**2
    held = np.isinf(stiffness)
    stiffness = np.where(held, 0.0, stiffness)
    free = np.array([True, *~held])

    def balance(plate: Array) -> Balance:
        deep = depths(np.array([plate[0], plate[1] / half, plate[2] / half]))
        forces, slopes = law(deep)
        wrist = np.array([touch.force_n, *(stiffness * (plate[1:] - unloaded))])
        return Balance((rows @ forces - wrist)[free], forces, np.where(deep > 0, slopes, 0.0))

    lift = float(np.abs(unloaded).sum())
    plate = np.array([top_mm + lift, *unloaded])
    plate[0] = _advance(balance, plate, lift + DEEP_MM)
    now = balance(plate)
    for step in range(1, MOST_STEPS + 1):
        if np.abs(now.wrong_n).max() <= TOLERANCE * touch.force_n:
            tilts = plate[1:] / half
            if np.abs(tilts).max() > STEEPEST_RAD:
                break
            per_tab = now.forces_n.reshape(shape[0] * shape[1], -1).sum(axis=1)
            return Contact(
                per_tab.reshape(shape), float(plate[0]), float(tilts[0]), float(tilts[1]),
                "mujoco", step,
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
        "the plate finds no rest in MuJoCo's distance field",
        fix="press with less force, or nearer to the middle of the face",
    )


def _advance(balance: Callable[[Array], Balance], plate: Array, most_mm: float) -> float:
    """Return the height at which the plate, tilted as the unloaded wrist, bears the force."""
    high, low = plate[0], plate[0] - most_mm
    for _ in range(12):
        middle = (high + low) / 2
        if balance(np.array([middle, *plate[1:]])).wrong_n[0] > 0:
            low = middle
        else:
            high = middle
    if balance(np.array([low, *plate[1:]])).wrong_n[0] <= 0:
        raise ContactError(
            "there is too little under the sensor to bear the force",
            fix="move the sensor over the object, or press with less force",
        )
    return float(low)


def _scene(
    part_mm: Mesh, sensor: SensorType, touch: Touch, points: Array, drop: Array
) -> tuple[Depths, float]:
    """Build MuJoCo's model of the part under the sensor; return its depths and the top."""
    import mujoco

    corners, faces = part_mm
    pad, fans = _pad(points.reshape(-1, 2), drop.ravel(), points.shape[1], sensor)
    spec = mujoco.MjSpec()
    spec.option.gravity = [0, 0, 0]
    part = spec.add_mesh(name="part")
    part.uservert, part.userface = (1e-3 * corners).ravel().tolist(), faces.ravel().tolist()
    tips = spec.add_mesh(name="tips")
    tips.uservert, tips.userface = (1e-3 * pad).ravel().tolist(), fans.ravel().tolist()
    tips.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    kind = mujoco.mjtGeom
    body = spec.worldbody.add_body(name="part")
    body.add_freejoint()  # two static bodies never touch
    body.add_geom(name="part", type=kind.mjGEOM_MESH, meshname="part")
    octree = spec.worldbody.add_body(name="octree", pos=[0, 0, -1])  # made for a geom of this type
    octree.add_geom(type=kind.mjGEOM_SDF, meshname="part", contype=0, conaffinity=0)
    probe = spec.worldbody.add_body(name="probe", mocap=True, pos=[0, 0, 1])
    half_x, half_y = (1e-3 * half for half in sensor.half_mm)
    probe.add_geom(type=kind.mjGEOM_BOX, size=[half_x, half_y, 2e-3], pos=[0, 0, 2e-3])
    probe.add_geom(
        name="tips", type=kind.mjGEOM_MESH, meshname="tips", contype=0, conaffinity=0, mass=0.01
    )
    spec.add_sensor(
        name="depth", type=mujoco.mjtSensor.mjSENS_TACTILE,
        objtype=mujoco.mjtObj.mjOBJ_MESH, objname="tips",
        reftype=mujoco.mjtObj.mjOBJ_GEOM, refname="tips",
    )  # fmt: skip
    model = spec.compile()
    data = mujoco.MjData(model)
    count = points.shape[0] * points.shape[1]

    def depths(plate: Array) -> Array:
        z, tilt_x, tilt_y = plate
        data.mocap_pos[0] = [1e-3 * touch.x_mm, 1e-3 * touch.y_mm, 1e-3 * z]
        data.mocap_quat[0] = _quaternion(touch.theta_rad, float(tilt_x), float(tilt_y))
        mujoco.mj_forward(model, data)
        deep: Array = 1e3 * np.asarray(data.sensordata[:count], dtype=np.float64)
        return deep

    return depths, float(corners[:, 2].max())


def _pad(
    at_mm: Array, drop_mm: Array, each: int, sensor: SensorType
) -> tuple[Array, NDArray[np.int64]]:
    """Return the mesh whose first corners are the points of the tips; a plate closes it above."""
    first = each * np.arange(len(at_mm) // each)[:, None]
    ring = np.arange(1, each)
    fans = np.stack(
        [np.broadcast_to(first, (len(first), each - 1)), first + np.roll(ring, -1), first + ring],
        -1,
    ).reshape(-1, 3)
    (half_x, half_y), count = sensor.half_mm, len(at_mm)
    lid = [[-half_x, -half_y, 4], [half_x, -half_y, 4], [half_x, half_y, 4], [-half_x, half_y, 4]]
    corners = np.concatenate([np.column_stack([at_mm, drop_mm]), np.array(lid, dtype=float)])
    closing = count + np.array([[0, 1, 2], [0, 2, 3]])
    return corners, np.concatenate([fans, closing])


def _quaternion(turn: float, tilt_x: float, tilt_y: float) -> list[float]:
    """Return (w, x, y, z) of the plate: turned about z, then tilted about its own x and y."""
    (a, z), (b, x), (c, y) = (
        (math.cos(angle / 2), math.sin(angle / 2)) for angle in (turn, tilt_x, tilt_y)
    )
    w1, x1, y1, z1 = a * b, a * x, z * x, z * b  # about z, then x
    return [w1 * c - y1 * y, x1 * c - z1 * y, w1 * y + y1 * c, x1 * y + z1 * c]


def triangles_under(surface: HeightMap, sensor: SensorType, touch: Touch) -> tuple[int, int] | None:
    """Return how many triangles of a body a touch needs, and how many the body has."""
    body = body_of(surface)
    return None if body is None else (len(mesh_under(surface, sensor, touch)[1]), len(body))


def mesh_under(surface: HeightMap, sensor: SensorType, touch: Touch) -> Mesh:
    """Return the surface under the sensor: corners (n, 3) and triangles (m, 3).

    Raises `ContactError` if there is nothing of it; `SurfaceError` if the triangles of a part close
    no body.
    """
    solid_mm = body_of(surface)
    if solid_mm is None:
        return _mesh_heights_under(surface, sensor, touch)
    from manifold3d import Manifold

    reach = max(sensor.half_mm) + AROUND_MM
    top = float(solid_mm[:, :, 2].max())
    box = Manifold.cube((2 * reach, 2 * reach, 2 * DEEP_MM), center=True)
    box = box.rotate((0, 0, math.degrees(touch.theta_rad))).translate((touch.x_mm, touch.y_mm, top))
    corners, triangles = indexed_triangles(manifold_of(solid_mm) ^ box)
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


ENGINE = Engine(press, points=7, overlays=("tab",), triangles=triangles_under)
