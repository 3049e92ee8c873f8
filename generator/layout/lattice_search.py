"""Rotations and shifts at which a lattice shows the most places on a face.

Regions (mm) + pitch + window -> candidates, for `lattice` to choose from. Rotations: along the
edges, and a search between them; shifts: a regular grid, and those at which a row of cells
touches what an edge forbids. All shifts of one rotation are tried at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.layout.footprint import Region, free_grid, mirror_region, move_region
from generator.layout.places import Cells, windows_in
from generator.layout.settings import LAYOUT

Points = NDArray[np.float64]

FACE_WORTH = 1 << 32  #: a face that shows a place counts more than any number of places elsewhere


@dataclass(frozen=True, slots=True)
class CellSet:
    """The cells that one shift of the lattice shows."""

    y: float  #: mm, lattice frame
    x: float
    cells: tuple[Cells, ...]  #: per region (n, 2): j, i


@dataclass(frozen=True, slots=True)
class LatticeCandidate:
    """One rotation and the shifts that show the most there."""

    worth: int  #: places, and FACE_WORTH for every face that shows one
    cells: int
    rotation: float  #: rad
    sets: tuple[CellSet, ...]  #: with these numbers of places and cells


def lattice_candidates(
    regions: Sequence[Region],
    half: float,
    pitch: float,
    window: tuple[int, int],
    search: bool,
) -> list[LatticeCandidate]:
    """Return the best shifts (mm) for every rotation worth a look, edge directions first.

    What is asked for: `lattice.choose_lattice`.
    """
    area = sum(abs(_area(region)) for region in regions) / pitch**2
    fine = int(np.clip(np.sqrt(LAYOUT.centres / (2.0 * area + 8.0)), 4, 16))
    found = []
    best = (0, 0)
    for rotation in edge_rotations(regions):
        found += _best_shifts(regions, half, pitch, window, rotation, fine, best)
        best = max(((c.worth, c.cells) for c in found), default=best)
    if search:
        steps = LAYOUT.search_rotations
        for rotation in (np.arange(1, steps) / steps * np.pi / 2).tolist():
            # A coarse look is enough to see whether a rotation may win.
            coarse = _best_shifts(regions, half, pitch, window, rotation, 4, best)
            if best[0] == 0:
                found += coarse
            elif coarse:
                found += _best_shifts(regions, half, pitch, window, rotation, fine, best)
            best = max(((c.worth, c.cells) for c in found), default=best)
    return found


def edge_rotations(regions: Sequence[Region]) -> list[float]:
    """Return the rotations (rad) that lay the lattice along an edge; the first edge is first."""
    side = np.concatenate([region.end - region.start for region in regions])
    length = np.hypot(side[:, 0], side[:, 1])
    order = np.concatenate([[0], 1 + np.argsort(-length[1:], kind="stable")])
    quarter = np.pi / 2
    rotations: list[float] = []
    for dx, dy in side[order].tolist():
        angle = -float(np.arctan2(dy, dx))
        angle -= quarter * round(angle / quarter)
        if angle <= -np.pi / 4 + LAYOUT.same_rad:
            angle += quarter
        apart = ((angle - r + quarter / 2) % quarter - quarter / 2 for r in rotations)
        if all(abs(turn) > LAYOUT.same_rad for turn in apart):
            rotations.append(0.0 if abs(angle) <= LAYOUT.same_rad else angle)
        if len(rotations) == LAYOUT.edge_rotations:
            break
    return rotations


def _best_shifts(
    regions: Sequence[Region],
    half: float,
    pitch: float,
    window: tuple[int, int],
    rotation: float,
    steps: int,
    best: tuple[int, int],
) -> list[LatticeCandidate]:
    """Return the shifts with the most places, then cells, at one rotation.

    None without cells, nor if it falls short of the best (worth, cells) so far.
    """
    turned = [move_region(region, rotation) for region in regions]
    ys = _shifts(turned, half, pitch, steps)
    xs = _shifts([mirror_region(region) for region in turned], half, pitch, steps)
    along = np.zeros((len(ys), len(xs)), dtype=np.int64)
    across, cells = along.copy(), along.copy()
    grids: list[tuple[NDArray[np.bool_], tuple[int, int]]] = []
    for region in turned:
        j, y = _lines(region.start[:, 1], ys, pitch)
        i, x = _lines(region.start[:, 0], xs, pitch)
        free = free_grid(region, half, y.ravel(), x.ravel())
        free = free.reshape(len(y), len(ys), len(x), len(xs))
        grids.append((free, (j, i)))
        cells += free.sum(axis=(0, 2))
        for total, shape in ((along, window), (across, window[::-1])):
            here = windows_in(free, *shape).sum(axis=(0, 2))
            total += here + FACE_WORTH * (here > 0)
    if cells.max() == 0:
        return []
    worth = np.maximum(along, across)
    cells[worth < worth.max()] = -1
    at = np.argwhere(cells == cells.max())
    reached = int(worth.max()), int(cells.max())
    if best[0] > 0 and reached < best:
        return []
    return [LatticeCandidate(*reached, rotation, _unique_sets(grids, at, ys, xs))]


def _unique_sets(
    grids: Sequence[tuple[NDArray[np.bool_], tuple[int, int]]],
    at: NDArray[np.intp],
    ys: Points,
    xs: Points,
) -> tuple[CellSet, ...]:
    """Return the different sets of cells at some shifts (k, 2), the first few of them."""
    if len(at) > 8 * LAYOUT.compared_sets:
        at = at[np.linspace(0, len(at) - 1, 8 * LAYOUT.compared_sets).astype(int)]
    sets: dict[bytes, CellSet] = {}
    for y, x in at.tolist():
        masks = [free[:, y, :, x] for free, _ in grids]
        key = b"".join(np.packbits(mask).tobytes() for mask in masks)
        if key not in sets:
            cells = tuple(
                np.argwhere(mask).astype(np.int64) + first
                for mask, (_, first) in zip(masks, grids, strict=True)
            )
            sets[key] = CellSet(float(ys[y]), float(xs[x]), cells)
        if len(sets) == LAYOUT.compared_sets:
            break
    return tuple(sets.values())


def _shifts(regions: Sequence[Region], half: float, pitch: float, steps: int) -> Points:
    """Return shifts along y worth trying: a regular grid, and rows that touch what edges forbid."""
    start, end = (
        np.concatenate([getattr(r, name)[:, 1] for r in regions]) for name in ("start", "end")
    )
    reach = np.concatenate([r.clearance for r in regions]) + half
    level = np.abs(end - start)
    touching = np.concatenate([np.maximum(start, end) + reach, np.minimum(start, end) - reach])
    order = np.argsort(np.tile(level, 2), kind="stable")[:steps]
    shifts = np.concatenate([np.arange(steps) * (pitch / steps), np.mod(touching[order], pitch)])
    shifts = np.sort(np.where(shifts >= pitch, 0.0, shifts))
    return shifts[np.diff(shifts, prepend=-1.0) > 1e-6 * pitch]


def _lines(values: Points, shifts: Points, pitch: float) -> tuple[int, Points]:
    """Return the first cell number, and all lattice lines (k, shifts) that may meet the region."""
    first = int(np.ceil(values.min() / pitch)) - 1
    last = int(np.floor(values.max() / pitch))
    return first, np.arange(first, last + 1)[:, None] * pitch + shifts


def _area(region: Region) -> float:
    (ax, ay), (bx, by) = region.start.T, region.end.T
    return 0.5 * float(np.sum(ax * by - ay * bx))
