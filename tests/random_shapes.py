"""Random solids for tests and verification campaigns, 40 to 120 mm, seeded by the caller.

Convex: hulls of random points, hulls of lattice points (many coplanar), truncated blocks.
Non-convex: extruded stars, some with a hole, straight or tapered, steps, and blocks with a
boss or a pocket, whose faces have holes. SciPy is loaded when a hull is made.
"""

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.frame import edge_length
from generator.polyhedron.winged import Polyhedron, polyhedron

Floats = NDArray[np.float64]
Loops = list[list[int]]

SMALLEST_MM, LARGEST_MM = 40.0, 120.0
SHORTEST_EDGE_MM = 2.0  #: shorter edges carry nothing and print badly
_TRIES = 200


def random_convex(rng: np.random.Generator) -> Polyhedron:
    """Return a convex polyhedron without short edges."""
    return _first_good(rng, (_cloud, _lattice, _truncated_block))


def random_nonconvex(rng: np.random.Generator) -> Polyhedron:
    """Return a non-convex polyhedron, of genus 0 or 1, without short edges."""
    return _first_good(rng, (_star, _steps, _block_with_boss))


def convex_hull(points: Floats) -> Polyhedron:
    """Return the hull of points (n, 3), mm: coplanar facets are one face, inner points dropped."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    faces: list[tuple[Floats, list[int]]] = []
    for plane in hull.equations:
        height = points @ plane[:3] + plane[3]
        on = np.flatnonzero(np.abs(height) <= 1e-9 * size)
        if not any(set(on.tolist()) <= set(members) for _, members in faces):
            faces.append((plane[:3], on.tolist()))
    loops = [_ring(points, members, normal) for normal, members in faces]
    used = sorted({v for loop in loops for v in loop})
    number = {v: k for k, v in enumerate(used)}
    return polyhedron("polyhedron", points[used], [[number[v] for v in loop] for loop in loops])


def extruded(
    loops: Sequence[Floats], height: float, taper: float = 1.0, pose: Floats | None = None
) -> Polyhedron:
    """Return a prism over a polygon with holes, or its frustum towards the z axis.

    Loops are (k, 2) mm, the outer one counter-clockwise, then holes, clockwise. The top is scaled
    by `taper` about the origin, all is turned by `pose` (3, 3). Faces: top, bottom, sides.
    """
    flat = np.concatenate(loops)
    bottom = np.column_stack([flat, np.zeros(len(flat))])
    top = np.column_stack([taper * flat, np.full(len(flat), height)])
    first = np.cumsum([0, *map(len, loops)])
    rings = [list(range(a, b)) for a, b in itertools.pairwise(first)]
    n = len(flat)
    faces: list[Loops] = [[[v + n for v in ring] for ring in rings], [ring[::-1] for ring in rings]]
    for ring in rings:
        faces += [[[a, b, b + n, a + n]] for a, b in zip(ring, ring[1:] + ring[:1], strict=True)]
    vertices = np.concatenate([bottom, top])
    return polyhedron("polyhedron", vertices if pose is None else vertices @ pose.T, faces)


def _first_good(
    rng: np.random.Generator, makers: Sequence[Callable[[np.random.Generator], Polyhedron]]
) -> Polyhedron:
    maker = makers[int(rng.integers(len(makers)))]
    for _ in range(_TRIES):
        try:
            solid = maker(rng)
        except ShapeError:
            continue  # a draw that touches itself; the next one is as random
        if min(edge_length(solid, k) for k in range(len(solid.edges))) >= SHORTEST_EDGE_MM:
            return solid
    raise RuntimeError(f"no random solid without short edges after {_TRIES} draws")


def _cloud(rng: np.random.Generator) -> Polyhedron:
    """Hull of points on a sphere: triangles alone."""
    points = rng.normal(size=(rng.integers(4, 14), 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    return convex_hull(_scaled(points, rng))


def _lattice(rng: np.random.Generator) -> Polyhedron:
    """Hull of points of a 4 x 4 x 4 lattice: faces of many corners."""
    points = rng.integers(0, 4, size=(rng.integers(6, 20), 3)).astype(np.float64)
    if np.linalg.matrix_rank(points - points[0]) < 3:
        raise ShapeError("a flat draw")
    return convex_hull(_scaled(np.unique(points, axis=0), rng))


def _truncated_block(rng: np.random.Generator) -> Polyhedron:
    """Block cut by random planes: three edges at every vertex."""
    from scipy.spatial import HalfspaceIntersection

    half = rng.uniform(0.5, 1.0, size=3)
    block = np.concatenate([np.eye(3), -np.eye(3)])
    normals = rng.normal(size=(rng.integers(1, 9), 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    reach = (np.abs(normals) * half).sum(axis=1) * rng.uniform(0.55, 0.95, size=len(normals))
    offsets = np.concatenate([half, half, reach])
    planes = np.column_stack([np.concatenate([block, normals]), -offsets])
    corners = HalfspaceIntersection(planes, np.zeros(3)).intersections
    return convex_hull(_scaled(corners @ _rotation(rng).T, rng))


def _star(rng: np.random.Generator) -> Polyhedron:
    """Extruded star-shaped polygon, often tapered, sometimes with a star-shaped hole."""
    count = int(rng.integers(5, 12))
    angles = 2 * math.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, size=count)) / count
    radius = rng.uniform(25.0, 60.0, size=count)
    outer = radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    loops = [outer]
    if rng.random() < 0.5:
        loops.append(rng.uniform(0.3, 0.7) * outer[::-1])
    return extruded(loops, rng.uniform(40.0, 80.0), rng.uniform(0.6, 1.0), _rotation(rng))


def _steps(rng: np.random.Generator) -> Polyhedron:
    """Staircase of one to four steps: L-shaped with one."""
    count = int(rng.integers(2, 6))
    x = np.cumsum(rng.uniform(10.0, 24.0, size=count))
    z = np.cumsum(rng.uniform(10.0, 24.0, size=count))[::-1]
    profile = [(0.0, 0.0), (x[-1], 0.0)]
    for k in range(count - 1, 0, -1):
        profile += [(x[k], z[k]), (x[k - 1], z[k])]
    profile += [(x[0], z[0]), (0.0, z[0])]
    return extruded([np.array(profile)], rng.uniform(40.0, 80.0), 1.0, _rotation(rng))


def _block_with_boss(rng: np.random.Generator) -> Polyhedron:
    """Block with a smaller block on its top, or sunk into it: a face with a hole, genus 0."""
    a, b, c = rng.uniform(40.0, 100.0, size=3)
    u, v = rng.uniform(0.3, 0.7, size=2) * (a, b)
    x, y = rng.uniform(-0.4, 0.4, size=2) * (a - u, b - v)
    rise = rng.uniform(10.0, 0.6 * c) * (1 if rng.random() < 0.5 else -1)
    big = 0.5 * np.array([(-a, -b), (a, -b), (a, b), (-a, b)])
    small = 0.5 * np.array([(-u, -v), (u, -v), (u, v), (-u, v)]) + (x, y)
    levels = [(big, 0.0), (big, c), (small, c), (small, c + rise)]
    vertices = np.concatenate([np.column_stack([p, np.full(4, z)]) for p, z in levels])
    faces: list[Loops] = [[[3, 2, 1, 0]], [[4, 5, 6, 7], [11, 10, 9, 8]], [[12, 13, 14, 15]]]
    for low in (0, 8):
        faces += [
            [[low + k, low + (k + 1) % 4, low + 4 + (k + 1) % 4, low + 4 + k]] for k in range(4)
        ]
    return polyhedron("polyhedron", vertices @ _rotation(rng).T, faces)


def _scaled(points: Floats, rng: np.random.Generator) -> Floats:
    extent = float(np.ptp(points, axis=0).max())
    return points * (rng.uniform(SMALLEST_MM, LARGEST_MM) / extent)


def _rotation(rng: np.random.Generator) -> Floats:
    """Return a random rotation (3, 3): the orthogonal factor of a normal matrix, turned right."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    turn: Floats = q * np.linalg.det(q)
    return turn  # odd dimension: -q is a rotation if q is a reflection


def _ring(points: Floats, members: list[int], normal: Floats) -> list[int]:
    """Return the corners of the hull of coplanar points, counter-clockwise about `normal`."""
    from scipy.spatial import ConvexHull

    if len(members) == 3:
        a, b, c = points[members]
        return members if np.cross(b - a, c - a) @ normal > 0 else members[::-1]
    x = points[members[1]] - points[members[0]]
    x = x / np.linalg.norm(x)
    flat = (points[members] - points[members[0]]) @ np.column_stack([x, np.cross(normal, x)])
    corners = [members[k] for k in ConvexHull(flat).vertices]  # counter-clockwise in 2-D
    start = corners.index(min(corners))
    return corners[start:] + corners[:start]
