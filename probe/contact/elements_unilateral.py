"""A rigid surface pressed on a pad's nodes without friction, by a plate on a compliant wrist.

Node i stands at zeta_i = z + tilt_x y_i - tilt_y x_i and gives way by w_i = (C p)_i. Wanted are
p >= 0 and the plate a = (z, tilt_x, tilt_y) with

    w_i + zeta_i >= h_i,    p_i (w_i + zeta_i - h_i) = 0,
    R'p = (force, 0, 0) + K (a - a_0),    R = [1, y, -x],    K = diag(0, k_x, k_y),

a strictly convex problem in p. It is solved by a primal-dual active set; should that come back
to a set that it has seen, by exchanging one node at a time along feasible p, which always ends.
mm, N, rad.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray
from scipy.optimize import nnls

from probe.contact.contract import Touch
from probe.errors import ContactError

Array = NDArray[np.float64]

MOST_STEPS = 60  # of the active set before nodes are exchanged one by one
FLOOR = 1e-11  # of the largest displacement or stiffness: rounding
FIRM = 1e4  # weight of an equation of equilibrium against the compliance
LOOSE = 1e-6  # of the largest force or gap: accuracy that the exchange must reach


@dataclass(frozen=True, slots=True, eq=False)
class UnilateralSolution:
    """Forces of the nodes, and the plate that they hold."""

    forces: Array  #: (n,) N
    plate: Array  #: (3,) z mm, tilt_x, tilt_y rad
    iterations: int


@dataclass(frozen=True, slots=True, eq=False)
class UnilateralProblem:
    """The problem in one place: what stays the same from set to set."""

    lever: Array  #: (n, 3) R
    heights: Array  #: (n,) mm, -inf where nothing can touch
    between: Callable[[NDArray[np.intp]], Array]  #: compliance among some nodes, mm/N
    displaced: Callable[[Array], Array]  #: w of all nodes under all forces
    load: Array  #: (3,) force and moments on the plate
    hold: Array  #: (3,) diagonal of K
    at_rest: Array  #: (3,) a_0


def rest(
    nodes_mm: Array,
    heights_mm: Array,
    between: Callable[[NDArray[np.intp]], Array],
    displaced: Callable[[Array], Array],
    touch: Touch,
    depth_mm: float,
) -> UnilateralSolution:
    """Return the equilibrium under `touch.force_n` > 0.

    Parameters
    ----------
    nodes_mm, heights_mm
        (n, 2) in the sensor frame, and (n,) of the surface there; -inf where there is none.
    between, displaced
        Compliance among k nodes as (k, k), and w (n,) under forces (n,).
    depth_mm
        Nodes that would be so deep in an unloaded plate's way are the first guess.

    Raises
    ------
    ContactError
        When nothing is under the nodes, or the plate, free to turn, tips over.
    """
    ones = np.ones(nodes_mm.shape[0])
    press = UnilateralProblem(
        lever=np.stack([ones, nodes_mm[:, 1], -nodes_mm[:, 0]], axis=-1),
        heights=heights_mm,
        between=between,
        displaced=displaced,
        load=np.array([touch.force_n, 0.0, 0.0]),
        hold=np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad]),
        at_rest=np.array([0.0, touch.tilt_x_rad, touch.tilt_y_rad]),
    )
    matter = np.isfinite(heights_mm)
    if not matter.any():
        raise ContactError(
            f"{touch.force_n:g} N press, but nothing lies under the pad",
            fix="move the touch over the surface",
        )
    _require_stable(press, matter)
    clear = heights_mm - press.lever @ press.at_rest
    active = matter & (clear >= clear[matter].max() - depth_mm)
    seen: set[bytes] = set()
    for step in range(1, MOST_STEPS + 1):
        seen.add(np.packbits(active).tobytes())
        forces, plate = _solve_active(press, active)
        following = (forces > 0) | (_gap(press, forces, plate) < 0)
        following &= matter
        if (following == active).all():
            return UnilateralSolution(forces, plate, step)
        active = following
        if np.packbits(active).tobytes() in seen:
            break
    return _solve_by_exchange(press, matter, step)


def _solve_active(press: UnilateralProblem, active: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return forces and plate with the gap closed at the active nodes, whatever the signs."""
    nodes = np.flatnonzero(active)
    lever = press.lever[nodes]
    factor = la.cho_factor(press.between(nodes), lower=True, overwrite_a=True)
    answers = la.cho_solve(factor, np.column_stack([press.heights[nodes], lever]))
    foundation = lever.T @ answers[:, 1:] + np.diag(press.hold)
    right = lever.T @ answers[:, 0] - press.load + press.hold * press.at_rest
    # A set that holds no tilt (one node, a row) leaves it where it is: the least of solutions.
    scale = 1 / np.sqrt(np.diag(foundation).clip(np.finfo(float).tiny))
    even = foundation * scale[:, None] * scale
    values, vectors = np.linalg.eigh((even + even.T) / 2)
    firm = values > FLOOR * values[-1]
    inverse = vectors[:, firm] / values[firm] @ vectors[:, firm].T
    plate = scale * (inverse @ (scale * right))
    forces = np.zeros(active.size)
    forces[nodes] = answers[:, 0] - answers[:, 1:] @ plate
    return forces, plate


