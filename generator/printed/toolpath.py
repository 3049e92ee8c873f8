"""The moves of a G-code file as arrays: one row for each straight move, in order.

G-code frame: mm, as the file has it, z up from the bed; z of a move is the nozzle's, which is
the top of the bead that it leaves. A travel is a move without volume. Arcs are chords here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

#: What a move is for; slicers' own words become these. The last four leave nothing on the part.
ROLES = (
    "unknown",
    "outer wall",
    "inner wall",
    "overhang",
    "top",
    "solid",
    "infill",
    "bridge",
    "gap fill",
    "ironing",
    "travel",
    "skirt",
    "support",
    "custom",
)
_OF_PART = ROLES.index("travel")


def role_number(name: str) -> int:
    """Return the number by which `Toolpath.role` knows a role."""
    return ROLES.index(name)


@dataclass(frozen=True, slots=True, eq=False)
class Toolpath:
    """All moves of a file."""

    name: str  #: of the file
    dialect: str  #: prusaslicer, cura, bambu, orca or unknown
    start_mm: Floats  #: (n, 3)
    end_mm: Floats  #: (n, 3)
    volume_mm3: Floats  #: (n,) plastic that leaves the nozzle, 0 on travels
    height_mm: Floats  #: (n,) of the layer, or a bridge's own
    width_mm: Floats  #: (n,) as the file announces it, nan where it does not
    speed_mm_s: Floats  #: (n,)
    role: Index  #: (n,) number in `ROLES`

    def __len__(self) -> int:
        return len(self.role)

    @property
    def of_part(self) -> NDArray[np.bool_]:
        """(n,) whether a move leaves plastic that stays on the part."""
        return (self.volume_mm3 > 0) & (self.role < _OF_PART)

    @property
    def length_mm(self) -> Floats:
        """(n,) length of each move."""
        length: Floats = np.linalg.norm(self.end_mm - self.start_mm, axis=1)
        return length

    def strokes(self) -> Index:
        """Return the stroke that each move belongs to, (n,), -1 for those that leave nothing.

        A stroke is a run of moves of one role at one height, without a travel between them.
        """
        laying = self.of_part
        breaks = np.ones(len(self), np.bool_)
        same = (self.role[1:] == self.role[:-1]) & laying[:-1]
        same &= np.abs(self.end_mm[1:, 2] - self.end_mm[:-1, 2]) < LEVEL_MM
        breaks[1:] = ~same
        numbers = np.cumsum(breaks & laying) - 1
        return np.where(laying, numbers, -1)


LEVEL_MM = 1e-3  #: heights that differ by less are one layer
