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

from probe.contact.contract import Touch
from recognizer.touch.lab import find_face
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import Recognition
from recognizer.validation.campaign import series_of
from recognizer.validation.draw import DrawnTouch
from recognizer.validation.errors import ValidationError
from recognizer.validation.pictures import WORDS, figure_on
from recognizer.validation.run import read_record
from recognizer.validation.trial import judge_all, touches_of
from recognizer.validation.workers import reader_now

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

FORMATS = (".png", ".svg", ".pdf")
TRUTH, ANSWER = "#b0413e", "#2f6db3"


def repeat_touch(folder: Path, number: int, plot: Path | None) -> dict[str, Any]:
    """Do a touch of a run again, and write a picture of it if `plot` is given.

    Returns the touch as a row of `trials.parquet` holds it; None for what is no number. Of touches
    that followed each other the picture shows the last.

    Raises ValidationError: there is no such run, touch, or kind of picture.
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
    made = touches_of(plan, number, reader)
    found, answer = made[-1].found, made[-1].answer
    row = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in judge_all(plan, number, made, reader).row().items()
    }
    if plot is not None:
        with figure_on(plot, 2, 2, (10.5, 10.0)) as axes:
            _draw_stages(axes, found, reader)
            _draw_answer(axes[3], found, reader, answer, row)
    return row


def _draw_stages(axes: list[Axes], found: DrawnTouch, reader: Reader) -> None:
    """Draw the surface with the sensor on it, the counts, and the symbols that the fit sees."""
    from probe.plot.frame import UNITS, in_mm
    from probe.plot.touch import draw_image, draw_patch
    from recognizer.picture import draw_touch, winning_lattice

    sensor, signal = reader.sensor, reader.signal(found.counts)
    draw_patch(axes[0], found.contact.scene.under(found.touch).surface, sensor, found.touch)
    axes[0].set_title("1  what is touched, and where the sensor stands")
    draw_image(axes[1], found.counts.astype(np.float64), sensor, UNITS["counts"])
    in_mm(axes[1], "2  what the sensor reads")
    draw_touch(axes[2], sensor, signal, winning_lattice(reader, signal))
    axes[2].set_title("3  the symbols that the likeliest lattice shows")


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
            face = reader.lab.arrays[held[0]].face(held[1])
            axis.plot(*face.centres_mm.T, ".", color="#aab0b8", ms=3)
        axis.plot(*_outline(reader, touch), color=TRUTH, label="truth")
    if answer:
        own = scene is not None and (answer.object, answer.face) == (scene.object_name, scene.face)
        label = "answer" if own else f"answer, on {answer.object}/{answer.face}"
        at = Touch(answer.x_mm, answer.y_mm, math.radians(answer.theta_deg), 0.0)
        axis.plot(*_outline(reader, at), "--", color=ANSWER, label=label)
    outcome = WORDS[row["verdict"]] + (f": {row['reason']}" if row["reason"] else "")
    if row["error_mm"] is not None:
        outcome += f", off by {row['error_mm']:.3f} mm, {row['error_deg']:.2f} degrees"
    axis.set_title(f"4  {outcome}")
    axis.set_xlabel("x of the face, mm")
    axis.set_ylabel("y of the face, mm")
    axis.set_aspect("equal")
    if axis.get_legend_handles_labels()[0]:
        axis.legend(frameon=False)


def _outline(reader: Reader, touch: Touch) -> Array:
    """Return the sensor's outline (2, n) on the face; its upper left corner is cut off."""
    a, b = reader.sensor.half_mm
    own = np.array([(-a + 3, b), (a, b), (a, -b), (-a, -b), (-a, b - 3), (-a + 3, b)])
    return touch.on_surface(own).T
