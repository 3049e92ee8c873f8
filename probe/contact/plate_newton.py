"""Newton's method for a plate on elastic tips: the solver behind `plate`.

Least Phi(a, v) = sum psi((R a + h - v)+) + sum Psi(v) + a'K a / 2 - f'a over the plate's
unknowns a (at most three) and the compression v of the columns behind groups of tips. Phi is
convex and C1, so every slope along a step rises and one sign tells which side to search. The
columns are eliminated one by one; what is left is 3x3, scaled to a unit diagonal. Where that
is singular and the load is not balanced, the step goes down the null space to the next tip.
Steps stay short of the laws' limits, so the plate never leaves where the forces are finite.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.neo_hooke import Law
from probe.contact.settings import PLATE_NEWTON

Array = NDArray[np.float64]

EPS = float(np.finfo(np.float64).eps)
_NONE = np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Common columns: each bears the points of one group, which follow one another."""

    law: Law
    starts: NDArray[np.intp]  #: (g,) first point of each group
    of_point: NDArray[np.intp]  #: (n,) group of each point
    foreseen_mm: Array  #: (g,) about the compression where the plate is foreseen


@dataclass(frozen=True, slots=True, eq=False)
class PlateProblem:
    """A plate, its tips and its load, in scaled unknowns."""

    rows: Array  # transpose of R, (m, n), m <= 3 free unknowns
    heights: Array  # (n,), relative to the datum
    law: Law
    columns: Columns | None
    K: Array  # (m,) its diagonal
    f: Array  # (m,)
    free: NDArray[np.intp]  # which of the three unknowns are free
    half_mm: float
    datum_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class NewtonState:
    """Where the plate and the columns stand, and how far from balance."""

    a: Array  # (m,)
    v: Array  # (g,) compression of the columns
    compression: Array  # (n,) of the tips, negative: not touching
    force: Array  # (n,)
    tangent: Array  # (n,)
    behind: Array  # (g,) tangent of the columns
    gradient: Array  # (m,) of Phi by a
    unbalance: Array  # (g,) gradient of Phi by v


def newton(problem: PlateProblem, a: Array, tolerance: float) -> tuple[NewtonState, int | None]:
    """Return the state at rest, begun at unknowns `a`, and the steps taken; None: no rest."""
    state = _first_state(problem, a)
    for iteration in range(PLATE_NEWTON.most_steps + 1):
        if _is_at_rest(problem, state, tolerance):
            return state, iteration
        state = _search_line(problem, state, *_step(problem, state))
    return state, None


def _first_state(problem: PlateProblem, a: Array) -> NewtonState:
    """Return the state to begin with: the unknowns, withdrawn to within the laws' limits."""
    columns, limit = problem.columns, problem.law.limit_mm
    whole = limit if columns is None else limit + columns.law.limit_mm
    pressed = a @ problem.rows + problem.heights
    deepest = float(pressed.max())
    # At least a trace of contact, at most nearly the limit.
    least = 1e-9 * (1.0 if math.isinf(whole) else whole)
    back = min(max(least - deepest, 0.0), PLATE_NEWTON.near_limit * whole - deepest)
    a[0] += back
    if columns is None:
        return _evaluate_at(problem, a, _NONE)
    v = np.maximum.reduceat(pressed, columns.starts) + (back - PLATE_NEWTON.near_limit * limit)
    v = np.maximum(columns.foreseen_mm, v)
    return _evaluate_at(problem, a, np.minimum(v, PLATE_NEWTON.near_limit * columns.law.limit_mm))


def _evaluate_at(problem: PlateProblem, a: Array, v: Array) -> NewtonState:
    """Evaluate forces, tangents and gradient."""
    columns = problem.columns
    compression = a @ problem.rows
    compression += problem.heights
    if columns is not None:
        compression -= v[columns.of_point]
    force, tangent = problem.law(np.maximum(compression, 0.0))
    tangent = tangent * (compression > 0)
    gradient = problem.rows @ force + problem.K * a - problem.f
    if columns is None:
        return NewtonState(a, v, compression, force, tangent, _NONE, gradient, _NONE)
    unbalance, behind = columns.law(v)
    unbalance -= np.add.reduceat(force, columns.starts)
    return NewtonState(a, v, compression, force, tangent, behind, gradient, unbalance)


def _is_at_rest(problem: PlateProblem, state: NewtonState, tolerance: float) -> bool:
    """Tell whether what is left of the forces is below tolerance or rounding."""
    # Three numbers are sooner done without arrays.
    moved: list[float] = [abs(a) for a in state.a.tolist()]
    turned = max(k * a for k, a in zip(problem.K.tolist(), moved, strict=True))
    # No lever is longer than 1, so the sum of forces bounds all three.
    scale = max(float(state.force.sum()), turned, *map(abs, problem.f.tolist()))
    # A tip in touch lies no deeper than the plate went, so that bounds what was rounded.
    stiffness = float(state.tangent.sum())
    allowed: float = tolerance * scale + 8 * EPS * (2 * stiffness * sum(moved) + turned)
    if not all(abs(left) <= allowed for left in state.gradient.tolist()):
        return False
    return float(np.abs(state.unbalance).max(initial=0.0)) <= allowed


