"""The packing list of a set: which part of which object lies where, as CSV for the technician.

UTF-8, commas, lines end in CR LF (RFC 4180); lengths in mm, plate frame of `bed`.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

from generator.export.bed import BedPlace

COLUMNS = (
    "object", "part", "printer", "plate", "x_mm", "y_mm", "turned",
    "width_mm", "depth_mm", "height_mm", "symbols", "fits",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class PackedPart:
    """One part of a set and its place."""

    order: tuple[int, int]  #: object and part, as the set lists them
    object: str
    part: str
    plate: int  #: from 1
    printer: str
    place: BedPlace
    size_mm: tuple[float, float, float]  #: as it comes from the file, before it is turned
    symbols: int
    fits: bool  #: whether the plate fits the bed

    @property
    def lying_mm(self) -> tuple[float, float]:
        """Width and depth as it lies on the bed."""
        width, depth, _ = self.size_mm
        return (depth, width) if self.place.turned else (width, depth)


def packing_csv(packed: Sequence[PackedPart]) -> bytes:
    """Return the list, one line for each part."""
    text = io.StringIO(newline="")
    table = csv.writer(text)
    table.writerow(COLUMNS)
    for one in packed:
        width, depth = one.lying_mm
        table.writerow(
            [
                one.object,
                one.part,
                one.printer,
                one.plate,
                *(f"{value + 0.0:.1f}" for value in (one.place.x_mm, one.place.y_mm)),
                "yes" if one.place.turned else "no",
                *(f"{value:.1f}" for value in (width, depth, one.size_mm[2])),
                one.symbols,
                "yes" if one.fits else "no",
            ]
        )
    return text.getvalue().encode()
