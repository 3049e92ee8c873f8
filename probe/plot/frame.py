"""One image as heat map and as surface that can be turned. Thesis figures 4.9 and 4.10.

Axes are those of the sensor frame (mm, seen through the sensor's back); row 0 lies at the
top, so at the largest y.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import ArrayLike, NDArray

from probe.plot.canvas import HEAT, in_mm, page
from probe.sensor import Sensor

UNITS = {"counts": "reading (ADC counts)", "N": "force (N)", "scaled": "reading (scaled)"}


def frame_picture(
    image: ArrayLike,
    path: Path,
    *,
    unit: str = "counts",
    title: str = "",
    sensor: Sensor | None = None,
    azimuth_deg: float = -60.0,
    elevation_deg: float = 40.0,
) -> None:
    """Draw an image twice: from above, and as a surface.

    Parameters
    ----------
    image
        (rows, columns) readings, row 0 on top.
    path
        PNG to write.
    unit
        counts, N, or what else the readings are.
    title
        Above the heat map.
    sensor
        Whose image it is; the 16x16 matrix of the thesis by default.
    azimuth_deg, elevation_deg
        From where the surface is seen.
    """
    values, matrix = np.asarray(image, dtype=np.float64), sensor or Sensor()
    half_x, half_y = matrix.half_mm
    label = UNITS.get(unit, f"reading ({unit})")
    heat = Normalize(min(0.0, float(values.min())), max(float(values.max()), 1e-9))
    with page(path, 1000, 440) as figure:
        flat, turned = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="3d")
        flat.imshow(values, cmap=HEAT, norm=heat, extent=(-half_x, half_x, -half_y, half_y))
        in_mm(flat, title)
        figure.colorbar(ScalarMappable(heat, HEAT), ax=flat, label=label, shrink=0.85)
        _surface(turned, values, matrix, heat, label, (azimuth_deg, elevation_deg))


def _surface(
    axes: Any,  # mplot3d has no types
    values: NDArray[np.float64],
    sensor: Sensor,
    heat: Normalize,
    label: str,
    seen_from_deg: tuple[float, float],
) -> None:
    """Draw tactels as a surface through their readings."""
    centres = sensor.centres_mm()
    patches = (values[1:, 1:] + values[:-1, :-1] + values[1:, :-1] + values[:-1, 1:]) / 4
    colours = ScalarMappable(heat, HEAT).to_rgba(patches)
    axes.plot_surface(
        centres[..., 0], centres[..., 1], values, rstride=1, cstride=1, facecolors=colours,
        edgecolor=(0.1, 0.1, 0.1, 0.5), linewidth=0.3, shade=False,
    )  # fmt: skip
    axes.view_init(elev=seen_from_deg[1], azim=seen_from_deg[0])
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("y (mm)")
    axes.set_zlabel(label)
    axes.set_box_aspect((1, 1, 0.6), zoom=0.85)