def _gap(press: UnilateralProblem, forces: Array, plate: Array) -> Array:
    """Return w + zeta - h of all nodes, mm; zero within rounding where forces close it."""
    given = press.displaced(forces)
    gap = given + press.lever @ plate - press.heights
    finite = np.isfinite(gap)
    gap[finite & (np.abs(gap) <= FLOOR * np.abs(given).max())] = 0.0
    return gap


def _require_stable(press: UnilateralProblem, matter: NDArray[np.bool_]) -> None:
    """Refuse a plate that no wrist holds, and whose centre no matter surrounds."""
    y, x = press.lever[matter, 1], -press.lever[matter, 2]
    about_x, about_y = press.hold[1:] > 0
    if about_x and about_y:
        return
    if about_x or about_y:
        across = x if about_x else y
        stands = across.min() <= 0 <= across.max()
    else:
        angles = np.sort(np.arctan2(y, x))
        turns = np.diff(np.append(angles, angles[0] + 2 * np.pi))
        stands = bool((turns <= np.pi * (1 + FLOOR)).all()) or bool((np.hypot(x, y) == 0).any())
    if not stands:
        raise tips()


def tips() -> ContactError:
    """Return the refusal of a plate without an equilibrium."""
    return ContactError(
        "the plate tips: nothing holds its tilt, and its centre is not over what it touches",
        fix="give the wrist a tilt stiffness above 0, or move the touch over the surface",
    )


def _solve_by_exchange(
    press: UnilateralProblem, matter: NDArray[np.bool_], steps: int
) -> UnilateralSolution:
    """Solve the same problem as non-negative least squares, one node in or out at a time."""
    nodes = np.flatnonzero(matter)
    lever = press.lever[nodes]
    matrix = press.between(nodes)
    root = la.cholesky(matrix, lower=True)
    reach = np.abs(lever).max(axis=0).clip(np.finfo(float).tiny)
    firm = FIRM * np.sqrt(np.diag(matrix).max()) / reach
    weight = np.where(press.hold > 0, 1 / np.sqrt(press.hold.clip(1e-300)), firm)
    clear = press.heights[nodes] - lever @ press.at_rest
    forces = np.zeros(matter.size)
    forces[nodes], _ = nnls(
        np.vstack([root.T, weight[:, None] * lever.T]),
        np.concatenate([la.solve_triangular(root, clear, lower=True), weight * press.load]),
        maxiter=20 * nodes.size,
    )
    forces, plate = _solve_active(press, forces > 0)
    gap = _gap(press, forces, plate)[matter]
    if forces.min() < -LOOSE * forces.max() or gap.min() < -LOOSE * np.abs(plate[0] - clear).max():
        raise tips()
    return UnilateralSolution(forces, plate, steps + int(np.count_nonzero(forces)))
