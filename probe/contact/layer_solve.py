"""Pressures under points that are glued to the surface, with the plate in balance.

For a given set of points in touch the conditions of `layer_active_set` are linear. With A = C
+ D (S/m - 1) of the cells in touch, h and R means over their points in touch,

    [ A    R ] [p]   [h]        S' = (K + moments of points within cells) / dA
    [ R'  -S'] [b] = [c],

solved by conjugate gradients on the pressures that keep the plate in balance (the diagonal of
A with the rows of the plate as preconditioner): 8-10 products with C for four digits, whatever
nu, since C on cells in touch is well conditioned (<= 36 at h = .1 ... 20, nu up to 1/2).
mm, N, MPa; turns times the matrix's reach.

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
from probe.contact.layer_influence import Influence
from probe.contact.layer_patch import Cells, Patch, centres_mm

Array = NDArray[np.float64]

MOST_PRODUCTS = 2000
_SINGULAR = 1e-13  # eigenvalue of the plate's scaled system, of the largest


@dataclass(frozen=True, slots=True, eq=False)
class Plate:
    """How the wrist holds the plate, with turns times the reach, so that all are lengths."""

    reach_mm: float
    force_n: float
    start: Array  #: (3,) b_0, first entry without meaning, mm
    stiffness: Array  #: (3,) diagonal of K, first entry 0, N/mm; inf: held fast

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of the three can move."""
        return np.isfinite(self.stiffness)


@dataclass(frozen=True, slots=True, eq=False)
class Glued:
    """The linear system of a set of points in touch; n cells."""

    grid: Influence
    size: int  #: of the patch's cells
    some: NDArray[np.intp]  #: (n,) which of the patch's cells
    cells: Cells  #: (n,) their flat numbers
    soft: Array  #: (n,) D (S/m - 1), mm/MPa
    heights: Array  #: (n,) h over the datum, mm
    levers: Array  #: (3, n) R
    datum_mm: float
    turn: Array  #: (3, 3) moments of points within cells, N/mm
    lift: Array  #: (3,) the same of the heights, N

    def product(self, p: Array) -> Array:
        """Return A p."""
        image = np.zeros(self.grid.rows * self.grid.columns)
        image[self.cells] = p
        sunk = self.grid.sunk_mm(image.reshape(self.grid.rows, -1)).ravel()[self.cells]
        sunk += self.soft * p
        return sunk


def plate_of(touch: Touch, reach_mm: float) -> Plate:
    """Return what holds the plate of a touch."""
    start = np.array([0.0, touch.tilt_x_rad * reach_mm, touch.tilt_y_rad * reach_mm])
    stiffness = np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad])
    return Plate(reach_mm, touch.force_n, start, stiffness / reach_mm**2)


def levers(patch: Patch, reach_mm: float) -> tuple[Array, Array]:
    """Return R of the patch's cells (3, cells) and what R changes by at their points (S, 3)."""
    x, y = centres_mm(patch.grid)[patch.cells].T / reach_mm
    at_cell = np.empty((3, len(x)))
    at_cell[0], at_cell[1] = 1.0, y
    np.negative(x, out=at_cell[2])
    at_point = np.zeros((len(patch.offsets_mm), 3))
    at_point[:, 1] = patch.offsets_mm[:, 1] / reach_mm
    at_point[:, 2] = -patch.offsets_mm[:, 0] / reach_mm
    return at_cell, at_point


def deep_mm(patch: Patch, plate: Array, reach_mm: float) -> Array:
    """Return h - R b (samples, cells): how deep each point stands in the pad as it was."""
    at_cell, at_point = levers(patch, reach_mm)
    deep = patch.heights_mm - plate @ at_cell
    deep -= (at_point @ plate)[:, None]
    return deep


def pressure_image(patch: Patch, pressures: Array) -> Array:
    """Return the pressures (rows, columns) on all cells, MPa."""
    image = np.zeros(patch.grid.rows * patch.grid.columns)
    image[patch.cells] = pressures
    return image.reshape(patch.grid.rows, patch.grid.columns)


