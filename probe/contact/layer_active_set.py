"""Which points of a patch press on the pad, how hard, and where the plate comes to rest.

A cell i with pressure p_i is sampled in S points k. Each point presses through a spring of
compliance D (what the grid does not resolve, `edge_compliance`), all of a cell sink together:

    q_k = (h_k - R_k b - w_i)/D >= 0,   p_i = sum_k q_k / S,   w = (C - D) p,   R = [1, y, -x],

b = (z, tilt_x, tilt_y) is the plate, C the compliance between cells. A cell with m of S points
in touch has then D (S/m - 1) more compliance than a full one: this is how strokes thinner than
a cell, slopes and flanks are felt. It is the minimum of a strictly convex quadratic function of
q >= 0, since C is positive definite, also at nu = 1/2, with the balance of the plate

    dA/S sum R q = (F, 0, 0) + K (b - b_0).

Each step solves for all cells in touch and the plate at once (`layer_solve`); points with q < 0
leave, points that would be run through enter: a semismooth Newton method. Only cells in touch
are unknowns. A set that comes back ends it, and `layer_descent`, which has a proof, takes over.
mm, N, MPa, rad; the turns are scaled by the matrix's reach inside.

References
----------
M. Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy as a semismooth
Newton method", SIAM J. Optim. 13 (2002) 865-888.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.layer_patch import Patch, centres_mm
from probe.contact.layer_solve import Plate, deep_mm, glued, pressure_image, solved

Array = NDArray[np.float64]

MOST_STEPS = 40
TOLERANCE = 1e-5  #: share of the force that may stand on the wrong side of q >= 0
FINE = 1e-5  #: residual of the last steps, of the indentation
_ROUGH = 1e-3  # of the first
_FORCING = 0.01  # residual of a step, of the share that was wrong before it


@dataclass(frozen=True, slots=True, eq=False)
class Pressed:
    """The pad in equilibrium, or an iterate on the way."""

    patch: Patch
    touching: NDArray[np.bool_]  #: (samples, cells) points in touch
    pressures: Array  #: (cells,) MPa, of the patch's cells
    plate: Array  #: (3,) b, mm
    iterations: int
    converged: bool


def equilibrium(
    patch: Patch, plate: Plate, first: Array, touching: NDArray[np.bool_] | None = None
) -> Pressed:
    """Return the contact in equilibrium, or the last iterate if the sets come again.

    Parameters
    ----------
    patch
        Cells that can touch; those that turn out to touch as well are taken in.
    plate
        Force and wrist.
    first
        (3,) b from which to start.
    touching
        (samples, cells) points to start with; those below `first` if not given.

    Returns
    -------
    Pressed
        `converged` is False when the method gave up.
    """
    b, pressures = first, np.zeros(len(patch.cells))
    if touching is None:
        touching = deep_mm(patch, b, plate.reach_mm) > 0
    seen: set[bytes] = set()
    loosest = tolerance = _ROUGH
    for iteration in range(1, MOST_STEPS + 1):
        if not touching.any():
            touching = _highest(patch, b, plate.reach_mm)
        key = np.packbits(touching).tobytes()
        if key in seen:
            if tolerance <= FINE:
                break
            loosest = tolerance = FINE
            seen.clear()
        seen.add(key)
        pressures, b = solved(glued(patch, plate, touching), plate, pressures, b, tolerance)
        force, wider = judged(patch, plate, pressures, b)
        if wider is not patch:
            at = np.searchsorted(wider.cells, patch.cells)
            more = np.zeros(len(wider.cells))
            more[at] = pressures
            patch, pressures = wider, more
            force, _ = judged(patch, plate, pressures, b)
            touching = force > 0
            continue
        total = float(force[touching].sum())
        wrong = float(np.abs(force[(force > 0) != touching]).sum())
        if wrong > TOLERANCE * total:
            touching = force > 0
        elif tolerance <= FINE:
            return Pressed(patch, touching, pressures, b, iteration, converged=True)
        else:
            seen.clear()  # the same set once more, finer
        tolerance = min(max(_FORCING * wrong / total, FINE), loosest) if total > 0 else loosest
    return Pressed(patch, touching, pressures, b, iteration, converged=False)


def judged(patch: Patch, plate: Plate, pressures: Array, b: Array) -> tuple[Array, Patch]:
    """Return what the points feel, and the patch with all cells that are touched.

    Returns
    -------
    force
        (samples, cells) D q, mm: by how much each point compresses its spring; < 0: a gap.
    patch
        With those cells that the surface would run through; itself if there are none.
    """
    grid = patch.grid
    sunk = grid.sunk_mm(pressure_image(patch, pressures)).ravel()
    x, y = centres_mm(grid).T
    free = b[0] + (b[1] * y - b[2] * x) / plate.reach_mm + sunk
    slack = grid.dx_mm * float(np.abs(b[1:]).sum()) / plate.reach_mm
    missed = patch.highest_mm > free - slack
    missed[patch.cells] = False
    wider = patch.with_cells(np.flatnonzero(missed)) if missed.any() else patch
    resting = sunk[patch.cells] - grid.edge_mm_mpa * pressures
    return deep_mm(patch, b, plate.reach_mm) - resting, wider


def _highest(patch: Patch, b: Array, reach_mm: float) -> NDArray[np.bool_]:
    """Return the points that the plate meets first."""
    deep = deep_mm(patch, b, reach_mm)
    highest = deep.max()
    return deep >= highest - 1e-9 * max(1.0, abs(highest))
