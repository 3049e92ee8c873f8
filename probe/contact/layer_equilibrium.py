"""Levels of a surface that press on the pad, their pressures, and the plate at rest.

A cell i with pressure p_i meets levels k with shares w_k of its bell and depths h_k
(`layer_patch`). Each presses through a spring of compliance D (what the grid does not resolve,
`edge_compliance`), all of a cell sink together:

    q_k = (h_k - R b - u_i)/D >= 0,   p_i = sum_k w_k q_k,   u = (C - D) p,   R = [1, y, -x],

b = (z, tilt_x, tilt_y) is the plate, C the compliance between cells. A cell of which a share c
is in touch has D (1/c - 1) more compliance than a full one: this is how strokes thinner than a
cell, slopes and flanks count. It is the minimum of a strictly convex quadratic function of q >= 0
with the balance of the plate, dA sum R p = (F, 0, 0) + K (b - b_0).

`equilibrium` is a semismooth Newton method [1]: each step solves for all cells in touch and the
plate at once; levels with q < 0 leave, levels that would be run through enter. For a given set,
where a share c of a cell is in touch at mean depth h, with A = C + D (1/c - 1),

    [ A    R ] [p]   [h]
    [ R'  -K ] [b] = [f - K b_0],    f = (F, 0, 0), K and f over the area of a cell,

solved by conjugate gradients on pressures that keep the plate in balance [2] (the diagonal of A
with the rows of the plate as preconditioner): some ten products with C for four digits, since C on
cells in touch is well conditioned (<= 36 for h = .1 ... 20, nu up to 1/2).

A set that comes back ends it (some 1 % of scenes at random, with tiny forces on weak wrists), and
`descend`, which always ends, takes over: with the plate held fast, the levels' spring compressions
f = D q >= 0 are found by projected conjugate gradients [3], a proven variant of [4]; the plate's
energy is convex with a continuous gradient: Newton's step, halved while the energy rises along it.
mm, N, MPa, rad; the turns are scaled by the matrix's reach.

[1] M. Hintermueller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865-888. [2] N. Gould, M. Hribar,
J. Nocedal, SIAM J. Sci. Comput. 23 (2001) 1376-1395. [3] Z. Dostal, J. Schoeberl, Comput. Optim.
Appl. 30 (2005) 23-43. [4] I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206-219.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.contact.layer_patch import Levels
from probe.errors import ContactError

Array = NDArray[np.float64]

MOST_STEPS = 40  # of the active set
TOLERANCE = 1e-5  # share of the force that may stand on the wrong side of q >= 0
FINE = 1e-5  # residual of the last steps, of the indentation
ROUGH = 1e-3  # residual of the first
FORCING = 0.01  # residual of a step, of the share that was wrong before it
MOST_PRODUCTS = 2000  # of the influence with pressures, in one linear system
SINGULAR = 1e-13  # eigenvalue of the plate's scaled system, of the largest
# Of the descent:
MOST_POSES = 50
MOST_GRADIENTS = 5000
HALVINGS = 20  # of one step of the plate
DESCENT_TOLERANCE = 1e-8  # of the force, for the plate; of the depth, for the levels
HESSIAN = 1e-4  # residual of the columns of the plate's matrix
PROPORTION = 1.0  # of chopped to free gradient; 1 is the usual choice
GRADIENT_STEP = 1.9  # over the largest eigenvalue; below 2


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
    """Return the contact in equilibrium; `converged` is False if the sets come again."""
    b = np.where(plate.free, 0.0, plate.start)
    pressures = np.zeros(len(levels.cells))
    touching = deep_mm(levels, b) > 0
    seen: set[bytes] = set()
    loosest = tolerance = ROUGH
    for iteration in range(1, MOST_STEPS + 1):
        if not touching.any():
            touching = _deepest(levels, b)
        key = np.packbits(touching).tobytes()
        if key in seen:
            if tolerance <= FINE:
                break
            loosest = tolerance = FINE
            seen.clear()
        seen.add(key)
        pressures, b = solve_glued(contact_system(levels, touching), plate, pressures, b, tolerance)
        springs = springs_mm(levels, pressures, b)
        total, wrong = _wrong_sided_force(levels, springs, touching)
        if wrong > TOLERANCE * total:
            touching = springs > 0
        elif tolerance <= FINE:
            return LayerContact(levels, touching, pressures, b, iteration, converged=True)
        else:
            seen.clear()  # the same set once more, finer
        tolerance = min(max(FORCING * wrong / total, FINE), loosest) if total > 0 else loosest
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
    """Return force and wrist of a touch, seen from the plane of the levels."""
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

    They start from `pressures` and `b`; `tolerance` is the residual, of the indentation.
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
    full = np.zeros(len(system.levels.cells))
    full[system.some] = p
    return full, b


def solve_pressures(system: ContactSystem, rhs: Array, tolerance: float) -> Array:
    """Return A^-1 rhs, (n, k): pressures under depths (n, k) mm, the plate held fast.

    `tolerance` is the residual of each column, of its length.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    shape, diagonal = (len(rhs), len(rhs)), system.diagonal
    A = LinearOperator(shape, system.product, dtype=np.float64)
    M = LinearOperator(shape, lambda r: r / diagonal, dtype=np.float64)
    columns = [cg(A, b, rtol=tolerance, maxiter=MOST_PRODUCTS, M=M)[0] for b in rhs.T]
    return np.column_stack(columns)


