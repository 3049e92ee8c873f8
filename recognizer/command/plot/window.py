"""The window on the array: cells around the sensor, who holds them, and the sensor on them.

Rows run downwards and columns to the right, as the array is printed. The array is a torus:
numbers beyond its last row or column begin anew.
"""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch, Polygon
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.plot.touch import MARK
from recognizer.command.plot.symbols import strokes_mm
from recognizer.command.plot.winning import WinningLattice

Array = NDArray[np.float64]

AROUND = 8  #: cells beside the one under the sensor's centre
FREE, OTHERS, OBJECT, FACE = "#ffffff", "#e4e4e4", "#cfe3f7", "#f7d9a8"


def draw_window(axes: Axes, sensor: SensorType, won: WinningLattice) -> None:
    """Draw the cells around the sensor with their symbols."""
    encoding, place = won.encoding, won.place
    array, pitch = encoding.array, encoding.style.pitch_mm
    middle_row = place.row - math.floor(won.y_mm / pitch)
    middle_column = place.column + math.floor(won.x_mm / pitch)
    rows, columns = np.meshgrid(
        np.arange(middle_row - AROUND, middle_row + AROUND + 1),
        np.arange(middle_column - AROUND, middle_column + AROUND + 1),
        indexing="ij",
    )
    owners, labels = encoding.at(rows % array.rows, columns % array.columns)
    objects = np.append(encoding.faces[:, 0], -1)[owners]
    mine = objects == encoding.faces[place.face, 0]
    kind = np.select([owners == place.face, mine, owners >= 0], [3, 2, 1], 0)
    box = (columns[0, 0], columns[0, -1] + 1, rows[-1, 0] + 1, rows[0, 0])
    colours = ListedColormap([FREE, OTHERS, OBJECT, FACE])
    axes.imshow(kind, cmap=colours, vmin=-0.5, vmax=3.5, extent=box)
    lines = []
    for row, column, label in zip(rows.flat, columns.flat, labels.flat, strict=True):
        if label >= 0:
            strokes = strokes_mm(encoding.alphabet, int(label), 1.0) * (1, -1)
            lines += list(strokes + np.array([column + 0.5, row + 0.5]))
    axes.add_collection(LineCollection(lines, colors="#303030", linewidths=0.9))
    half_x, half_y = sensor.half_mm
    corners = np.array([(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)])
    outline = _on_array(won, corners)
    axes.add_patch(Polygon(outline, fill=False, edgecolor=MARK, linewidth=1.8))
    axes.plot(*outline[3], "o", color=MARK, markersize=5)
    axes.plot(*_on_array(won, np.zeros((1, 2)))[0], "+", color=MARK)
    axes.set_xticks(columns[0, ::4] + 0.5, (columns[0, ::4] % array.columns).tolist())
    axes.set_yticks(rows[::4, 0] + 0.5, (rows[::4, 0] % array.rows).tolist())
    known = ((FACE, "this face"), (OBJECT, "this object"), (OTHERS, "others"))
    patches = [Patch(facecolor=colour, edgecolor="#808080", label=name) for colour, name in known]
    axes.legend(handles=patches, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=3,
                frameon=False, fontsize=8)  # fmt: skip
    axes.set_xlabel("column")
    axes.set_ylabel("row")
    axes.set_title(f"window on the array, {array.rows} x {array.columns}")


def _on_array(won: WinningLattice, points_mm: Array) -> Array:
    """Return sensor points (n, 2) as columns and rows of the array, in cells."""
    cells = won.on_lattice(points_mm) / won.encoding.style.pitch_mm
    return np.stack([won.place.column + cells[:, 0], won.place.row + 1 - cells[:, 1]], axis=1)
