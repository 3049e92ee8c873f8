"""Round tabs and pads at small strain: finite elements of a section through the axis.

Displacements (u_r, u_z) over a product of lines r, z; four elements to compare:

=====  ==================================================  =============================
q1     bilinear                                            locks towards nu = .5
q2     biquadratic                                         locks a little
q1p0   bilinear, mean dilatation (one pressure in each)    to nu = .5
q2q1   biquadratic, bilinear continuous pressure           to nu = .5; the reference
=====  ==================================================  =============================

The bottom is bonded, on the axis u_r = 0, all else is free until it is held. Thesis 4.2.
mm, N, MPa. References: Hughes, The Finite Element Method, ch. 4 (B-bar and mixed elements).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray

from reference.elements_pad import Array, LineBasis, integral, line_bases

Kind = Literal["q1", "q2", "q1p0", "q2q1"]
DEGREES: dict[Kind, tuple[int, int | None]] = {
    "q1": (1, None),
    "q2": (2, None),
    "q1p0": (1, 0),
    "q2q1": (2, 1),
}
COMPRESSIBLE = 1e-7  #: 1 - 2 nu counts as at least this where a pressure is eliminated
SOFTENED = 1e-7  #: of the volume over G: added to what a pressure gives way, while factoring
REFINED = 2  #: steps towards the matrix that is not softened


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """An assembled section: unknowns u_r, then u_z (r slow, z fast), then pressures."""

    matrix: sp.csc_matrix
    r: Array  #: (m,) nodes along r, mm
    z: Array  #: (k,) nodes along z from the base up, mm
    across: LineBasis  #: shape functions along r
    ring: sp.csr_matrix  #: (m, m) integral of f_i f_j 2 pi r along r, mm^2
    softened: Array  #: (n,) what pressures give way more in the matrix that is factored

    @property
    def unknowns(self) -> int:
        """Displacements and pressures, the held ones included."""
        return int(self.matrix.shape[0])

    def radial(self, i: NDArray[np.intp] | slice, k: NDArray[np.intp] | slice) -> NDArray[np.intp]:
        """Return the unknowns u_r of nodes (i, k) of the two lines."""
        grid = np.arange(self.r.size * self.z.size).reshape(self.r.size, self.z.size)
        return np.asarray(grid[i, k]).ravel()

    def axial(self, i: NDArray[np.intp] | slice, k: NDArray[np.intp] | slice) -> NDArray[np.intp]:
        """Return the unknowns u_z of nodes (i, k)."""
        return self.radial(i, k) + self.r.size * self.z.size

    @property
    def base(self) -> NDArray[np.intp]:
        """Both displacements of the bonded base, and u_r on the axis."""
        every, first = slice(None), slice(0, 1)
        axis = self.radial(first, every) if self.r[0] == 0 else np.array([], dtype=np.intp)
        return np.unique(
            np.concatenate([self.radial(every, first), self.axial(every, first), axis])
        )

    def solved(self, held: NDArray[np.intp], values: Array) -> Array:
        """Return all unknowns (n,) or (n, k) for values (h,) or (h, k) of the held ones.

        Near nu = .5 pressures have no diagonal, and pivoting fills the factor a hundredfold. A
        little give makes the matrix quasi-definite (Vanderbei 1995): any order of pivots on its
        diagonal is stable enough, and refinement takes the give back to rounding.
        """
        free = np.ones(self.unknowns, dtype=bool)
        free[held] = False
        columns = values.reshape(held.size, -1)
        rows = self.matrix[free]
        system, right = rows[:, free], -(rows[:, held] @ columns)
        factor = sla.splu(
            sp.csc_matrix(system - sp.diags(self.softened[free])),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        answer = factor.solve(right)
        for _ in range(REFINED):
            answer += factor.solve(right - system @ answer)
        found = np.empty((self.unknowns, columns.shape[1]))
        found[held], found[free] = columns, answer
        return found.reshape(-1, *values.shape[1:])


def section(r: Array, z: Array, young: float, poisson: float, kind: Kind = "q2q1") -> Section:
    """Assemble a section between element boundaries r and z (ascending, z from 0)."""
    degree, pressure = DEGREES[kind]
    shear = young / (2 * (1 + poisson))
    degrees = (degree,) if pressure is None else (degree, pressure)
    radial, axial = line_bases(r, *degrees), line_bases(z, *degrees)
    f, g = radial[0], axial[0]
    turn = 2 * np.pi
    ring = turn * f.points
    mass = integral(lambda u, v: u * v, g, g)
    slope = integral(lambda u, v: u.grad[0] * v.grad[0], g, g)
    mixed = integral(lambda u, v: u.grad[0] * v, g, g)
    area = integral(lambda u, v: u * v, f, f, ring)
    stretch = integral(lambda u, v: u.grad[0] * v.grad[0], f, f, ring)
    hoop = integral(lambda u, v: u * v, f, f, turn / f.points)
    sheared = integral(lambda u, v: u.grad[0] * v, f, f, ring)
    rr = 2 * shear * sp.kron(stretch + hoop, mass) + shear * sp.kron(area, slope)
    zz = 2 * shear * sp.kron(area, slope) + shear * sp.kron(stretch, mass)
    rz = shear * sp.kron(sheared, mixed.T)
    softened = np.zeros(0)
    if pressure is None:
        lame = 2 * shear * poisson / (1 - 2 * poisson)
        widened = integral(lambda u, v: u.grad[0] * v, f, f, turn)
        opened = integral(lambda u, v: u * v, f, f, turn) + sheared.T
        rr = rr + lame * sp.kron(stretch + hoop + widened + widened.T, mass)
        zz = zz + lame * sp.kron(area, slope)
        rz = rz + lame * sp.kron(opened, mixed)
        matrix = sp.bmat([[rr, rz], [rz.T, zz]], format="csc")
    else:
        matrix = sp.bmat([[rr, rz], [rz.T, zz]], format="csc")
        p, q = radial[1], axial[1]
        widened = integral(lambda u, v: u.grad[0] * v, f, p, ring)
        widened = widened + integral(lambda u, v: u * v, f, p, turn)
        opened = sp.hstack(
            [
                sp.kron(widened, integral(lambda u, v: u * v, g, q)),
                sp.kron(
                    integral(lambda u, v: u * v, f, p, ring),
                    integral(lambda u, v: u.grad[0] * v, g, q),
                ),
            ]
        )
        volume = sp.kron(
            integral(lambda u, v: u * v, p, p, ring), integral(lambda u, v: u * v, q, q)
        )
        if pressure:
            give = (1 - 2 * poisson) / (2 * shear * poisson)
            matrix = sp.bmat([[matrix, opened.T], [opened, -give * volume]], format="csc")
            softened = SOFTENED / shear * volume.diagonal()
        else:  # each element's own pressure is eliminated within it
            lame = 2 * shear * poisson / max(1 - 2 * poisson, COMPRESSIBLE)
            matrix = matrix + lame * (opened.T @ sp.diags(1 / volume.diagonal()) @ opened)
    softened = np.concatenate([np.zeros(matrix.shape[0] - softened.size), softened])
    return Section(matrix.tocsc(), f.places, g.places, f, area, softened)


def apparent_modulus(
    radius: float,
    height: float,
    poisson: float,
    kind: Kind = "q2q1",
    *,
    parts: tuple[int, int],
    bonded_top: bool = True,
) -> float:
    """Return mean stress over strain of a disc of `parts` along radius and height, over E.

    Gent, Lindley (1959): near 1 + 2 S^2 bonded on both faces, S = radius / (2 height); 1 + S^2/2
    with one of them free to slide, since that is half of a disc of twice the height.
    """
    disc = section(
        np.linspace(0, radius, parts[0] + 1), np.linspace(0, height, parts[1] + 1), 1.0, poisson,
        kind,
    )  # fmt: skip
    every, last = slice(None), slice(disc.z.size - 1, None)
    top = disc.axial(every, last)
    held = np.union1d(disc.base, np.union1d(top, disc.radial(every, last) if bonded_top else top))
    found = disc.solved(held, np.where(np.isin(held, top), -height, 0.0))
    return float(-(disc.matrix[top] @ found).sum() / (np.pi * radius**2))
