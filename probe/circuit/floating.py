"""Floating rows, inverted: resistances between terminals -> the conductances between them.

All resistances R of a network tell all its conductances g: they minimise the strictly convex

    -logdet L(g) + <R, g>,  g >= 0,

because R is the gradient of logdet L. In y = g R the Hessian has a unit diagonal at the
solution (by g alone its rows differ by the square of the contrast, and steps stall); Foster:
the sum of y is rows + columns - 1, each y at most 1. Each step minimises the quadratic model
over y >= 0 (block pivoting), and goes along it until the function falls.

Where y = gR falls to the relative noise of R the reading is that of the neighbours' paths,
and says nothing of the tactel any more.

References
----------
J. J. Judice and F. M. Pires, block principal pivoting for quadratic programmes with bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.circuit.fsr import Image
from probe.circuit.network import Network, eliminate
from probe.circuit.settings import FLOATING
from probe.errors import CircuitError

Vector = NDArray[np.float64]

EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True, slots=True, eq=False)
class FloatingSolution:
    """A network found from its resistances."""

    conductance_s: Image  #: (rows, columns) S, 0 or more
    own: Image  #: (rows, columns) y = gR, how much of a reading is the tactel's own
    hessian: NDArray[np.float64]  #: (tactels, tactels) -d ln R / d y
    steps: int


def solve_floating(resistance_ohm: Image, tolerance: float = 1e-9) -> FloatingSolution:
    """Find the conductances of a network from all its resistances.

    Parameters
    ----------
    resistance_ohm
        (rows, columns) ohm between every row and column with all others open; > 0.
    tolerance
        Largest relative change of a conductance in the last step.

    Raises
    ------
    CircuitError
        If a resistance is not above 0, or the steps do not end.
    """
    if not (np.isfinite(resistance_ohm).all() and (resistance_ohm > 0).all()):
        raise CircuitError(
            "a resistance between terminals is not above 0, or no number",
            fix="read within the ADC's range: lower the load, or press less",
        )
    shape = resistance_ohm.shape
    scale = float(np.exp(np.log(resistance_ohm).mean()))
    measured = resistance_ohm / scale
    y = np.full(measured.size, (sum(shape) - 1) / measured.size)
    network = eliminate(y.reshape(shape) / measured)
    free = np.ones(y.size, dtype=np.bool_)
    for steps in range(1, FLOATING.steps + 1):
        gradient = 1.0 - (network.resistances_ohm / measured).ravel()
        hessian = _hessian(network, measured)
        wanted, free = _minimise_bounded(hessian, gradient - hessian @ y, free)
        move = wanted - y
        misfit = float(np.abs(gradient[free]).max(initial=0.0))
        if (np.abs(move) <= tolerance * y).all() or misfit <= 64 * EPSILON:
            conductance = y.reshape(shape) / measured / scale
            return FloatingSolution(conductance, y.reshape(shape), hessian, steps)
        y, network = _search_line(y, move, gradient, network, measured)
    raise CircuitError(
        f"the network did not settle in {FLOATING.steps} steps; misfit {misfit:.1e}",
        fix="the readings contradict each other: average more frames",
    )


def _hessian(network: Network, measured: Image) -> NDArray[np.float64]:
    root = np.sqrt(measured.ravel())
    transfer = network.transfer_ohm()
    transfer /= root[:, None]
    transfer /= root
    return np.square(transfer, out=transfer)


def _minimise_bounded(
    hessian: NDArray[np.float64], linear: Vector, free: NDArray[np.bool_]
) -> tuple[Vector, NDArray[np.bool_]]:
    """Minimise z' hessian z / 2 + linear' z over z >= 0; start from a guess of what is free."""
    patience, fewest = FLOATING.patience, linear.size + 1
    for _ in range(FLOATING.pivots):
        z = _minimise_free(hessian, linear, free)
        slope = hessian @ z + linear
        wrong = (free & (z < 0)) | (~free & (slope < -64 * EPSILON))
        number = int(wrong.sum())
        if number == 0:
            return z, free
        if number < fewest:
            patience, fewest = FLOATING.patience, number
        elif patience > 0:
            patience -= 1
        else:
            last = int(np.flatnonzero(wrong)[-1])
            wrong = np.zeros_like(free)
            wrong[last] = True
        free = free ^ wrong
    return np.maximum(z, 0.0), free


def _minimise_free(hessian: NDArray[np.float64], linear: Vector, free: NDArray[np.bool_]) -> Vector:
    """Minimise with the variables that are not free held at 0."""
    from scipy.linalg import cho_factor, cho_solve

    index = np.flatnonzero(free)
    part = hessian[index[:, None], index]
    weight = 1.0 / np.sqrt(np.diagonal(part))
    part *= weight[:, None]
    part *= weight
    part[np.diag_indices_from(part)] += 4 * EPSILON
    factor = cho_factor(part, lower=True, overwrite_a=True, check_finite=False)
    z = np.zeros_like(linear)
    z[index] = -weight * cho_solve(factor, weight * linear[index], check_finite=False)
    return z


def _search_line(
    y: Vector, move: Vector, gradient: Vector, network: Network, measured: Image
) -> tuple[Vector, Network]:
    """Go along the step until the function falls; stay if it does not."""
    value = float(y.sum() - network.logdet)
    slope = float(gradient @ move)
    length = 1.0
    for _ in range(FLOATING.halvings):
        there = np.maximum(y + length * move, 0.0)
        try:
            ahead = eliminate(there.reshape(measured.shape) / measured)
        except CircuitError:
            length /= 2
            continue
        allowed = value + FLOATING.decrease * length * slope
        if -slope < FLOATING.near or there.sum() - ahead.logdet <= allowed:
            return there, ahead
        length /= 2
    return y, network
