"""MuJoCo's tactile sensor on a surface: an engine that shares no model with ours.

MuJoCo holds the part as a signed distance field on an octree of seven levels, made of what is under
the sensor: a written part is cut, heights alone (a print, a registered face) become a mesh.
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

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch, no_contact
from probe.contact.engines import Engine
from probe.contact.meshes import Mesh, check_tabs, mesh_under, rest_on, triangles_under
from probe.contact.neo_hooke import NeoHooke
from probe.contact.tips import Tips, tip_points
from probe.surface.contract import HeightMap

require("mujoco", extra="engines", purpose="engine mujoco")

Array = NDArray[np.float64]

#: Elastomer against the overlay's, and the depth, mm, at which it is crushed: a distance field has
#: no depth beyond the half width of a stroke, .5 to .7 mm. 120 N press .5 mm deep, not 1 mm. If it
#: is crushed at the overlay's height, faces of 12 to 35 mm with `tactel-8` are answered in 99 of
#: 150 touches instead of 116 (seeds 5151, 5252; octree of six levels).
STIFFER = 8.0
DEEPEST_MM = 0.7
#: Cells of .28 mm under the sensor: MuJoCo's own 6 is too coarse for strokes of 1 mm. Images are a
#: fifth nearer to our own engine's, for 1.7 s of CPU instead of .4.
OCTREE_DEPTH = 7


def press(surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips) -> Contact:
    """Press a sensor with tabs on a written part, or on heights alone, which are meshed first.

    Raises `ContactError` for an overlay that is no tabs, nothing under the sensor, or no rest.
    """
    check_tabs("mujoco", sensor, touch)
    if touch.force_n == 0:
        return no_contact(sensor, touch, "mujoco")
    points, drop = tip_points(sensor, tips)
    depths, top_mm = _scene(mesh_under(surface, sensor, touch), sensor, touch, points, drop)
    share = math.pi * sensor.overlay.tab_diameter_mm**2 / 4 / points.shape[1]
    modulus = STIFFER * sensor.overlay.young_mpa
    law = NeoHooke(modulus * share / sensor.overlay.height_mm, DEEPEST_MM)

    def forces_at(plate: Array) -> tuple[Array, Array]:
        deep = depths(plate)
        forces, slopes = law(deep)
        return forces, np.where(deep > 0, slopes, 0.0)

    return rest_on(forces_at, top_mm, points.reshape(-1, 2), touch, sensor.shape, "mujoco")


Depths = Callable[[Array], Array]
"""Plate (z mm, tilt x, tilt y) -> depth of every point in the part, mm, 0 outside."""


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
    part.octree_maxdepth = OCTREE_DEPTH
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


ENGINE = Engine(press, points=7, overlays=("tab",), triangles=triangles_under)
