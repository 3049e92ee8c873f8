"""A round indenter pressed on a round pad: the reference for every other level. Thesis 4.2.

Small strain, frictionless, unilateral: an active set over the nodes of the top, each step a
solution of the section (`elements_axisymmetric`). The stress at the base, recovered from the
reactions there by the consistent mass matrix, is integrated over the tactels' squares.
The washer of 15/7 mm on a pad larger than the sensor is the thesis's figure 4.10.
mm, N, MPa; z = 0 is the indenter's highest point.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from reference.elements_axisymmetric import Kind, Section, section
from reference.elements_pad import Array

STEPS = 60
EVEN = 24  #: Gauss points along a tactel
FAR = 0.75  #: of the thickness: elements of a pad far beside the washer


@dataclass(frozen=True, slots=True, eq=False)
class Indented:
    """A pressed pad."""

    depth_mm: float  #: of the indenter's highest point below the undeformed top
    force_n: float
    active: NDArray[np.bool_]  #: (m,) nodes of the top in touch
    top_n: Array  #: (m,) forces on the top's nodes (rings)
    base_mpa: Array  #: (m,) pressure at the base's nodes
    section: Section
    iterations: int

    @property
    def pad_force_n(self) -> float:
        """Force on the whole base."""
        return float((self.section.ring @ self.base_mpa).sum())

    def stress_mpa(self, r_mm: Array) -> Array:
        """Return the pressure at the base at radii (n,); 0 beyond the pad."""
        inside = r_mm <= self.section.r[-1]
        field = np.zeros(self.base_mpa.size)
        field[self.section.across.order] = self.base_mpa
        probes = self.section.across.basis.probes(r_mm[inside][None])
        stress = np.zeros(r_mm.size)
        stress[inside] = probes @ field
        return stress

    def tactels_n(self, sensor: SensorType, at_mm: tuple[float, float] = (0.0, 0.0)) -> Array:
        """Return the force on each tactel (rows, columns) with the axis at `at_mm`."""
        points, weights = np.polynomial.legendre.leggauss(EVEN)
        step = points * sensor.pitch_mm / 2
        x, y = np.moveaxis(sensor.centres_mm(), -1, 0)
        r = np.hypot(
            x[..., None, None] - at_mm[0] + step, y[..., None, None] - at_mm[1] + step[:, None]
        )
        stress = self.stress_mpa(r.ravel()).reshape(r.shape)
        return np.asarray(stress @ weights @ weights) * sensor.pitch_mm**2 / 4


def indented(pad: Section, height_mm: Callable[[Array], Array], force_n: float) -> Indented:
    """Press an indenter, heights (m,) <= 0 or -inf at radii (m,), on a pad with a force > 0."""
    heights = height_mm(pad.r)
    matter = np.isfinite(heights)
    every, last = slice(None), slice(pad.z.size - 1, None)
    top = pad.axial(every, last)
    active = matter & (heights >= heights[matter].max() - (pad.z[-1] / 50))
    for step in range(1, STEPS + 1):
        held = np.union1d(pad.base, top[active])
        # u_z = z - height of the touched nodes: one column for the heights, one for z.
        values = np.zeros((pad.unknowns, 2))
        values[top[active], 0] = -heights[active]
        values[top[active], 1] = 1.0
        found = pad.solved(held, values[held])
        press = -(pad.matrix[top] @ found)
        z = (force_n - press[:, 0].sum()) / press[:, 1].sum()
        moved, forces = found @ [1.0, z], np.where(active, press @ [1.0, z], 0.0)
        gap = z - heights - moved[top]
        following = np.where(active, forces > 0, gap < 0) & matter
        # A quadratic ring on the axis bears nothing: it does what its neighbour does.
        following[0] = following[1] & matter[0]
        if (following == active).all():
            base = pad.axial(every, slice(0, 1))
            reactions = pad.matrix[base] @ moved
            pressure = sla.spsolve(sp.csc_matrix(pad.ring), reactions)
            return Indented(-z, force_n, active, forces, pressure, pad, step)
        active = following
    raise ArithmeticError(f"no set of touching nodes after {STEPS} steps")


def washer_pad(
    inner_mm: float,
    outer_mm: float,
    thickness_mm: float,
    young: float,
    poisson: float,
    *,
    parts: int,
    radius_mm: float = 25.0,
    kind: Kind = "q2q1",
) -> Section:
    """Return a round pad with a mesh for a washer: fine at both of its edges, and at the top.

    `parts` elements lie through the thickness and across the hole; across the washer 1.3 as many.
    The pad reaches more than three thicknesses beyond the washer.
    """
    wide, n = outer_mm + 3 * thickness_mm, parts
    more = round(1.3 * n)
    far = max(4, math.ceil((radius_mm - wide) / (FAR * thickness_mm)))
    r = np.concatenate(
        [
            _both(0, inner_mm, n),
            _both(inner_mm, outer_mm, more)[1:],
            outer_mm + (wide - outer_mm) * np.linspace(0, 1, more + 1)[1:] ** 2.2,
            np.linspace(wide, radius_mm, far + 1)[1:],
        ]
    )
    z = thickness_mm * (1 - (1 - np.linspace(0, 1, n + 1)) ** 1.6)
    return section(r, z, young, poisson, kind)


def _both(a: float, b: float, n: int) -> Array:
    """Divide a ... b into n parts, finer towards both ends."""
    s = np.linspace(0, 1, n + 1)
    return a + (b - a) * np.where(s < 0.5, (2 * s) ** 1.6, 2 - (2 - 2 * s) ** 1.6) / 2