def glued(patch: Patch, plate: Plate, touching: NDArray[np.bool_]) -> Glued:
    """Return the system of the points in touch (samples, cells)."""
    grid, samples = patch.grid, len(touching)
    some = np.flatnonzero(touching.any(axis=0))
    touching, own = touching[:, some], patch.heights_mm[:, some]
    inside = touching.astype(np.float64)
    many = inside.sum(axis=0)
    at_cell, at_point = levers(patch, plate.reach_mm)
    shift = (at_point.T @ inside) / many
    datum = float(own.max())
    heights = np.where(touching, own - datum, 0.0)
    h = heights.sum(axis=0) / many
    # Within a cell the points on the higher side press harder: moments about its mean point.
    weight = grid.dx_mm**2 / (samples * grid.edge_mm_mpa)
    turn = (at_point.T * inside.sum(axis=1)) @ at_point - (shift * many) @ shift.T
    lift = at_point.T @ heights.sum(axis=1) - shift @ (many * h)
    return Glued(
        grid=grid,
        size=len(patch.cells),
        some=some,
        cells=patch.cells[some],
        soft=grid.edge_mm_mpa * (samples / many - 1),
        heights=h,
        levers=at_cell[:, some] + shift,
        datum_mm=datum,
        turn=weight * turn,
        lift=weight * lift,
    )


def solved(
    system: Glued, plate: Plate, pressures: Array, b: Array, tolerance: float
) -> tuple[Array, Array]:
    """Return pressures (of all the patch's cells,) and plate (3,) in balance.

    Parameters
    ----------
    system
        Points in touch.
    plate
        Force and wrist.
    pressures, b
        Where to start.
    tolerance
        Residual, of the indentation.
    """
    area, free = system.grid.dx_mm**2, plate.free
    K = np.where(free, plate.stiffness, 0.0)
    b = np.where(free, b, plate.start)
    b[0] -= system.datum_mm
    S = (np.diag(K) + system.turn)[free] / area
    c = (system.lift + K * plate.start)[free]
    c[0] -= plate.force_n
    c /= -area
    held = S[:, ~free] @ b[~free]
    c, S = c + held, S[:, free]
    R = system.levers[free]

    diagonal = system.grid.own_mm_mpa + system.soft
    Y = R / diagonal
    G = pseudo_inverse(Y @ R.T + S)

    p = pressures[system.some]
    left = system.heights - b @ system.levers - system.product(p)
    db = G @ (Y @ left - (c - R @ p + S @ b[free]))
    dp = (left - db @ R) / diagonal
    p = p + dp
    b[free] += db
    r = left - system.product(dp) - db @ R
    deep = system.heights - b @ system.levers
    enough = tolerance**2 * float(deep @ deep)

    d, e, before = np.zeros_like(p), np.zeros_like(db), 1.0
    for _ in range(MOST_PRODUCTS):
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
    b[0] += system.datum_mm
    full = np.zeros(system.size)
    full[system.some] = p
    return full, b


def answers(system: Glued, rhs: Array, tolerance: float) -> Array:
    """Return A^-1 rhs, (n, k): pressures under given depths, the plate held fast.

    Parameters
    ----------
    system
        Points in touch.
    rhs
        (n, k) depths, mm.
    tolerance
        Residual of each column, of its length.
    """
    diagonal = system.grid.own_mm_mpa + system.soft
    found = np.empty_like(rhs)
    for column in range(rhs.shape[1]):
        r = rhs[:, column].copy()
        x, d, before = np.zeros(len(r)), np.zeros(len(r)), 1.0
        enough = tolerance**2 * float(r @ r)
        for _ in range(MOST_PRODUCTS):
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
    keep = values > _SINGULAR * values[-1]
    half = vectors[:, keep] * scale[:, None]
    return np.asarray((half / values[keep]) @ half.T)
