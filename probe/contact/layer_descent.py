"""The layer's equilibrium by descent: no matrix, and it always ends.

For where the active set came back to one that was seen: in some 1 % of scenes at random, with tiny
forces on weak wrists. Two convex problems, one in the other:

- the plate held fast, the levels' spring compressions f = D q >= 0 (`layer_active_set`) are the
  minimum of a strictly convex quadratic function: conjugate gradients on the levels in touch,
  projected steps where the set changes; the pad acts by its fast Fourier transform;
- the plate's energy is convex with a continuous gradient in its three unknowns: Newton's
  step, halved while the energy rises along it. The three columns of its matrix are conjugate
  gradients on the cells in touch.

References
----------
Z. Dostal, J. Schoeberl, "Minimizing quadratic functions subject to bound constraints with the
rate of convergence and finite termination", Comput. Optim. Appl. 30 (2005) 23-43.
I. A. Polonsky, L. M. Keer, "A numerical method for solving rough contact problems", Wear 231
(1999) 206-219: the projected conjugate gradients of which this is the variant with a proof.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.layer_active_set import LayerContact, deep_mm
from probe.contact.layer_levels import Levels
from probe.contact.layer_solve import RigidPlate, contact_system, pseudo_inverse, solve_pressures
from probe.contact.settings import DESCENT
from probe.errors import ContactError

Array = NDArray[np.float64]


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
        step, nothing = DESCENT.step / self.largest, self.levels.shares <= 0
        g = self.applied(f) - e
        free = np.where(f > 0, g, 0.0)
        p = free
        for _ in range(DESCENT.most_gradients):
            chopped = np.where((f > 0) | nothing, 0.0, np.minimum(g, 0.0))
            if max(np.abs(free).max(), np.abs(chopped).max()) <= tolerance:
                return f
            reduced = self.dot(np.minimum(f / step, free), free)
            if self.dot(chopped, chopped) > DESCENT.proportion**2 * reduced:
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

    Raises
    ------
    ContactError
        When the limits of this module are reached: forces that a fraction of one cell bears.
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
        f = springs.least(e, f, DESCENT.tolerance * scale) if scale > 0 else np.zeros_like(f)
        gradient = K * (b - plate.start)
        gradient -= area / edge * (levels.levers @ (levels.shares * f).sum(axis=0))
        gradient[0] += plate.force_n
        return gradient[free], f

    b = np.where(free, 0.0, plate.start)
    gradient, f = left(b, np.zeros(levels.shares.shape))
    for iteration in range(begun.iterations + 1, begun.iterations + DESCENT.most_poses):
        size = plate.force_n + float((K * np.abs(b - plate.start)).max())
        if np.abs(gradient).max() <= 10 * DESCENT.tolerance * size:
            pressures = (levels.shares * f).sum(axis=0) / edge
            return LayerContact(levels, f > 0, pressures, b, iteration, converged=True)
        if (f > 0).any():
            system = contact_system(levels, f > 0)
            R = system.levers[free]
            stiff = area * (R @ solve_pressures(system, R.T, DESCENT.hessian)) + np.diag(K[free])
            step = -pseudo_inverse((stiff + stiff.T) / 2) @ gradient
        else:  # nothing is touched: go down to the highest level and a little deeper
            step = np.zeros(int(free.sum()))
            step[0] = 1.001 * float(deep_mm(levels, b).max()) - grid.dx_mm
        slope = float(gradient @ step)
        for halving in range(DESCENT.halvings):
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
