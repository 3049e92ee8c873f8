"""A one-piece pad as finite elements, condensed to its top nodes and tactels. Thesis 4.2.

Quadratic bricks with a linear pressure of their own in each of them (Q2-P1: no locking), bonded
at the base, free at the sides, loaded by normal forces on the nodes of the top. The mesh is a
product of three lines, so each matrix is a sum of Kronecker products. Nodes of a line ascend, the
middle ones included. A quarter of the pad serves, in the four parities (even, odd) x (even, odd):
one sweep of block Cholesky along x gives, for each, the displacement of the top and the force on
each tactel per force on the top.

mm, N, MPa; x, y in the sensor frame, w = displacement of the top into the pad.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, BilinearForm, ElementLineP0, ElementLineP1, ElementLineP2, MeshLine

Array = NDArray[np.float64]

COMPRESSIBLE = 1e-7  # 1 - 2 nu counts as at least this; bulk over shear modulus 1e7


LINE_ELEMENTS = (ElementLineP0, ElementLineP1, ElementLineP2)
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
    """Return shape functions of some degrees (0 ... 2) that share the quadrature of the first."""
    mesh = MeshLine(np.asarray(boundaries, dtype=np.float64))
    basis = Basis(mesh, LINE_ELEMENTS[degrees[0]](), intorder=POINTS[degrees[0]])
    bases = [basis, *(basis.with_element(LINE_ELEMENTS[d]()) for d in degrees[1:])]
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
    offset = f.points - one.places[:, None]
    return Quadratic(
        nodes=f.places,
        lengths=np.diff(boundaries),
        mass=integral(lambda u, v: u * v, f, f),
        stiffness=integral(lambda u, v: u.grad[0] * v.grad[0], f, f),
        mixed=integral(lambda u, v: u * v.grad[0], f, f),
        average=(
            integral(lambda u, q: u * q, f, one),
            integral(lambda u, q: u * q, f, one, offset),
        ),
        slope=(
            integral(lambda u, q: u.grad[0] * q, f, one),
            integral(lambda u, q: u.grad[0] * q, f, one, offset),
        ),
    )


def mirror(half: Array) -> Array:
    """Take places from 0 up to the whole line, symmetric about 0."""
    return np.concatenate([-half[:0:-1], half])


def per_tactel(boundaries: Array, edges: Array, parity: int) -> sp.csr_matrix:
    """Take reactions on the nodes of half a line to the forces on the tactels of that half.

    The stress that has these reactions (the consistent one, by the mass matrix) is integrated over
    each tactel. `boundaries` (n + 1,) are those of the elements with x >= 0, `edges` those of all
    tactels; by `parity` reactions of the other half are the same (1) or the negative (-1).
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


PARITIES = ((1, 1), (1, -1), (-1, 1), (-1, -1))  #: of w under x -> -x, and under y -> -y


@dataclass(frozen=True, slots=True, eq=False)
class PadLines:
    """The mesh of a quarter of a pad: element boundaries along x, y, and z from the base up."""

    x: Array  #: (nx + 1,) 0 ... half the width, mm
    y: Array  #: (ny + 1,)
    z: Array  #: (nz + 1,) 0 ... thickness

    @property
    def unknowns(self) -> int:
        """Displacements of the quarter."""
        return 6 * (2 * self.x.size - 1) * (2 * self.y.size - 1) * (self.z.size - 1)


