"""The live view as a picture of characters: heat map at the left, counts at the right.

A tactel is a block of two characters, or, in a terminal that is too low for that, half a
character: two rows of tactels share a line.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from textwrap import wrap

import numpy as np
from numpy.typing import NDArray
from rich.console import Console, ConsoleOptions, RenderResult
from rich.segment import Segment
from rich.style import Style

from probe.client import ClientStatistics
from probe.command.live_state import LiveState
from probe.protocol import IdentPacket

LEVELS = 64
AROUND = 6  #: lines of the view besides those of the image; in fewer a tactel is half a character
KEYS = "q quit  space pause  0-7 sensor  b bias  m median  s save  r record"
#: black, violet, red, orange, pale yellow: rises in brightness, also without hue
_ANCHORS = ((8, 6, 16), (74, 12, 107), (165, 44, 96), (237, 105, 37), (251, 180, 26),
            (252, 255, 164))  # fmt: skip
SHADES = " .:-=+*#%@"
UPPER_HALF = "\u2580"  # its foreground stands over its background
GAP = 3  # characters
BOLD, DIM, YELLOW, RED = map(Style.parse, ("bold", "dim", "yellow", "bold red"))


@dataclass(frozen=True, slots=True)
class LivePicture:
    """Lines of pieces of text; cheaper to draw than tables."""

    lines: list[list[Segment]]

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Give the pieces to the console."""
        for number, line in enumerate(self.lines):
            if number:
                yield Segment.line()
            yield from line


def render_frame(
    state: LiveState,
    counts: ClientStatistics,
    ident: IdentPacket | None,
    *,
    height: int,
    colours: bool,
) -> LivePicture:
    """Return the whole view.

    Parameters
    ----------
    state
        What is shown.
    counts, ident
        What the client counted, and what the device is.
    height
        Of the terminal, lines.
    colours
        Whether it has any; characters of rising weight otherwise.
    """
    image = state.image()
    if image is None:
        blocks = [[Segment("waiting for frames ...")]]
    else:
        small = height < len(image) + AROUND
        blocks = heat_map(image / state.scale, small=small, colours=colours)
    numbers = _numbers(state, image, counts, ident)[: max(height - 5, 4)]
    wide = max(sum(len(part.text) for part in line) for line in blocks)
    lines = [_head(state)]
    for i in range(max(len(blocks), len(numbers))):
        left = blocks[i] if i < len(blocks) else [Segment(" " * wide)]
        lines.append([*left, Segment(" " * GAP), *(numbers[i] if i < len(numbers) else ())])
    lines += [_legend(state, colours), [Segment(KEYS, DIM)]]
    lines += [[Segment(text, YELLOW)] for text in wrap(state.notice, len(KEYS))]
    return LivePicture(lines)


def heat_map(share: NDArray[np.float64], *, small: bool, colours: bool) -> list[list[Segment]]:
    """Return readings as lines of blocks.

    Parameters
    ----------
    share
        (rows, columns) 0 ... 1 of the scale.
    small
        Two rows of tactels a line.
    colours
        Characters of rising weight otherwise, of the larger of two rows where it is small.
    """
    if small and len(share) % 2:
        share = np.pad(share, ((0, 1), (0, 0)))
    if not colours:
        shades = np.clip((share * len(SHADES)).astype(int), 0, len(SHADES) - 1)
        wide, rows = (1, np.maximum(shades[::2], shades[1::2])) if small else (2, shades)
        return [[Segment("".join(SHADES[shade] * wide for shade in row))] for row in rows.tolist()]
    levels = np.clip((share * (LEVELS - 1)).round().astype(int), 0, LEVELS - 1)
    above, under = (levels[::2], levels[1::2]) if small else (levels, levels)
    block = UPPER_HALF if small else "  "
    return [
        [Segment(block * len(list(equal)), _style(*pair))
         for pair, equal in groupby(zip(*rows, strict=True))]
        for rows in zip(above.tolist(), under.tolist(), strict=True)
    ]  # fmt: skip


def line_of(state: LiveState, counts: ClientStatistics) -> str:
    """Return the view in one line, where there is no terminal."""
    image = state.image()
    if image is None:
        return "waiting for frames"
    return (
        f"frame {state.frame.seq if state.frame else 0}  {counts.rate:.1f}/s  "
        f"lost {counts.lost}  failed {counts.failed}  reboots {counts.reboots}  "
        f"peak {_reading(float(image.max()), state.unit)} at {_place(image)}"
    )


def _head(state: LiveState) -> list[Segment]:
    head = [Segment("probe-sensor  ", BOLD)]
    if state.recorder is not None:
        recorded = f"{state.recorder.path.name}, {state.recorder.frames:,} frames  "
        head += [Segment("REC ", RED), Segment(recorded)]
    if state.paused:
        head += [Segment("PAUSED  ", RED)]
    return [*head, Segment(state.url)]


def _numbers(
    state: LiveState,
    image: NDArray[np.float64] | None,
    counts: ClientStatistics,
    ident: IdentPacket | None,
) -> list[list[Segment]]:
    name = "..." if ident is None else f"{ident.sensor} of {ident.name}, {ident.bits} bits"
    chosen = [word for word, on in (("bias off the image", state.bias is not None),
                                    ("taking bias", state.taking_bias),
                                    ("median 3x3", state.median)) if on]  # fmt: skip
    trouble = ("lost", "failed", "reboots", "reopenings", "overruns")
    counted = {title: f"{getattr(counts, title):,}" for title in trouble}
    rows = {"rate": f"{counts.rate:.1f} frames/s", "frames": f"{counts.frames:,}", **counted}
    rows |= {"sensor": name, "calibration": state.age()}
    if image is not None:
        rows["peak"] = f"{_reading(float(image.max()), state.unit)} at {_place(image)}"
        rows["sum"] = _reading(float(image.sum()), state.unit)
    rows["filter"] = ", ".join(chosen) or "none"
    return [
        [Segment(f"{title:<13}", DIM),
         Segment(value, YELLOW if title in trouble and value != "0" else None)]
        for title, value in rows.items()
    ]  # fmt: skip


def _legend(state: LiveState, colours: bool) -> list[Segment]:
    scale = [Segment(SHADES)]
    if colours:
        scale = [Segment(" ", _style(level, level)) for level in range(0, LEVELS, 4)]
    return [Segment("0 "), *scale, Segment(f" {_reading(state.scale, state.unit)}")]


def _reading(value: float, unit: str) -> str:
    return f"{value:,.2f} N" if unit == "N" else f"{value:,.0f} counts"


def _place(image: NDArray[np.float64]) -> str:
    row, column = divmod(int(image.argmax()), image.shape[1])
    return f"({row}, {column})"


@lru_cache(maxsize=LEVELS * LEVELS)
def _style(upper: int, lower: int) -> Style:
    """Return the colours of a block: foreground of the upper level, background of the lower."""
    return Style(color=_colour(upper), bgcolor=_colour(lower))


def _colour(level: int) -> str:
    at = level / (LEVELS - 1) * (len(_ANCHORS) - 1)
    low = min(int(at), len(_ANCHORS) - 2)
    channels = [
        round(a + (at - low) * (b - a))
        for a, b in zip(_ANCHORS[low], _ANCHORS[low + 1], strict=True)
    ]
    return "#{:02x}{:02x}{:02x}".format(*channels)
