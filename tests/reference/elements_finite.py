"""Finite strain of an elastomer block: neo-Hookean, mean dilatation (Q1P0). Thesis 4.2.

The energy of a volume is

    G/2 (J^(-2/3) F:F - 3) + K/2 (theta - 1)^2,   theta = mean of J over the element,

so that one volume ratio in each element keeps it from locking (Simo, Taylor, Pister 1985).
Everything refers to the undeformed block (total Lagrangian); Newton's method in load steps.
A block is a mesh of hexahedra, or of quadrilaterals in the (r, z) section of a round one.
mm, N, MPa.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sla
from numpy.typing import NDArray
from skfem import Basis, ElementHex1, ElementQuad1, MeshHex, MeshQuad

from reference.elements_pad import Array

NEWTON = 25  #: iterations of a load step
TOLERANCE = 1e-9  #: of a step's first change
HALVINGS = 6  #: of a load step that does not converge
INCOMPRESSIBLE = 1e-7  #: 1 - 2 nu counts as at least this


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A mesh with what Newton's method needs of it."""

    places: Array  #: (d, n) nodes, mm; d = 2 (r, z) or 3 (x, y, z)
    unknowns: NDArray[np.intp]  #: (e, k d) of each element: d times node + component
    strain: Array  #: (e, q, 9, k d) d(displacement) -> deformation gradient, at q points
    weight: Array  #: (e, q) volume of each point, mm^3
    shear: float  #: G, MPa
    bulk: float  #: K, MPa

    @property
    def axis(self) -> NDArray[np.intp]:
        """Unknowns u_r on the axis of a round block."""
        return 2 * np.flatnonzero(self.places[0] == 0)


def block(mesh: MeshHex | MeshQuad, young: float, poisson: float) -> Block:
    """Prepare a mesh: hexahedra in space, or quadrilaterals in a section (r, z), r >= 0."""
    d = mesh.p.shape[0]
    basis = Basis(mesh, (ElementHex1 if d == 3 else ElementQuad1)(), intorder=3)
    k = basis.Nbfun
    e, q = basis.dx.shape
    strain = np.zeros((e, q, 3, 3, k, d))
    for a in range(k):
        field = basis.basis[a][0]
        for i in range(d):
            strain[:, :, i, :d, a, i] = np.moveaxis(field.grad, 0, -1)
    weight = np.array(basis.dx)
    if d == 2:
        r = basis.global_coordinates()[0]
        weight *= 2 * np.pi * r
        for a in range(k):
            strain[:, :, 2, 2, a, 0] = basis.basis[a][0] / r
    unknowns = (d * basis.element_dofs.T[:, :, None] + np.arange(d)).reshape(e, k * d)
    shear = young / (2 * (1 + poisson))
    bulk = young / (3 * max(1 - 2 * poisson, INCOMPRESSIBLE))
    return Block(
        basis.doflocs, unknowns, strain.reshape(e, q, 9, k * d), weight, shear, bulk
    )  # fmt: skip


def deformed(
    part: Block, start: Array, held: NDArray[np.intp], values: Array, *, halvings: int = HALVINGS
) -> tuple[Array, Array]:
    """Return displacements (n d,) and forces (n d,), N, under held unknowns with other values, mm.

    Newton's method begins at `start`; a load step that turns an element inside out is halved.
    """
    found = _newton(part, held, start, values)
    if found is not None:
        return found
    if not halvings:
        raise ArithmeticError("elements turn inside out under this displacement")
    middle, _ = deformed(part, start, held, (start[held] + values) / 2, halvings=halvings - 1)
    return deformed(part, middle, held, values, halvings=halvings - 1)


