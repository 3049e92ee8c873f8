"""G-code -> the surface that the beads leave: parts as a filament printer makes them.

::

    part's STL --slicer--> G-code --gcode--> Toolpath --faults--> Toolpath
        --beads, deposit--> Deposit --view (above | sideways)--> PrintedSurface
        --survey, check--> verdict on each symbol

A `PrintedSurface` is a grid of heights over a face, mm. Limits of the model stand in `beads`,
`faults` and `view`.
"""

from __future__ import annotations

from generator.printed.deposit import Deposit, deposit
from generator.printed.faults import NAMED, PrintFaults, print_faults
from generator.printed.gcode import read_gcode
from generator.printed.slicer import (
    PROFILES,
    PrintProfile,
    SlicedPart,
    print_profile,
    profile_of_printer,
    slice_part,
)
from generator.printed.surface import PrintedSurface
from generator.printed.view import face_surface, is_seen

__all__ = [
    "NAMED",
    "PROFILES",
    "Deposit",
    "PrintFaults",
    "PrintProfile",
    "PrintedSurface",
    "SlicedPart",
    "deposit",
    "face_surface",
    "is_seen",
    "print_faults",
    "print_profile",
    "profile_of_printer",
    "read_gcode",
    "slice_part",
]
