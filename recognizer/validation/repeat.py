"""One touch of a run again, by its number, with pictures of each stage.

Folder + number -> what was drawn, read and answered, and a picture: the surface and where the
sensor stands, the counts, the symbols that the fit sees, the answer on the face.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from generator.alphabet import Alphabet
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.touch.symbols.fit import Fit, fit_lattices
from recognizer.validation.campaign import plan_of, series_of
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.errors import ValidationError
from recognizer.validation.pictures import figure_on
from recognizer.validation.run import read_record
from recognizer.validation.trial import find_face, judge, row_of, symbols_in_view
from recognizer.validation.workers import prepare_reader

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

GRID = 240  #: points of the picture of a surface, each way
FORMATS = (".png", ".svg", ".pdf")


def repeat_touch(folder: Path, number: int, plot: Path | None) -> dict[str, Any]:
    """Do a touch again.

    Parameters
    ----------
    folder
        Of a run, done or not.
    number
        Of the touch.
    plot
        Picture to write; None: none.

    Returns
    -------
    The touch as a row of `trials.parquet` holds it.

    Raises
    ------
    ValidationError
        There is no such run, touch, or kind of picture.
    """
    if plot is not None and plot.suffix.lower() not in FORMATS:
        raise ValidationError(
            f"'{plot.suffix}' is no kind of picture",
            fix=f"give {', '.join(FORMATS)}",
            place=str(plot),
        )
    record = read_record(folder)
    series = series_of(record.campaign)[0]
    if number >= series.touches:
        raise ValidationError(
            f"touch {number} of {series.touches}",
            fix=f"give 0 ... {series.touches - 1}",
            place=str(folder),
        )
    work = record.work_now(folder)
    reader = prepare_reader(work)
    kind, plan = plan_of(record.campaign, series, work.database, number, work.labs, work.prints)
    found = draw_touch(plan, number, reader)
    answer = recognise(reader, reader.signal(found.counts), number)
    trial = judge(plan, number, found, answer, 0.0)
    row = row_of(trial, kind, symbols_in_view(reader.lab, reader.sensor, trial))
    row = {name: _or_none(value) for name, value in row.items()}
    if plot is not None:
        with figure_on(plot, 2, 2, (10.5, 10.0)) as axes:
            _draw_surface(axes[0], found, reader)
            _draw_counts(axes[1], found, reader)
            _draw_fit(axes[2], found, reader)
            _draw_answer(axes[3], found, reader, answer, row)
    return row


def _or_none(value: Any) -> Any:
    """Return a value, None for what is no number or has no bound."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _draw_surface(axis: Axes, found: DrawnTouch, reader: Reader) -> None:
    """Draw heights about the sensor, surface frame, and the sensor on them."""
    touch, reach = found.touch, 1.2 * reader.sensor.reach_mm
    x = touch.x_mm + np.linspace(-reach, reach, GRID)
    y = touch.y_mm + np.linspace(-reach, reach, GRID)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    surface = found.contact.scene.under(touch).surface
    heights = surface.heights_mm(points).reshape(GRID, GRID)
    shown = np.where(np.isfinite(heights), np.maximum(heights, -1.0), np.nan)
    image = axis.imshow(
        shown, origin="lower", extent=(x[0], x[-1], y[0], y[-1]), cmap="Greys_r", aspect="equal"
    )
    axis.figure.colorbar(image, ax=axis, shrink=0.8, label="height over the face, mm")
    axis.plot(*_outline(reader, touch.x_mm, touch.y_mm, touch.theta_rad), color="#b0413e")
    axis.set_title("1  what is touched, and where the sensor stands")
    axis.set_xlabel("x of the surface, mm")
    axis.set_ylabel("y of the surface, mm")


def _draw_counts(axis: Axes, found: DrawnTouch, reader: Reader) -> None:
    image = axis.imshow(found.counts, extent=_extent(reader), cmap="viridis")
    axis.figure.colorbar(image, ax=axis, shrink=0.8, label="counts")
    axis.set_title("2  what the sensor reads")
    _sensor_labels(axis)


