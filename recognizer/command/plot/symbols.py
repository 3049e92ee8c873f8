"""The touch with the fitted symbols drawn on it, sensor frame."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import Alphabet
from probe.plot.canvas import HEAT, in_mm
from recognizer.command.plot.winning import WinningLattice
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]

HELD = "#5fd0ff"  #: symbols that the database holds there and that are felt
OTHER = "#ff5a5a"  #: symbols that it holds and that look otherwise, or are worn
ACROSS = 240  #: points of the outlines, each way


def draw_touch(axes: Axes, sensor: SensorType, signal: Signal, won: WinningLattice | None) -> None:
    """Draw readings, lattice, and outlines of the symbols; untrusted tactels are crossed."""
    half_x, half_y = sensor.half_mm
    box = (-half_x, half_x, -half_y, half_y)
    heat = Normalize(0.0, max(float(signal.forces.max()), 1e-9))
    drawn = axes.imshow(signal.forces, cmap=HEAT, norm=heat, extent=box)
    unit = "force (N)" if signal.newtons else "reading over the background (counts)"
    axes.figure.colorbar(drawn, ax=axes, label=unit, shrink=0.75)
    bad = sensor.centres_mm()[signal.trust <= 0]
    axes.plot(bad[:, 0], bad[:, 1], "x", color="white", markersize=4)
    in_mm(axes, "touch and fitted symbols")
    if won is not None:
        pitch = won.encoding.style.pitch_mm
        axes.add_collection(
            LineCollection(_cells(won, pitch), colors="white", linewidths=0.4, alpha=0.5)
        )
        _outlines(axes, sensor, won, won.felt, HELD)
        _outlines(axes, sensor, won, ~won.felt, OTHER)
    axes.set_xlim(-half_x, half_x)
    axes.set_ylim(-half_y, half_y)


def strokes_mm(alphabet: Alphabet, label: int, pitch_mm: float) -> Array:
    """Return the strokes (n, 2, 2) of a symbol about its centre, mm."""
    return np.array(alphabet.glyphs[label].strokes, np.float64) * (alphabet.reach * pitch_mm)


def _cells(won: WinningLattice, pitch: float) -> list[Array]:
    """Return the outlines of the cells, sensor frame."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)])
    return [won.on_sensor((cell + corners) * pitch) for cell in won.cells]


def _outlines(
    axes: Axes, sensor: SensorType, won: WinningLattice, which: NDArray[np.bool_], colour: str
) -> None:
    """Draw how far the strokes reach of those symbols that the face holds."""
    half_x, half_y = sensor.half_mm
    x, y = np.linspace(-half_x, half_x, ACROSS), np.linspace(-half_y, half_y, ACROSS)
    points = np.stack(np.meshgrid(x, y), axis=-1)
    away = np.full(points.shape[:2], np.inf)
    pitch = won.encoding.style.pitch_mm
    for cell, label in zip(won.cells[which], won.registered[which], strict=True):
        if label >= 0:
            strokes = strokes_mm(won.encoding.alphabet, int(label), pitch) + (cell + 0.5) * pitch
            for start, end in won.on_sensor(strokes):
                away = np.minimum(away, _distance(points, start, end))
    edge = won.encoding.style.stroke_mm / 2
    if away.min() < edge < away.max():
        near = np.minimum(away, 2 * edge)
        axes.contour(x, y, near, [edge], colors=colour, linewidths=1.2)


def _distance(points: Array, start: Array, end: Array) -> Array:
    along = end - start
    t = ((points - start) @ along / max(float(along @ along), 1e-12)).clip(0, 1)
    distance: Array = np.linalg.norm(points - start - t[..., None] * along, axis=-1)
    return distance
