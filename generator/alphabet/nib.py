"""The region that an octagonal nib covers along strokes, as exact support lines.

Strokes (mm) + stroke width (mm) -> rings of lines (nx, ny, c): the ring's material lies
at n . x <= c near that edge, so moving the outline by d is c + d, and every side between
two heights stays exactly planar. The union's own coordinates are rounded to 1e-8; its
edges only name the lines, and vertices are their intersections.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Lines = NDArray[np.float64]  # (k, 3): unit normal out of the material, and offset in mm

_ROOT = np.sqrt(0.5)
#: Flats of the nib; the diagonal ones to the last bit alike.
_FLATS = np.array(
    [[1, 0], [_ROOT, _ROOT], [0, 1], [-_ROOT, _ROOT], [-1, 0], [-_ROOT, -_ROOT], [0, -1],
     [_ROOT, -_ROOT]]
)  # fmt: skip
_NIB = _FLATS + np.tan(np.pi / 8) * np.stack([-_FLATS[:, 1], _FLATS[:, 0]], axis=1)


def nib_outline(strokes: NDArray[np.float64], width_mm: float) -> list[Lines]:
    """Return the outline of strokes drawn by an octagonal nib.

    Parameters
    ----------
    strokes
        (s, 2, 2) end points, mm.
    width_mm
        Width between two flats of the nib.

    Returns
    -------
    list of (k, 3) arrays
        Outer rings counter-clockwise and holes clockwise, in no order; no two
        neighbouring edges are parallel.
    """
    from manifold3d import CrossSection, OpType

    radius = width_mm / 2
    hulls, lines = [], []
    for a, b in strokes:
        corners = np.concatenate([a + radius * _NIB, b + radius * _NIB])
        along = (b - a) / np.hypot(*(b - a))
        side = np.array([along[1], -along[0]])
        normals = np.concatenate([_FLATS, [side, -side]])
        # On the flats, the support is that of the end point; elsewhere that of a nib corner.
        support = np.maximum(_FLATS @ a, _FLATS @ b) + radius
        beside = (corners @ np.stack([side, -side], axis=1)).max(axis=0)
        hulls.append(CrossSection.hull_points(corners))
        lines.append(np.c_[normals, np.concatenate([support, beside])])
    known = np.concatenate(lines)
    union = CrossSection.batch_boolean(hulls, OpType.Add)
    scale = float(np.abs(strokes).max()) + width_mm
    return [_support_lines(ring, known, scale) for ring in union.to_polygons()]


def offset_ring(ring: Lines, distance_mm: float) -> NDArray[np.float64]:
    """Return the (k, 2) corners of a ring whose every edge moves out by `distance_mm`.

    Corner i lies between edges i - 1 and i.
    """
    n, c = ring[:, :2], ring[:, 2] + distance_mm
    m, d = np.roll(n, 1, axis=0), np.roll(c, 1)
    turn = m[:, 0] * n[:, 1] - m[:, 1] * n[:, 0]
    x = (d * n[:, 1] - c * m[:, 1]) / turn
    y = (c * m[:, 0] - d * n[:, 0]) / turn
    return np.stack([x, y], axis=1)


def _support_lines(ring: NDArray[np.float64], known: Lines, scale: float) -> Lines:
    """Replace the rounded edges of a union by the support lines they lie on."""
    edge = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(edge[:, 0], edge[:, 1])
    found: list[NDArray[np.float64]] = []
    for start, step, size in zip(ring, edge, length, strict=True):
        if size < 1e-6 * scale:
            continue
        normal = np.array([step[1], -step[0]]) / size
        off = np.abs(known[:, :2] @ (start + step / 2) - known[:, 2]) / scale
        miss = off + np.hypot(*(known[:, :2] - normal).T) * size / scale
        best = known[int(np.argmin(miss))]
        if not found or np.abs(best - found[-1]).max() > 1e-9 * max(1.0, scale):
            found.append(best)
    while len(found) > 1 and np.abs(found[0] - found[-1]).max() <= 1e-9 * max(1.0, scale):
        found.pop()
    return np.array(found)
