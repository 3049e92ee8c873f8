"""Which points of a patch press on the pad, how hard, and where the plate comes to rest.

A cell i with pressure p_i is sampled in S points k. Each point presses through a spring of
compliance D (what the grid does not resolve, `edge_compliance`), all of a cell sink together:

    q_k = (h_k - R_k b - w_i)/D >= 0,   p_i = sum_k q_k / S,   w = (C - D) p,   R = [1, y, -x],

b = (z, tilt_x, tilt_y) is the plate, C the compliance between cells. A cell with m of S points
in touch has then D (S/m - 1) more compliance than a full one: this is how strokes thinner than
a cell, slopes and flanks are felt. It is the minimum of a strictly convex quadratic function of
q >= 0, since C is positive definite, also at nu = 1/2. With the moments of the points

    dA/S sum q R = (F, 0, 0) + K (b - b_0)

one step solves for all cells in touch and the plate; points with q < 0 leave, points that
would be run through enter: a semismooth Newton method. Only cells in touch are in the matrix,
whose Cholesky factor is kept, so the next pose on the same cells costs two triangular solves.
Where the set comes back to one that was seen, `layer_descent` takes over, which always ends.
mm, N, MPa, rad; the turns are scaled by the matrix's reach inside.

References
----------
M. Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy as a semismooth
Newton method", SIAM J. Optim. 13 (2002) 865-888.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.contact.layer_influence import Influence
from probe.contact.layer_patch import Cells, Patch, centres_mm

Array = NDArray[np.float64]

MOST_STEPS = 40
TOLERANCE = 1e-7  #: share of the force that may stand on the wrong side of q >= 0
LARGEST_SYSTEM = 1500  #: cells in touch whose matrix is made; beyond it the descent is used
KEPT = 8  #: factors
_SINGULAR = 1e-13  # of the plate's scaled system


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """How the wrist holds the plate, with turns times the reach, so that all are lengths."""

    reach_mm: float
    force_n: float
    start: Array  #: (3,) b_0, first entry without meaning, mm
    stiffness: Array  #: (3,) diagonal of K, first entry 0, N/mm; inf: held fast

    @property
    def free(self) -> NDArray[np.intp]:
        """Which of the three can move."""
        return np.flatnonzero(np.isfinite(self.stiffness))


@dataclass(frozen=True, slots=True, eq=False)
class Pressed:
    """The pad in equilibrium, or an iterate on the way."""

    patch: Patch
    touching: NDArray[np.bool_]  #: (cells, samples) points in touch
    pressures: Array  #: (cells,) MPa, of the patch's cells
    plate: Array  #: (3,) b, mm
    iterations: int
    converged: bool


def plate_of(touch: Touch, reach_mm: float) -> Plate:
    """Return what holds the plate of a touch."""
    start = np.array([0.0, touch.tilt_x_rad * reach_mm, touch.tilt_y_rad * reach_mm])
    stiffness = np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad])
    return Plate(reach_mm, touch.force_n, start, stiffness / reach_mm**2)


def levers(patch: Patch, reach_mm: float) -> tuple[Array, Array]:
    """Return R of the patch's cells (cells, 3) and what R changes by at their points (S, 3)."""
    centre = centres_mm(patch.grid)[patch.cells] / reach_mm
    offset = patch.offsets_mm / reach_mm
    at_cell = np.stack([np.ones(len(centre)), centre[:, 1], -centre[:, 0]], axis=1)
    at_point = np.stack([np.zeros(len(offset)), offset[:, 1], -offset[:, 0]], axis=1)
    return at_cell, at_point


def gaps_mm(patch: Patch, plate: Array, reach_mm: float) -> Array:
    """Return h - R b (cells, samples): how deep each point stands in the pad as it was."""
    at_cell, at_point = levers(patch, reach_mm)
    return patch.heights_mm - (at_cell @ plate)[:, None] - at_point @ plate


def equilibrium(patch: Patch, plate: Plate, first: Array) -> Pressed:
    """Return the contact in equilibrium, or the last iterate if the sets come again.

    Parameters
    ----------
    patch
        Cells that can touch; those that turn out to touch as well are taken in.
    plate
        Force and wrist.
    first
        (3,) b from which to start.

    Returns
    -------
    Pressed
        `converged` is False when the method gave up.
    """
    touching = gaps_mm(patch, first, plate.reach_mm) > 0
    b = first
    pressures = np.zeros(len(patch.cells))
    seen = set()
    for iteration in range(1, MOST_STEPS + 1):
        if not touching.any():
            touching = _highest(patch, b, plate.reach_mm)
        key = (len(patch.cells), np.packbits(touching).tobytes())
        cells = int(touching.any(axis=1).sum())
        if key in seen or cells > LARGEST_SYSTEM:
            return Pressed(patch, touching, pressures, b, iteration, converged=False)
        seen.add(key)
        pressures, b = _step(patch, plate, touching)
        force = spring_mm(patch, pressures, b, plate.reach_mm)
        bigger = run_through(patch, pressures, b, plate.reach_mm)
        if bigger is not patch:
            patch, pressures, force = _taken_in(patch, bigger, pressures, b, plate.reach_mm)
            touching = force > 0
            continue
        wrong = np.abs(force[(force > 0) != touching]).sum()
        if wrong <= TOLERANCE * force[touching].sum():
            return Pressed(patch, touching, pressures, b, iteration, converged=True)
        touching = force > 0
    return Pressed(patch, touching, pressures, b, MOST_STEPS, converged=False)


