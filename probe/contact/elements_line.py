"""Elements along a line: the factors of Kronecker products.

A mesh that is the product of lines needs no assembly in space: each of its matrices is a sum of
products of matrices along the lines. Nodes ascend, the middle ones of quadratic elements
included. Lengths in mm.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, BilinearForm, ElementLineP0, ElementLineP1, ElementLineP2, MeshLine

Array = NDArray[np.float64]

ELEMENTS = (ElementLineP0, ElementLineP1, ElementLineP2)
POINTS = {0: 3, 1: 3, 2: 5}  #: order of the quadrature by order of the displacement


@dataclass(frozen=True, slots=True, eq=False)
class LineBasis:
    """Shape functions of one order on a line."""

    basis: Any
    order: NDArray[np.intp]  #: of the basis's unknowns along the line

    @property
    def places(self) -> Array:
        """Nodes, or middles of the elements, (n,), ascending."""
        places: Array = self.basis.doflocs[0][self.order]
        return places

    @property
    def points(self) -> Array:
        """Points of the quadrature, (elements, points)."""
        points: Array = np.array(self.basis.global_coordinates()[0])
        return points


def line_bases(boundaries: Array, *degrees: int) -> tuple[LineBasis, ...]:
    """Return shape functions of some degrees (0 ... 2) over elements between boundaries.

    All share the quadrature of the first.
    """
    mesh = MeshLine(np.asarray(boundaries, dtype=np.float64))
    basis = Basis(mesh, ELEMENTS[degrees[0]](), intorder=POINTS[degrees[0]])
    bases = [basis, *(basis.with_element(ELEMENTS[d]()) for d in degrees[1:])]
    return tuple(LineBasis(b, np.argsort(b.doflocs[0], kind="stable")) for b in bases)


def integral(
    form: Callable[[Any, Any], Any], trial: LineBasis, test: LineBasis, weight: Array | float = 1.0
) -> sp.csr_matrix:
    """Integrate form(u, v) times a weight at the quadrature's points: (test, trial)."""
    found = BilinearForm(lambda u, v, _: form(u, v) * weight).assemble(trial.basis, test.basis)
    return sp.csr_matrix(found)[test.order][:, trial.order]


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """Integrals of quadratic shape functions f, and of their products with linear pressures."""

    nodes: Array  #: (2 n + 1,) mm
    lengths: Array  #: (n,) of the elements, mm
    mass: sp.csr_matrix  #: of f f
    stiffness: sp.csr_matrix  #: of f' f'
    mixed: sp.csr_matrix  #: of f_i' f_j
    average: tuple[sp.csr_matrix, sp.csr_matrix]  #: (n, nodes): of f, and of f (x - middle)
    slope: tuple[sp.csr_matrix, sp.csr_matrix]  #: (n, nodes): of f', and of f' (x - middle)


def quadratic(boundaries: Array) -> Quadratic:
    """Return the integrals over elements between ascending boundaries (n + 1,), mm."""
    f, one = line_bases(boundaries, 2, 0)
    beside = f.points - one.places[:, None]
    return Quadratic(
        nodes=f.places,
        lengths=np.diff(boundaries),
        mass=integral(lambda u, v: u * v, f, f),
        stiffness=integral(lambda u, v: u.grad[0] * v.grad[0], f, f),
        mixed=integral(lambda u, v: u * v.grad[0], f, f),
        average=(
            integral(lambda u, q: u * q, f, one),
            integral(lambda u, q: u * q, f, one, beside),
        ),
        slope=(
            integral(lambda u, q: u.grad[0] * q, f, one),
            integral(lambda u, q: u.grad[0] * q, f, one, beside),
        ),
    )


def mirror(half: Array) -> Array:
    """Take places from 0 up to the whole line, symmetric about 0."""
    return np.concatenate([-half[:0:-1], half])


def per_tactel(boundaries: Array, edges: Array, parity: int) -> sp.csr_matrix:
    """Take reactions on the nodes of half a line to the forces on the tactels along it.

    The stress that has these reactions (the consistent one, by the mass matrix) is integrated
    over each tactel.

    Parameters
    ----------
    boundaries
        (n + 1,) elements of the half with x >= 0, mm.
    edges
        (tactels + 1,) boundaries of all tactels, ascending and symmetric; on the line's own.
    parity
        1, -1: reactions of the other half are the same, the negative.

    Returns
    -------
    (ceil(tactels / 2), 2 n + 1) for the tactels of the half, that in the middle included.
    """
    whole = quadratic(mirror(boundaries))
    middles = whole.nodes[1::2]
    inside = (middles > edges[:-1, None]) & (middles < edges[1:, None])
    taken = sp.csr_matrix(inside.astype(np.float64)) @ whole.average[0]
    recovered = np.linalg.solve(whole.mass.toarray(), taken.toarray().T).T
    middle = 2 * (boundaries.size - 1)
    # The plane of symmetry counts twice where even (half its reaction is here), else not at all.
    folded = recovered[:, middle:] + parity * recovered[:, middle::-1]
    return sp.csr_matrix(folded[(edges.size - 1) // 2 :])
