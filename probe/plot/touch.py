"""A touch: the surface with the sensor on it, the true force on each tactel, the reading.

The surface is drawn in its own frame, forces and readings in the sensor frame (mm, seen
through the sensor's back), with the outline of what is raised drawn over them. A dot marks
tactel (0, 0) in all three.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.plot.frame import HEAT, UNITS, in_mm, page
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]

ACROSS = 400  #: points in which the surface is drawn, each way
DEPTH_MM = 3.0  #: below the top; what lies deeper is drawn as that
FLAT_MM = 1.0  #: least range of heights; the outline runs half of it below the top
NOTHING = "#e9dcc8"
MARK = "tab:orange"
OUTLINE = "#5fd0ff"
_BESIDE = 1.05  # of the sensor's reach is shown


def touch_picture(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    forces_n: ArrayLike,
    counts: ArrayLike,
    path: Path,
    *,
    title: str = "",
) -> None:
    """Draw the patch of a surface under a sensor, the force (N) on it, and its readings.

    Forces and counts are (rows, columns); the picture is a PNG.
    """
    forces, readings = np.asarray(forces_n, np.float64), np.asarray(counts, np.float64)
    with page(path, 1440, 430) as figure:
        patch, pressed, read = figure.subplots(1, 3)
        figure.suptitle(title)
        top = draw_patch(patch, surface, sensor, touch)
        at_mm, above_mm = _heights_under(surface, sensor, touch)
        for axes, values, what, label in (
            (pressed, forces, f"force, {forces.sum():.3g} N in all", UNITS["N"]),
            (read, readings, "reading", UNITS["counts"]),
        ):
            draw_image(axes, values, sensor, label)
            in_mm(axes, what)
            raised = top - FLAT_MM / 2
            if above_mm.min() < raised < above_mm.max():
                axes.contour(at_mm[0], at_mm[1], above_mm, [raised], colors=OUTLINE,
                             linewidths=0.8, linestyles="solid")  # fmt: skip


def draw_patch(axes: Axes, surface: HeightMap, sensor: SensorType, touch: Touch) -> float:
    """Draw the surface about the sensor, and the sensor; returns the surface's top there."""
    reach = _BESIDE * sensor.reach_mm
    x = np.linspace(touch.x_mm - reach, touch.x_mm + reach, ACROSS)
    y = np.linspace(touch.y_mm - reach, touch.y_mm + reach, ACROSS)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    heights = surface.heights_mm(points).reshape(ACROSS, ACROSS)
    there = np.isfinite(heights)
    top = float(heights[there].max(initial=-math.inf)) if there.any() else 0.0
    shown: Array = np.where(there, np.maximum(heights, top - DEPTH_MM), np.nan)
    # A flat surface is drawn as bright as the top of another one.
    low = min(float(shown[there].min(initial=math.inf)), top - FLAT_MM)
    axes.set_facecolor(NOTHING)
    drawn = axes.imshow(shown, cmap="bone", extent=(x[0], x[-1], y[0], y[-1]), origin="lower",
                        norm=Normalize(low, top))  # fmt: skip
    axes.figure.colorbar(drawn, ax=axes, label="height (mm)", shrink=0.8)
    half_x, half_y = sensor.half_mm
    corners = np.array([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    outline = touch.on_surface(corners)
    axes.add_patch(Polygon(outline, fill=False, edgecolor=MARK, linewidth=1.5))
    axes.plot(touch.x_mm, touch.y_mm, "+", color=MARK)
    axes.plot(*outline[3], "o", color=MARK, markersize=5)
    in_mm(axes, f"surface; the sensor turned by {math.degrees(touch.theta_rad):.1f} degrees")
    return top


def _heights_under(
    surface: HeightMap, sensor: SensorType, touch: Touch
) -> tuple[tuple[Array, Array], Array]:
    """Return x and y (n,), sensor frame, and the finite heights (n, n) under the sensor."""
    half_x, half_y = sensor.half_mm
    x, y = np.linspace(-half_x, half_x, ACROSS), np.linspace(-half_y, half_y, ACROSS)
    points = touch.on_surface(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    heights = surface.heights_mm(points).reshape(ACROSS, ACROSS)
    known = heights[np.isfinite(heights)]
    top = float(known.max()) if known.size else 0.0
    lowest: Array = np.maximum(np.nan_to_num(heights, neginf=-math.inf), top - DEPTH_MM)
    return (x, y), lowest


def draw_image(axes: Axes, values: Array, sensor: SensorType, label: str) -> None:
    """Draw an image (rows, columns) in the sensor frame, with a dot at tactel (0, 0)."""
    half_x, half_y = sensor.half_mm
    heat = Normalize(0.0, max(float(values.max()), 1e-9))
    axes.imshow(values, cmap=HEAT, norm=heat, extent=(-half_x, half_x, -half_y, half_y))
    axes.plot(-half_x, half_y, "o", color=MARK, markersize=5, clip_on=False)
    axes.figure.colorbar(ScalarMappable(heat, HEAT), ax=axes, label=label, shrink=0.8)
