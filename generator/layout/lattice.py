"""Choose how the lattice of symbols lies on a face, or on several faces of a net at once.

Regions (mm) + pitch + window -> Lattice: rotation and shift that show the most identifiable
places. Rotations: along the edges, and twelfths of a quarter turn between them; shifts: a regular
grid, and those at which a row of cells touches what an edge forbids. All shifts of one rotation
are tried at once. The lattice frame is the face (or net) frame turned by `rotation_rad`; cell
(j, i) has its centre at (x_mm + i p, y_mm + j p), j against the array's rows.

Other numbers below give other lattices, so other cells for the same spec: objects that are
registered keep theirs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.layout.footprint import Region, free_grid, mirror_region, move_region, slack
from generator.layout.places import Cells, Identifies, array_cells, count_places, windows_in

Points = NDArray[np.float64]

SAME_RAD = 1e-9  #: rotations nearer than this are the same
CENTRES = 1 << 17  #: candidate centres looked at for one rotation
SEARCH_ROTATIONS = 12  #: steps over a quarter turn between the edges' directions: 7.5 degrees
EDGE_ROTATIONS = 12  #: edge directions tried at most
COMPARED_SETS = 8  #: sets of cells with equal scores whose margins to the edges are compared
FACE_WORTH = 1 << 32  #: a face that shows a place counts more than any number of places elsewhere


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


@dataclass(frozen=True, slots=True)
class LatticeRequest:
    """What lattices carry: symbols, and the window that a place takes."""

    half_mm: float  #: half side of a symbol's footprint
    pitch_mm: float
    window: tuple[int, int]  #: rows, columns
    #: rank test for faces into which the window does not fit; None leaves it out
    identifies: Identifies | None = None

    def choose(self, regions: Sequence[Region], *, search: bool = True) -> Lattice:
        """Return the lattice that shows a place on the most faces, then the most places, mm.

        Ties are broken by more cells, then by the rotation (that of the first edge, then of longer
        edges), then by the largest margin to the edges; at last the lattice is centred. `search`
        tries rotations other than along the edges too.
        """
        found = self._candidates(regions, search)
        if not found:
            none = np.empty((0, 2), dtype=np.int64)
            return Lattice(0.0, 0.0, 0.0, (none,) * len(regions), (0,) * len(regions), 0, 0.0)
        best = max((c.worth, c.cells) for c in found)
        if best[0] == 0 and self.identifies is not None:
            for candidate in sorted(found, key=lambda c: -c.cells):
                for cells in candidate.sets:
                    if any(any(self._places(cells.cells, k)) for k in range(4)):
                        return self._with_places(self._centre(regions, candidate.rotation, cells))
        head = next(c for c in found if (c.worth, c.cells) == best)
        choice = [self._centre(regions, head.rotation, cells) for cells in head.sets]
        lattice = max(choice, key=lambda lattice: lattice.margin_mm)
        return self._with_places(lattice)

    def _candidates(self, regions: Sequence[Region], search: bool) -> list[LatticeCandidate]:
        """Return the best shifts (mm) for every rotation worth a look, edge directions first."""
        area = sum(abs(_area(region)) for region in regions) / self.pitch_mm**2
        fine = int(np.clip(np.sqrt(CENTRES / (2.0 * area + 8.0)), 4, 16))
        found = []
        best = (0, 0)
        for rotation in edge_rotations(regions):
            found += self._best_shifts(regions, rotation, fine, best)
            best = max(((c.worth, c.cells) for c in found), default=best)
        others = np.arange(1, SEARCH_ROTATIONS) / SEARCH_ROTATIONS * np.pi / 2
        for rotation in others.tolist() if search else ():
            # A coarse look is enough to see whether a rotation may win.
            coarse = self._best_shifts(regions, rotation, 4, best)
            if best[0] == 0:
                found += coarse
            elif coarse:
                found += self._best_shifts(regions, rotation, fine, best)
            best = max(((c.worth, c.cells) for c in found), default=best)
        return found

    def _best_shifts(
        self, regions: Sequence[Region], rotation: float, steps: int, best: tuple[int, int]
    ) -> list[LatticeCandidate]:
        """Return the shifts with the most places, then cells, at one rotation.

        None without cells, nor if it falls short of the best (worth, cells) so far.
        """
        half, pitch = self.half_mm, self.pitch_mm
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
            for total, shape in ((along, self.window), (across, self.window[::-1])):
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

    def _centre(self, regions: Sequence[Region], rotation: float, shown_set: CellSet) -> Lattice:
        """Move the lattice to the middle of its play along x and y, keeping its cells."""
        half, pitch = self.half_mm, self.pitch_mm
        cells, y, x = shown_set.cells, shown_set.y, shown_set.x
        turned = [move_region(region, rotation) for region in regions]
        shown = [(r, mirror_region(r), c) for r, c in zip(turned, cells, strict=True) if len(c)]
        margin = 0.0
        for _ in range(3):
            sides = [slack(r, half, c[:, ::-1] * pitch + np.array([x, y])) for r, _, c in shown]
            left, right = min(s[0] for s in sides), min(s[1] for s in sides)
            x += (right - left) / 2
            sides = [slack(m, half, c * pitch + np.array([y, x])) for _, m, c in shown]
            down, up = min(s[0] for s in sides), min(s[1] for s in sides)
            y += (up - down) / 2
            margin = min(left + right, down + up) / 2
            if abs(right - left) + abs(up - down) < 1e-9 * pitch:
                break
        places = (0,) * len(regions)
        # Rounded, so that mirror images tie and the first of them is taken.
        return Lattice(rotation, x, y, cells, places, 0, round(margin / pitch, 6) * pitch)

    def _with_places(self, lattice: Lattice) -> Lattice:
        """Count the places and choose the quarter turn that shows the most."""
        turns = [self._places(lattice.cells, quarter) for quarter in range(4)]
        quarter = max(range(4), key=lambda k: sum(n + FACE_WORTH * (n > 0) for n in turns[k]))
        return replace(lattice, places=turns[quarter], quarter=quarter)

    def _places(self, cells: Sequence[Cells], quarter: int) -> tuple[int, ...]:
        return tuple(
            count_places(*array_cells(own, quarter), self.window, self.identifies) for own in cells
        )


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
        if angle <= -np.pi / 4 + SAME_RAD:
            angle += quarter
        apart = ((angle - r + quarter / 2) % quarter - quarter / 2 for r in rotations)
        if all(abs(turn) > SAME_RAD for turn in apart):
            rotations.append(0.0 if abs(angle) <= SAME_RAD else angle)
        if len(rotations) == EDGE_ROTATIONS:
            break
    return rotations


def _unique_sets(
    grids: Sequence[tuple[NDArray[np.bool_], tuple[int, int]]],
    at: NDArray[np.intp],
    ys: Points,
    xs: Points,
) -> tuple[CellSet, ...]:
    """Return the different sets of cells at some shifts (k, 2), the first few of them."""
    if len(at) > 8 * COMPARED_SETS:
        at = at[np.linspace(0, len(at) - 1, 8 * COMPARED_SETS).astype(int)]
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
        if len(sets) == COMPARED_SETS:
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
