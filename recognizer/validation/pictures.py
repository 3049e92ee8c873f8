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
WORDS = {RIGHT: "right", WRONG: "wrong", REJECTED: "refused"}  #: as pages say them
LEVEL_COLOURS = {"low": "#4c9f70", "typical": "#2f6db3", "hard": "#b8860b", "mismatch": "#b0413e"}
MORE_COLOURS = ("#7b4fa3", "#1f8a99", "#8c564b", "#d17fb0", "#6b7280", "#9aa227")  #: other levels
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
def svg_figure(
    rows: int, columns: int, size: tuple[float, float], into: SvgPicture
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Yield a figure of so many inches and its axes; its SVG is there at the end."""
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
    with svg_figure(1, 1, (max(5.0, side + 3.2), max(2.6, side + 1.6)), picture) as (_, (axis,)):
        axis.grid(visible=False)
        axis.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
        axis.set_xticks(range(len(names) + 1), [*names, "refused"], rotation=35, ha="right")
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
    """Return the distribution of pose errors, and how honest the covariance is; "" of none."""
    right = rows["verdict"] == RIGHT
    if not right.any():
        return ""
    picture = SvgPicture()
    colours = level_colours(rows["level"])
    with svg_figure(1, 3, (11.5, 3.2), picture) as (_, axes):
        for axis, name, label in (
            (axes[0], "error_mm", "error of the place, mm"),
            (axes[1], "error_deg", "error of the turn, degrees"),
        ):
            for level, colour in colours.items():
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
        for level, colour in colours.items():
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
    with svg_figure(2, len(names) + 1, (2.6 * len(names) + 2.6, 4.6), picture) as (_, axes):
        above, below = axes[: len(names) + 1], axes[len(names) + 1 :]
        levels = results["levels"]
        places = np.arange(len(levels))
        _share(above[0], places, [line["answered"] for line in levels], marker="o")
        below[0].plot(
            places, [number_or_nan(line["rms_mm"]) for line in levels], "o", color="black"
        )
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
            rms = [number_or_nan(line["rms_mm"]) for line in bins]
            bottom.plot(middle, rms, "o-", color="black", ms=3)
            bottom.set_xlabel(_NAMES[name])
        above[0].set_ylabel("answered, %; wrong (x), %")
        below[0].set_ylabel("place, rms, mm")
        for axis in above:
            axis.set_ylim(-3, 103)
        for axis in below:
            axis.set_ylim(bottom=0)
    return picture.svg


def level_colours(levels: Any) -> dict[str, str]:
    """Return a colour for each level that occurs; those that are not usual take the next one."""
    there = set(levels.tolist())
    others = sorted(there.difference(LEVEL_COLOURS))
    more = {name: MORE_COLOURS[k % len(MORE_COLOURS)] for k, name in enumerate(others)}
    return {name: colour for name, colour in LEVEL_COLOURS.items() if name in there} | more


def margins(rows: dict[str, Any]) -> str:
    """Return how sure right, wrong and refused answers are; "" where nothing was weighed."""
    if not np.isfinite(rows["margin"]).any():
        return ""
    picture = SvgPicture()
    bins = np.linspace(0, 100, 41)
    with svg_figure(1, 1, (6.2, 2.6), picture) as (_, (axis,)):
        for verdict, colour in COLOURS.items():
            chosen = rows["margin"][rows["verdict"] == verdict]
            chosen = np.clip(chosen[np.isfinite(chosen)], 0, bins[-1] - 1e-6)
            axis.hist(
                chosen, bins.tolist(), histtype="step", color=colour, label=WORDS[verdict], log=True
            )
        axis.set_xlabel("margin over the runner-up, nats (the last bin: all beyond)")
        axis.set_ylabel("touches")
        axis.legend(frameon=False)
    return picture.svg


def _share(axis: Axes, at: Any, shares: list[dict[str, Any]], marker: str = ".") -> None:
    """Draw shares with their intervals, in percent."""
    value = np.array([100 * share["share"] for share in shares])
    low = value - np.array([100 * share["low"] for share in shares])
    high = np.array([100 * share["high"] for share in shares]) - value
    axis.errorbar(at, value, (low, high), fmt=marker, color=COLOURS[RIGHT], capsize=2)


def number_or_nan(value: float | None) -> float:
    """Return a number, for what is None as well."""
    return np.nan if value is None else value
