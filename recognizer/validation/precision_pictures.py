"""The picture of error against run time: contact models and engines, decoders, readers.

Study + times -> SVG. Every point bears its name; no name stands over another.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from recognizer.validation.labels import Point, label_points
from recognizer.validation.pictures import SvgPicture, number_or_nan, svg_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation


def work_precision(study: dict[str, Any], times: dict[str, Any], used: str = "") -> str:
    """Return error against run time for contact models, decoders and readers.

    Parameters
    ----------
    study, times
        As `results.json` and `times.json` have them.
    used
        The level of the contact model by which this run touched; it is ringed.
    """
    picture = SvgPicture()
    with svg_figure(2, 2, (11.5, 8.0), picture) as (_, axes):
        draw_work_precision(axes, study, times, used)
    return picture.svg


def draw_work_precision(
    axes: list[Axes], study: Mapping[str, Any], times: Mapping[str, Any], used: str
) -> list[Annotation]:
    """Draw four pictures; return the names beside their points."""
    panels = [_contact_points(axes[0], study, times, used)]
    decoders = zip(study["decoders"], times["decoders"], strict=True)
    panels.append(
        [
            (1e3 * ms, 100 * (1 - line["right"] / line["windows"]), line["decoder"])
            for line, ms in decoders
        ]
    )
    readers = list(zip(study["readers"], times["readers"], strict=True))
    panels.append(
        [(ms, 100 * (1 - line["right"] / line["touches"]), line["reader"]) for line, ms in readers]
    )
    panels.append([(ms, number_or_nan(line["rms_mm"]), line["reader"]) for line, ms in readers])
    titles = (
        ("contact models and engines", "largest error of an image, %", "ms"),
        ("decoders, 5 % wrong symbols", "windows not answered right, %", "µs"),
        ("readers", "touches not answered right, %", "ms"),
        ("readers", "place, rms, mm", "ms"),
    )
    for axis, points, (title, label, unit) in zip(axes, panels, titles, strict=True):
        if axis is not axes[0]:
            _scatter(axis, points)
        axis.set_title(title)
        axis.set_ylabel(label)
        axis.set_xlabel(f"CPU time of one, {unit}")
        axis.margins(x=0.3, y=0.2)
    for axis in axes[1:]:
        top = max(axis.get_ylim()[1], 1e-3)
        axis.set_ylim(-0.12 * top, 1.15 * top)
    names = []
    for axis, points in zip(axes, panels, strict=True):
        names += label_points(axis, points)
    return names


def _contact_points(
    axis: Axes, study: Mapping[str, Any], times: Mapping[str, Any], used: str
) -> list[Point]:
    """Draw a line for each overlay and each engine; return their points."""
    lines = list(zip(study["contact"], times["contact"], strict=True))
    found: list[Point] = []
    for number, name in enumerate(dict.fromkeys(line["series"] for line, _ in lines)):
        points = [(ms, 100 * line["error"], line["level"])
                  for line, ms in lines if line["series"] == name]  # fmt: skip
        x, y, _levels = zip(*points, strict=True)
        axis.loglog(x, y, "os^vD"[number % 5] + "-", lw=1, label=name, mfc="none")
        for ms, error, level in points:
            if level == used:
                axis.plot(
                    [ms], [error], "o", ms=10, mfc="none", mec="black", ls="", label="this run"
                )
        found += points
    axis.legend(frameon=False, loc="lower left")
    return found


def _scatter(axis: Axes, points: list[Point]) -> None:
    """Draw points over a logarithm of the time."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    x, y, _names = zip(*points, strict=True)
    axis.semilogx(x, y, "o", color="black", mfc="none")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.xaxis.set_minor_formatter("")