def _newton(
    part: Block, held: NDArray[np.intp], start: Array, values: Array
) -> tuple[Array, Array] | None:
    u = start.copy()
    free = np.setdiff1d(np.arange(u.size), held)
    change, largest, size = values - u[held], 0.0, np.inf
    for _ in range(NEWTON):
        system = _system(part, u)
        if system is None:
            return None
        forces, tangent = system
        if size <= TOLERANCE * largest:
            return u, forces
        rows = tangent[free]
        factor = sla.splu(
            rows[:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )
        step = factor.solve(-forces[free] - rows[:, held] @ change)
        u[free] += step
        u[held] += change
        change = np.zeros(held.size)
        size = float(np.abs(step).max(initial=0.0))
        largest = max(largest, size, float(np.abs(values).max(initial=0.0)))
        if not np.isfinite(size):
            return None
    return None


def _stress(part: Block, u: Array) -> tuple[Array, Array, Array, Array] | None:
    """Return F, its inverse transposed, J at the points, and each element's pressure."""
    field = u[part.unknowns]
    gradient = np.einsum("eqij,ej->eqi", part.strain, field, optimize=True)
    gradient = gradient.reshape(*part.weight.shape, 3, 3) + np.eye(3)
    ratio = np.linalg.det(gradient)
    if not np.isfinite(ratio).all() or ratio.min() <= 0:
        return None
    inverse = np.linalg.inv(gradient).swapaxes(-1, -2)
    theta = (part.weight * ratio).sum(axis=1) / part.weight.sum(axis=1)
    return gradient, inverse, ratio, part.bulk * (theta - 1)


def _nominal(part: Block, state: tuple[Array, Array, Array, Array]) -> Array:
    """Return the first Piola-Kirchhoff stress (e, q, 9)."""
    gradient, inverse, ratio, pressure = state
    invariant = (gradient**2).sum(axis=(-2, -1))
    scale = part.shear * ratio ** (-2 / 3)
    stress = scale[..., None, None] * (gradient - invariant[..., None, None] / 3 * inverse)
    stress += (pressure[:, None] * ratio)[..., None, None] * inverse
    return np.asarray(stress.reshape(*ratio.shape, 9))


def _system(part: Block, u: Array) -> tuple[Array, sp.csr_matrix] | None:
    """Return the residual and the tangent, None where an element is inside out."""
    state = _stress(part, u)
    if state is None:
        return None
    gradient, inverse, ratio, pressure = state
    f, h = gradient.reshape(*ratio.shape, 9), inverse.reshape(*ratio.shape, 9)
    invariant = (f**2).sum(axis=-1)
    scale = part.shear * ratio ** (-2 / 3)
    volume = pressure[:, None] * ratio
    # d(F^-T) = -F^-T dF' F^-T
    turned = np.einsum("eqil,eqkj->eqijkl", inverse, inverse).reshape(*ratio.shape, 9, 9)
    hh = h[..., :, None] * h[..., None, :]
    fh = f[..., :, None] * h[..., None, :]
    moduli = scale[..., None, None] * (
        np.eye(9) - 2 / 3 * (fh + fh.swapaxes(-1, -2)) + 2 / 9 * invariant[..., None, None] * hh
    )
    moduli += (scale * invariant / 3 - volume)[..., None, None] * turned
    moduli += volume[..., None, None] * hh
    moduli *= part.weight[..., None, None]
    tangent = np.einsum("eqai,eqab,eqbj->eij", part.strain, moduli, part.strain, optimize=True)
    opened = np.einsum("eqai,eqa,eq->ei", part.strain, h, part.weight * ratio, optimize=True)
    stiff = part.bulk / part.weight.sum(axis=1)
    tangent += stiff[:, None, None] * opened[:, :, None] * opened[:, None, :]
    forces: Array = np.einsum(
        "eqij,eqi,eq->ej", part.strain, _nominal(part, state), part.weight, optimize=True
    )
    n, size = part.unknowns, u.size
    rows = np.broadcast_to(n[:, :, None], tangent.shape).ravel()
    columns = np.broadcast_to(n[:, None, :], tangent.shape).ravel()
    matrix = sp.csr_matrix((tangent.ravel(), (rows, columns)), shape=(size, size))
    return np.bincount(n.ravel(), forces.ravel(), minlength=size).astype(np.float64), matrix
