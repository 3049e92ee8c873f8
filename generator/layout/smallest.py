"""How small a face could be and still be told by touch.

Region + request -> the least size, with the face's own proportions, at which one place shows. The
face is scaled, symbols and clearances are not.
"""

from __future__ import annotations

import math

import numpy as np

from generator.layout.blank import Request
from generator.layout.footprint import Region
from generator.layout.lattice import choose_lattice
from generator.layout.settings import LAYOUT


def extent_mm(region: Region) -> tuple[float, float]:
    """Return width and height of a face in its own frame, mm."""
    low = np.minimum(region.start, region.end).min(axis=0)
    width, height = (np.maximum(region.start, region.end).max(axis=0) - low).tolist()
    return width, height


def smallest_mm(region: Region, request: Request) -> tuple[float, float]:
    """Return width and height at which the face still shows a place; infinite if never, mm."""

    def shows(scale: float) -> bool:
        scaled = Region(region.start * scale, region.end * scale, region.clearance)
        lattice = choose_lattice(
            [scaled], request.half_mm, request.pitch_mm, request.window, request.identifies,
            search=False,
        )  # fmt: skip
        return any(lattice.places)

    works, fails = (1.0, 1.0 / LAYOUT.size_range) if shows(1.0) else (LAYOUT.size_range, 1.0)
    if works == LAYOUT.size_range and not shows(LAYOUT.size_range):
        return math.inf, math.inf
    for _ in range(LAYOUT.size_bisections):
        middle = math.sqrt(works * fails)
        works, fails = (middle, fails) if shows(middle) else (works, middle)
    width, height = extent_mm(region)
    return width * works, height * works
