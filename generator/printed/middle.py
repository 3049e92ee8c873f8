"""Where the symbols of a printed face stand as a whole: PrintedSurface + Embossing -> mm.

Backlash and the play of layers move a whole panel by some hundredths of a mm against its own
edges, which no touch of its symbols can know. So places on a print are counted from the middle
of its symbols. mm, face frame.
"""

from __future__ import annotations

import numpy as np

from generator.printed.surface import Floats, PrintedSurface
from generator.printed.symbol_design import (
    DesignLattice,
    footprint_shift,
    over_face,
    symbol_designs,
)
from generator.solid.emboss import turn
from generator.solid.part import Embossing

#: A footprint of 10 mm2 has a thousand places then: its middle is known to some um.
COARSE = DesignLattice(step_mm=0.1)


def symbols_shift(
    surface: PrintedSurface, embossing: Embossing, lattice: DesignLattice = COARSE
) -> Floats:
    """Return how far symbols stand from where they were designed, (2,) mm, on average.

    Symbols of which nothing was printed do not count; without any symbol it is 0.
    """
    points, designs = symbol_designs(embossing, lattice)
    R = turn(embossing.rotation_rad)
    shifts = []
    for centre, label in zip(embossing.centres_mm, embossing.labels.tolist(), strict=True):
        design = designs[label]
        found = surface.heights_mm(centre + points @ R.T).reshape(design.footprint.shape)
        over, base = over_face(found, design)
        if np.isfinite(base) and (over[~design.around] > design.height_mm / 2).any():
            shifts.append(R @ footprint_shift(over, design, points))
    return np.mean(shifts, axis=0) if shifts else np.zeros(2)
