"""The object's wireframe with the probe on it, object frame. Thesis figures 6.17 to 6.19."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.database.read import read_object
from generator.database.registered import Polyhedron
from generator.database.transaction import read_transaction
from probe.plot.touch import MARK
from probe.surface.body import triangulate
from recognizer.command.plot.window import FACE
from recognizer.touch.lab import EmbossedArray

Array = NDArray[np.float64]

BESIDE_DEG = (35.0, 32.0)  #: from where the touched face is seen, off its normal
AXES = (("x", "tab:red"), ("y", "tab:green"), ("z", "tab:blue"))
MANY = 40  #: vertices beyond which they are not numbered


def draw_object(
    axes: Any,  # mplot3d has no types
    encoding: EmbossedArray,
    sensor: SensorType,
    name: str,
    face: str,
    T_object_probe: Array,
) -> None:
    """Draw the edges, the numbers of the vertices, the face that is touched, and the probe."""
    axes.computed_zorder = False  # what is drawn later lies above
    with read_transaction(encoding.engine) as connection:
        held = read_object(connection, name)
    solid = held.polyhedron
    for edge in solid.edges:
        axes.plot(*solid.vertices[[edge.start, edge.end]].T, color="#404040", linewidth=0.9,
                  zorder=2)  # fmt: skip
    touched = next((f for f in held.faces if f.name == face), None)
    if touched is not None:
        loops = solid.faces[touched.face_id].loops
        corners = solid.vertices[np.concatenate([np.array(loop) for loop in loops])]
        _fill(axes, corners, triangulate(touched.polygon_mm), FACE, 0.4, 1)
    if len(solid.vertices) <= MANY:
        for number, at in enumerate(solid.vertices.tolist()):
            axes.text(*at, str(number), fontsize=7, color="#404040", zorder=6)
    _draw_probe(axes, sensor, T_object_probe)
    _look(axes, solid, T_object_probe)


def _draw_probe(axes: Any, sensor: SensorType, T: Array) -> None:
    """Draw the sensor's outline, its axes, and a dot at tactel (0, 0)."""
    x, y = sensor.half_mm
    corners = np.array([(-x, -y, 0), (x, -y, 0), (x, y, 0), (-x, y, 0)]) @ T[:3, :3].T + T[:3, 3]
    _fill(axes, corners, np.array([(0, 1, 2), (0, 2, 3)]), MARK, 0.45, 3)
    axes.plot(*corners[[0, 1, 2, 3, 0]].T, color=MARK, linewidth=1.2, zorder=3)
    axes.plot(*corners[3:4].T, "o", color=MARK, markersize=4, zorder=4)
    for k, (_, colour) in enumerate(AXES):
        tip = T[:3, 3] + T[:3, k] * sensor.reach_mm
        axes.plot(*np.stack([T[:3, 3], tip]).T, color=colour, linewidth=1.6, zorder=5)


def _fill(
    axes: Any, corners: Array, triangles: NDArray[np.int64], colour: str, alpha: float, zorder: int
) -> None:
    axes.plot_trisurf(*corners.T[:2], triangles, corners.T[2], color=colour, alpha=alpha,
                      shade=False, linewidth=0, antialiased=False, zorder=zorder)  # fmt: skip


def _look(axes: Any, solid: Polyhedron, T_object_probe: Array) -> None:
    """Look at the touched face from beside its normal, with the whole object in view."""
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    middle, half = (low + high) / 2, float((high - low).max()) * 0.6
    for k, (name, _) in enumerate(AXES):
        getattr(axes, f"set_{name}lim")(middle[k] - half, middle[k] + half)
        getattr(axes, f"set_{name}label")(f"{name} (mm)")
    axes.locator_params(nbins=4)  # more of them cover each other where an axis is foreshortened
    axes.set_box_aspect((1, 1, 1), zoom=0.85)
    x, y, z = T_object_probe[:3, 2]
    up = math.degrees(math.asin(max(-1.0, min(1.0, z))))
    azimuth = math.degrees(math.atan2(y, x)) if math.hypot(x, y) > 1e-6 else -60.0
    axes.view_init(elev=up - BESIDE_DEG[1] * (1 if up > 45 else -1), azim=azimuth + BESIDE_DEG[0])
    axes.set_title("object and probe")
