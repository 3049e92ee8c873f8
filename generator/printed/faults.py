"""Faults of machines as numbers, and their effect on a nozzle's moves.

Every move of the new Toolpath is where the nozzle really went, every volume as it really came. mm,
G-code frame. `usual` and `bad` lie inside the range of real machines: scale .994-1.005, flow
.8-1.3, backlash .05-.4, ringing .12, seam blobs .25-.5, bow .5.
"""

from __future__ import annotations

import difflib
import math
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from generator.errors import PrintError
from generator.printed.gcode import LEVEL_MM, Toolpath

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PrintFaults:
    """How a machine departs from its G-code; the defaults are a perfect one."""

    scale_x: float = 1.0  #: belts and shrinkage, about the middle of the part's box
    scale_y: float = 1.0
    skew_deg: float = 0.0  #: by which the machine's y axis leans towards its x axis
    flow: float = 1.0  #: plastic over what was asked, mean
    flow_spread: float = 0.0  #: its standard deviation along the path
    backlash_mm: float = 0.0  #: play of each axis
    ringing_mm: float = 0.0  #: amplitude after a corner of 90 degrees
    jitter_mm: float = 0.0  #: standard deviation of each layer's place, x and y
    seam_mm: float = 0.0  #: diameter of the blob where a loop begins
    strings: float = 0.0  #: share of travels that draw a string
    string_mm: float = 0.15  #: diameter of strings
    starved_mm: float = 0.0  #: by which each stroke begins late
    bow_mm: float = 0.0  #: by which the part's corners stand above its middle


NAMED = {
    "none": PrintFaults(),
    "usual": PrintFaults(
        scale_x=0.997, scale_y=0.998, flow=1.02, flow_spread=0.03, backlash_mm=0.05,
        ringing_mm=0.03, jitter_mm=0.02, seam_mm=0.1, strings=0.03, starved_mm=0.05, bow_mm=0.1,
    ),
    "bad": PrintFaults(
        scale_x=0.994, scale_y=0.997, flow=1.06, flow_spread=0.08, backlash_mm=0.18,
        ringing_mm=0.12, jitter_mm=0.04, seam_mm=0.25, strings=0.15, starved_mm=0.15, bow_mm=0.4,
    ),
}  # fmt: skip

_RANGES = {
    "scale_x": (0.9, 1.1), "scale_y": (0.9, 1.1), "skew_deg": (-5.0, 5.0), "flow": (0.3, 2.0),
    "flow_spread": (0.0, 0.3), "strings": (0.0, 1.0), "string_mm": (0.02, 0.5),
    "bow_mm": (-3.0, 3.0),
}  # fmt: skip
_LENGTHS = (0.0, 1.0)  # of all others, mm

#: Over which the flow changes, mm of path: pressure follows slowly.
FLOW_LENGTH_MM = 20.0
#: A frame's usual first resonance, and after how many of its waves a third is left.
RESONANCE_HZ = 40.0
DECAY_WAVES = 1.5
#: Moves are cut to this length where they ring, at most this many waves after a corner.
_RINGING_STEP_MM = 0.25
_RINGING_WAVES = 3.0
_RINGING_SPEED = (10.0, 80.0)  # mm/s: a slower nozzle's wave is no longer than its bead


def print_faults(text: str) -> PrintFaults:
    """Return the faults that a text names: `none`, `usual`, `bad`, `k=v,...`, `usual,flow=1.1`.

    Raises `PrintError` for another name, a value that is no number, or one out of its range.

    >>> print_faults("usual,backlash_mm=0.2").scale_x
    0.997
    """
    faults = PrintFaults()
    names = [field.name for field in fields(PrintFaults)]
    for number, word in enumerate(filter(None, (w.strip() for w in text.split(",")))):
        key, given, value = word.partition("=")
        if not given and number == 0 and key in NAMED:
            faults = NAMED[key]
            continue
        if key not in names:
            near = difflib.get_close_matches(key, [*names, *NAMED], 1)
            raise PrintError(
                f"unknown fault '{key}'",
                fix=f"{f'did you mean {near[0]}? ' if near else ''}give none, usual or bad, then "
                f"k=v of {', '.join(names)}",
            )
        low, high = _RANGES.get(key, _LENGTHS)
        try:
            number_given = float(value)
        except ValueError:
            number_given = math.nan
        if not low <= number_given <= high:
            raise PrintError(f"{key} '{value}'", fix=f"give {key} from {low:g} to {high:g}")
        faults = replace(faults, **{key: number_given})
    return faults


