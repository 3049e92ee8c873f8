"""Pictures of worlds: what became of their touches, how far off, and how honest.

Lines of worlds -> SVG: bars of right, refused and wrong touches; root mean squares and shares
inside the 95 % ellipsoid with their intervals, the bounds beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from recognizer.validation.bounds import FAILS, HOLDS
from recognizer.validation.flat_faces import DOTS
from recognizer.validation.pictures import WORDS, SvgPicture, svg_figure
from recognizer.validation.settings import LIMITS
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TINTS = {HOLDS: "#2a7f62", FAILS: "#c0392b"}  #: of a state; others are grey
GREY, REFUSED_STRANGER = "#8a8f98", "#7fae9d"


def world_name(line: dict[str, Any]) -> str:
    """Return a world in a line."""
    return f"{line['run']}: {line['engine']}, {line['surface']}, {line['sensor']}"


def draw_answers(worlds: Sequence[dict[str, Any]]) -> str:
    """Return a bar for each world: right, refused and wrong touches, % and counts."""
    picture = SvgPicture()
    with svg_figure(1, 1, (11.0, 1.0 + 0.27 * len(worlds)), picture) as (_, (axis,)):
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
    picture = SvgPicture()
    with svg_figure(1, 3, (11.5, 1.0 + 0.27 * len(shown)), picture) as (_, axes):
        for axis, name, label in (
            (axes[0], "mm", "place, rms, mm"),
            (axes[1], "deg", "turn, rms, degrees"),
        ):
            places = _rows_of(axis, shown)
            top = 1.3 * max(line[f"rms_{name}"] for line in shown)
            for y, line in zip(places, shown, strict=True):
                low, high = line[f"rms_{name}_95"]
                ends = low, min(top, np.inf if high is None else high)
                _interval(axis, y, line[f"rms_{name}"], ends, line["states"][f"rms_{name}"])
            axis.axvline(LIMITS.rms_mm if name == "mm" else LIMITS.rms_deg, color="black", lw=0.8,
                         ls="--")  # fmt: skip
            axis.set_xlim(0, max(top, 1.1 * (LIMITS.rms_mm if name == "mm" else LIMITS.rms_deg)))
            axis.set_xlabel(label)
        places = _rows_of(axes[2], shown)
        for y, line in zip(places, shown, strict=True):
            share = line["inside_95"]
            ends = 100 * share["low"], 100 * share["high"]
            _interval(axes[2], y, 100 * share["share"], ends, line["states"]["inside_95"])
        axes[2].axvspan(*(100 * end for end in LIMITS.inside), color="#2a7f62", alpha=0.12, lw=0)
        axes[2].set_xlim(0, 101)
        axes[2].set_xlabel("inside the 95 % ellipsoid, %")
        for axis in axes[1:]:
            axis.set_yticklabels([])
    return picture.svg


def _rows_of(axis: Axes, worlds: Sequence[dict[str, Any]]) -> np.ndarray:
    """Give every world a row, the first on top; return their places."""
    places = np.arange(len(worlds))
    axis.set_yticks(places, [world_name(line) for line in worlds])
    axis.set_ylim(len(worlds) - 0.4, -0.6)
    axis.grid(visible=False, axis="y")
    return places


def _interval(axis: Axes, y: float, value: float, ends: tuple[float, float], state: str) -> None:
    colour = TINTS.get(state, GREY)
    axis.plot(ends, [y, y], color=colour, lw=1.5)
    axis.plot([value], [y], "o", color=colour, ms=4)
