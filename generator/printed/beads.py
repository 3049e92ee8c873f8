"""Toolpath -> beads: the plastic that each move leaves, with the volume that was extruded.

A bead is a straight piece of plastic with a stadium section: as high as its layer, flat above
and below, round at the sides; its width follows from the volume laid on its length (the flow
model of slic3r: A = h (w - h) + pi h^2 / 4). Plastic too little for that lies as a round
string on the layer below. Where a stroke begins and ends the bead is round, and set back so
far that the round ends hold no more than was extruded, which shows seams. Part frame: mm, z
up as printed. Beads do not run, sag or shrink.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from generator.printed.toolpath import Toolpath

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

#: Length over which the volume is averaged, mm: files round E and places, which tells on
#: moves of some hundredths of a mm.
AVERAGED_MM = 0.2
_ROUND_SECTION = math.pi / 4


@dataclass(frozen=True, slots=True, eq=False)
class Beads:
    """Straight beads; one whose ends are the same is a dot."""

    start_mm: Floats  #: (n, 2) part frame
    end_mm: Floats  #: (n, 2)
    top_mm: Floats  #: (n,) z of the highest plastic
    width_mm: Floats  #: (n,) widest, at half height
    height_mm: Floats  #: (n,) at most the width

    def __len__(self) -> int:
        return len(self.top_mm)

    @property
    def section_mm2(self) -> Floats:
        """(n,) area of the section."""
        area: Floats = self.height_mm * (self.width_mm - self.height_mm * (1 - _ROUND_SECTION))
        return area

    def chosen(self, which: NDArray[np.bool_] | Index) -> Self:
        """Return some of the beads."""
        return type(self)(
            self.start_mm[which],
            self.end_mm[which],
            self.top_mm[which],
            self.width_mm[which],
            self.height_mm[which],
        )

    def shifted(self, by_mm: Floats) -> Self:
        """Return the beads moved by (3,) mm."""
        return replace(
            self,
            start_mm=self.start_mm + by_mm[:2],
            end_mm=self.end_mm + by_mm[:2],
            top_mm=self.top_mm + by_mm[2],
        )


def join_beads(*beads: Beads) -> Beads:
    """Return the beads of several sets as one."""
    return Beads(
        np.concatenate([b.start_mm for b in beads]),
        np.concatenate([b.end_mm for b in beads]),
        np.concatenate([b.top_mm for b in beads]),
        np.concatenate([b.width_mm for b in beads]),
        np.concatenate([b.height_mm for b in beads]),
    )


def beads_of(path: Toolpath, *, starved_mm: float = 0.0) -> Beads:
    """Return the beads of all moves that leave plastic on the part, in the frame of the path.

    For want of pressure each stroke begins `starved_mm` late.
    """
    moves = np.flatnonzero(path.of_part)
    start, end = path.start_mm[moves], path.end_mm[moves]
    stroke = path.strokes()[moves]
    length = path.length_mm[moves]
    along = np.cumsum(length) - length  # from the beginning of the first stroke
    area = _sections(stroke, along, length, path.volume_mm3[moves])
    width, height = section_size(area, path.height_mm[moves])
    top = (start[:, 2] + end[:, 2]) / 2 - (path.height_mm[moves] - height)

    first = np.flatnonzero(np.diff(stroke, prepend=-1))
    last = np.append(first[1:], len(stroke)) - 1
    begins, ends = along[first], along[last] + length[last]
    from_ = begins + cap_mm(width[first], height[first]) + starved_mm
    until = ends - cap_mm(width[last], height[last])
    short = from_ >= until
    of = np.repeat(np.arange(len(first)), last - first + 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        t0 = ((from_[of] - along) / length).clip(0, 1)
        t1 = ((until[of] - along) / length).clip(0, 1)
    kept = (t0 < t1) & ~short[of]
    way = (end - start)[:, :2]
    lines = Beads(start[:, :2] + t0[:, None] * way, start[:, :2] + t1[:, None] * way,
                  top, width, height).chosen(kept)  # fmt: skip
    # A stroke shorter than its round ends is a dot of the volume that is left of it.
    volume = np.add.reduceat(path.volume_mm3[moves], first) if len(first) else np.zeros(0)
    share = 1 - np.minimum(1.0, starved_mm / np.maximum(ends - begins, 1e-9))
    dots = short & (share > 0)
    at = (last + first)[dots] // 2
    size = dot_size((volume * share)[dots], path.height_mm[moves][at])
    middle = (start[at] + end[at])[:, :2] / 2
    bottom = (start[at, 2] + end[at, 2]) / 2 - path.height_mm[moves][at]
    return join_beads(lines, Beads(middle, middle, bottom + size[1], *size))


def section_size(area_mm2: Floats, layer_mm: Floats) -> tuple[Floats, Floats]:
    """Return width and height of beads of a section's area laid in a layer of a height."""
    thin = area_mm2 < _ROUND_SECTION * layer_mm**2
    width = area_mm2 / layer_mm + layer_mm * (1 - _ROUND_SECTION)
    diameter = np.sqrt(area_mm2 / _ROUND_SECTION)
    return np.where(thin, diameter, width), np.where(thin, diameter, layer_mm)


def dot_size(volume_mm3: Floats, layer_mm: Floats) -> tuple[Floats, Floats]:
    """Return width and height of dots of a volume: a stadium turned about its axis, or a ball."""
    r = layer_mm / 2
    ball = 4 / 3 * math.pi * r**3
    # volume = pi h R^2 + pi^2 r^2 R + ball, with R the radius of the flat top
    a, b = math.pi * layer_mm, math.pi**2 * r**2
    flat = (np.sqrt(b**2 + 4 * a * (volume_mm3 - ball).clip(0)) - b) / (2 * a)
    diameter = np.minimum(2 * np.cbrt(volume_mm3 * 3 / (4 * math.pi)), layer_mm)
    return np.where(flat > 0, 2 * flat + layer_mm, diameter), diameter


def cap_mm(width_mm: Floats, height_mm: Floats) -> Floats:
    """Return the length of straight bead that holds as much as its round end."""
    r = height_mm / 2
    flat = (width_mm - height_mm) / 2
    turned = math.pi * height_mm * flat**2 + math.pi**2 * r**2 * flat + 4 / 3 * math.pi * r**3
    section = np.maximum(2 * flat * height_mm + math.pi * r**2, 1e-12)
    length: Floats = turned / 2 / section
    return length


def _sections(stroke: Index, along: Floats, length: Floats, volume: Floats) -> Floats:
    """Return each move's section area, short moves averaged with their stroke's neighbours."""
    if not len(stroke):
        return np.zeros(0)
    first = np.flatnonzero(np.diff(stroke, prepend=-1))
    last = np.append(first[1:], len(stroke)) - 1
    of = np.repeat(np.arange(len(first)), last - first + 1)
    low, high = along[first][of], (along[last] + length[last])[of]
    middle = along + length / 2
    half = np.maximum(length, AVERAGED_MM) / 2
    a, b = np.maximum(middle - half, low), np.minimum(middle + half, high)
    places = np.append(along, along[-1] + length[-1])
    total = np.concatenate([[0.0], np.cumsum(volume)])
    laid = np.interp(b, places, total) - np.interp(a, places, total)
    area: Floats = laid / np.maximum(b - a, 1e-9)
    return area
