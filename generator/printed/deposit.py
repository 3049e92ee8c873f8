"""A sliced part, printed by a machine with faults: all plastic, in the part's frame.

Each move leaves a bead, a straight piece of plastic with a stadium section: as high as its layer,
flat above and below, round at the sides; its width follows from the volume laid on its length (the
flow model of slic3r: A = h (w - h) + pi h^2 / 4). Plastic too little for that lies as a round
string on the layer below. Where a stroke begins and ends the bead is round, and set back so far
that the round ends hold no more than was extruded, which shows seams. Besides there are blobs
where loops begin and strings along travels. Part frame: mm, z up as printed. Beads do not run, sag
or shrink.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from generator.printed.faults import PrintFaults, faulty_path
from generator.printed.gcode import LEVEL_MM, Toolpath, role_number
from generator.printed.slicer import SlicedPart

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

#: Length over which the volume is averaged, mm: files round E and places, which tells on
#: moves of some hundredths of a mm.
AVERAGED_MM = 0.2
_ROUND_SECTION = math.pi / 4
_CLOSED_MM = 0.6  # a loop's end lies this near its beginning: slicers leave a gap at the seam
_LOOP_MM = 3.0  # a shorter run is no loop
_STRING_MM = 1.0  # a shorter travel draws no string
_WALLS = tuple(map(role_number, ("outer wall", "overhang", "unknown")))


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

    def chosen(self, which: NDArray[np.bool_] | Index) -> Self:
        """Return some of the beads."""
        return type(self)(*(getattr(self, each.name)[which] for each in fields(self)))

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
    columns = ([getattr(one, each.name) for one in beads] for each in fields(Beads))
    return Beads(*map(np.concatenate, columns))


def beads_of(path: Toolpath, *, starved_mm: float = 0.0) -> Beads:
    """Return the beads of all moves that leave plastic on the part, in the frame of the path.

    For want of pressure each stroke begins `starved_mm` late.
    """
    moves = np.flatnonzero(path.of_part)
    start, end = path.start_mm[moves], path.end_mm[moves]
    stroke = path.strokes()[moves]
    length = path.length_mm[moves]
    along = np.cumsum(length) - length  # from the beginning of the first stroke
    first = np.flatnonzero(np.diff(stroke, prepend=-1))
    last = np.append(first[1:], len(stroke)) - 1
    of = np.repeat(np.arange(len(first)), last - first + 1)
    begins, ends = along[first], along[last] + length[last]
    area = _sections(begins[of], ends[of], along, length, path.volume_mm3[moves])
    width, height = section_size(area, path.height_mm[moves])
    top = (start[:, 2] + end[:, 2]) / 2 - (path.height_mm[moves] - height)

    from_ = begins + cap_mm(width[first], height[first]) + starved_mm
    until = ends - cap_mm(width[last], height[last])
    short = from_ >= until
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


def _sections(low: Floats, high: Floats, along: Floats, length: Floats, volume: Floats) -> Floats:
    """Return each move's section area, short moves averaged with their stroke's neighbours.

    Where its stroke begins and ends, where it begins itself, its length, mm; its volume, mm3.
    """
    if not len(along):
        return np.zeros(0)
    middle = along + length / 2
    half = np.maximum(length, AVERAGED_MM) / 2
    a, b = np.maximum(middle - half, low), np.minimum(middle + half, high)
    places = np.append(along, along[-1] + length[-1])
    total = np.concatenate([[0.0], np.cumsum(volume)])
    laid = np.interp(b, places, total) - np.interp(a, places, total)
    area: Floats = laid / np.maximum(b - a, 1e-9)
    return area


@dataclass(frozen=True, slots=True, eq=False)
class Deposit:
    """The plastic of one part as it lies on the bed."""

    beads: Beads  #: part frame
    low_mm: Floats  #: (3,) the box of the part as designed, part frame
    high_mm: Floats  #: (3,)
    bow_mm: float  #: corners above the middle, in everything that is read from the beads

    def bow_at(self, points_mm: Floats) -> Floats:
        """Return how far plastic at (n, 2) is lifted: a bowl, 0 at the middle of the box."""
        middle = (self.low_mm + self.high_mm)[:2] / 2
        corner = float(((self.high_mm - self.low_mm)[:2] ** 2).sum()) / 4
        lifted: Floats = self.bow_mm * ((points_mm - middle) ** 2).sum(axis=-1) / corner
        return lifted


def deposit(
    sliced: SlicedPart, faults: PrintFaults | None = None, rng: np.random.Generator | None = None
) -> Deposit:
    """Print a sliced part; `rng` draws flow spread, jitter and strings of the machine's faults."""
    faults = faults or PrintFaults()
    rng = rng if rng is not None else np.random.default_rng(0)
    shift = sliced.T_part_gcode[:3, 3]
    datum = (sliced.low_mm + sliced.high_mm)[:2] / 2 - shift[:2]
    path = faulty_path(sliced.toolpath, faults, rng, datum_mm=(float(datum[0]), float(datum[1])))
    found = [beads_of(path, starved_mm=faults.starved_mm)]
    if faults.seam_mm > 0:
        found.append(seam_blobs(path, faults.seam_mm))
    if faults.strings > 0:
        found.append(strings(path, faults.strings, faults.string_mm, rng))
    beads = join_beads(*found).shifted(shift)
    return Deposit(beads, sliced.low_mm, sliced.high_mm, faults.bow_mm)


def seam_blobs(path: Toolpath, diameter_mm: float) -> Beads:
    """Return a ball on the top of each loop's beginning; its half stands above the layer."""
    stroke = path.strokes()
    moves = np.flatnonzero(stroke >= 0)
    first = moves[np.flatnonzero(np.diff(stroke[moves], prepend=-1))]
    count = np.bincount(stroke[moves])
    last = first + count - 1
    way = np.bincount(stroke[moves], weights=path.length_mm[moves])
    gap = np.linalg.norm(path.end_mm[last] - path.start_mm[first], axis=1)
    loops = first[(gap < _CLOSED_MM) & (way > _LOOP_MM) & np.isin(path.role[first], _WALLS)]
    at = path.start_mm[loops]
    size = np.full(len(at), diameter_mm)
    return Beads(at[:, :2], at[:, :2], at[:, 2] + diameter_mm / 2, size, size)


def strings(path: Toolpath, share: float, diameter_mm: float, rng: np.random.Generator) -> Beads:
    """Return threads between the ends of some travels within a layer, at the nozzle's height.

    A chain of travels (lift, go, lower) is one; it draws its thread from the end of the plastic to
    where it begins again.
    """
    laying = path.of_part
    before = np.flatnonzero(laying[:-1] & ~laying[1:])
    after = np.flatnonzero(laying[1:] & ~laying[:-1]) + 1
    next_ = np.searchsorted(after, before, side="right")
    before, after = before[next_ < len(after)], after[next_[next_ < len(after)]]
    a, b = path.end_mm[before], path.start_mm[after]
    level = np.abs(b[:, 2] - a[:, 2]) < LEVEL_MM
    level &= np.linalg.norm((b - a)[:, :2], axis=1) > _STRING_MM
    drawn = np.flatnonzero(level)
    drawn = drawn[rng.random(len(drawn)) < share]
    size = np.full(len(drawn), diameter_mm)
    return Beads(a[drawn, :2], b[drawn, :2], a[drawn, 2], size, size)
