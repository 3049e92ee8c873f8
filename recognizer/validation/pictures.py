"""Pictures of the report, as SVG to stand in the page.

Rows and results -> text of SVG elements. Same input, same bytes; letters stay letters, so
that they can be searched and the page stays small. Axes carry their units.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from recognizer.validation.statistics import chi2_quantile
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {RIGHT: "#2a7f62", WRONG: "#c0392b", REJECTED: "#8a8f98"}
LEVEL_COLOURS = {"low": "#4c9f70", "typical": "#2f6db3", "hard": "#b8860b", "mismatch": "#b0413e"}
MOST_OBJECTS = 40  #: that are drawn as a matrix
_SETTINGS = {
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "svg.fonttype": "none",
    "svg.hashsalt": "validate-set",
}
_NAMES = {
    "force_n": "force, N",
    "tilt_deg": "tilt of the wrist, degrees",
    "edge_mm": "sensor's centre to the nearest edge, mm",
    "symbols": "symbols under the sensor",
}


class SvgPicture:
    """A figure while it is drawn, and its SVG afterwards."""

    def __init__(self) -> None:
        self.svg = ""


@contextmanager
def _picture(
    rows: int, columns: int, size: tuple[float, float], into: SvgPicture
) -> Iterator[tuple[Figure, list[Axes]]]:
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_SETTINGS):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        axes = figure.subplots(rows, columns, squeeze=False)
        yield figure, list(axes.flat)
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    into.svg = svg[svg.index("<svg") :]


@contextmanager
def figure_on(
    path: Path, rows: int, columns: int, size: tuple[float, float]
) -> Iterator[list[Axes]]:
    """Yield axes, without a grid, of a picture that is written at the end: .png, .svg, .pdf."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_SETTINGS | {"axes.grid": False}):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasAgg(figure)
        yield list(figure.subplots(rows, columns, squeeze=False).flat)
        undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
        metadata: dict[str, None] = undated.get(path.suffix.lower(), {})
        figure.savefig(path, dpi=110, metadata=metadata)


def confusion(objects: dict[str, Any]) -> str:
    """Return the matrix of touched and answered objects; empty for too many of them."""
    names = objects["names"]
    if not names or len(names) > MOST_OBJECTS:
        return ""
    matrix = np.array(objects["matrix"], float)
    shares = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
    picture, side = SvgPicture(), 0.28 * len(names)
    with _picture(1, 1, (max(5.0, side + 3.2), max(2.6, side + 1.6)), picture) as (_, (axis,)):
        axis.grid(visible=False)
        axis.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axis.set_xticks(range(len(names) + 1), [*names, "rejected"], rotation=35, ha="right")
        axis.set_yticks(range(len(names)), names)
        axis.set_xlabel("answered")
        axis.set_ylabel("touched")
        if len(names) <= 12:
            for i, line in enumerate(matrix.astype(int)):
                for j, count in enumerate(line):
                    colour = "white" if shares[i, j] > 0.5 else "black"
                    axis.text(j, i, f"{count:,}", ha="center", va="center", color=colour)
    return picture.svg


def pose(rows: dict[str, Any]) -> str:
    """Return the distribution of pose errors, and how honest the covariance is."""
    picture = SvgPicture()
    right = rows["verdict"] == RIGHT
    with _picture(1, 3, (11.5, 3.2), picture) as (_, axes):
        for axis, name, label in (
            (axes[0], "error_mm", "error of the place, mm"),
            (axes[1], "error_deg", "error of the turn, degrees"),
        ):
            for level, colour in LEVEL_COLOURS.items():
                errors = np.sort(np.abs(rows[name][right & (rows["level"] == level)]))
                if len(errors):
                    shares = np.linspace(0, 100, len(errors) + 1)[1:]
                    keep = np.unique(np.linspace(0, len(errors) - 1, 200).astype(int))
                    axis.step(errors[keep], shares[keep], where="post", color=colour, label=level)
            axis.set_xlabel(label)
            axis.set_ylabel("right answers with no more, %")
            axis.set_ylim(0, 101)
            axis.set_xlim(left=0)
        axes[0].legend(frameon=False, loc="lower right")
        expected = np.linspace(0.01, 0.99, 99)
        limits = np.array([chi2_quantile(p) for p in expected])
        axes[2].plot([0, 100], [0, 100], color="black", lw=0.8, ls="--")
        for level, colour in LEVEL_COLOURS.items():
            chi2 = rows["chi2"][right & (rows["level"] == level)]
            if len(chi2):
                found = (chi2[None] < limits[:, None]).mean(axis=1)
                axes[2].plot(100 * expected, 100 * found, color=colour, label=level)
        axes[2].set_xlabel("ellipsoid of the covariance that should hold, %")
        axes[2].set_ylabel("and holds, % of the right answers")
    return picture.svg