def spring_mm(patch: Patch, pressures: Array, plate: Array, reach_mm: float) -> Array:
    """Return D q (cells, samples): by how much every point compresses its spring; < 0: a gap."""
    sunk = _sunk(patch, pressures).ravel()[patch.cells]
    sunk -= patch.grid.edge_mm_mpa * pressures
    return gaps_mm(patch, plate, reach_mm) - sunk[:, None]


def run_through(patch: Patch, pressures: Array, plate: Array, reach_mm: float) -> Patch:
    """Return the patch with those cells that the surface would run through, itself if none."""
    x, y = centres_mm(patch.grid).T
    free = plate[0] + (plate[1] * y - plate[2] * x) / reach_mm + _sunk(patch, pressures).ravel()
    slack = patch.grid.dx_mm * float(np.abs(plate[1:]).sum()) / reach_mm
    missed = patch.coarse_mm.max(axis=1) > free - slack
    missed[patch.cells] = False
    return patch.with_cells(np.flatnonzero(missed)) if missed.any() else patch


def pressure_image(patch: Patch, pressures: Array) -> Array:
    """Return the pressures (rows, columns) on all cells, MPa."""
    image = np.zeros(patch.grid.rows * patch.grid.columns)
    image[patch.cells] = pressures
    return image.reshape(patch.grid.rows, patch.grid.columns)


def _sunk(patch: Patch, pressures: Array) -> Array:
    return patch.grid.sunk_mm(pressure_image(patch, pressures))


def _step(patch: Patch, plate: Plate, touching: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return pressures (cells,) and plate (3,) for the points in touch, as if they were glued."""
    grid, samples = patch.grid, touching.shape[1]
    many = touching.sum(axis=1)
    some = np.flatnonzero(many)
    many, inside = many[some], touching[some].astype(np.float64)
    at_cell, at_point = levers(patch, plate.reach_mm)
    mean_lever = (inside @ at_point) / many[:, None]
    R = at_cell[some] + mean_lever
    datum = patch.heights_mm[some].max()
    heights = np.where(touching[some], patch.heights_mm[some] - datum, 0.0)
    h = heights.sum(axis=1) / many
    # Within a cell the points on the higher side press harder: moments about its mean point.
    weight = grid.dx_mm**2 / (samples * grid.edge_mm_mpa)
    turn = (at_point * inside.sum(axis=0)[:, None]).T @ at_point
    turn -= (mean_lever * many[:, None]).T @ mean_lever
    lift = at_point.T @ heights.sum(axis=0) - mean_lever.T @ (many * h)

    factor = _factor(grid, patch.cells[some].tobytes(), many.astype(np.int32).tobytes(), samples)
    solved = scipy.linalg.cho_solve((factor, True), np.column_stack([h, R]), check_finite=False)
    area = grid.dx_mm**2
    free = plate.free
    K = np.diag(plate.stiffness[free])
    system = (area * (R.T @ solved[:, 1:]) + weight * turn)
    rhs = area * (R.T @ solved[:, 0]) + weight * lift
    rhs[0] -= plate.force_n
    b = plate.start.copy()
    b[0] = 0.0
    held = np.setdiff1d(np.arange(3), free)
    rhs = rhs[free] + K @ plate.start[free] - system[np.ix_(free, held)] @ b[held]
    b[free] = symmetric_solve(system[np.ix_(free, free)] + K, rhs)
    pressures = np.zeros(len(patch.cells))
    pressures[some] = solved[:, 0] - solved[:, 1:] @ b
    b[0] += datum
    return pressures, b


@lru_cache(maxsize=KEPT)
def _factor(grid: Influence, cells: bytes, many: bytes, samples: int) -> Array:
    """Return the lower Cholesky factor of C + D (S/m - 1) on some cells."""
    numbers: Cells = np.frombuffer(cells, dtype=np.intp)
    matrix = grid.gathered(numbers)
    share = samples / np.frombuffer(many, dtype=np.int32)
    matrix.flat[:: len(numbers) + 1] += grid.edge_mm_mpa * (share - 1)
    return np.asarray(
        scipy.linalg.cholesky(matrix.T, lower=True, overwrite_a=True, check_finite=False)
    )


def symmetric_solve(system: Array, rhs: Array) -> Array:
    """Return the shortest solution of a small symmetric system that may be singular."""
    scale = 1 / np.sqrt(np.maximum(system.diagonal(), 1e-300))
    values, vectors = np.linalg.eigh(system * scale * scale[:, None])
    keep = values > _SINGULAR * values[-1]
    along = vectors[:, keep].T @ (scale * rhs)
    return np.asarray(scale * (vectors[:, keep] @ (along / values[keep])))


def _taken_in(
    patch: Patch, bigger: Patch, pressures: Array, b: Array, reach_mm: float
) -> tuple[Patch, Array, Array]:
    """Return the bigger patch with pressures and springs of its cells."""
    wider = np.zeros(len(bigger.cells))
    wider[np.searchsorted(bigger.cells, patch.cells)] = pressures
    return bigger, wider, spring_mm(bigger, wider, b, reach_mm)


def _highest(patch: Patch, b: Array, reach_mm: float) -> NDArray[np.bool_]:
    """Return the points that the plate meets first."""
    gaps = gaps_mm(patch, b, reach_mm)
    highest = gaps.max()
    return gaps >= highest - 1e-9 * max(1.0, math.fabs(highest))
