"""Triangles of surfaces: closed bodies, meshes of heights, symbols and faces.

Triangles (n, 3, 3) mm, counter-clockwise from outside <-> Manifold, which cuts them. Written parts
are bodies (their surface has `solid_mm`); faces of the database and a printer's beads are heights.

Heights on a square grid -> a closed body of few triangles, within a stated error, by a
right-triangulated irregular network (Evans, Kirkpatrick and Townsend, Algorithmica 30, 2001):
the square is two right triangles, and each is halved from its right angle to the middle of its
longest side as long as a height that lies within it would be missed by more than the tolerance.
No crack opens, since two triangles at a side are halved together.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError
from probe.surface.contract import HeightMap
from probe.surface.polygon import signed_area
from probe.surface.symbols import SymbolReliefs

Array = NDArray[np.float64]
Index = NDArray[np.int64]


if TYPE_CHECKING:
    from manifold3d import Manifold


def body_of(surface: HeightMap) -> Array | None:
    """Return the triangles (n, 3, 3) of a surface's body, mm, surface frame; None: no body."""
    body: Array | None = getattr(surface, "solid_mm", None)
    return body


def manifold_of(triangles_mm: Array) -> Manifold:
    """Return a body that can be cut; raises `SurfaceError` if the triangles close none."""
    corners, index = np.unique(triangles_mm.reshape(-1, 3), axis=0, return_inverse=True)
    return manifold_from(corners, index.reshape(-1, 3))


def manifold_from(corners_mm: Array, triangles: NDArray[np.int64]) -> Manifold:
    """Return a body of corners (n, 3) and triangles (m, 3); raises as `manifold_of`."""
    from manifold3d import Error, Manifold, Mesh

    vertices, index = corners_mm.astype(np.float32), triangles.astype(np.uint32)
    body = Manifold(Mesh(vert_properties=vertices, tri_verts=index))
    if body.status() != Error.NoError:
        raise SurfaceError(
            f"the triangles close no body ({body.status().name})", fix="take a written part"
        )
    return body


def indexed_triangles(body: Manifold) -> tuple[Array, NDArray[np.int64]]:
    """Return corners (n, 3) mm and triangles (m, 3) of a body; both empty if nothing is left."""
    mesh = body.to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    return corners, np.asarray(mesh.tri_verts, dtype=np.int64).reshape(-1, 3)


def mesh_heights(heights_mm: Array, tolerance_mm: float) -> Index:
    """Return triangles over a grid whose planes miss none of its heights by more than a tolerance.

    The grid is (n + 1, n + 1), n a power of two, all finite. The triangles (m, 3) are places of the
    corners in the flat grid, counter-clockwise where x runs along columns and y along rows.

    Raises `SurfaceError` for a grid of another size.
    """
    cells = len(heights_mm) - 1
    if heights_mm.shape != (cells + 1, cells + 1) or cells < 2 or cells & (cells - 1):
        raise SurfaceError(
            f"a grid of {' x '.join(map(str, heights_mm.shape))} heights",
            fix="give a square one whose side has a power of two, and one more",
        )
    errors = _errors(heights_mm)
    # Corners (row, column): the two ends of the longest side, then the right angle.
    left = np.array([[(0, 0), (cells, cells), (cells, 0)], [(cells, cells), (0, 0), (0, cells)]])
    done: list[Index] = []
    while len(left):
        a, b, c = left[:, 0], left[:, 1], left[:, 2]
        middle = (a + b) // 2
        parts = np.abs(a - c).sum(axis=1) > 1
        parts &= errors[middle[:, 0], middle[:, 1]] > tolerance_mm
        done.append(left[~parts])
        a, b, c, middle = a[parts], b[parts], c[parts], middle[parts]
        left = np.concatenate([np.stack([c, a, middle], 1), np.stack([b, c, middle], 1)])
    corners = np.concatenate(done)
    found: Index = corners[..., 0] * (cells + 1) + corners[..., 1]
    return found


