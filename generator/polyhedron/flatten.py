"""Move vertices by roundings, so that every face is planar to the last bits.

Coordinates typed with three decimals, or read from float32, lie off their faces' planes
by a rounding. Vertices x and planes (n, d) are corrected together: the smallest change,
in the sense of least squares, for which n . x = d wherever a vertex lies on a face.
Gauss-Newton on these 2E equations converges in two or three steps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import area_vector, plane_axes

PLANAR_EXACTLY = 2e-15  #: share of the size: vertices this near to their planes stay as they are
PLANAR_ENOUGH = 1e-10  #: the same where there are many equations: a tenth of what parts allow
DENSE_EQUATIONS = 3000  #: more are solved as a sparse system
MOST_EQUATIONS = 30000  #: beyond this the coordinates are left as given: bounds the time
FLATTEN_STEPS = 6  #: at most

Points = NDArray[np.float64]
Numbers = NDArray[np.intp]
Loops = list[list[int]]  # the outer loop of each face
Entries = list[tuple[NDArray[np.intp], Points]]  # columns and values, one for each row

_DAMPING = 1e-13  # of the mean diagonal: dependent equations stay solvable


def flatten_faces(
    vertices: Points, faces: Sequence[Sequence[Sequence[int]]]
) -> tuple[Points, float]:
    """Return vertices (V, 3) on the planes of their faces, and how far the farthest moved, mm.

    Faces that are planar already are returned bit by bit as given; so is a solid that
    cannot be corrected by less than a thousandth of its size.
    """
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    faces = [loops for loops in faces if len(loops) > 1 or len(loops[0]) > 3]
    if not faces:
        return vertices.copy(), 0.0  # a triangle is planar
    pairs = [(f, v) for f, loops in enumerate(faces) for loop in loops for v in loop]
    face_of, vertex_of = np.array(pairs, dtype=np.intp).T
    first = [list(loops[0]) for loops in faces]
    moved = vertices
    best = np.abs(_residual(vertices, first, face_of, vertex_of)[0]).max()
    large = len(face_of) > DENSE_EQUATIONS
    enough = (PLANAR_ENOUGH if large else PLANAR_EXACTLY) * size
    if best <= enough or len(face_of) > MOST_EQUATIONS:
        return vertices.copy(), 0.0
    for _ in range(FLATTEN_STEPS):
        trial = _step(moved, first, face_of, vertex_of, size)
        with np.errstate(invalid="ignore"):  # a face that shrank to a point has no plane
            worst = np.abs(_residual(trial, first, face_of, vertex_of)[0]).max()
        if not worst < 0.5 * best:
            break
        moved, best = trial, worst
        if best <= PLANAR_EXACTLY * size:
            break
    distance = float(np.linalg.norm(moved - vertices, axis=1).max())
    if distance > 1e-3 * size or (large and best > PLANAR_ENOUGH * size):
        return vertices.copy(), 0.0
    return moved.copy(), distance


def _residual(
    vertices: Points, first: Loops, face_of: Numbers, vertex_of: Numbers
) -> tuple[Points, Points, Points]:
    """Heights (N,) of vertices over their planes; the planes' axes (F, 3, 3), centres (F, 3)."""
    rings = [vertices[loop] for loop in first]
    axes = np.array([plane_axes(area_vector(ring), ring[1] - ring[0]) for ring in rings])
    count = np.bincount(face_of)[:, None]
    centres = np.zeros_like(axes[:, 0])
    np.add.at(centres, face_of, vertices[vertex_of])
    centres /= count
    offset = vertices[vertex_of] - centres[face_of]
    return np.einsum("ij,ij->i", offset, axes[face_of, 2]), axes, centres


def _step(
    vertices: Points, first: Loops, face_of: Numbers, vertex_of: Numbers, size: float
) -> Points:
    """One correction: unknowns are the vertices and, per face, two tilts (by size) and a shift."""
    height, axes, centres = _residual(vertices, first, face_of, vertex_of)
    count = len(vertices)
    row = np.arange(len(face_of))
    offset = vertices[vertex_of] - centres[face_of]
    entries = [(3 * vertex_of + k, axes[face_of, 2, k]) for k in range(3)]
    for k in range(2):
        tilt = np.einsum("ij,ij->i", offset, axes[face_of, k])
        entries.append((3 * (count + face_of) + k, tilt / size))
    entries.append((3 * (count + face_of) + 2, np.full(len(row), -1.0)))
    solve = _least if len(row) <= DENSE_EQUATIONS else _least_sparse
    change = solve(entries, (len(row), 3 * count + 3 * len(first)), height)
    return vertices - change[: 3 * count].reshape(-1, 3)


def _least(entries: Entries, shape: tuple[int, int], height: Points) -> Points:
    """Return the smallest change (n,) that changes the heights by `height`."""
    row = np.arange(shape[0])
    jacobian = np.zeros(shape)
    for column, value in entries:
        jacobian[row, column] = value
    normal = jacobian @ jacobian.T
    normal[row, row] += _DAMPING * np.trace(normal) / len(row)
    change: Points = jacobian.T @ np.linalg.solve(normal, height)
    return change


def _least_sparse(entries: Entries, shape: tuple[int, int], height: Points) -> Points:
    """As `_least`, of many equations, each of which has six unknowns."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    row = np.tile(np.arange(shape[0]), len(entries))
    column = np.concatenate([column for column, _ in entries])
    value = np.concatenate([value for _, value in entries])
    jacobian = sparse.csr_matrix((value, (row, column)), shape=shape)
    normal = jacobian @ jacobian.T
    damping = _DAMPING * normal.trace() / shape[0] * sparse.identity(shape[0])
    change: Points = jacobian.T @ splu((normal + damping).tocsc()).solve(height)
    return change