def _draw_fit(axis: Axes, found: DrawnTouch, reader: Reader) -> None:
    """Draw the likeliest lattice and its symbols over the counts."""
    axis.imshow(found.counts, extent=_extent(reader), cmap="Greys")
    signal = reader.signal(found.counts)
    best: tuple[float, Fit, Alphabet, float] | None = None
    for prepared in reader.prepared if signal.contact else ():
        encoding, image = prepared.embossed, reader.image(signal, prepared)
        for fit in fit_lattices(image, prepared.bank, reader.options.first):
            if best is None or fit.value > best[0]:
                best = (fit.value, fit, encoding.alphabet, encoding.style.pitch_mm)
    if best is not None:
        _, fit, alphabet, pitch = best
        for cell, scores in zip(fit.cells, fit.scores, strict=True):
            label = int(np.argmax(scores))
            if label == len(alphabet.glyphs):
                continue  # no symbol
            for stroke in alphabet.glyphs[label].strokes:
                line = (cell + 0.5) * pitch + np.array(stroke) * alphabet.reach * pitch
                at = _to_sensor_frame(line, fit.x_mm, fit.y_mm, fit.theta_rad)
                axis.plot(*at.T, color="#2f6db3", lw=2.5, alpha=0.8)
    axis.set_title("3  the symbols that the likeliest lattice shows")
    half = reader.sensor.half_mm
    axis.set_xlim(-half[0], half[0])
    axis.set_ylim(-half[1], half[1])
    _sensor_labels(axis)


def _draw_answer(
    axis: Axes, found: DrawnTouch, reader: Reader, answer: Recognition, row: dict[str, Any]
) -> None:
    """Draw the face, the true place and the answered one."""
    scene, touch = found.truth_of(None, None)
    if scene is not None:
        for start, end in zip(scene.region.starts, scene.region.ends, strict=True):
            axis.plot(*np.array([start, end]).T, color="#555c66", lw=1)
        held = find_face(reader.lab, scene.object_name, scene.face)
        if held is not None:
            axis.plot(*held[0].centres_mm.T, ".", color="#aab0b8", ms=3)
        axis.plot(
            *_outline(reader, touch.x_mm, touch.y_mm, touch.theta_rad),
            color="#b0413e",
            label="truth",
        )
    T = answer.T_face_probe
    if answer and T is not None:
        turn = math.atan2(T[1, 0], T[0, 0])
        own = scene is not None and (answer.object, answer.face) == (scene.object_name, scene.face)
        label = "answer" if own else f"answer, on {answer.object}/{answer.face}"
        outline = _outline(reader, float(T[0, 3]), float(T[1, 3]), turn)
        axis.plot(*outline, "--", color="#2f6db3", label=label)
    outcome = row["verdict"] + (f": {row['reason']}" if row["reason"] else "")
    if row["error_mm"] is not None:
        outcome += f", off by {row['error_mm']:.3f} mm, {row['error_deg']:.2f} degrees"
    axis.set_title(f"4  {outcome}")
    axis.set_xlabel("x of the face, mm")
    axis.set_ylabel("y of the face, mm")
    axis.set_aspect("equal")
    if axis.get_legend_handles_labels()[0]:
        axis.legend(frameon=False)


def _outline(reader: Reader, x: float, y: float, theta: float) -> Array:
    """Return the sensor's outline (2, n) at a place; its upper left corner is cut off."""
    a, b = reader.sensor.half_mm
    own = np.array([(-a + 3, b), (a, b), (a, -b), (-a, -b), (-a, b - 3), (-a + 3, b)])
    c, s = math.cos(theta), math.sin(theta)
    outline: Array = (own @ np.array([[c, s], [-s, c]]) + (x, y)).T
    return outline


def _to_sensor_frame(points: Array, x: float, y: float, theta: float) -> Array:
    """Take points of the lattice to the sensor frame."""
    c, s = math.cos(theta), math.sin(theta)
    moved: Array = (points - (x, y)) @ np.array([[c, -s], [s, c]])
    return moved


def _extent(reader: Reader) -> tuple[float, float, float, float]:
    a, b = reader.sensor.half_mm
    return (-a, a, -b, b)


def _sensor_labels(axis: Axes) -> None:
    axis.set_xlabel("x of the sensor, mm")
    axis.set_ylabel("y of the sensor, mm")