def _errors(h: Array) -> Array:
    """Return the most that is missed within the triangles whose longest side a height halves.

    From the smallest triangles up: what the halves miss, and what halving moves, at most.
    """
    cells, errors = len(h) - 1, np.zeros_like(h)
    step = 1
    while step < cells:
        two, half = 2 * step, step // 2
        for heights, found in ((h, errors), (h.T, errors.T)):  # longest sides along x, along y
            ends = heights[::two, :-1:two] + heights[::two, two::two]
            missed = np.abs(heights[::two, step::two] - ends / 2)
            if half:
                inner = found[half::step, half::step]
                adjacent = np.maximum(inner[:, ::2], inner[:, 1::2])
                within = np.zeros_like(missed)
                within[:-1] = adjacent[::2]
                within[1:] = np.maximum(within[1:], adjacent[1::2])
                missed += within
            found[::two, step::two] = missed
        falling = h[:-1:two, :-1:two] + h[two::two, two::two]
        rising = h[:-1:two, two::two] + h[two::two, :-1:two]
        row, column = np.indices(falling.shape)
        ends = np.where((row + column) % 2 == 0, falling, rising)
        missed = np.abs(h[step::two, step::two] - ends / 2)  # longest sides across squares
        sides = (errors[:-1:two, step::two], errors[two::two, step::two],
                 errors[step::two, :-1:two], errors[step::two, two::two])  # fmt: skip
        errors[step::two, step::two] = missed + np.maximum.reduce(sides)
        step = two
    return errors


def close_below(
    heights_mm: Array, triangles: Index, step_mm: float, bottom_mm: float
) -> tuple[Array, Index]:
    """Return corners (k, 3) and triangles (m, 3) of the body between a grid and a level below it.

    `heights_mm` and `triangles` are as `mesh_heights` takes and gives them; places of the grid are
    `step_mm` apart, its middle is the origin, and `bottom_mm` is the height of the underside.
    """
    side = len(heights_mm)
    places, index = np.unique(triangles, return_inverse=True)
    index = index.reshape(-1, 3)
    at = np.column_stack([places % side, places // side])
    above = np.column_stack([(at - (side - 1) / 2) * step_mm, heights_mm.ravel()[places]])
    grid = np.full((side, side), -1)
    grid[at[:, 1], at[:, 0]] = np.arange(len(places))
    rim = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    rim = rim[rim >= 0]  # counter-clockwise from above
    then, low = np.roll(rim, -1), len(places) + np.arange(len(rim))
    low_then, middle = np.roll(low, -1), np.full(len(rim), len(places) + len(rim))
    below = above[rim].copy()
    below[:, 2] = bottom_mm
    walls = [np.stack(t, 1) for t in
             ((rim, low, low_then), (rim, low_then, then), (low_then, low, middle))]  # fmt: skip
    corners = np.concatenate([above, below, [[0.0, 0.0, bottom_mm]]])
    return corners, np.concatenate([index, *walls])


def symbol_triangles(symbols: SymbolReliefs, label: int) -> Array:
    """Return the sides and the top of a symbol, (m, 3, 3) mm; z from the face."""
    away, heights = symbols.relief.profile()
    if heights[-1] > 0:  # an upright wall down to the face
        away, heights = np.append(away, away[-1]), np.append(heights, 0.0)
    found = []
    tops = []
    for ring in symbols.rings[label]:
        tiers = [
            np.c_[ring.moved(float(d)), np.full(len(ring.supports), z)]
            for d, z in zip(away, heights, strict=True)
        ]
        tops.append(tiers[0])
        for upper, lower in pairwise(tiers):
            above, below = np.roll(upper, -1, axis=0), np.roll(lower, -1, axis=0)
            found += [np.stack([lower, below, above], 1), np.stack([lower, above, upper], 1)]
    found.append(np.concatenate(tops)[triangulate([top[:, :2] for top in tops])])
    return np.concatenate(found)


def triangulate(loops_mm: Sequence[Array]) -> NDArray[np.int64]:
    """Return triangles (m, 3) over the points of all loops (k, 2), one loop after the other.

    Raises `SurfaceError` when the triangles do not have the area of the loops: they cross, or run
    the wrong way (the outer one runs counter-clockwise, holes clockwise).
    """
    from manifold3d import triangulate

    points = np.concatenate(list(loops_mm))
    found = np.asarray(triangulate(list(loops_mm), allow_convex=False), dtype=np.int64)
    areas = [signed_area(triangle) for triangle in points[found.reshape(-1, 3)]]
    covered, wanted = sum(areas), sum(map(signed_area, loops_mm))
    eps = 1e-9 * float(np.ptp(points, axis=0).max()) ** 2
    if abs(covered - wanted) > eps or min(areas, default=0.0) < -eps:
        raise SurfaceError(
            f"the triangles of a face cover {covered:.6g} of {wanted:.6g} mm^2",
            fix="give loops that do not cross, the outer one counter-clockwise, holes clockwise",
        )
    return found
