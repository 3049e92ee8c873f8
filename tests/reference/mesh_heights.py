"""Heights of a mesh by numpy: what `probe/surface/heights.c` computes, to the bit."""

from __future__ import annotations

import numpy as np

from probe.surface.mesh import MeshSurface


def heights_by_numpy(part: MeshSurface, points: np.ndarray) -> np.ndarray:
    """Return the height of the highest triangle over points (n, 2); -inf beside all."""
    bins = part.bins
    found = np.full(len(points), -np.inf)
    cell, asked = _bins_of(part, points)
    found[asked[bins.level[cell]]] = 0.0  # as each triangle there says, exactly
    count = np.diff(bins.starts)[cell]
    met = np.flatnonzero(count)
    asked, cell, count = asked[met], cell[met], count[met]
    if not len(asked):
        return np.minimum(found, part.top_mm)
    offsets = np.cumsum(count) - count
    listed = np.repeat(bins.starts[cell] - offsets, count) + np.arange(count.sum())
    x, y = (np.repeat(points[asked, i], count) for i in (0, 1))
    found[asked] = np.maximum.reduceat(heights_over(part, bins.triangles[listed], x, y), offsets)
    return np.minimum(found, part.top_mm)  # a mean of equal heights may round up


def _bins_of(part: MeshSurface, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the bins of the points that lie in any, and the numbers of these points."""
    bins = part.bins
    x, y = ((points[:, i] - bins.low[i]) / bins.side_mm for i in (0, 1))
    within = (x >= 0) & (x <= bins.shape[0]) & (y >= 0) & (y <= bins.shape[1])
    inside = np.flatnonzero(within)
    i = np.minimum(x[inside].astype(np.int64), bins.shape[0] - 1)
    j = np.minimum(y[inside].astype(np.int64), bins.shape[1] - 1)
    return i * bins.shape[1] + j, inside


def heights_over(
    part: MeshSurface, triangle: np.ndarray, x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the height of triangles over a point each; -inf where it is not under it."""
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = part.corners[triangle].transpose(2, 1, 0)
    # Twice the signed areas of the three parts; each edge runs up the order a < b < c.
    ab = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    bc = (cx - bx) * (y - by) - (cy - by) * (x - bx)
    ac = (cx - ax) * (y - ay) - (cy - ay) * (x - ax)
    under = ((ab >= 0) & (bc >= 0) & (ac <= 0)) | ((ab <= 0) & (bc <= 0) & (ac >= 0))
    weight = ab + bc - ac
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (ab * cz + bc * az - ac * bz) / weight
    return np.where(under & (weight != 0), z, -np.inf)
