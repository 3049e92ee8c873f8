"""Rest of a rigid plate on elastic tips, held by a compliant wrist. Thesis 4.2.

Points (mm, plate frame) with the height of the surface under them, a force law for the tips,
and a touch -> pose of the plate and force at every point. The unknowns are the advance and
the turns, a = -(z, L tilt_x, L tilt_y), measured from first touch and from the tilt of the
unloaded wrist; L is half the width, which makes the three of one size. With the rows
R = [1, y/L, -x/L] a point is pressed by R a + h, and the plate rests where

    Phi(a) = sum psi((R a + h)+) + a'K a / 2 - f'a

is least: convex, with a continuous gradient, for every law whose force rises. Points may
stand in groups (the tip of one tab) on a common column: then its compression v takes part,
psi((R a + h - v)+) + Psi(v), and is eliminated group by group: the system stays 3x3.

Method: semismooth Newton with a line search (every slope along a step rises, so one sign tells
which side to search). The 3x3 system is scaled to a unit diagonal; where it is singular and the
load is not balanced, the step goes down the null space to the next tip. Steps stay short of the
laws' limits. With K = 0 and the centre outside the hull of all tips there is no rest.

References: L. Qi, J. Sun, "A nonsmooth version of Newton's method", Math. Programming 58 (1993)
353-367.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch
from probe.contact.neo_hooke import Law
from probe.errors import ContactError

Array = NDArray[np.float64]

FAR_TURNED_RAD = 0.2  # beyond, the message says that the plate tips
HULL_SLACK = 1e-12  # of the half width, by which a centre of pressure may miss the hull
MOST_STEPS = 100  # of Newton's method
SINGULAR = 1e-14  # eigenvalue of the scaled system, of the largest
LEAST_PIVOT = 1e-6  # of the scaled system, below which its eigenvalues are computed
NEAR_LIMIT = 0.95  # share of the way to a law's limit that one step may go
WHOLE_SLOPE = 0.5  # of the first slope that a whole step may leave
SEARCHED_SLOPE = 0.1  # of the first slope that a searched step may leave
MOST_SEARCHES = 200  # lengths tried for one step
EPS = float(np.finfo(np.float64).eps)
_NONE = np.zeros(0)


@dataclass(frozen=True, slots=True)
class PlatePose:
    """Pose of the plate."""

    z_mm: float  #: height of its centre over the surface frame
    tilt_x_rad: float
    tilt_y_rad: float

    def heights_mm(self, points_mm: Array) -> Array:
        """Return the height (...) of the plate over points (..., 2) of its frame."""
        heights: Array = points_mm @ np.array([-self.tilt_y_rad, self.tilt_x_rad])
        heights += self.z_mm
        return heights


@dataclass(frozen=True, slots=True, eq=False)
class PlateRest:
    """The plate at rest."""

    pose: PlatePose
    forces_n: Array  #: (n,) at every point
    iterations: int


def rest(
    points_mm: Array,
    heights_mm: Array,
    law: Law,
    touch: Touch,
    *,
    columns: Columns | None = None,
    start: PlatePose | None = None,
    tolerance: float = 1e-12,
) -> PlateRest:
    """Return where the plate comes to rest.

    Parameters
    ----------
    points_mm
        (n, 2) x and y of the tips, plate frame.
    heights_mm
        (n,) height under each tip, surface frame; -inf where there is nothing. A tip that is
        shorter than the others sees its surface lower by as much.
    law
        Of the tips, called with compressions (n,).
    touch
        Force, tilt and wrist; a stiffness of inf holds a turn fast.
    columns
        What stands behind the tips; none: they are fixed to the plate.
    start
        Predicted pose, to begin there; that of columns is their own field.
    tolerance
        Largest residual force, as a share of the forces that balance.

    Raises
    ------
    ContactError
        For a load that is no number or negative, nothing under the plate, a plate that
        tips, or no convergence.
    """
    check_load(touch)
    if touch.force_n == 0:
        free = PlatePose(math.inf, touch.tilt_x_rad, touch.tilt_y_rad)
        return PlateRest(free, np.zeros(heights_mm.shape), 0)
    if not heights_mm.max(initial=-math.inf) > -math.inf:
        raise ContactError(
            f"there is nothing under the plate to bear {touch.force_n:g} N",
            fix="move the sensor over the object",
        )
    problem = _pose_problem(points_mm, heights_mm, law, columns, touch)
    state, iterations = newton(problem, _unknowns(problem, touch, start), tolerance)
    a = np.zeros(3)
    a[problem.free] = state.a
    half = problem.half_mm
    pose = PlatePose(
        z_mm=problem.datum_mm - float(a[0]),
        tilt_x_rad=touch.tilt_x_rad - float(a[1]) / half,
        tilt_y_rad=touch.tilt_y_rad - float(a[2]) / half,
    )
    if iterations is None:
        raise _no_rest(pose, touch)
    return PlateRest(pose, state.force, iterations)


def _no_rest(pose: PlatePose, touch: Touch) -> ContactError:
    turned = math.hypot(pose.tilt_x_rad - touch.tilt_x_rad, pose.tilt_y_rad - touch.tilt_y_rad)
    if turned > FAR_TURNED_RAD:
        return ContactError(
            f"the plate tips: turned by {math.degrees(turned):.3g} degrees it still finds no rest",
            fix="move the sensor, press with less force, or take a stiffer wrist",
        )
    return ContactError(
        f"no equilibrium within {MOST_STEPS} steps",
        fix="report the scene; a wrist with some stiffness helps",
    )


def check_load(touch: Touch) -> None:
    """Refuse a load that is no number, presses upward, or is held by less than nothing."""
    given = (touch.force_n, touch.tilt_x_rad, touch.tilt_y_rad)
    if not all(map(math.isfinite, given)) or touch.force_n < 0:
        raise ContactError(
            f"a load of {touch.force_n:g} N, tilts {touch.tilt_x_rad:g} and "
            f"{touch.tilt_y_rad:g} rad; all must be finite and the force not negative",
            fix="press with a force >= 0",
        )
    stiffness = (touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad)
    if not min(stiffness) >= 0 or math.isnan(max(stiffness)):
        raise ContactError(
            f"a wrist of {stiffness[0]:g} and {stiffness[1]:g} N mm/rad; both must be >= 0",
            fix="give stiffness 0 for a free wrist, inf for a rigid one",
        )


def _pose_problem(
    points: Array, heights: Array, law: Law, columns: Columns | None, touch: Touch
) -> PlateProblem:
    x, y = points.T
    half = float(np.abs(points).max()) or 1.0
    stiffness = np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad])
    free = np.flatnonzero(np.isfinite(stiffness))
    level = heights - touch.tilt_x_rad * y + touch.tilt_y_rad * x
    datum = float(level.max())
    if (stiffness[free[1:]] == 0).any():
        _require_stable(points[heights > -math.inf], stiffness, half)
    rows = np.empty((3, len(heights)))
    rows[0] = 1.0
    np.divide(y, half, out=rows[1])
    np.divide(x, -half, out=rows[2])
    return PlateProblem(
        rows=rows if len(free) == 3 else rows[free],
        heights=level - datum,
        law=law,
        columns=columns,
        K=stiffness[free] / half**2,
        f=np.array([touch.force_n, 0.0, 0.0])[free],
        free=free,
        half_mm=half,
        datum_mm=datum,
    )


def _require_stable(points_mm: Array, stiffness: Array, half: float) -> None:
    """Refuse a plate whose centre no tips surround, as the wrist does not hold it."""
    points = points_mm / half
    free_x, free_y = stiffness[2] == 0, stiffness[1] == 0  # a turn about y moves it along x
    if free_x and free_y:
        stands = _surround(points)
    else:
        along = 0 if free_x else 1
        low, high = points[:, along].min(), points[:, along].max()
        stands = bool(low <= HULL_SLACK and high >= -HULL_SLACK)
    if not stands:
        low, high = points_mm.min(axis=0), points_mm.max(axis=0)
        raise ContactError(
            "the plate tips: its centre lies outside the hull of the tips that have something "
            f"under them, x {low[0]:.4g} ... {high[0]:.4g} mm and y {low[1]:.4g} ... "
            f"{high[1]:.4g} mm, and the wrist does not hold it",
            fix="move the sensor, or give the wrist a stiffness",
        )


def _surround(points: Array) -> bool:
    """Tell whether the origin lies in the convex hull: seen from it no gap is wider than pi."""
    if not (np.abs(points).max(axis=1) > HULL_SLACK).all():
        return True
    angles = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2 * math.pi)
    return bool(gaps.max() <= math.pi + 1e-9)


def _unknowns(problem: PlateProblem, touch: Touch, pose: PlatePose | None) -> Array:
    """Return the unknowns of a pose, by default first touch."""
    if pose is None:
        return np.zeros(len(problem.f))
    turns = (touch.tilt_x_rad - pose.tilt_x_rad, touch.tilt_y_rad - pose.tilt_y_rad)
    whole = (problem.datum_mm - pose.z_mm, *(turn * problem.half_mm for turn in turns))
    return np.array(whole)[problem.free]


@dataclass(frozen=True, slots=True, eq=False)
class Columns:
    """Common columns: each bears the points of one group, which follow one another."""

    law: Law
    starts: NDArray[np.intp]  #: (g,) first point of each group
    of_point: NDArray[np.intp]  #: (n,) group of each point
    start_mm: Array  #: (g,) predicted compression


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
    """State of plate and columns, and their imbalance."""

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
    for iteration in range(MOST_STEPS + 1):
        if _is_at_rest(problem, state, tolerance):
            return state, iteration
        state = _search_line(problem, state, *_step(problem, state))
    return state, None


def _first_state(problem: PlateProblem, a: Array) -> NewtonState:
    """Return the state to begin with: the unknowns, withdrawn to within the laws' limits."""
    columns, limit = problem.columns, problem.law.length_mm
    whole = limit if columns is None else limit + columns.law.length_mm
    pressed = a @ problem.rows + problem.heights
    deepest = float(pressed.max())
    # At least a trace of contact, at most nearly the limit.
    least = 1e-9 * (1.0 if math.isinf(whole) else whole)
    back = min(max(least - deepest, 0.0), NEAR_LIMIT * whole - deepest)
    a[0] += back
    if columns is None:
        return _evaluate_at(problem, a, _NONE)
    v = np.maximum.reduceat(pressed, columns.starts) + (back - NEAR_LIMIT * limit)
    v = np.maximum(columns.start_mm, v)
    return _evaluate_at(problem, a, np.minimum(v, NEAR_LIMIT * columns.law.length_mm))


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
    regular = values > SINGULAR * max(float(values[-1]), 1e-300)
    along = np.array(right) @ vectors
    if not regular.all() and np.abs(along[~regular]).max() > 1e-9 * np.abs(along).max():
        return np.asarray(scale * (vectors[:, ~regular] @ along[~regular]))
    return np.asarray(scale * (vectors[:, regular] @ (along[regular] / values[regular])))


def _eliminate(system: list[list[float]], right: list[float]) -> list[float] | None:
    """Solve up to three equations of unit diagonal; None where a pivot all but vanishes."""
    m = len(right)
    for i in range(m):
        pivot = system[i][i]
        if not pivot > LEAST_PIVOT:
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
    t = min(1.0, NEAR_LIMIT * high)
    found = state
    for _ in range(MOST_SEARCHES):
        found = _evaluate_at(problem, state.a + t * da, state.v + t * dv)
        slope = float(found.gradient @ da + found.unbalance @ dv)
        if (
            abs(slope) <= (WHOLE_SLOPE if t == 1 else SEARCHED_SLOPE) * abs(first)
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
    limit = problem.law.length_mm
    if limit < math.inf:
        fastest = float((rate / (limit - state.compression)).max())
    if problem.columns is not None and (limit := problem.columns.law.length_mm) < math.inf:
        fastest = max(fastest, float((dv / (limit - state.v)).max()))
    return 1 / fastest if fastest > 0 else math.inf
