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

from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.touch.recognition import Recognition
from recognizer.touch.symbols.fit import fit_lattices
from recognizer.validation.campaign import series_of
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.errors import ValidationError
from recognizer.validation.pictures import WORDS, figure_on
from recognizer.validation.run import read_record
from recognizer.validation.trial import (
    MOST,
    NEXT,
    find_face,
    judge,
    judge_all,
    touch_until_answered,
)
from recognizer.validation.workers import reader_now

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

GRID = 240  #: points of the picture of a surface, each way
FORMATS = (".png", ".svg", ".pdf")
TRUTH, ANSWER = "#b0413e", "#2f6db3"


def repeat_touch(folder: Path, number: int, plot: Path | None) -> dict[str, Any]:
    """Do a touch of a run again, and write a picture of it if `plot` is given.

    Returns the touch as a row of `trials.parquet` holds it; None for what is no number. Of touches
    that followed each other the picture shows the last.

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
    work = read_record(folder)
    series = series_of(work.campaign)[0]
    if number >= series.touches:
        raise ValidationError(
            f"touch {number} of {series.touches}",
            fix=f"give 0 ... {series.touches - 1}",
            place=str(folder),
        )
    plan = work.plan(series, number)
    reader = plan.knowing(reader_now(work))
    if plan.policy == NEXT:
        made = list(touch_until_answered(plan, number, reader, MOST))
        found, answer = made[-1].found, made[-1].answer
        row = judge_all(plan, number, made, reader).row()
    else:
        found = draw_touch(plan, number, reader)
        answer = recognise(reader, reader.signal(found.counts), number)
        row = judge(plan, number, found, answer, reader).row()
    row = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in row.items()
    }
    if plot is not None:
        with figure_on(plot, 2, 2, (10.5, 10.0)) as axes:
            _draw_surface(axes[0], found, reader)
            _draw_counts(axes[1], found, reader)
            _draw_fit(axes[2], found, reader)
            _draw_answer(axes[3], found, reader, answer, row)
    return row


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
    axis.plot(*_outline(reader, touch.x_mm, touch.y_mm, touch.theta_rad), color=TRUTH)
    axis.set_title("1  what is touched, and where the sensor stands")
    _label(axis, "surface")


def _draw_counts(axis: Axes, found: DrawnTouch, reader: Reader) -> None:
    image = axis.imshow(found.counts, extent=_extent(reader), cmap="viridis")
    axis.figure.colorbar(image, ax=axis, shrink=0.8, label="counts")
    axis.set_title("2  what the sensor reads")
    _label(axis, "sensor")


def _draw_fit(axis: Axes, found: DrawnTouch, reader: Reader) -> None:
    """Draw the likeliest lattice and its symbols over the counts."""
    axis.imshow(found.counts, extent=_extent(reader), cmap="Greys")
    signal = reader.signal(found.counts)
    fits = [
        (fit, prepared.embossed)
        for prepared in (reader.prepared if signal.contact else ())
        for fit in fit_lattices(reader.image(signal, prepared), prepared.bank, reader.options.first)
    ]
    if fits:
        fit, embossed = max(fits, key=lambda one: one[0].value)
        glyphs, pitch = embossed.alphabet.glyphs, embossed.style.pitch_mm
        c, s = math.cos(fit.theta_rad), math.sin(fit.theta_rad)
        for cell, scores in zip(fit.cells, fit.scores, strict=True):
            label = int(np.argmax(scores))
            for stroke in glyphs[label].strokes if label < len(glyphs) else ():
                line = (cell + 0.5) * pitch + np.array(stroke) * embossed.alphabet.reach * pitch
                at = (line - (fit.x_mm, fit.y_mm)) @ np.array([[c, -s], [s, c]])  # sensor frame
                axis.plot(*at.T, color=ANSWER, lw=2.5, alpha=0.8)
    axis.set_title("3  the symbols that the likeliest lattice shows")
    left, right, bottom, top = _extent(reader)
    axis.set_xlim(left, right)
    axis.set_ylim(bottom, top)
    _label(axis, "sensor")


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
        outline = _outline(reader, touch.x_mm, touch.y_mm, touch.theta_rad)
        axis.plot(*outline, color=TRUTH, label="truth")
    T = answer.T_face_probe
    if answer and T is not None:
        own = scene is not None and (answer.object, answer.face) == (scene.object_name, scene.face)
        label = "answer" if own else f"answer, on {answer.object}/{answer.face}"
        outline = _outline(reader, T[0, 3], T[1, 3], math.atan2(T[1, 0], T[0, 0]))
        axis.plot(*outline, "--", color=ANSWER, label=label)
    outcome = WORDS[row["verdict"]] + (f": {row['reason']}" if row["reason"] else "")
    if row["error_mm"] is not None:
        outcome += f", off by {row['error_mm']:.3f} mm, {row['error_deg']:.2f} degrees"
    axis.set_title(f"4  {outcome}")
    _label(axis, "face")
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


def _extent(reader: Reader) -> tuple[float, float, float, float]:
    a, b = reader.sensor.half_mm
    return (-a, a, -b, b)


def _label(axis: Axes, frame: str) -> None:
    axis.set_xlabel(f"x of the {frame}, mm")
    axis.set_ylabel(f"y of the {frame}, mm")
