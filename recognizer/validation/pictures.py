"""Pictures of the report, as SVG to stand in the page.

Rows and results -> text of SVG elements. Same input, same bytes; letters stay letters, so
that they can be searched and the page stays small. Axes carry their units.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from recognizer.validation.results import INSIDE, RMS_DEG, RMS_MM
from recognizer.validation.statistics import FAILS, HOLDS, chi2_quantile
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Annotation
    from matplotlib.transforms import BboxBase

GREEN, RED, GREY = "#2a7f62", "#c0392b", "#8a8f98"
COLOURS = {RIGHT: GREEN, WRONG: RED, REJECTED: GREY}
DOTS = COLOURS | {REJECTED: "#d98c00"}  #: grey would be taken for a symbol
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


@dataclass(slots=True)
class SvgFigure:
    """A figure while it is drawn, and its SVG afterwards."""

    axes: list[Axes]
    svg: str = ""


@contextmanager
def svg_figure(rows: int, columns: int, size: tuple[float, float]) -> Iterator[SvgFigure]:
    """Yield a figure of some inches; its SVG is there at the end."""
    drawn, text = SvgFigure([]), io.StringIO()
    with _figure(rows, columns, size) as figure:
        drawn.axes = figure.axes
        yield drawn
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    drawn.svg = svg[svg.index("<svg") :]


@contextmanager
def figure_on(
    path: Path, rows: int, columns: int, size: tuple[float, float]
) -> Iterator[list[Axes]]:
    """Yield axes, without a grid, of a picture that is written at the end: .png, .svg, .pdf."""
    undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    metadata: dict[str, None] = undated.get(path.suffix.lower(), {})
    with _figure(rows, columns, size, {"axes.grid": False}) as figure:
        yield figure.axes
        figure.savefig(path, dpi=110, metadata=metadata)


@contextmanager
def _figure(
    rows: int, columns: int, size: tuple[float, float], settings: dict[str, Any] | None = None
) -> Iterator[Figure]:
    """Yield a figure with its axes; letters are as large as in SVG until it is saved."""
    import matplotlib
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_SETTINGS | (settings or {})):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        figure.subplots(rows, columns)
        yield figure


def confusion(objects: dict[str, Any]) -> str:
    """Return the matrix of touched and answered objects; empty for too many of them."""
    names = objects["names"]
    if not names or len(names) > MOST_OBJECTS:
        return ""
    matrix = np.array(objects["matrix"], float)
    shares = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
    side = 0.28 * len(names)
    with svg_figure(1, 1, (max(5.0, side + 3.2), max(2.6, side + 1.6))) as picture:
        (axis,) = picture.axes
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
    colours = level_colours(rows["level"])
    of_level = {level: right & (rows["level"] == level) for level in colours}
    of_level = {level: where for level, where in of_level.items() if where.any()}
    with svg_figure(1, 3, (11.5, 3.2)) as picture:
        axes = picture.axes
        for axis, name, label in (
            (axes[0], "error_mm", "error of the place, mm"),
            (axes[1], "error_deg", "error of the turn, degrees"),
        ):
            for level, where in of_level.items():
                errors = np.sort(np.abs(rows[name][where]))
                shares = np.linspace(0, 100, len(errors) + 1)[1:]
                keep = np.unique(np.linspace(0, len(errors) - 1, 200).astype(int))
                axis.step(errors[keep], shares[keep], where="post", color=colours[level],
                          label=level)  # fmt: skip
            axis.set_xlabel(label)
            axis.set_ylabel("right answers with no more, %")
            axis.set_ylim(0, 101)
            axis.set_xlim(left=0)
        axes[0].legend(frameon=False, loc="lower right")
        expected = np.linspace(0.01, 0.99, 99)
        limits = np.array([chi2_quantile(p) for p in expected])
        axes[2].plot([0, 100], [0, 100], color="black", lw=0.8, ls="--")
        for level, where in of_level.items():
            found = (rows["chi2"][where][None] < limits[:, None]).mean(axis=1)
            axes[2].plot(100 * expected, 100 * found, color=colours[level], label=level)
        axes[2].set_xlabel("ellipsoid of the covariance that should hold, %")
        axes[2].set_ylabel("and holds, % of the right answers")
    return picture.svg


def accuracy(results: dict[str, Any]) -> str:
    """Return answers and pose error against level, force, tilt, edge distance and symbols."""
    names = [name for name in _NAMES if results["against"][name]["bins"]]
    with svg_figure(2, len(names) + 1, (2.6 * len(names) + 2.6, 4.6)) as picture:
        axes = picture.axes
        above, below = axes[: len(names) + 1], axes[len(names) + 1 :]
        levels = results["levels"]
        places = np.arange(len(levels))
        _shares(above[0], places, levels, marker="o")
        below[0].plot(places, _rms_mm(levels), "o", color="black")
        for axis in (above[0], below[0]):
            axis.set_xticks(places, [line["level"] for line in levels], rotation=30, ha="right")
            axis.set_xlim(-0.5, max(len(levels), 1) - 0.5)
        below[0].set_xlabel("level of noise")
        for name, top, bottom in zip(names, above[1:], below[1:], strict=True):
            bins = results["against"][name]["bins"]
            middle = np.array([(line["low"] + line["high"]) / 2 for line in bins])
            _shares(top, middle, bins)
            wrong = [100 * line["wrongly"]["share"] for line in bins]
            top.plot(middle, wrong, "x", color=COLOURS[WRONG])
            bottom.plot(middle, _rms_mm(bins), "o-", color="black", ms=3)
            bottom.set_xlabel(_NAMES[name])
        above[0].set_ylabel("answered, %; wrong (x), %")
        below[0].set_ylabel("place, rms, mm")
        for axis in above:
            axis.set_ylim(-3, 103)
        for axis in below:
            axis.set_ylim(bottom=0)
    return picture.svg


def _shares(axis: Axes, at: Any, lines: list[dict[str, Any]], marker: str = ".") -> None:
    """Draw the shares that are answered, with their intervals, in percent."""
    value, low, high = (
        np.array([100 * line["answered"][end] for line in lines])
        for end in ("share", "low", "high")
    )
    ends = value - low, high - value
    axis.errorbar(at, value, ends, fmt=marker, color=COLOURS[RIGHT], capsize=2)


def _rms_mm(lines: list[dict[str, Any]]) -> list[float]:
    return [np.nan if line["rms_mm"] is None else line["rms_mm"] for line in lines]


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
    bins = np.linspace(0, 100, 41)
    with svg_figure(1, 1, (6.2, 2.6)) as picture:
        (axis,) = picture.axes
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


def limits(found: dict[str, Any]) -> str:
    """Return what touches can say at best by class: places named, answers, and pose errors."""
    classes = found["classes"]
    names, at = [line["class"] for line in classes], np.arange(len(classes))
    with svg_figure(1, 4, (13.0, 3.2)) as picture:
        named, answers, *errors = picture.axes
        for line in classes:
            shares = [(each["places"], 100 * each["share"]) for each in line["named"]]
            named.semilogx(*zip(*shares, strict=True), ".-", label=line["class"])
        named.set_xlabel(f"registered places, at a doubt of {found['doubt']:g}")
        named.set_ylabel("touches that can be named, %")
        named.set_ylim(-3, 103)
        named.legend(frameon=False)
        pairs: list[tuple[Axes, str, str, str, str, float]] = [
            (answers, "best", "right", "can be named, answered right, %", "share", 100.0),
            (errors[0], "bound_mm", "rms_mm", "place, rms, mm", "", 1.0),
            (errors[1], "bound_deg", "rms_deg", "turn, rms, degrees", "", 1.0),
        ]
        for axis, best, reached, label, key, scale in pairs:
            for name, off, colour in ((best, -0.2, GREY), (reached, 0.2, GREEN)):
                values = [line[name][key] if key else line[name] for line in classes]
                axis.bar(at + off, [scale * (v or 0.0) for v in values], 0.38, color=colour)
            axis.set_xticks(at, names)
            axis.set_ylabel(label)
        for axis, unit in zip(errors, ("mm", "deg"), strict=True):
            for place, line in enumerate(classes):
                if line[f"ratio_{unit}"] is not None:
                    text = f"x {line[f'ratio_{unit}']:.1f}"
                    axis.text(place + 0.2, line[f"rms_{unit}"], text, ha="center", va="bottom")
    return picture.svg


TINTS = {HOLDS: GREEN, FAILS: RED}  #: of a state; others are grey
REFUSED_STRANGER = "#7fae9d"


def draw_answers(worlds: Sequence[dict[str, Any]]) -> str:
    """Return a bar for each world: right, refused and wrong touches, % and counts."""
    with svg_figure(1, 1, (11.0, 1.0 + 0.27 * len(worlds))) as picture:
        (axis,) = picture.axes
        places = _rows_of(axis, worlds)
        left = np.zeros(len(worlds))
        known = np.array([line["registered"] for line in worlds])
        for verdict in (RIGHT, REJECTED, WRONG):
            count = np.array([line[verdict] for line in worlds])
            wide = 100 * count / np.maximum([line["touches"] for line in worlds], 1)
            axis.barh(places, wide, left=left, color=DOTS[verdict], label=WORDS[verdict])
            if verdict == REJECTED and not known.all():
                axis.barh(places[~known], wide[~known], left=left[~known], color=REFUSED_STRANGER,
                          label="refused, as what nobody knows must be")  # fmt: skip
            for y, x, w, n in zip(places, left, wide, count, strict=True):
                if w >= 5:
                    axis.text(x + w / 2, y, f"{n:,}", ha="center", va="center", color="white",
                              fontsize=7.5)  # fmt: skip
                elif verdict == WRONG and n:
                    axis.text(101, y, f"{n:,} wrong", va="center", color=DOTS[WRONG], fontsize=7.5)
            left += wide
        axis.set_xlim(0, 112)
        axis.set_xticks(range(0, 101, 20))
        axis.set_xlabel("touches, %")
        axis.legend(frameon=False, ncols=4, loc="lower left", bbox_to_anchor=(0, 1))
    return picture.svg


def draw_errors(worlds: Sequence[dict[str, Any]]) -> str:
    """Return the errors of the right answers with their intervals; empty without any."""
    shown = [line for line in worlds if line["right"]]
    if not shown:
        return ""
    with svg_figure(1, 3, (11.5, 1.0 + 0.27 * len(shown))) as picture:
        axes = picture.axes
        for axis, name, bound, label in (
            (axes[0], "rms_mm", RMS_MM, "place, rms, mm"),
            (axes[1], "rms_deg", RMS_DEG, "turn, rms, degrees"),
        ):
            places = _rows_of(axis, shown)
            top = 1.3 * max(line[name] for line in shown)
            for y, line in zip(places, shown, strict=True):
                low, high = line[f"{name}_95"]
                ends = low, top if high is None else min(top, high)
                _interval(axis, y, line[name], ends, line["states"][name])
            axis.axvline(bound, color="black", lw=0.8, ls="--")
            axis.set_xlim(0, max(top, 1.1 * bound))
            axis.set_xlabel(label)
        places = _rows_of(axes[2], shown)
        for y, line in zip(places, shown, strict=True):
            share = line["inside_95"]
            ends = 100 * share["low"], 100 * share["high"]
            _interval(axes[2], y, 100 * share["share"], ends, line["states"]["inside_95"])
        axes[2].axvspan(*(100 * end for end in INSIDE), color=GREEN, alpha=0.12, lw=0)
        axes[2].set_xlim(0, 101)
        axes[2].set_xlabel("inside the 95 % ellipsoid, %")
        for axis in axes[1:]:
            axis.set_yticklabels([])
    return picture.svg


def _rows_of(axis: Axes, worlds: Sequence[dict[str, Any]]) -> np.ndarray:
    """Give every world a row, the first on top; return their places."""
    places = np.arange(len(worlds))
    names = (f"{w['run']}: {w['engine']}, {w['surface']}, {w['sensor']}" for w in worlds)
    axis.set_yticks(places, list(names))
    axis.set_ylim(len(worlds) - 0.4, -0.6)
    axis.grid(visible=False, axis="y")
    return places


def _interval(axis: Axes, y: float, value: float, ends: tuple[float, float], state: str) -> None:
    colour = TINTS.get(state, GREY)
    axis.plot(ends, [y, y], color=colour, lw=1.5)
    axis.plot([value], [y], "o", color=colour, ms=4)


Point = tuple[float, float, str]

# Labels, sizes in points.
LETTERS = 7.5
CLEAR = 1.5  #: around every name: another font's letters are a little wider
MARKER = 5.0  #: half the side of a point
AWAY = (5.0, 9.0, 16.0, 25.0, 36.0, 50.0, 66.0)  #: from the point, tried in this order ...
TURNS = (0, 180, 90, 270, 45, 225, 315, 135)  #: ... and in these directions, degrees
LINE_FROM = 16.0  #: a name at this distance, or farther, gets a line


def label_points(axes: Axes, points: Sequence[Point]) -> list[Annotation]:
    """Write the names of points that are drawn already; returns them in the order of x.

    None stands over another, over a point or outside the axes, whose limits and scales must stand.
    Every name tries places around its point, from near to far, and takes the first that is free; a
    far one gets a thin line to its point. A point that is no finite number gets no name.
    """
    from matplotlib.transforms import Bbox

    figure = axes.get_figure(root=True)
    if figure is None:
        return []
    figure.draw_without_rendering()
    pixel = figure.dpi / 72
    shown = sorted(point for point in points if np.isfinite(point[:2]).all())
    spots = [axes.transData.transform(point[:2]) for point in shown]
    taken: list[BboxBase] = [Bbox([spot - MARKER * pixel, spot + MARKER * pixel]) for spot in spots]
    legend = axes.get_legend()
    if legend is not None:
        taken.append(legend.get_window_extent())
    frame, found = axes.get_window_extent(), []
    for (x, y, name), spot in zip(shown, spots, strict=True):
        text = axes.annotate(name, (x, y), (0, 0), textcoords="offset points",
                             fontsize=LETTERS, ha="center", va="center")  # fmt: skip
        text.set_in_layout(False)
        half = np.array(text.get_window_extent().size) / pixel / 2
        for away, turn in product(AWAY, TURNS):  # the last one if none is free
            towards = np.array([math.cos(math.radians(turn)), math.sin(math.radians(turn))])
            offset = away * towards + (half + CLEAR) * np.sign(towards.round(6))
            low, high = (spot + (offset + k * (half + CLEAR)) * pixel for k in (-1, 1))
            box = Bbox([low, high])
            inside = (low >= frame.min).all() and (high <= frame.max).all()
            if inside and not box.count_overlaps(taken):
                break
        text.set_position(tuple(offset))
        if math.hypot(*offset) - half[0] >= LINE_FROM:
            axes.annotate("", (x, y), tuple(offset), textcoords="offset points",
                          annotation_clip=False,
                          arrowprops={"arrowstyle": "-", "lw": 0.5, "color": GREY,
                                      "shrinkA": 4, "shrinkB": 3}).set_in_layout(False)  # fmt: skip
        taken.append(box)
        found.append(text)
    return found


def work_precision(study: dict[str, Any], times: dict[str, Any], used: str = "") -> str:
    """Return error against run time for contact models, decoders and readers.

    `study` and `times` are those of `results.json` and `times.json`; `used` is the level of the
    contact model of this run, which is ringed.
    """
    contact, decoders, readers = (
        list(zip(times[name], study[name], strict=True))
        for name in ("contact", "decoders", "readers")
    )
    places = _rms_mm(study["readers"])
    panels: list[tuple[str, str, str, list[Point]]] = [
        ("contact models and engines", "largest error of an image, %", "ms",
         [(ms, 100 * line["error"], line["level"]) for ms, line in contact]),
        ("decoders, 5 % wrong symbols", "windows not answered right, %", "µs",
         [(1e3 * ms, 100 * (1 - line["right"] / line["windows"]), line["decoder"])
          for ms, line in decoders]),
        ("readers", "touches not answered right, %", "ms",
         [(ms, 100 * (1 - line["right"] / line["touches"]), line["reader"])
          for ms, line in readers]),
        ("readers", "place, rms, mm", "ms",
         [(ms, mm, line["reader"]) for (ms, line), mm in zip(readers, places, strict=True)]),
    ]  # fmt: skip
    with svg_figure(2, 2, (11.5, 8.0)) as picture:
        _draw_contact(picture.axes[0], [line["series"] for _, line in contact], panels[0][3], used)
        for axis, (_, _, _, points) in zip(picture.axes[1:], panels[1:], strict=True):
            _scatter(axis, points)
        for axis, (title, label, unit, _) in zip(picture.axes, panels, strict=True):
            axis.set_title(title)
            axis.set_ylabel(label)
            axis.set_xlabel(f"CPU time of one, {unit}")
            axis.margins(x=0.3, y=0.2)
        for axis in picture.axes[1:]:
            top = max(axis.get_ylim()[1], 1e-3)
            axis.set_ylim(-0.12 * top, 1.15 * top)
        for axis, panel in zip(picture.axes, panels, strict=True):
            label_points(axis, panel[3])
    return picture.svg


def _draw_contact(axis: Axes, series: list[str], points: list[Point], used: str) -> None:
    """Draw a line for each overlay and each engine, and a ring about the level in use."""
    for number, name in enumerate(dict.fromkeys(series)):
        own = [point for point, of in zip(points, series, strict=True) if of == name]
        x, y, _levels = zip(*own, strict=True)
        axis.loglog(x, y, "os^vD"[number % 5] + "-", lw=1, label=name, mfc="none")
        for ms, error, level in own:
            if level == used:
                axis.plot(ms, error, "o", ms=10, mfc="none", mec="black", label="this run")
    axis.legend(frameon=False, loc="lower left")


def _scatter(axis: Axes, points: list[Point]) -> None:
    """Draw points over a logarithm of the time."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    x, y, _names = zip(*points, strict=True)
    axis.semilogx(x, y, "o", color="black", mfc="none")
    axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.xaxis.set_minor_formatter("")
