"""A page to draw on, and its file: no window, no user's settings, no date in it.

matplotlib draws. Its pyplot is left out: it chooses a backend by the display, keeps every
figure until it is closed, and takes the user's matplotlibrc, so the same picture would not be
the same bytes everywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

DPI = 100
HEAT = "inferno"
_SETTINGS = {"font.family": "DejaVu Sans", "font.size": 9.0, "svg.hashsalt": "probe"}


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
