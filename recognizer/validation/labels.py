"""Names beside the points of a picture, none over another, over a point or outside the axes.

Axes with points -> annotations. Every name tries places around its point, from near to far, and
takes the first that is free; a far one gets a thin line to its point.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

Point = tuple[float, float, str]
Box = tuple[float, float, float, float]  # left, bottom, right, top; pixels


@dataclass(frozen=True, slots=True)
class LabelSettings:
    """Sizes in points, as the letters'."""

    letters: float = 7.5
    clear: float = 1.5  #: around every name: another font's letters are a little wider
    marker: float = 5.0  #: half the side of a point
    away: tuple[float, ...] = (5.0, 9.0, 16.0, 25.0, 36.0, 50.0, 66.0)
    turns: tuple[int, ...] = (0, 180, 90, 270, 45, 225, 315, 135)  #: degrees
    line_from: float = 16.0  #: a name as far off, or farther, gets a line


LABELS = LabelSettings()


def label_points(
    axes: Axes, points: Sequence[Point], settings: LabelSettings = LABELS
) -> list[Annotation]:
    """Write names beside points; limits and scales of the axes must stand.

    Parameters
    ----------
    axes
        Where the points are drawn already.
    points
        x, y in data units and the name; what is no finite number gets none.

    Returns
    -------
    The annotations, in the order of x.
    """
    figure = axes.get_figure(root=True)
    if figure is None:
        return []
    figure.draw_without_rendering()
    pixel = figure.dpi / 72
    shown = sorted(point for point in points if np.isfinite(point[:2]).all())
    spots = [axes.transData.transform(point[:2]) for point in shown]
    half = settings.marker * pixel
    taken = [(x - half, y - half, x + half, y + half) for x, y in spots]
    legend = axes.get_legend()
    if legend is not None:
        taken.append(legend.get_window_extent().extents)
    frame: Box = tuple(axes.get_window_extent().extents)  # type: ignore[assignment]
    found = []
    for (x, y, name), spot in zip(shown, spots, strict=True):
        text = axes.annotate(name, (x, y), (0, 0), textcoords="offset points",
                             fontsize=settings.letters, ha="center", va="center")  # fmt: skip
        text.set_in_layout(False)
        extent = text.get_window_extent()
        size = extent.width / pixel, extent.height / pixel
        offset, box = _free_place(spot, size, pixel, taken, frame, settings)
        text.set_position(offset)
        if math.hypot(*offset) - size[0] / 2 >= settings.line_from:
            axes.annotate("", (x, y), offset, textcoords="offset points", annotation_clip=False,
                          arrowprops={"arrowstyle": "-", "lw": 0.5, "color": "#8a8f98",
                                      "shrinkA": 4, "shrinkB": 3}).set_in_layout(False)  # fmt: skip
        taken.append(box)
        found.append(text)
    return found


def _free_place(
    spot: NDArray[np.float64], size: tuple[float, float], pixel: float, taken: Sequence[Box],
    frame: Box, settings: LabelSettings,
) -> tuple[tuple[float, float], Box]:  # fmt: skip
    """Return the offset of a name's middle in points, and its box; the last one if none is free."""
    wide, high = (side / 2 + settings.clear for side in size)
    offset, box = (0.0, 0.0), frame
    for away, turn in product(settings.away, settings.turns):
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        offset = (away * c + wide * np.sign(round(c, 6)), away * s + high * np.sign(round(s, 6)))
        x, y = (spot[k] + offset[k] * pixel for k in (0, 1))
        box = (x - wide * pixel, y - high * pixel, x + wide * pixel, y + high * pixel)
        inside = box[0] >= frame[0] and box[1] >= frame[1]
        inside = inside and box[2] <= frame[2] and box[3] <= frame[3]
        if inside and not any(boxes_overlap(box, other) for other in taken):
            break
    return (float(offset[0]), float(offset[1])), box


def boxes_overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share an area."""
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