def accuracy(results: dict[str, Any]) -> str:
    """Return answers and pose error against level, force, tilt, edge distance and symbols."""
    picture = SvgPicture()
    names = [name for name in _NAMES if results["against"][name]["bins"]]
    with _picture(2, len(names) + 1, (2.6 * len(names) + 2.6, 4.6), picture) as (_, axes):
        above, below = axes[: len(names) + 1], axes[len(names) + 1 :]
        levels = results["levels"]
        places = np.arange(len(levels))
        _share(above[0], places, [line["answered"] for line in levels], marker="o")
        below[0].plot(places, [_number(line["rms_mm"]) for line in levels], "o", color="black")
        for axis in (above[0], below[0]):
            axis.set_xticks(places, [line["level"] for line in levels], rotation=30, ha="right")
            axis.set_xlim(-0.5, max(len(levels), 1) - 0.5)
        below[0].set_xlabel("level of noise")
        for name, top, bottom in zip(names, above[1:], below[1:], strict=True):
            bins = results["against"][name]["bins"]
            middle = np.array([(line["low"] + line["high"]) / 2 for line in bins])
            _share(top, middle, [line["answered"] for line in bins])
            wrong = [100 * line["wrongly"]["share"] for line in bins]
            top.plot(middle, wrong, "x", color=COLOURS[WRONG])
            rms = [_number(line["rms_mm"]) for line in bins]
            bottom.plot(middle, rms, "o-", color="black", ms=3)
            bottom.set_xlabel(_NAMES[name])
        above[0].set_ylabel("answered, %; wrong (x), %")
        below[0].set_ylabel("place, rms, mm")
        for axis in above:
            axis.set_ylim(-3, 103)
        for axis in below:
            axis.set_ylim(bottom=0)
    return picture.svg


def margins(rows: dict[str, Any]) -> str:
    """Return how sure right, wrong and refused answers are."""
    picture = SvgPicture()
    bins = np.linspace(0, 100, 41)
    with _picture(1, 1, (6.2, 2.6), picture) as (_, (axis,)):
        for verdict, colour in COLOURS.items():
            chosen = rows["margin"][rows["verdict"] == verdict]
            chosen = np.clip(chosen[np.isfinite(chosen)], 0, bins[-1] - 1e-6)
            axis.hist(chosen, bins.tolist(), histtype="step", color=colour, label=verdict, log=True)
        axis.set_xlabel("margin over the runner-up, nats (the last bin: all beyond)")
        axis.set_ylabel("touches")
        axis.legend(frameon=False)
    return picture.svg


def work_precision(study: dict[str, Any], times: dict[str, Any]) -> str:
    """Return error against run time for contact levels, decoders and readers."""
    picture = SvgPicture()
    with _picture(2, 2, (11.5, 7.6), picture) as (_, axes):
        for kind, marker in (("tab", "o"), ("pad", "s")):
            points = [
                (ms, 100 * line["error"], line["level"])
                for line, ms in zip(study["contact"], times["contact"], strict=True)
                if line["overlay"] == kind
            ]
            x, y, _names = zip(*points, strict=True)
            axes[0].loglog(x, y, marker + "-", label=f"{kind} overlay", mfc="none")
            _name(axes[0], points)
        axes[0].set_ylabel("largest error of an image, %")
        axes[0].set_title("contact models")
        axes[0].legend(frameon=False)
        _scatter(
            axes[1],
            [
                (1e3 * ms, 100 * (1 - line["right"] / line["windows"]), line["decoder"])
                for line, ms in zip(study["decoders"], times["decoders"], strict=True)
            ],
        )
        axes[1].set_ylabel("windows not answered right, %")
        axes[1].set_title("decoders, 5 % wrong symbols")
        readers = list(zip(study["readers"], times["readers"], strict=True))
        missed = [
            (ms, 100 * (1 - line["right"] / line["touches"]), line["reader"])
            for line, ms in readers
        ]
        _scatter(axes[2], missed)
        axes[2].set_ylabel("touches not answered right, %")
        axes[2].set_title("readers")
        _scatter(axes[3], [(ms, _number(line["rms_mm"]), line["reader"]) for line, ms in readers])
        axes[3].set_ylabel("place, rms, mm")
        axes[3].set_title("readers")
        for axis, unit in zip(axes, ("ms", "µs", "ms", "ms"), strict=True):
            axis.set_xlabel(f"CPU time of one, {unit}")
            axis.margins(x=0.25, y=0.15)
        for axis in axes[1:]:
            top = max(axis.get_ylim()[1], 1e-3)
            axis.set_ylim(-0.08 * top, 1.1 * top)
    return picture.svg


def _scatter(axis: Axes, points: list[tuple[float, float, str]]) -> None:
    """Draw named points over a logarithm of the time."""
    from matplotlib.ticker import LogFormatter, LogLocator

    x, y, _names = zip(*points, strict=True)
    axis.semilogx(x, y, "o", color="black", mfc="none")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.xaxis.set_major_formatter(LogFormatter(labelOnlyBase=False, minor_thresholds=(9, 9)))
    axis.xaxis.set_minor_formatter("")
    _name(axis, points)


def _name(axis: Axes, points: list[tuple[float, float, str]]) -> None:
    """Write names beside points, in turn to the right above and to the left below."""
    for k, (x, y, text) in enumerate(sorted(points)):
        if np.isfinite((x, y)).all():
            aside, side = ((3, 4), "left") if k % 2 == 0 else ((-3, -11), "right")
            axis.annotate(text, (x, y), aside, textcoords="offset points", fontsize=7.5, ha=side)


def _share(axis: Axes, at: Any, shares: list[dict[str, Any]], marker: str = ".") -> None:
    """Draw shares with their intervals, in percent."""
    value = np.array([100 * share["share"] for share in shares])
    low = value - np.array([100 * share["low"] for share in shares])
    high = np.array([100 * share["high"] for share in shares]) - value
    axis.errorbar(at, value, (low, high), fmt=marker, color=COLOURS[RIGHT], capsize=2)


def _number(value: float | None) -> float:
    return np.nan if value is None else value