def pseudo_inverse(system: Array) -> Array:
    """Return the inverse of a small symmetric system that may be singular."""
    scale = 1 / np.sqrt(np.maximum(system.diagonal(), 1e-300))
    values, vectors = np.linalg.eigh(system * scale * scale[:, None])
    keep = values > SINGULAR * values[-1]
    half = vectors[:, keep] * scale[:, None]
    return np.asarray((half / values[keep]) @ half.T)


@dataclass(frozen=True, slots=True, eq=False)
class _Springs:
    """The function f'WAf/2 - f'We of the levels (levels, cells); W are their shares."""

    levels: Levels
    largest: float  # bound of A's eigenvalues

    def applied(self, f: Array) -> Array:
        """Return A f."""
        grid = self.levels.grid
        mean = (self.levels.shares * f).sum(axis=0)
        image = self.levels.image(mean / grid.edge_mm_mpa)
        return np.asarray(f + (grid.sunk_mm(image).ravel()[self.levels.cells] - mean))

    def dot(self, f: Array, g: Array) -> float:
        """Return f'W g."""
        return float(np.einsum("ij,ij,ij", f, self.levels.shares, g))

    def least(self, e: Array, f: Array, tolerance: float) -> Array:
        """Return the minimum over f >= 0 from a first guess."""
        step, nothing = GRADIENT_STEP / self.largest, self.levels.shares <= 0
        g = self.applied(f) - e
        free = np.where(f > 0, g, 0.0)
        p = free
        for _ in range(MOST_GRADIENTS):
            chopped = np.where((f > 0) | nothing, 0.0, np.minimum(g, 0.0))
            if max(np.abs(free).max(), np.abs(chopped).max()) <= tolerance:
                return f
            reduced = self.dot(np.minimum(f / step, free), free)
            if self.dot(chopped, chopped) > PROPORTION**2 * reduced:
                Ap = self.applied(chopped)
                along = self.dot(g, chopped) / self.dot(chopped, Ap)
                f, g = f - along * chopped, g - along * Ap
                p = free = np.where(f > 0, g, 0.0)
                continue
            Ap = self.applied(p)
            curvature = self.dot(p, Ap)
            along = self.dot(g, p) / curvature
            falling = p > 0
            reach = float((f[falling] / p[falling]).min(initial=np.inf))
            if along <= reach:
                f, g = np.maximum(f - along * p, 0.0), g - along * Ap
                free = np.where(f > 0, g, 0.0)
                p = free - (self.dot(free, Ap) / curvature) * p
            else:
                f, g = np.maximum(f - reach * p, 0.0), g - reach * Ap
                f = np.maximum(f - step * np.where(f > 0, g, 0.0), 0.0)
                g = self.applied(f) - e
                p = free = np.where(f > 0, g, 0.0)
        raise _no_rest()


def descend(begun: LayerContact, plate: RigidPlate) -> LayerContact:
    """Return the contact in equilibrium, begun at the plane of the levels.

    Raises `ContactError` when the limits of this module are reached: forces that a fraction of one
    cell bears.
    """
    levels, grid = begun.levels, begun.levels.grid
    matter = levels.shares > 0
    softest = float(grid.compliance.max()) / grid.edge_mm_mpa
    springs = _Springs(levels, max(1.0, softest))
    free, K = plate.free, plate.finite
    area, edge = grid.dx_mm**2, grid.edge_mm_mpa

    def left(b: Array, f: Array) -> tuple[Array, Array]:
        """Return the gradient of the plate's energy, and the levels at their minimum."""
        e = np.where(matter, deep_mm(levels, b), 0.0)
        scale = float(e.max())
        f = springs.least(e, f, DESCENT_TOLERANCE * scale) if scale > 0 else np.zeros_like(f)
        gradient = K * (b - plate.start)
        gradient -= area / edge * (levels.levers @ (levels.shares * f).sum(axis=0))
        gradient[0] += plate.force_n
        return gradient[free], f

    b = np.where(free, 0.0, plate.start)
    gradient, f = left(b, np.zeros(levels.shares.shape))
    for iteration in range(begun.iterations + 1, begun.iterations + MOST_POSES):
        size = plate.force_n + float((K * np.abs(b - plate.start)).max())
        if np.abs(gradient).max() <= 10 * DESCENT_TOLERANCE * size:
            pressures = (levels.shares * f).sum(axis=0) / edge
            return LayerContact(levels, f > 0, pressures, b, iteration, converged=True)
        if (f > 0).any():
            system = contact_system(levels, f > 0)
            R = system.levers[free]
            stiff = area * (R @ solve_pressures(system, R.T, HESSIAN)) + np.diag(K[free])
            step = -pseudo_inverse((stiff + stiff.T) / 2) @ gradient
        else:  # nothing is touched: go down to the highest level and a little deeper
            step = np.zeros(int(free.sum()))
            step[0] = 1.001 * float(deep_mm(levels, b).max()) - grid.dx_mm
        slope = float(gradient @ step)
        for halving in range(HALVINGS):
            there = b.copy()
            there[free] += 0.5**halving * step
            found, f_there = left(there, f)
            if float(found @ step) <= 0.5 * abs(slope):
                break
        else:
            raise _no_rest()
        b, f, gradient = there, f_there, found
    raise _no_rest()


def _no_rest() -> ContactError:
    return ContactError(
        "the pad finds no equilibrium within the steps allowed",
        fix="report the scene; a wrist with some stiffness helps",
    )
