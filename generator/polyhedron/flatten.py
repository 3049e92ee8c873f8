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
from generator.polyhedron.settings import SOLID

Points = NDArray[np.float64]


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
    face_of, vertex_of = _incidences(faces)
    moved = vertices
    best = np.abs(_residual(vertices, faces, face_of, vertex_of)[0]).max()
    if best <= SOLID.planar_exactly * size or len(face_of) > SOLID.most_equations:
        return vertices.copy(), 0.0
    for _ in range(SOLID.flatten_steps):
        trial = _step(moved, faces, face_of, vertex_of, size)
        worst = np.abs(_residual(trial, faces, face_of, vertex_of)[0]).max()
        if not worst < 0.5 * best:
            break
        moved, best = trial, worst
        if best <= SOLID.planar_exactly * size:
            break
    distance = float(np.linalg.norm(moved - vertices, axis=1).max())
    if distance > 1e-3 * size:
        return vertices.copy(), 0.0
    return moved.copy(), distance


def _incidences(
    faces: Sequence[Sequence[Sequence[int]]],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    pairs = [(f, v) for f, loops in enumerate(faces) for loop in loops for v in loop]
    face_of, vertex_of = np.array(pairs, dtype=np.intp).T
    return face_of, vertex_of


def _residual(
    vertices: Points,
    faces: Sequence[Sequence[Sequence[int]]],
    face_of: NDArray[np.intp],
    vertex_of: NDArray[np.intp],
) -> tuple[Points, Points, Points]:
    """Heights (N,) of vertices over their planes; the planes' axes (F, 3, 3), centres (F, 3)."""
    rings = [vertices[list(loops[0])] for loops in faces]
    axes = np.array([plane_axes(area_vector(ring), ring[1] - ring[0]) for ring in rings])
    count = np.bincount(face_of)[:, None]
    centres = np.zeros_like(axes[:, 0])
    np.add.at(centres, face_of, vertices[vertex_of])
    centres /= count
    offset = vertices[vertex_of] - centres[face_of]
    return np.einsum("ij,ij->i", offset, axes[face_of, 2]), axes, centres


def _step(
    vertices: Points,
    faces: Sequence[Sequence[Sequence[int]]],
    face_of: NDArray[np.intp],
    vertex_of: NDArray[np.intp],
    size: float,
) -> Points:
    """One correction: unknowns are the vertices and, per face, two tilts (by size) and a shift."""
    height, axes, centres = _residual(vertices, faces, face_of, vertex_of)
    count = len(vertices)
    row = np.arange(len(face_of))
    jacobian = np.zeros((len(row), 3 * count + 3 * len(faces)))
    offset = vertices[vertex_of] - centres[face_of]
    for k in range(3):
        jacobian[row, 3 * vertex_of + k] = axes[face_of, 2, k]
    for k in range(2):
        tilt = np.einsum("ij,ij->i", offset, axes[face_of, k])
        jacobian[row, 3 * (count + face_of) + k] = tilt / size
    jacobian[row, 3 * (count + face_of) + 2] = -1.0
    normal = jacobian @ jacobian.T
    normal[row, row] += 1e-13 * np.trace(normal) / len(row)  # dependent equations stay solvable
    change = -jacobian.T @ np.linalg.solve(normal, height)
    return vertices + change[: 3 * count].reshape(-1, 3)
