"""Pressures under levels that are glued to the surface, with the plate in balance.

For a given set of levels in touch the conditions of `layer_active_set` are linear. Where a share
c of a cell is in touch at mean depth h, with A = C + D (1/c - 1) on the cells in touch,

    [ A    R ] [p]   [h]
    [ R'  -K ] [b] = [f - K b_0],    f = (F, 0, 0), K and f over the area of a cell,

solved by conjugate gradients on pressures that keep the plate in balance (the diagonal of A
with the rows of the plate as preconditioner): some ten products with C for four digits,
whatever nu, since C on cells in touch is well conditioned (<= 36 for h = .1 ... 20, nu up to
1/2). mm, N, MPa; turns times the matrix's reach.

References
----------
N. Gould, M. Hribar, J. Nocedal, "On the solution of equality constrained quadratic programming
problems arising in optimization", SIAM J. Sci. Comput. 23 (2001) 1376-1395.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.contact.layer_levels import Levels
from probe.contact.settings import LAYER_SYSTEM

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RigidPlate:
    """How the wrist holds the plate, seen from the plane of `Levels`; turns times the reach."""

    force_n: float
    start: Array  #: (3,) b_0, first entry without meaning, mm
    stiffness: Array  #: (3,) diagonal of K, first entry 0, N/mm; inf: held fast

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of the three can move."""
        return np.isfinite(self.stiffness)

    @property
    def finite(self) -> Array:
        """(3,) K with 0 where the plate is held fast."""
        return np.where(self.free, self.stiffness, 0.0)

    def held(self, by_mm: float) -> RigidPlate:
        """Return the plate held to the plane as well: by its force, where it is `by_mm` off."""
        whole = self.stiffness + np.array([0.0, 1.0, 1.0]) * (self.force_n / by_mm)
        start = self.start.copy()
        turns = np.flatnonzero(self.free)[1:]
        start[turns] *= self.stiffness[turns] / whole[turns]
        return RigidPlate(self.force_n, start, whole)


@dataclass(frozen=True, slots=True, eq=False)
class ContactSystem:
    """The linear system of a set of levels in touch; m cells."""

    levels: Levels
    some: NDArray[np.intp]  #: (m,) which of the cells of the levels
    soft: Array  #: (m,) D (1/c - 1), mm/MPa
    depths: Array  #: (m,) h, mm
    levers: Array  #: (3, m) R

    @property
    def diagonal(self) -> Array:
        """(m,) of A."""
        return self.levels.grid.own_mm_mpa + self.soft

    def product(self, p: Array) -> Array:
        """Return A p."""
        grid, cells = self.levels.grid, self.levels.cells[self.some]
        image = np.zeros(grid.rows * grid.columns)
        image[cells] = p
        sunk = grid.sunk_mm(image.reshape(grid.rows, grid.columns)).ravel()[cells]
        sunk += self.soft * p
        return sunk


def plate_of(touch: Touch, levels: Levels) -> RigidPlate:
    """Return what holds the plate of a touch."""
    plane, reach = levels.plane, levels.reach_mm
    turns = touch.tilt_x_rad - plane.tilt_x_rad, touch.tilt_y_rad - plane.tilt_y_rad
    stiffness = np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad])
    start = np.array([0.0, turns[0] * reach, turns[1] * reach])
    return RigidPlate(touch.force_n, start, stiffness / reach**2)


def contact_system(levels: Levels, touching: NDArray[np.bool_]) -> ContactSystem:
    """Return the system of the levels in touch (levels, cells)."""
    some = np.flatnonzero(touching.any(axis=0))
    touching = touching[:, some]
    shares = np.where(touching, levels.shares[:, some], 0.0)
    share = shares.sum(axis=0)
    moment = (shares * np.where(touching, levels.depths_mm[:, some], 0.0)).sum(axis=0)
    soft = levels.grid.edge_mm_mpa * np.maximum(1 / share - 1, 0.0)
    return ContactSystem(levels, some, soft, moment / share, levels.levers[:, some])


def solve_glued(
    system: ContactSystem, plate: RigidPlate, pressures: Array, b: Array, tolerance: float
) -> tuple[Array, Array]:
    """Return pressures (of all cells of the levels,) and plate (3,) in balance.

    Parameters
    ----------
    system
        Levels in touch.
    plate
        Force and wrist.
    pressures, b
        Where to start.
    tolerance
        Residual, of the indentation.
    """
    free, K = plate.free, plate.finite
    area = system.levels.grid.dx_mm**2
    b = np.where(free, b, plate.start)
    c = K * plate.start / -area
    c[0] = plate.force_n / area
    c, S = c[free], np.diag(K[free] / area)
    R, diagonal = system.levers[free], system.diagonal
    Y = R / diagonal
    G = pseudo_inverse(Y @ R.T + S)

    p = pressures[system.some]
    left = system.depths - b @ system.levers - system.product(p)
    db = G @ (Y @ left - (c - R @ p + S @ b[free]))
    dp = (left - db @ R) / diagonal
    p = p + dp
    b[free] += db
    r = left - system.product(dp) - db @ R
    deep = system.depths - b @ system.levers
    enough = tolerance**2 * float(deep @ deep)

    d, e, before = np.zeros_like(p), np.zeros_like(db), 1.0
    for _ in range(LAYER_SYSTEM.most_products):
        if float(r @ r) <= enough:
            break
        w = G @ (Y @ r)
        z = (r - w @ R) / diagonal
        rz = float(r @ z)
        if not rz > 0:
            break
        d *= rz / before
        d += z
        e = w + (rz / before) * e
        Ad = system.product(d)
        step = rz / float(d @ Ad + e @ (S @ e))
        p += step * d
        b[free] += step * e
        r -= step * (Ad + e @ R)
        before = rz
    full = np.zeros(len(system.levels.cells))
    full[system.some] = p
    return full, b


def solve_pressures(system: ContactSystem, rhs: Array, tolerance: float) -> Array:
    """Return A^-1 rhs, (n, k): pressures under given depths, the plate held fast.

    Parameters
    ----------
    system
        Levels in touch.
    rhs
        (n, k) depths, mm.
    tolerance
        Residual of each column, of its length.
    """
    diagonal = system.diagonal
    found = np.empty_like(rhs)
    for column in range(rhs.shape[1]):
        r = rhs[:, column].copy()
        x, d, before = np.zeros(len(r)), np.zeros(len(r)), 1.0
        enough = tolerance**2 * float(r @ r)
        for _ in range(LAYER_SYSTEM.most_products):
            if float(r @ r) <= enough:
                break
            z = r / diagonal
            rz = float(r @ z)
            d = z + (rz / before) * d
            Ad = system.product(d)
            step = rz / float(d @ Ad)
            x += step * d
            r -= step * Ad
            before = rz
        found[:, column] = x
    return found


def pseudo_inverse(system: Array) -> Array:
    """Return the inverse of a small symmetric system that may be singular."""
    scale = 1 / np.sqrt(np.maximum(system.diagonal(), 1e-300))
    values, vectors = np.linalg.eigh(system * scale * scale[:, None])
    keep = values > LAYER_SYSTEM.singular * values[-1]
    half = vectors[:, keep] * scale[:, None]
    return np.asarray((half / values[keep]) @ half.T)
