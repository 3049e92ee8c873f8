"""Where a rigid plate comes to rest on elastic tips, held by a compliant wrist. Thesis 4.2.

Points (mm, plate frame) with the height of what lies under them, a force law for the tips,
and a load -> pose of the plate and force at every point. The unknowns are the advance and
the turns, a = -(z, L tilt_x, L tilt_y), measured from first touch and from how the unloaded
wrist stands; L is half the width, so that the three are of one size. With the rows
R = [1, y/L, -x/L] a point is pressed by R a + h, and the plate rests where

    Phi(a) = sum psi((R a + h)+) + a'K a / 2 - f'a

is least: convex, with a continuous gradient, for every law whose force rises. Points may
stand in groups (the tip of one tab) on a common column: then its compression v takes part,
psi((R a + h - v)+) + Psi(v), and is eliminated group by group: the system stays 3x3.

Method: semismooth Newton with a line search (`plate_newton`). With K = 0 and the centre of
pressure outside the hull of all tips there is no rest: the plate tips over.

References
----------
L. Qi, J. Sun, "A nonsmooth version of Newton's method", Math. Programming 58 (1993) 353-367.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Touch, WristStiffness
from probe.contact.neo_hooke import Law
from probe.contact.plate_newton import Columns, PlateProblem, newton
from probe.contact.settings import PLATE, PLATE_NEWTON
from probe.errors import ContactError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlateLoad:
    """What acts on the plate at the centre of its frame."""

    force_n: float  #: along -z
    wrist: WristStiffness = field(default_factory=WristStiffness)  #: inf holds a turn fast
    tilt_x_rad: float = 0.0  #: how the unloaded wrist stands
    tilt_y_rad: float = 0.0
    moment_x_nmm: float = 0.0
    moment_y_nmm: float = 0.0


@dataclass(frozen=True, slots=True)
class PlatePose:
    """Where the plate stands."""

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


def load_of(touch: Touch) -> PlateLoad:
    """Return what a touch asks of the plate."""
    return PlateLoad(touch.force_n, touch.wrist, touch.tilt_x_rad, touch.tilt_y_rad)


def rest(
    points_mm: Array,
    heights_mm: Array,
    law: Law,
    load: PlateLoad,
    *,
    columns: Columns | None = None,
    foreseen: PlatePose | None = None,
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
    load
        Force, moments and wrist.
    columns
        What stands behind the tips; none: they are fixed to the plate.
    foreseen
        About where the plate comes to rest, to begin there; columns are foreseen by their
        own field.
    tolerance
        Largest residual force, as a share of the forces that balance.

    Raises
    ------
    ContactError
        For a load that is no number or negative, nothing under the plate, a plate that
        tips, or no convergence.
    """
    checked_load(load)
    if load.force_n == 0:
        free = PlatePose(math.inf, load.tilt_x_rad, load.tilt_y_rad)
        return PlateRest(free, np.zeros(heights_mm.shape), 0)
    if not heights_mm.max(initial=-math.inf) > -math.inf:
        raise ContactError(
            f"there is nothing under the plate to bear {load.force_n:g} N",
            fix="move the sensor over the object",
        )
    problem = _pose_problem(points_mm, heights_mm, law, columns, load)
    state, iterations = newton(problem, _unknowns(problem, load, foreseen), tolerance)
    a = np.zeros(3)
    a[problem.free] = state.a
    half = problem.half_mm
    pose = PlatePose(
        z_mm=problem.datum_mm - float(a[0]),
        tilt_x_rad=load.tilt_x_rad - float(a[1]) / half,
        tilt_y_rad=load.tilt_y_rad - float(a[2]) / half,
    )
    if iterations is None:
        raise _no_rest_error(pose, load)
    return PlateRest(pose, state.force, iterations)


def _no_rest_error(pose: PlatePose, load: PlateLoad) -> ContactError:
    turned = math.hypot(pose.tilt_x_rad - load.tilt_x_rad, pose.tilt_y_rad - load.tilt_y_rad)
    if turned > PLATE.far_turned_rad:
        return ContactError(
            f"the plate tips: turned by {math.degrees(turned):.3g} degrees it still finds no rest",
            fix="move the sensor, press with less force, or take a stiffer wrist",
        )
    return ContactError(
        f"no equilibrium within {PLATE_NEWTON.most_steps} steps",
        fix="report the scene; a wrist with some stiffness helps",
    )


