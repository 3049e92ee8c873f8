"""Which levels of a surface press on the pad, how hard, and where the plate comes to rest.

A cell i with pressure p_i meets levels k with shares w_k of its bell and depths h_k
(`layer_levels`). Each presses through a spring of compliance D (what the grid does not resolve,
`edge_compliance`), all of a cell sink together:

    q_k = (h_k - R b - u_i)/D >= 0,   p_i = sum_k w_k q_k,   u = (C - D) p,   R = [1, y, -x],

b = (z, tilt_x, tilt_y) is the plate, C the compliance between cells. A cell of which a share c
is in touch has then D (1/c - 1) more compliance than a full one: this is how strokes thinner
than a cell, slopes and flanks are felt. It is the minimum of a strictly convex quadratic
function of q >= 0, since C is positive definite, also at nu = 1/2, with the balance of the plate

    dA sum R p = (F, 0, 0) + K (b - b_0).

Each step solves for all cells in touch and the plate at once (`layer_solve`); levels with q < 0
leave, levels that would be run through enter: a semismooth Newton method. Only cells in touch
are unknowns. A set that comes back ends it, and `layer_descent`, which has a proof, takes over.
mm, N, MPa, rad; the turns are scaled by the matrix's reach.

References
----------
M. Hintermueller, K. Ito, K. Kunisch, "The primal-dual active set strategy as a semismooth
Newton method", SIAM J. Optim. 13 (2002) 865-888.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.layer_levels import Levels
from probe.contact.layer_solve import RigidPlate, contact_system, solve_glued
from probe.contact.settings import ACTIVE_SET

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LayerContact:
    """The pad in equilibrium, or an iterate on the way."""

    levels: Levels
    touching: NDArray[np.bool_]  #: (levels, cells) levels in touch
    pressures: Array  #: (cells,) MPa
    plate: Array  #: (3,) b, mm
    iterations: int
    converged: bool


def equilibrium(levels: Levels, plate: RigidPlate) -> LayerContact:
    """Return the contact in equilibrium, or the last iterate if the sets come again.

    Parameters
    ----------
    levels
        What the cells meet, seen from about where the plate comes to rest.
    plate
        Force and wrist.

    Returns
    -------
    Pressed
        `converged` is False when the method gave up.
    """
    b = np.where(plate.free, 0.0, plate.start)
    pressures = np.zeros(len(levels.cells))
    touching = deep_mm(levels, b) > 0
    seen: set[bytes] = set()
    loosest = tolerance = ACTIVE_SET.rough
    for iteration in range(1, ACTIVE_SET.most_steps + 1):
        if not touching.any():
            touching = _deepest(levels, b)
        key = np.packbits(touching).tobytes()
        if key in seen:
            if tolerance <= ACTIVE_SET.fine:
                break
            loosest = tolerance = ACTIVE_SET.fine
            seen.clear()
        seen.add(key)
        pressures, b = solve_glued(contact_system(levels, touching), plate, pressures, b, tolerance)
        springs = springs_mm(levels, pressures, b)
        total, wrong = _wrong_sided_force(levels, springs, touching)
        if wrong > ACTIVE_SET.tolerance * total:
            touching = springs > 0
        elif tolerance <= ACTIVE_SET.fine:
            return LayerContact(levels, touching, pressures, b, iteration, converged=True)
        else:
            seen.clear()  # the same set once more, finer
        tolerance = (
            min(max(ACTIVE_SET.forcing * wrong / total, ACTIVE_SET.fine), loosest)
            if total > 0
            else loosest
        )
    return LayerContact(levels, touching, pressures, b, iteration, converged=False)


def deep_mm(levels: Levels, b: Array) -> Array:
    """Return h - R b (levels, cells): how deep each level stands in the pad as it was."""
    return levels.depths_mm - b @ levels.levers


def springs_mm(levels: Levels, pressures: Array, b: Array) -> Array:
    """Return D q (levels, cells): by how much each level compresses its spring; < 0: a gap."""
    sunk = levels.grid.sunk_mm(levels.image(pressures)).ravel()[levels.cells]
    sunk -= levels.grid.edge_mm_mpa * pressures
    return levels.depths_mm - (b @ levels.levers + sunk)


def _wrong_sided_force(
    levels: Levels, springs: Array, touching: NDArray[np.bool_]
) -> tuple[float, float]:
    """Return the force of the levels in touch and how much of it is on the wrong side."""
    total = float(np.vdot(levels.shares[touching], springs[touching]))
    different = (springs > 0) != touching
    return total, float(np.vdot(levels.shares[different], np.abs(springs[different])))


def _deepest(levels: Levels, b: Array) -> NDArray[np.bool_]:
    """Return the levels that the plate meets first."""
    deep = deep_mm(levels, b)
    deepest = deep.max()
    return np.asarray(deep >= deepest - 1e-9 * max(1.0, abs(deepest)))
