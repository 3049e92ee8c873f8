"""Images as heat maps and as surfaces that can be turned. Thesis figures 4.9 and 4.10.

Axes are those of the sensor frame (mm, seen through the sensor's back); row 0 lies at the
top, at the largest y. matplotlib draws on `page`, without its pyplot, which takes the user's
matplotlibrc: the same picture is the same bytes everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType

DPI = 100
HEAT = "inferno"
_SETTINGS = {"font.family": "DejaVu Sans", "font.size": 9.0, "svg.hashsalt": "probe"}
UNITS = {"counts": "reading (ADC counts)", "N": "force (N)", "scaled": "reading (scaled)"}
WIDTH, HEIGHT = 1000, 440  #: px
#: left, low, wide and high of heat map, its scale, and the surface: shares of WIDTH and HEIGHT
_PLACES = ((0.07, 0.13, 0.352, 0.8), (0.437, 0.2, 0.015, 0.66), (0.5, 0.02, 0.49, 0.96))


@contextmanager
def page(path: Path, width_px: int, height_px: int) -> Iterator[Figure]:
    """Yield a figure of that size; it is written as PNG when the block ends."""
    defaults = {
        name: value for name, value in mpl.rcParamsDefault.items() if not name.startswith("backend")
    }
    with mpl.rc_context({**defaults, **_SETTINGS}):
        figure = Figure(figsize=(width_px / DPI, height_px / DPI), dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        yield figure
        figure.savefig(path, format="png", dpi=DPI, metadata={"Software": None})


def in_mm(axes: Axes, title: str) -> None:
    """Label axes of the sensor frame."""
    axes.set_title(title)
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("y (mm)")
    axes.set_aspect("equal")


def frame_picture(
    image: ArrayLike,
    path: Path,
    *,
    unit: str = "counts",
    title: str = "",
    sensor: SensorType | None = None,
    azimuth_deg: float = -60.0,
    elevation_deg: float = 40.0,
) -> None:
    """Draw an image (rows, columns) twice, from above and as a surface.

    `path` is the PNG. The unit is counts, N, or another; `sensor` is that of the thesis by default;
    the angles say from where the surface is seen.
    """
    matrix = sensor or SensorType()
    half_x, half_y = matrix.half_mm
    values = np.asarray(image, dtype=np.float64)
    heat = Normalize(min(0.0, float(values.min())), max(float(values.max()), 1e-9))
    with page(path, WIDTH, HEIGHT) as figure:
        figure.set_layout_engine("none")
        flat, scale, turned = (
            figure.add_axes(place, projection=kind)
            for place, kind in zip(_PLACES, (None, None, "3d"), strict=True)
        )
        flat.imshow(values, cmap=HEAT, norm=heat, extent=(-half_x, half_x, -half_y, half_y))
        in_mm(flat, title)
        label = UNITS.get(unit, f"reading ({unit})")
        figure.colorbar(ScalarMappable(heat, HEAT), cax=scale, label=label)
        _surface(turned, values, matrix, heat, (azimuth_deg, elevation_deg))


def _surface(
    axes: Any,  # mplot3d has no types
    values: NDArray[np.float64],
    sensor: SensorType,
    heat: Normalize,
    seen_from_deg: tuple[float, float],
) -> None:
    centres = sensor.centres_mm()
    patches = (values[1:, 1:] + values[:-1, :-1] + values[1:, :-1] + values[:-1, 1:]) / 4
    colours = ScalarMappable(heat, HEAT).to_rgba(patches)
    axes.plot_surface(
        centres[..., 0], centres[..., 1], values, rstride=1, cstride=1, facecolors=colours,
        edgecolor=(0.1, 0.1, 0.1, 0.5), linewidth=0.3, shade=False
    )  # fmt: skip
    axes.view_init(elev=seen_from_deg[1], azim=seen_from_deg[0])
    axes.set_zlim(heat.vmin, heat.vmax)
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("y (mm)")
    axes.set_box_aspect((1, 1, 0.6), zoom=0.95)
