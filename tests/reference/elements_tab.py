"""One tab of the overlay by finite elements at finite strain. Thesis 4.2.

A round column is bonded at its base; a rigid flat surface comes down on its top without
friction: on the whole of it (a section through the axis serves), or on the part x >= edge (half
of the tab in space serves). Against these stand the tabs' neo-Hookean law
(E/3) (lambda^-2 - lambda) and the part c (1 + 0.59 (1 - c)) that a partly covered tab bears.
mm, N, MPa.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from skfem import MeshHex, MeshQuad

from reference.elements_finite import Block, block, deformed
from reference.elements_pad import Array

STEPS = 20  #: of the set of nodes that rest beside the foot
POLE_RAD = 0.15  #: the half-disc ends there, short of x = -R and R, where elements would be wedges


@dataclass(frozen=True, slots=True)
class Tab:
    """A round column of an elastomer."""

    diameter_mm: float = 1.2666
    height_mm: float = 2.0
    young_mpa: float = 1.0
    poisson: float = 0.4999


def compressed(tab: Tab, compression_mm: ArrayLike, *, parts: int = 8) -> Array:
    """Return the force (n,), N, at compressions (n,), mm, ascending, of a wholly covered tab."""
    radius, height = tab.diameter_mm / 2, tab.height_mm
    along = max(2, round(parts * height / radius))
    mesh = MeshQuad.init_tensor(
        np.linspace(0, radius, parts + 1), np.linspace(0, height, along + 1)
    )
    part = block(mesh, tab.young_mpa, tab.poisson)
    top = np.flatnonzero(part.places[1] > height * (1 - 1e-9))
    return _pressed(part, tab, top, part.axis, np.asarray(compression_mm, float))


def partly_covered(tab: Tab, share: float, compression_mm: ArrayLike, *, parts: int = 6) -> Array:
    """Return the force (n,), N, at compressions (n,) of a tab covered to a share above 0."""
    radius = tab.diameter_mm / 2
    edge = -radius if share == 1 else radius * _chord(share)
    mesh = _half_column(radius, tab.height_mm, edge, parts)
    part = block(mesh, tab.young_mpa, tab.poisson)
    x, y, z = part.places
    on_top = z > tab.height_mm * (1 - 1e-9)
    top = np.flatnonzero(on_top & (x >= edge - 1e-9 * radius))
    plane = 3 * np.flatnonzero(y == 0) + 1
    return 2 * _pressed(part, tab, top, plane, np.asarray(compression_mm, float))


def _pressed(
    part: Block, tab: Tab, top: NDArray[np.intp], sides: NDArray[np.intp], compression: Array
) -> Array:
    """Move nodes of the top down, the base and some side-ways unknowns held.

    Beyond a third of its height a tab bulges onto the sensor beside its foot; nodes that get
    there slide on it.
    """
    d = part.places.shape[0]
    height = part.places[-1]
    base = np.flatnonzero(height == 0)
    still = np.union1d((d * base[:, None] + np.arange(d)).ravel(), sides)
    down = d * top + d - 1
    rising = np.setdiff1d(np.arange(d - 1, d * height.size, d), np.concatenate([still, down]))
    floor = -height[rising // d]
    resting = np.zeros(rising.size, dtype=bool)
    u = np.zeros(part.places.size)
    found = []
    for value in compression:
        for _ in range(STEPS):
            held = np.concatenate([still, down, rising[resting]])
            values = np.concatenate(
                [np.zeros(still.size), np.full(down.size, -value), floor[resting]]
            )
            u, forces = deformed(part, u, held, values)
            following = np.where(resting, forces[rising] > 0, u[rising] < floor)
            if (following == resting).all():
                break
            resting = following
        found.append(-forces[down].sum())
    return np.array(found)


def _chord(share: float) -> float:
    """Return where x >= edge is a share of the unit disc."""

    def excess(edge: float) -> float:
        return float(np.arccos(edge) - edge * np.sqrt(1 - edge**2)) / np.pi - share

    return float(brentq(excess, -1, 1))


def _half_column(radius: float, height: float, edge: float, parts: int) -> MeshHex:
    """Mesh the half y >= 0 of a round column, with lines of the mesh at x = edge."""
    low, cut, high = POLE_RAD - np.pi / 2, np.arcsin(edge / radius), np.pi / 2 - POLE_RAD
    if cut <= low:
        turn = np.linspace(low, high, 2 * parts + 1)
    else:
        left = max(2, round(2 * parts * (cut - low) / np.pi))
        right = max(2, round(2 * parts * (high - cut) / np.pi))
        turn = np.concatenate(
            [np.linspace(low, cut, left + 1), np.linspace(cut, high, right + 1)[1:]]
        )
    along = max(2, round(parts * height / radius))
    mesh = MeshHex.init_tensor(
        turn, np.linspace(0, 1, parts + 1), np.linspace(0, height, along + 1)
    )
    p = mesh.p.copy()
    p[0] = radius * np.sin(mesh.p[0])
    p[1] = radius * np.cos(mesh.p[0]) * mesh.p[1]
    return MeshHex(p, mesh.t)