def _step(problem: PlateProblem, state: NewtonState) -> tuple[Array, Array]:
    """Return Newton's step, or the way down the null space of a singular system."""
    columns = problem.columns
    weighted = problem.rows * state.tangent
    system = weighted @ problem.rows.T
    np.fill_diagonal(system, system.diagonal() + problem.K)
    wanted = -state.gradient
    if columns is None:
        return _solve_scaled(system, wanted), _NONE
    sums = np.add.reduceat(weighted, columns.starts, axis=1)
    # The rows' first is 1, so the first sums are those of the tangents.
    pivots = 1.0 / (state.behind + sums[0])
    eliminated = sums * pivots
    step = _solve_scaled(system - eliminated @ sums.T, wanted - eliminated @ state.unbalance)
    return step, step @ eliminated - pivots * state.unbalance


def _solve_scaled(system: Array, wanted: Array) -> Array:
    """Solve the scaled system; where it is singular go down the null space, if that is down."""
    rows = system.tolist()
    size = [row[i] for i, row in enumerate(rows)]
    largest = max(*size, 1e-300)
    scale = [1 / math.sqrt(own if own > 1e-30 * largest else largest) for own in size]
    scaled = [[v * b * a for v, b in zip(row, scale, strict=True)]
              for row, a in zip(rows, scale, strict=True)]  # fmt: skip
    right = [w * a for w, a in zip(wanted.tolist(), scale, strict=True)]
    quick = _eliminate([row[:] for row in scaled], right[:])
    if quick is not None:
        return np.array([v * a for v, a in zip(quick, scale, strict=True)])
    values, vectors = np.linalg.eigh(scaled)
    regular = values > PLATE_NEWTON.singular * max(float(values[-1]), 1e-300)
    along = np.array(right) @ vectors
    if not regular.all() and np.abs(along[~regular]).max() > 1e-9 * np.abs(along).max():
        return np.asarray(scale * (vectors[:, ~regular] @ along[~regular]))
    return np.asarray(scale * (vectors[:, regular] @ (along[regular] / values[regular])))


def _eliminate(system: list[list[float]], right: list[float]) -> list[float] | None:
    """Solve up to three equations of unit diagonal; None where a pivot all but vanishes."""
    m = len(right)
    for i in range(m):
        pivot = system[i][i]
        if not pivot > PLATE_NEWTON.pivot:
            return None
        for k in range(i + 1, m):
            factor = system[k][i] / pivot
            for j in range(i, m):
                system[k][j] -= factor * system[i][j]
            right[k] -= factor * right[i]
    for i in reversed(range(m)):
        for j in range(i + 1, m):
            right[i] -= system[i][j] * right[j]
        right[i] /= system[i][i]
    return right


def _search_line(problem: PlateProblem, state: NewtonState, da: Array, dv: Array) -> NewtonState:
    """Return the state along a step where the slope has all but vanished."""
    rate = da @ problem.rows
    if problem.columns is not None:
        rate -= dv[problem.columns.of_point]
    first = float(state.gradient @ da + state.unbalance @ dv)
    low, high = 0.0, _end(problem, state, rate, dv)
    t = min(1.0, PLATE_NEWTON.near_limit * high)
    found = state
    for _ in range(PLATE_NEWTON.searches):
        found = _evaluate_at(problem, state.a + t * da, state.v + t * dv)
        slope = float(found.gradient @ da + found.unbalance @ dv)
        if (
            abs(slope)
            <= (PLATE_NEWTON.whole_slope if t == 1 else PLATE_NEWTON.searched_slope) * abs(first)
            or not low < t < high
        ):
            return found
        if slope < 0:
            low = t
        else:
            high = t
        curvature = float(
            (found.tangent * rate) @ rate + (found.behind * dv) @ dv + (problem.K * da) @ da
        )
        t = t - slope / curvature if curvature > 0 else math.inf
        if not low < t < high:
            t = 4 * low if math.isinf(high) else (low + high) / 2
    return found


def _end(problem: PlateProblem, state: NewtonState, rate: Array, dv: Array) -> float:
    """Return how far along a step the laws' limits lie."""
    fastest = 0.0
    limit = problem.law.limit_mm
    if limit < math.inf:
        fastest = float((rate / (limit - state.compression)).max())
    if problem.columns is not None and (limit := problem.columns.law.limit_mm) < math.inf:
        fastest = max(fastest, float((dv / (limit - state.v)).max()))
    return 1 / fastest if fastest > 0 else math.inf
