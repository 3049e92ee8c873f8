"""A touch: the surface with the sensor's outline on it, beside what the sensor reads."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike, NDArray

from probe.contact.contract import Touch
from probe.plot.canvas import HEAT, in_mm, page
from probe.plot.frame import UNITS
from probe.sensor import Sensor
from probe.surface.contract import Surface

Array = NDArray[np.float64]

ACROSS = 400  #: points in which the surface is drawn, each way
DEPTH_MM = 3.0  #: below the top; what lies deeper is drawn as that
FLAT_MM = 1.0  #: least range of heights
NOTHING = "#e9dcc8"
_BESIDE = 1.15  # of the sensor's reach is shown


def touch_picture(
    surface: Surface,
    sensor: Sensor,
    touch: Touch,
    image: ArrayLike,
    path: Path,
    *,
    unit: str = "counts",
    title: str = "",
) -> None:
    """Draw the patch of a surface under a sensor, and the image.

    Parameters
    ----------
    surface, sensor, touch
        What is touched, with what, and where.
    image
        (rows, columns) readings, row 0 on top.
    path
        PNG to write.
    unit
        counts, or N.
    title
        Above the patch.
    """
    values = np.asarray(image, dtype=np.float64)
    half_x, half_y = sensor.half_mm
    corners = np.array([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    with page(path, 1000, 440) as figure:
        patch, felt = figure.subplots(1, 2)
        heights, box, range_mm = _heights(surface, sensor, touch)
        patch.set_facecolor(NOTHING)
        drawn = patch.imshow(heights, cmap="bone", extent=box, origin="lower",
                             norm=Normalize(*range_mm))  # fmt: skip
        figure.colorbar(drawn, ax=patch, label="height (mm)", shrink=0.85)
        outline = touch.on_surface(corners)
        patch.add_patch(Polygon(outline, fill=False, edgecolor="tab:orange", linewidth=1.5))
        (x, y), top_left = touch.on_surface(np.zeros((1, 2)))[0], outline[3]
        patch.plot(x, y, "+", color="tab:orange")
        patch.plot(*top_left, "o", color="tab:orange", markersize=5)
        in_mm(patch, title)
        heat = Normalize(0.0, max(float(values.max()), 1e-9))
        felt.imshow(values, cmap=HEAT, norm=heat, extent=(-half_x, half_x, -half_y, half_y))
        felt.plot(-half_x, half_y, "o", color="tab:orange", markersize=5, clip_on=False)
        in_mm(felt, f"turned {math.degrees(touch.theta_rad):.1f} degrees")
        label = UNITS.get(unit, f"reading ({unit})")
        figure.colorbar(ScalarMappable(heat, HEAT), ax=felt, label=label, shrink=0.85)


def _heights(
    surface: Surface, sensor: Sensor, touch: Touch
) -> tuple[Array, tuple[float, float, float, float], tuple[float, float]]:
    """Return heights about the sensor, nan where there is nothing; their box and range."""
    reach = _BESIDE * sensor.reach_mm
    x = np.linspace(touch.x_mm - reach, touch.x_mm + reach, ACROSS)
    y = np.linspace(touch.y_mm - reach, touch.y_mm + reach, ACROSS)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    heights = surface.heights_mm(points).reshape(ACROSS, ACROSS)
    known = heights[np.isfinite(heights)]
    top = float(known.max()) if known.size else 0.0
    shown: Array = np.where(np.isfinite(heights), np.maximum(heights, top - DEPTH_MM), np.nan)
    low = float(np.nanmin(shown)) if known.size else 0.0
    # A flat surface is drawn as bright as the top of another one.
    range_mm = (min(low, top - FLAT_MM), top)
    return shown, (float(x[0]), float(x[-1]), float(y[0]), float(y[-1])), range_mm
