"""A recognition as a picture of three panels: touch, window, object."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from probe.plot.canvas import page
from recognizer.command.plot.symbols import draw_touch
from recognizer.command.plot.window import draw_window
from recognizer.command.plot.winning import WinningLattice, winning_lattice
from recognizer.command.plot.wireframe import draw_object
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]

WIDTH, HEIGHT = 1500, 520  #: px


def touch_picture(
    reader: Reader,
    signal: Signal,
    found: Recognition,
    path: Path,
    *,
    T_robot_object: Array | None = None,
) -> None:
    """Draw a touch with its symbols, the window on the array, and the object with the probe on it.

    Parameters
    ----------
    reader, signal, found
        What was read by what, and the answer; one without an object gets the first panel.
    path
        PNG to write.
    T_robot_object
        (4, 4), mm, where it is known.
    """
    won = winning_lattice(reader, signal)
    with page(path, WIDTH, HEIGHT) as figure:
        figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 0.95))
        figure.suptitle(_title(found, T_robot_object))
        touched, window = (figure.add_subplot(1, 3, k) for k in (1, 2))
        solid = figure.add_subplot(1, 3, 3, projection="3d")
        draw_touch(touched, reader.sensor, signal, won)
        if not found or won is None:
            _say_why(window, found)
            solid.set_axis_off()
            return
        draw_window(window, reader.sensor, won)
        _draw_solid(solid, reader, won, found)


def _say_why(axes: Axes, found: Recognition) -> None:
    axes.set_axis_off()
    lines = [found.reason]
    if found.margin is not None:
        lines.append(f"margin {found.margin:.1f} nats")
    if found.runner_up is not None:
        lines.append(f"also possible: {found.runner_up.object}, face {found.runner_up.face}")
    axes.text(0.5, 0.5, "\n".join(lines), ha="center", va="center", transform=axes.transAxes)


def _draw_solid(axes: object, reader: Reader, won: WinningLattice, found: Recognition) -> None:
    if found.object is not None and found.face is not None and found.T_object_probe is not None:
        draw_object(
            axes, won.encoding, reader.sensor, found.object, found.face, found.T_object_probe
        )


def _title(found: Recognition, T_robot_object: Array | None) -> str:
    if not found or found.T_face_probe is None:
        return f"touch {found.seq}: not recognised, {found.reason}"
    T = found.T_face_probe
    turn = math.degrees(math.atan2(T[1, 0], T[0, 0]))
    told = (
        f"touch {found.seq}: {found.object}, face {found.face}, x {T[0, 3]:.2f} mm, "
        f"y {T[1, 3]:.2f} mm, turned {turn:.1f} degrees; array {found.index}"
    )
    if T_robot_object is not None:
        at = ", ".join(f"{value:.1f}" for value in T_robot_object[:3, 3])
        told += f"; in the robot's base ({at}) mm"
    return told