def checked_load(load: PlateLoad) -> None:
    """Refuse a load that is no number, presses upward, or is held by less than nothing."""
    given = (load.force_n, load.tilt_x_rad, load.tilt_y_rad, load.moment_x_nmm, load.moment_y_nmm)
    if not all(map(math.isfinite, given)) or load.force_n < 0:
        raise ContactError(
            f"a load of {load.force_n:g} N, moments {load.moment_x_nmm:g} and "
            f"{load.moment_y_nmm:g} N mm, tilts {load.tilt_x_rad:g} and {load.tilt_y_rad:g} rad; "
            "all must be finite and the force not negative",
            fix="press with a force >= 0",
        )
    if load.force_n == 0 and (load.moment_x_nmm or load.moment_y_nmm):
        raise ContactError(
            f"moments of {load.moment_x_nmm:g} and {load.moment_y_nmm:g} N mm without a force",
            fix="press with a force, too",
        )
    stiffness = (load.wrist.tilt_x_nmm_rad, load.wrist.tilt_y_nmm_rad)
    if not min(stiffness) >= 0 or math.isnan(max(stiffness)):
        raise ContactError(
            f"a wrist of {stiffness[0]:g} and {stiffness[1]:g} N mm/rad; both must be >= 0",
            fix="give stiffness 0 for a free wrist, inf for a rigid one",
        )


def _pose_problem(
    points: Array, heights: Array, law: Law, columns: Columns | None, load: PlateLoad
) -> PlateProblem:
    x, y = points.T
    half = float(np.abs(points).max()) or 1.0
    stiffness = np.array([0.0, load.wrist.tilt_x_nmm_rad, load.wrist.tilt_y_nmm_rad])
    free = np.flatnonzero(np.isfinite(stiffness))
    level = heights - load.tilt_x_rad * y + load.tilt_y_rad * x
    datum = float(level.max())
    f = np.array([load.force_n, -load.moment_x_nmm / half, -load.moment_y_nmm / half])
    if (stiffness[free[1:]] == 0).any():
        _require_stable(points[heights > -math.inf] / half, stiffness, f, half)
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
        f=f[free],
        free=free,
        half_mm=half,
        datum_mm=datum,
    )


def _require_stable(points: Array, stiffness: Array, f: Array, half: float) -> None:
    """Refuse a load whose centre of pressure no tips can bear, as the wrist does not hold."""
    at = np.array([-f[2], f[1]]) / f[0]  # x and y, of the half width
    free_x, free_y = stiffness[2] == 0, stiffness[1] == 0  # a turn about y moves it along x
    if free_x and free_y:
        stands = _within_hull(points, at, PLATE.slack)
    else:
        along = 0 if free_x else 1
        low, high = points[:, along].min(), points[:, along].max()
        stands = bool(low - PLATE.slack <= at[along] <= high + PLATE.slack)
    if not stands:
        low, high = points.min(axis=0) * half, points.max(axis=0) * half
        raise ContactError(
            f"the plate tips: its centre of pressure ({at[0] * half:.4g}, {at[1] * half:.4g}) mm "
            f"lies outside the hull of the tips that have something under them, x "
            f"{low[0]:.4g} ... {high[0]:.4g} mm and y {low[1]:.4g} ... {high[1]:.4g} mm, and the "
            "wrist does not hold it",
            fix="move the sensor, or give the wrist a stiffness",
        )


def _within_hull(points: Array, at: Array, slack: float) -> bool:
    """Tell whether a place lies in the convex hull: seen from it no gap is wider than pi."""
    away = points - at
    far = np.abs(away).max(axis=1) > slack
    if not far.all():
        return True
    angles = np.sort(np.arctan2(away[:, 1], away[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2 * math.pi)
    return bool(gaps.max() <= math.pi + 1e-9)


def _unknowns(problem: PlateProblem, load: PlateLoad, pose: PlatePose | None) -> Array:
    """Return the unknowns of a pose, by default first touch."""
    if pose is None:
        return np.zeros(len(problem.f))
    turns = (load.tilt_x_rad - pose.tilt_x_rad, load.tilt_y_rad - pose.tilt_y_rad)
    whole = (problem.datum_mm - pose.z_mm, *(turn * problem.half_mm for turn in turns))
    return np.array(whole)[problem.free]