def faulty_path(
    path: Toolpath,
    faults: PrintFaults,
    rng: np.random.Generator,
    *,
    datum_mm: tuple[float, float] = (0.0, 0.0),
) -> Toolpath:
    """Return where the nozzle goes and how much plastic it lays.

    Scale and skew act about `datum_mm`; then backlash, ringing and each layer's jitter move
    it, and the flow changes along the path.
    """
    path = _scale_and_skew(path, faults, datum_mm)
    if faults.backlash_mm > 0:
        path = _with_backlash(path, faults.backlash_mm)
    if faults.ringing_mm > 0:
        path = _with_ringing(path, faults.ringing_mm)
    if faults.jitter_mm > 0:
        path = _with_jitter(path, faults.jitter_mm, rng)
    volume = path.volume_mm3 * faults.flow
    if faults.flow_spread > 0:
        length = np.where(path.volume_mm3 > 0, path.length_mm, 0.0)
        along = np.cumsum(length)
        knots = np.arange(0.0, float(along[-1]) + 2 * FLOW_LENGTH_MM, FLOW_LENGTH_MM)
        drift = rng.normal(0.0, faults.flow_spread, len(knots))
        # Between two knots the variance of a straight line is two thirds of theirs.
        volume = volume * (1 + np.interp(along, knots, drift) * math.sqrt(1.5)).clip(0.1)
    return replace(path, volume_mm3=volume)


def _scale_and_skew(path: Toolpath, faults: PrintFaults, datum: tuple[float, float]) -> Toolpath:
    lean = math.tan(math.radians(faults.skew_deg))
    A = np.array([[faults.scale_x, faults.scale_x * lean], [0.0, faults.scale_y]])
    if (np.eye(2) == A).all():
        return path

    def move(points: Floats) -> Floats:
        out = points.copy()
        out[:, :2] = (points[:, :2] - datum) @ A.T + datum
        return out

    return replace(path, start_mm=move(path.start_mm), end_mm=move(path.end_mm))


def _with_backlash(path: Toolpath, play: float) -> Toolpath:
    """Let each axis follow its motor only when the play is used up."""
    start, end = path.start_mm.copy(), path.end_mm.copy()
    for axis in (0, 1):
        at = float(start[0, axis])
        behind = []
        for motor in end[:, axis].tolist():
            at = min(max(at, motor - play / 2), motor + play / 2)
            behind.append(at)
        end[:, axis] = behind
    start[1:, :2] = end[:-1, :2]
    return replace(path, start_mm=start, end_mm=end)


def _with_ringing(path: Toolpath, amplitude: float) -> Toolpath:
    """Let the nozzle swing after corners, along the change of its direction."""
    speed = path.speed_mm_s.clip(*_RINGING_SPEED)
    wave = speed / RESONANCE_HZ
    way = (path.end_mm - path.start_mm)[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    ahead = way / np.maximum(length, 1e-9)[:, None]
    turn = np.zeros_like(ahead)
    turn[1:] = ahead[1:] - ahead[:-1]  # of length sqrt(2) at 90 degrees
    turn /= math.sqrt(2)
    rung = np.minimum(length, _RINGING_WAVES * wave)
    rings = path.of_part & (np.hypot(turn[:, 0], turn[:, 1]) > 0.1) & (length > _RINGING_STEP_MM)
    cuts = np.where(rings, np.ceil(rung / _RINGING_STEP_MM), 0).astype(np.int64)
    pieces = cuts + np.where(rings & (rung >= length), 0, 1)
    owner = np.repeat(np.arange(len(path)), pieces)
    k = np.arange(len(owner)) - (np.cumsum(pieces) - pieces)[owner]
    step = np.where(cuts > 0, rung / np.maximum(cuts, 1), length)[owner]
    last = k + 1 == pieces[owner]
    s0, s1 = k * step, np.where(last, length[owner], (k + 1) * step)

    def place(s: Floats) -> Floats:
        swing = np.exp(-s / (DECAY_WAVES * wave[owner])) * np.sin(2 * math.pi * s / wave[owner])
        swing = np.where(rings[owner] & (s < rung[owner]), amplitude * swing, 0.0)
        share = np.divide(s, length[owner], out=np.zeros_like(s), where=length[owner] > 0)
        points = path.start_mm[owner] + share[:, None] * (path.end_mm - path.start_mm)[owner]
        points[:, :2] += swing[:, None] * turn[owner]
        return points

    start, end = place(s0), place(s1)
    end[last] = path.end_mm[owner[last]]
    share = np.divide(s1 - s0, length[owner], out=np.ones(len(owner)), where=length[owner] > 0)
    return Toolpath(
        path.name, path.dialect, start, end, path.volume_mm3[owner] * share,
        path.height_mm[owner], path.width_mm[owner], path.speed_mm_s[owner], path.role[owner],
    )  # fmt: skip


def _with_jitter(path: Toolpath, spread: float, rng: np.random.Generator) -> Toolpath:
    levels, layer = np.unique(np.round(path.end_mm[:, 2] / LEVEL_MM), return_inverse=True)
    by = np.zeros((len(levels), 3))
    by[:, :2] = rng.normal(0.0, spread, (len(levels), 2))
    return replace(path, start_mm=path.start_mm + by[layer], end_mm=path.end_mm + by[layer])
