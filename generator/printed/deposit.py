"""A sliced part, printed by a machine with faults: all plastic, in the part's frame, mm.

Besides the beads of the moves there are blobs where loops begin and strings along travels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.printed.beads import Beads, beads_of, join_beads
from generator.printed.faults import PrintFaults, faulty_path
from generator.printed.slicer import SlicedPart
from generator.printed.toolpath import LEVEL_MM, Toolpath, role_number

Floats = NDArray[np.float64]

_CLOSED_MM = 0.6  # a loop's end lies this near its beginning: slicers leave a gap at the seam
_LOOP_MM = 3.0  # a shorter run is no loop
_STRING_MM = 1.0  # a shorter travel draws no string
_WALLS = tuple(map(role_number, ("outer wall", "overhang", "unknown")))


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
