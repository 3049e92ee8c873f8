"""The layer's equilibrium by descent: no matrix, and it always ends.

For contacts on very many cells, and where the active set came back to one that was seen. Two
convex problems, one in the other:

- the plate held fast, the points' spring compressions f = D q >= 0 (`layer_active_set`) are the
  minimum of a strictly convex quadratic function: conjugate gradients on the points in touch,
  projected steps where the set changes; the pad acts by its fast Fourier transform;
- the plate's energy is convex with a continuous gradient in its three unknowns: Newton's
  step, halved while the energy rises along it. The three columns of its matrix are conjugate
  gradients on the points in touch.

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

from probe.contact.layer_active_set import Pressed, judged
from probe.contact.layer_patch import Patch
from probe.contact.layer_solve import (
    Plate,
    answers,
    deep_mm,
    glued,
    levers,
    pressure_image,
    pseudo_inverse,
)
from probe.errors import ContactError

Array = NDArray[np.float64]

MOST_POSES = 100
MOST_GRADIENTS = 5000
HALVINGS = 40
TOLERANCE = 1e-8  #: of the force, for the plate; of the deepest gap, for the points
_HESSIAN = 1e-4  # residual of the columns of the plate's matrix
_PROPORTION = 1.0  # of chopped to free gradient; 1 is the usual choice
_STEP = 1.9  # over the largest eigenvalue; below 2


@dataclass(frozen=True, slots=True, eq=False)
class _Springs:
    """The function f'Af/2 - f'e of the points (S, cells) of a patch."""

    patch: Patch
    largest: float  # bound of A's eigenvalues

    def applied(self, f: Array) -> Array:
        """Return A f."""
        grid = self.patch.grid
        mean = f.mean(axis=0)
        image = pressure_image(self.patch, mean / grid.edge_mm_mpa)
        return f + (grid.sunk_mm(image).ravel()[self.patch.cells] - mean)

    def least(self, e: Array, f: Array, tolerance: float) -> Array:
        """Return the minimum over f >= 0 from a first guess."""
        step = _STEP / self.largest
        g = self.applied(f) - e
        free = np.where(f > 0, g, 0.0)
        p = free
        for _ in range(MOST_GRADIENTS):
            chopped = np.where(f > 0, 0.0, np.minimum(g, 0.0))
            if max(np.abs(free).max(), np.abs(chopped).max()) <= tolerance:
                return f
            reduced = np.vdot(np.minimum(f / step, free), free)
            if np.vdot(chopped, chopped) > _PROPORTION**2 * reduced:
                Ap = self.applied(chopped)
                along = np.vdot(g, chopped) / np.vdot(chopped, Ap)
                f, g = f - along * chopped, g - along * Ap
                p = free = np.where(f > 0, g, 0.0)
                continue
            Ap = self.applied(p)
            curvature = np.vdot(p, Ap)
            along = np.vdot(g, p) / curvature
            falling = p > 0
            reach = (f[falling] / p[falling]).min(initial=np.inf)
            if along <= reach:
                f, g = np.maximum(f - along * p, 0.0), g - along * Ap
                free = np.where(f > 0, g, 0.0)
                p = free - (np.vdot(free, Ap) / curvature) * p
            else:
                f, g = np.maximum(f - reach * p, 0.0), g - reach * Ap
                f = np.maximum(f - step * np.where(f > 0, g, 0.0), 0.0)
                g = self.applied(f) - e
                p = free = np.where(f > 0, g, 0.0)
        raise _no_rest()


def descended(begun: Pressed, plate: Plate) -> Pressed:
    """Return the contact in equilibrium, from where the active set gave up.

    Raises
    ------
    ContactError
        When the limits of this module are reached; no scene is known that does.
    """
    patch, b = begun.patch, begun.plate
    iterations = begun.iterations
    f = np.zeros(patch.heights_mm.shape)
    while True:
        b, f, more = _rested(patch, plate, b, f)
        iterations += more
        pressures = f.mean(axis=0) / patch.grid.edge_mm_mpa
        _, bigger = judged(patch, plate, pressures, b)
        if bigger is patch:
            return Pressed(patch, f > 0, pressures, b, iterations, converged=True)
        wider = np.zeros(bigger.heights_mm.shape)
        wider[:, np.searchsorted(bigger.cells, patch.cells)] = f
        patch, f = bigger, wider


def _rested(patch: Patch, plate: Plate, b: Array, f: Array) -> tuple[Array, Array, int]:
    """Return plate, spring compressions and Newton's steps."""
    grid = patch.grid
    softest = float(grid.compliance.max()) / grid.edge_mm_mpa
    springs = _Springs(patch, max(1.0, softest))
    at_cell, at_point = levers(patch, plate.reach_mm)
    weight = grid.dx_mm**2 / (f.shape[0] * grid.edge_mm_mpa)  # N/mm of one point's spring
    free = plate.free
    K = np.where(np.isfinite(plate.stiffness), plate.stiffness, 0.0)
    b = np.where(np.isfinite(plate.stiffness), b, plate.start)

    def moments(f: Array) -> Array:
        return weight * (at_cell @ f.sum(axis=0) + f.sum(axis=1) @ at_point)

    def left(b: Array, f: Array) -> tuple[Array, Array]:
        """Return the gradient of the plate's energy, with the points at their minimum."""
        e = deep_mm(patch, b, plate.reach_mm)
        f = springs.least(e, f, TOLERANCE * max(float(e.max()), 1e-300))
        gradient = K * (b - plate.start) - moments(f)
        gradient[0] += plate.force_n
        return gradient[free], f

    gradient, f = left(b, f)
    for iteration in range(1, MOST_POSES + 1):
        size = plate.force_n + float((K * np.abs(b - plate.start)).max())
        if np.abs(gradient).max() <= 10 * TOLERANCE * size:
            return b, f, iteration
        touching = f > 0
        if touching.any():
            system = glued(patch, plate, touching)
            R = system.levers[free]
            stiff = grid.dx_mm**2 * (R @ answers(system, R.T, _HESSIAN))
            stiff += system.turn[np.ix_(free, free)] + np.diag(K[free])
            step = -pseudo_inverse((stiff + stiff.T) / 2) @ gradient
        else:  # nothing is touched: go down to the highest point and a little deeper
            step = np.zeros(int(free.sum()))
            step[0] = 1.001 * float(deep_mm(patch, b, plate.reach_mm).max()) - grid.dx_mm
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
