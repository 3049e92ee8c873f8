"""The live view as a picture of characters: heat map at the left, counts beside it.

A tactel is a block of two characters, or, in a terminal that is too low for that, half a
character: two rows of tactels share a line.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from rich.console import Group, RenderableType
from rich.style import Style
from rich.table import Table
from rich.text import Text

from probe.client import ClientStatistics
from probe.command.live_state import LiveState
from probe.protocol import IdentPacket

LEVELS = 64
LOW = 22  #: lines, from here on a tactel is two characters
KEYS = "q quit  space pause  0-7 sensor  b bias  m median  s save  r record"
#: black, violet, red, orange, pale yellow: rises in brightness, also without hue
_ANCHORS = ((8, 6, 16), (74, 12, 107), (165, 44, 96), (237, 105, 37), (251, 180, 26),
            (252, 255, 164))  # fmt: skip
_SHADES = " .:-=+*#%@"


def rendered(
    state: LiveState,
    counts: ClientStatistics,
    ident: IdentPacket | None,
    *,
    lines: int,
    colours: bool,
) -> RenderableType:
    """Return the whole view.

    Parameters
    ----------
    state
        What is shown.
    counts, ident
        What the client counted, and what the device is.
    lines
        Height of the terminal.
    colours
        Whether it has any; characters of rising weight otherwise.
    """
    image = state.image()
    grid = Table.grid(padding=(0, 3))
    grid.add_row(
        Text("waiting for frames ...") if image is None
        else heat_map(image / state.scale, small=lines < LOW, colours=colours),
        _numbers(state, image, counts, ident),
    )  # fmt: skip
    head = Text("probe-sensor  ", style="bold", no_wrap=True, overflow="ellipsis")
    head.append(state.url, style="not bold")
    foot = [Text(KEYS, style="dim", no_wrap=True), Text(state.notice, style="yellow")]
    return Group(head, grid, _legend(state, colours), *foot)


def heat_map(share: NDArray[np.float64], *, small: bool, colours: bool) -> Text:
    """Return readings as blocks.

    Parameters
    ----------
    share
        (rows, columns) 0 ... 1 of the scale.
    small
        Two rows of tactels a line.
    colours
        Characters of rising weight otherwise.
    """
    text = Text(no_wrap=True)
    if not colours:
        shades = np.clip((share * len(_SHADES)).astype(int), 0, len(_SHADES) - 1)
        rows = shades[::2] if small else shades
        wide = 1 if small else 2
        return text.append("\n".join("".join(_SHADES[s] * wide for s in row) for row in rows))
    levels = np.clip((share * (LEVELS - 1)).round().astype(int), 0, LEVELS - 1)
    if small:
        lines = [zip(top, under, strict=True) for top, under in zip(levels[::2].tolist(),
                 levels[1::2].tolist(), strict=True)]  # fmt: skip
        block = "\u2580"  # upper half: its foreground over the background
    else:
        lines = [zip(row, row, strict=True) for row in levels.tolist()]
        block = "  "
    for number, line in enumerate(lines):
        if number:
            text.append("\n")
        for top, under in line:
            text.append(block, _style(top, under))
    return text


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


def _numbers(
    state: LiveState,
    image: NDArray[np.float64] | None,
    counts: ClientStatistics,
    ident: IdentPacket | None,
) -> Table:
    table = Table.grid(padding=(0, 2))
    rows = [("rate", f"{counts.rate:.1f} frames/s"), ("frames", f"{counts.frames:,}"),
            ("lost", f"{counts.lost:,}"), ("failed", f"{counts.failed:,}"),
            ("reboots", str(counts.reboots)), ("reopened", str(counts.reopenings))]  # fmt: skip
    if counts.overruns:
        rows.append(("overruns", str(counts.overruns)))
    name = "..." if ident is None else f"{ident.sensor} of {ident.name}, {ident.bits} bits"
    rows += [("sensor", name), ("calibration", state.age())]
    if image is not None:
        rows += [("peak", f"{_reading(float(image.max()), state.unit)} at {_place(image)}"),
                 ("sum", _reading(float(image.sum()), state.unit))]  # fmt: skip
    chosen = [word for word, on in (("bias off the image", state.bias is not None),
                                    ("taking bias", state.taking_bias),
                                    ("median 3x3", state.median)) if on]  # fmt: skip
    rows.append(("filter", ", ".join(chosen) or "none"))
    for title, value in rows:
        bad = title in ("lost", "failed", "reboots", "reopened", "overruns") and value != "0"
        table.add_row(Text(title, style="dim"), Text(value, style="yellow" if bad else ""))
    if state.recorder is not None:
        recorded = f"{state.recorder.path.name}, {state.recorder.frames:,} frames"
        table.add_row(Text("REC", style="bold red"), Text(recorded))
    if state.paused:
        table.add_row(Text("PAUSED", style="bold yellow"), Text("space goes on"))
    return table


def _legend(state: LiveState, colours: bool) -> Text:
    text = Text("0 ", no_wrap=True)
    if colours:
        for level in range(0, LEVELS, 4):
            text.append(" ", _style(level, level))
    else:
        text.append(_SHADES)
    return text.append(f" {_reading(state.scale, state.unit)}")


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
