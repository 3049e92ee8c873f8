"""Choose how the lattice of symbols lies on a face, or on several faces of a net at once.

Regions (mm) + pitch + window -> Lattice: rotation and shift that show the most identifiable
places, of those that `lattice_search` finds. The lattice frame is the face (or net) frame turned
by `rotation_rad`; cell (j, i) has its centre at (x_mm + i p, y_mm + j p), j against the array's
rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.layout.footprint import Region, mirror_region, move_region, slack
from generator.layout.lattice_search import FACE_WORTH, CellSet, lattice_candidates
from generator.layout.places import Cells, Identifies, array_cells, count_places

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lattice:
    """One lattice and the cells that it shows on each region."""

    rotation_rad: float  #: turns face (net) x into lattice x
    x_mm: float  #: centre of cell (0, 0), lattice frame
    y_mm: float
    cells: tuple[Cells, ...]  #: per region (n, 2): j, i
    places: tuple[int, ...]  #: per region
    quarter: int  #: quarter turns from lattice x to array x (columns)
    margin_mm: float  #: least way to the next edge along x or y


def choose_lattice(
    regions: Sequence[Region],
    half_mm: float,
    pitch_mm: float,
    window: tuple[int, int],
    identifies: Identifies | None = None,
    *,
    search: bool = True,
) -> Lattice:
    """Return the lattice that shows a place on the most faces, then the most places.

    Ties are broken by more cells, then by the rotation (that of the first edge, then of longer
    edges), then by the largest margin to the edges; at last the lattice is centred.

    Parameters
    ----------
    regions
        Faces that share the lattice, all in one frame (mm).
    half_mm, pitch_mm
        Half side of the footprint; distance of two symbols.
    window
        Rows and columns of the array's window.
    identifies
        Rank test for faces into which the window does not fit; None leaves it out.
    search
        Try rotations other than along the edges too.
    """
    found = lattice_candidates(regions, half_mm, pitch_mm, window, search)
    if not found:
        return Lattice(0.0, 0.0, 0.0, (_no_cells(),) * len(regions), (0,) * len(regions), 0, 0.0)
    best = max((c.worth, c.cells) for c in found)
    if best[0] == 0 and identifies is not None:
        for candidate in sorted(found, key=lambda c: -c.cells):
            for cells in candidate.sets:
                if any(any(_places(cells.cells, k, window, identifies)) for k in range(4)):
                    lattice = _centre(regions, half_mm, pitch_mm, candidate.rotation, cells)
                    return _with_places(lattice, window, identifies)
    head = next(c for c in found if (c.worth, c.cells) == best)
    choice = [_centre(regions, half_mm, pitch_mm, head.rotation, cells) for cells in head.sets]
    lattice = max(choice, key=lambda lattice: lattice.margin_mm)
    return _with_places(lattice, window, identifies)


def _centre(
    regions: Sequence[Region],
    half: float,
    pitch: float,
    rotation: float,
    shown_set: CellSet,
) -> Lattice:
    """Move the lattice to the middle of its play along x and y, keeping its cells."""
    cells, y, x = shown_set.cells, shown_set.y, shown_set.x
    turned = [move_region(region, rotation) for region in regions]
    shown = [(r, mirror_region(r), c) for r, c in zip(turned, cells, strict=True) if len(c)]
    margin = 0.0
    for _ in range(3):
        sides = [slack(r, half, _centres(c[:, ::-1], pitch, x, y)) for r, _, c in shown]
        left, right = min(s[0] for s in sides), min(s[1] for s in sides)
        x += (right - left) / 2
        sides = [slack(m, half, _centres(c, pitch, y, x)) for _, m, c in shown]
        down, up = min(s[0] for s in sides), min(s[1] for s in sides)
        y += (up - down) / 2
        margin = min(left + right, down + up) / 2
        if abs(right - left) + abs(up - down) < 1e-9 * pitch:
            break
    places = (0,) * len(regions)
    # Rounded, so that mirror images tie and the first of them is taken.
    return Lattice(rotation, x, y, cells, places, 0, round(margin / pitch, 6) * pitch)


def _centres(cells: Cells, pitch: float, first: float, second: float) -> Points:
    return np.asarray(cells * pitch + np.array([first, second]), dtype=np.float64)


def _with_places(
    lattice: Lattice, window: tuple[int, int], identifies: Identifies | None
) -> Lattice:
    """Count the places and choose the quarter turn that shows the most."""
    best: tuple[int, ...] = ()
    quarter = 0
    for turn in range(4):
        places = _places(lattice.cells, turn, window, identifies)
        if not best or _worth(places) > _worth(best):
            best, quarter = places, turn
    return Lattice(
        lattice.rotation_rad,
        lattice.x_mm,
        lattice.y_mm,
        lattice.cells,
        best,
        quarter,
        lattice.margin_mm,
    )


def _places(
    cells: Sequence[Cells], quarter: int, window: tuple[int, int], identifies: Identifies | None
) -> tuple[int, ...]:
    return tuple(count_places(*array_cells(own, quarter), window, identifies) for own in cells)


def _worth(places: Sequence[int]) -> int:
    return sum(n + FACE_WORTH * (n > 0) for n in places)


def _no_cells() -> Cells:
    return np.empty((0, 2), dtype=np.int64)