@dataclass(frozen=True, slots=True, eq=False)
class CondensedPad:
    """What the top of a pad does under forces on its nodes: counted x slow, y fast, ascending."""

    x: Array  #: (mx,) coordinates of the nodes, mm, symmetric about 0
    y: Array  #: (my,)
    compliance: tuple[Array, ...]  #: per parity (q, q), mm/N; q nodes of the quarter
    tactels: tuple[Array, ...]  #: per parity (ceil(rows / 2), ceil(columns / 2), q), N/N
    rows: int
    columns: int
    unknowns: int  #: of the quarter

    @property
    def nodes_mm(self) -> Array:
        """The nodes of the top, (mx my, 2), sensor frame."""
        grid = np.meshgrid(self.x, self.y, indexing="ij")
        return np.stack([g.ravel() for g in grid], axis=-1)

    def displaced(self, forces: Array) -> Array:
        """Return w at each node (n,), mm, under forces (n,), N."""
        w = np.zeros((self.x.size, self.y.size))
        for parity, matrix in zip(PARITIES, self.compliance, strict=True):
            part = self._folded(forces, parity)
            w += _unfold_symmetry((matrix @ part.ravel()).reshape(part.shape), parity)
        return w.ravel()

    def between(self, nodes: NDArray[np.intp]) -> Array:
        """Return the compliance (k, k) between k nodes, mm/N."""
        i, j = (
            index - size // 2
            for index, size in zip(
                np.divmod(nodes, self.y.size), (self.x.size, self.y.size), strict=True
            )
        )
        quarter = np.abs(i) * (self.y.size // 2 + 1) + np.abs(j)
        found = np.zeros((nodes.size, nodes.size))
        for (px, py), matrix in zip(PARITIES, self.compliance, strict=True):
            sign = np.where(i < 0, px, 1) * np.where(j < 0, py, 1)
            found += sign[:, None] * matrix[quarter[:, None], quarter] * sign
        return found

    def base_forces(self, forces: Array) -> Array:
        """Return the force on each tactel (rows, columns), N: the base stress over its square."""
        total = np.zeros((self.rows, self.columns))
        for (px, py), matrix in zip(PARITIES, self.tactels, strict=True):
            corner = matrix @ self._folded(forces, (px, py)).ravel()
            total += _mirror_half(_mirror_half(corner, self.columns, px).T, self.rows, py).T
        return total[::-1]  # row 0 is at the top, y grows upwards

    def _folded(self, forces: Array, parity: tuple[int, int]) -> Array:
        grid = forces.reshape(self.x.size, self.y.size)
        for sign in parity:
            half = grid.shape[0] // 2
            folded = grid[half:].copy()
            folded[1:] += sign * grid[half - 1 :: -1]
            grid = folded.T
        return grid


def condense(
    lines: PadLines, young: float, poisson: float, tactel_edges: tuple[Array, Array]
) -> CondensedPad:
    """Condense a pad to the nodes of its top and to the tactels between edges along x and y.

    Poisson's ratio above (1 - 1e-7)/2 counts as that; all edges lie on lines of the mesh.
    """
    along = [quadratic(part) for part in (lines.x, lines.y, lines.z)]
    shape = tuple(part.nodes.size for part in along)
    stiffness = _stiffness(along, young, poisson)
    place = np.unravel_index(np.arange(stiffness.shape[0]), (3, *shape))
    to_tactels = [
        {p: per_tactel(part, edges, p) for p in (1, -1)}
        for part, edges in zip((lines.x, lines.y), tactel_edges, strict=True)
    ]
    columns, rows = (edges.size - 1 for edges in tactel_edges)
    compliance, tactels = [], []
    for px, py in PARITIES:
        take = sp.kron(to_tactels[0][px], to_tactels[1][py])
        load_response, reaction = _parity(stiffness, place, shape, (px, py), take)
        compliance.append(load_response / 4)
        reaction = reaction.reshape(to_tactels[0][px].shape[0], to_tactels[1][py].shape[0], -1)
        tactels.append(np.ascontiguousarray(reaction.transpose(1, 0, 2)) / 4)
    whole = [mirror(part.nodes) for part in along[:2]]
    return CondensedPad(
        whole[0], whole[1], tuple(compliance), tuple(tactels), rows, columns, lines.unknowns
    )


def _stiffness(along: list[Quadratic], young: float, poisson: float) -> sp.csr_matrix:
    """Return the stiffness of all displacements (component, x, y, z), pressures eliminated."""
    shear = young / (2 * (1 + poisson))
    lame = 2 * shear * poisson / max(1 - 2 * poisson, COMPRESSIBLE)

    def product(factors: list[sp.csr_matrix]) -> sp.csr_matrix:
        return sp.kron(sp.kron(factors[0], factors[1]), factors[2], format="csr")

    def derived(a: int, b: int) -> sp.csr_matrix:
        """Integrate d_a f_i d_b f_j."""
        if a == b:
            return product([p.stiffness if k == a else p.mass for k, p in enumerate(along)])
        return product(
            [p.mixed if k == a else p.mixed.T if k == b else p.mass for k, p in enumerate(along)]
        )

    laplace = sum(derived(a, a) for a in range(3))
    blocks = [[derived(b, a) + (laplace if a == b else 0) for b in range(3)] for a in range(3)]
    total = shear * sp.bmat(blocks, format="csr")
    volume = np.kron(np.kron(along[0].lengths, along[1].lengths), along[2].lengths)
    for mode in (None, 0, 1, 2):  # pressure 1, x - middle, y - middle, z - middle
        divergence = sp.hstack(
            [
                product(
                    [(p.slope if k == a else p.average)[k == mode] for k, p in enumerate(along)]
                )
                for a in range(3)
            ],
            format="csr",
        )
        if mode is None:
            mass = volume
        else:
            ones = [np.ones(p.lengths.size) for p in along]
            ones[mode] = along[mode].lengths ** 2 / 12
            mass = volume * np.kron(np.kron(ones[0], ones[1]), ones[2])
        total = total + lame * (divergence.T @ sp.diags(1 / mass) @ divergence)
    return total.tocsr()


def _parity(
    stiffness: sp.csr_matrix,
    place: tuple[NDArray[np.intp], ...],
    shape: tuple[int, ...],
    parity: tuple[int, int],
    take: sp.csr_matrix,
) -> tuple[Array, Array]:
    """Return displacements of the quarter's top (q, q) and tactels' forces (t, q) of a parity."""
    component, ix, iy, iz = place
    fixed = iz == 0
    for axis, (index, sign) in enumerate(zip((ix, iy), parity, strict=True)):
        normal = component == axis
        fixed |= (index == 0) & (normal if sign > 0 else ~normal)
    free = np.flatnonzero(~fixed)
    slab = (ix[free] + 1) // 2  # planes {0}, {1, 2}, {3, 4} ... couple to their neighbours alone
    order = np.argsort(slab, kind="stable")
    free, slab = free[order], slab[order]
    starts = np.searchsorted(slab, np.arange(slab[-1] + 2))
    base = np.flatnonzero((component == 2) & (iz == 0))
    rows = stiffness[free]
    sense = -(rows[:, base] @ take.T).toarray()  # against: the load presses, the base bears
    top = np.flatnonzero((component[free] == 2) & (iz[free] == shape[2] - 1))
    node = ix[free][top] * shape[1] + iy[free][top]
    gram = _sweep_slabs(rows[:, free].tocsr(), starts, sense, top, node, shape[0] * shape[1])
    t = sense.shape[1]
    return gram[t:, t:], gram[:t, t:]


def _sweep_slabs(
    stiffness: sp.csr_matrix,
    starts: NDArray[np.intp],
    sense: Array,
    top: NDArray[np.intp],
    node: NDArray[np.intp],
    nodes: int,
) -> Array:
    """Return R' K^-1 R of the columns R = (sense, unit loads on the top's nodes).

    K is block tridiagonal in slabs, K = L L'; with Y = L^-1 R the answer is Y'Y, summed slab by
    slab. A load enters Y at its own slab, so earlier slabs have no column for it.
    """
    t = sense.shape[1]
    gram = np.zeros((t + nodes, t + nodes))
    coupling, carried = np.zeros((0, 0)), np.zeros((0, 0))
    for i, (a, b) in enumerate(pairwise(starts)):
        here = (top >= a) & (top < b)
        width = max(carried.shape[1], t + int(node[here].max(initial=-1)) + 1)
        block = stiffness[a:b, a:b].toarray()
        right = np.zeros((b - a, width))
        right[:, :t] = sense[a:b]
        right[top[here] - a, t + node[here]] = 1.0
        if i:
            block -= coupling.T @ coupling
            right[:, : carried.shape[1]] -= coupling.T @ carried
        factor = la.cholesky(block, lower=True, overwrite_a=True, check_finite=False)
        carried = la.solve_triangular(factor, right, lower=True, check_finite=False)
        gram[:width, :width] += carried.T @ carried
        if i + 2 < starts.size:
            ahead = stiffness[a:b, b : starts[i + 2]].toarray()
            coupling = la.solve_triangular(factor, ahead, lower=True, check_finite=False)
    return gram


def _unfold_symmetry(part: Array, parity: tuple[int, int]) -> Array:
    for sign in parity:
        part = np.concatenate([sign * part[:0:-1], part]).T
    return part


def _mirror_half(half: Array, size: int, sign: int) -> Array:
    """Take the upper half (..., ceil(size / 2)) of an even or odd row to the whole of it."""
    return np.concatenate([sign * half[..., ::-1][..., : size // 2], half], axis=-1)
