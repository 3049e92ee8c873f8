"""A one-piece pad by finite elements in space, its free edge included: the layer's oracle.

Small strain; the surface is rigid and without friction. A pad is condensed once (`elements_pad`)
and kept. Heights are sampled at the nodes of its top. Node i stands at
zeta_i = z + tilt_x y_i - tilt_y x_i and gives way by w_i = (C p)_i; an active set finds p >= 0 and
the plate a = (z, tilt_x, tilt_y) with

    w_i + zeta_i >= h_i,    p_i (w_i + zeta_i - h_i) = 0,
    R'p = (force, 0, 0) + K (a - a_0),    R = [1, y, -x],    K = diag(0, k_x, k_y).

mm, N, rad, sensor frame. Thesis 4.2.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Contact, Touch, heights_at
from probe.surface.contract import HeightMap
from reference.elements_pad import Array, CondensedPad, PadLines, condense

GROWTH = 1.5  # from element to element of the margin
FINER = 1.6  # elements get thinner towards the top, by this power
FIRST = 0.02  # of the height: nodes so deep in an unloaded plate's way are the first guess
MOST_STEPS = 60  # of the active set
ROUNDING = 1e-11  # of the largest displacement or stiffness


def elements(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    *,
    per_tactel: int = 2,
    layers: int = 3,
    margin_mm: float = 0.0,
) -> Contact:
    """Press a pad, held by a wrist of some stiffness, on a surface.

    `per_tactel` and `layers` are quadratic elements along a tactel and through the pad, which
    reaches `margin_mm` beyond the matrix (0: its sides are free there).
    """
    pad = _condensed_pad(sensor, per_tactel, layers, margin_mm)
    heights = heights_at(surface, touch, pad.nodes_mm)
    forces, plate, steps = _rest(pad, heights, touch, FIRST * sensor.overlay.height_mm)
    base = pad.base_forces(forces)
    pressed = np.maximum(base, 0.0)  # far from the contact the base pulls a little
    pressed *= base.sum() / pressed.sum()
    return Contact(pressed, *(float(v) for v in plate), "elements", steps)


@lru_cache(maxsize=2)
def _condensed_pad(
    sensor: SensorType, per_tactel: int, layers: int, margin_mm: float
) -> CondensedPad:
    overlay, pitch = sensor.overlay, sensor.pitch_mm
    lines = PadLines(
        _element_boundaries(sensor.columns, pitch, per_tactel, margin_mm),
        _element_boundaries(sensor.rows, pitch, per_tactel, margin_mm),
        overlay.height_mm * (1 - (1 - np.linspace(0, 1, layers + 1)) ** FINER),
    )
    edges = _edges(sensor.columns, pitch), _edges(sensor.rows, pitch)
    return condense(lines, overlay.young_mpa, overlay.poisson, edges)


def _edges(tactels: int, pitch: float) -> Array:
    return np.asarray((np.arange(tactels + 1) - tactels / 2) * pitch, dtype=np.float64)


def _element_boundaries(tactels: int, pitch: float, per_tactel: int, margin: float) -> Array:
    """Return element boundaries from 0 to the pad's edge: tactels divided, then the margin."""
    edges = _edges(tactels, pitch)
    firm = np.unique(np.append(edges[edges >= 0], 0.0))
    parts = np.ceil(np.diff(firm) / pitch * per_tactel - 1e-9).astype(int)
    lines: Array = np.interp(
        np.arange(parts.sum() + 1), np.concatenate([[0], np.cumsum(parts)]), firm
    )
    if margin > 0:
        size = pitch / per_tactel
        count = max(1, math.ceil(math.log1p(margin / size * (GROWTH - 1)) / math.log(GROWTH)))
        steps = np.cumsum(GROWTH ** np.arange(count))
        lines = np.concatenate([lines, lines[-1] + margin * steps / steps[-1]])
    return lines


def _rest(
    pad: CondensedPad, heights_mm: Array, touch: Touch, depth_mm: float
) -> tuple[Array, Array, int]:
    """Return the nodes' forces (n,), the plate (z, tilt_x, tilt_y) and the steps taken."""
    x, y = pad.nodes_mm.T
    lever = np.stack([np.ones_like(x), y, -x], axis=-1)
    hold = np.array([0.0, touch.wrist.tilt_x_nmm_rad, touch.wrist.tilt_y_nmm_rad])
    load = np.array([touch.force_n, 0.0, 0.0])
    unloaded = np.array([0.0, touch.tilt_x_rad, touch.tilt_y_rad])
    clear = heights_mm - lever @ unloaded
    active = clear >= clear.max() - depth_mm
    for step in range(1, MOST_STEPS + 1):
        forces, plate = _solve_active(pad, active, heights_mm, lever, hold, hold * unloaded - load)
        given = pad.displaced(forces)
        gap = given + lever @ plate - heights_mm
        gap[np.abs(gap) <= ROUNDING * np.abs(given).max()] = 0.0
        following = (forces > 0) | (gap < 0)
        if (following == active).all():
            return forces, plate, step
        active = following
    raise ArithmeticError(f"no equilibrium within {MOST_STEPS} steps")


def _solve_active(
    pad: CondensedPad, active: NDArray[np.bool_], heights: Array, lever: Array, hold: Array,
    held: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Return forces and plate with the gap closed at the active nodes, whatever the signs."""
    nodes = np.flatnonzero(active)
    lever = lever[nodes]
    factor = la.cho_factor(pad.between(nodes), lower=True, overwrite_a=True)
    answers = la.cho_solve(factor, np.column_stack([heights[nodes], lever]))
    foundation = lever.T @ answers[:, 1:] + np.diag(hold)
    plate = np.linalg.solve(foundation, lever.T @ answers[:, 0] + held)
    forces = np.zeros(active.size)
    forces[nodes] = answers[:, 0] - answers[:, 1:] @ plate
    return forces, plate
