"""Where on a face a symbol may stand: footprint squares that keep clear of every edge.

Region (edges of a polygon with holes, mm) + half side of the footprint (mm) -> free places.
A square with sides along the axes, centred at c, is nearer than r to an edge exactly if c lies
within r of the edge grown by the square. That set is convex (a hexagon with rounded corners),
so a horizontal line meets it in one interval, and a row of candidates is tested against
intervals instead of squares. Non-convex faces and holes need no special case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]

ROUNDING = 1e-9  #: lengths below this share of a face's size do not count
_CHUNK = 1 << 18  # edges times lines worked on at once


@dataclass(frozen=True, slots=True)
class Region:
    """The edges of one face; the face lies on the left of each edge."""

    start: Points  #: (E, 2) mm
    end: Points  #: (E, 2) mm
    clearance: Points  #: (E,) mm, least distance from a footprint to the edge

    @property
    def tolerance(self) -> float:
        """Length (mm) below which two places are one."""
        return ROUNDING * float(np.abs(self.start).max())


def region_of(loops: Sequence[Points], clearances_mm: Sequence[Points]) -> Region:
    """Return the region of a polygon: loops (k, 2) mm, with one clearance (k,) mm per edge.

    Outer loop counter-clockwise, holes clockwise; entry e is of the edge from vertex e to e + 1.
    """
    return Region(
        np.concatenate(loops),
        np.concatenate([np.roll(loop, -1, axis=0) for loop in loops]),
        np.concatenate([np.asarray(c, dtype=np.float64) for c in clearances_mm]),
    )


def move_region(
    region: Region, rotation_rad: float, x_mm: float = 0.0, y_mm: float = 0.0
) -> Region:
    """Return the region turned about the origin, then shifted."""
    c, s = np.cos(rotation_rad), np.sin(rotation_rad)
    turn, shift = np.array([[c, s], [-s, c]]), np.array([x_mm, y_mm])
    return Region(region.start @ turn + shift, region.end @ turn + shift, region.clearance)


def mirror_region(region: Region) -> Region:
    """Return the region with x and y exchanged; edges are reversed to keep it on their left."""
    return Region(region.end[:, ::-1], region.start[:, ::-1], region.clearance)


def blocked_intervals(region: Region, half_mm: float, y: Points) -> tuple[Points, Points]:
    """Return the open intervals of x, (E, Y) mm, that edges forbid to centres on the lines y (Y,).

    low >= high where the edge forbids nothing. The region's axes are those of the footprint square.
    """
    eps = region.tolerance
    edges, lines = len(region.start), len(y)
    low, high = np.empty((edges, lines)), np.empty((edges, lines))
    step = max(1, _CHUNK // max(1, lines))
    for first in range(0, edges, step):
        part = slice(first, first + step)
        low[part], high[part] = _extent(
            region.start[part], region.end[part], region.clearance[part], half_mm, y
        )
    reach = region.clearance + half_mm - eps
    bottom = np.minimum(region.start[:, 1], region.end[:, 1]) - reach
    top = np.maximum(region.start[:, 1], region.end[:, 1]) + reach
    off = (y <= bottom[:, None]) | (y >= top[:, None])
    low[off], high[off] = np.inf, -np.inf
    return low + eps, high - eps


def free_grid(region: Region, half_mm: float, y: Points, x: Points) -> NDArray[np.bool_]:
    """Return for centres (y, x) whether the square keeps inside and off every edge, (Y, X) bool.

    y in any order, x rising, mm.
    """
    low, high = blocked_intervals(region, half_mm, y)
    width = len(x) + 1
    lines = np.arange(len(y)) * width
    edge, line = np.nonzero(low < high)
    begin = lines[line] + np.searchsorted(x, low[edge, line], side="right")
    finish = lines[line] + np.searchsorted(x, high[edge, line], side="left")
    some = begin < finish
    begin, finish = begin[some], finish[some]
    cut, line, weight = _crossings(region, y)
    enter = lines[line] + np.searchsorted(x, cut)
    # Winding number (1 inside, 0 outside) minus twice the number of edges that forbid x.
    steps = np.bincount(
        np.concatenate([begin, finish, enter]),
        np.concatenate([np.full(len(begin), -2.0), np.full(len(finish), 2.0), weight]),
        minlength=width * len(y),
    )
    level = np.cumsum(steps.reshape(len(y), width), axis=1)
    return np.asarray(level[:, :-1] == 1.0)


def slack(region: Region, half_mm: float, centres: Points) -> tuple[float, float]:
    """Return how far all centres (n, 2) may move together to the left and to the right, mm."""
    y, line = np.unique(centres[:, 1], return_inverse=True)
    low, high = blocked_intervals(region, half_mm, y)
    none = low >= high
    low[none], high[none] = np.inf, -np.inf
    x, eps = centres[:, 0], 2 * region.tolerance
    left = np.inf
    right = np.inf
    for a, b in zip(low, high, strict=True):
        a, b = a[line], b[line]
        left = min(left, float(np.min(x - b, where=b <= x + eps, initial=np.inf)))
        right = min(right, float(np.min(a - x, where=a >= x - eps, initial=np.inf)))
    return max(left, 0.0), max(right, 0.0)


def _extent(
    start: Points, end: Points, clearance: Points, half: float, y: Points
) -> tuple[Points, Points]:
    """Return the least and greatest x (E, Y) of the grown edges on the lines y.

    An edge grown by its clearance is a capsule. Grown by the square too, its least x on a line
    is the capsule's least x on the lines at most `half` away, minus `half`; that is reached on
    the line nearest to the edge's own least x. Beyond the ends the values mean nothing.
    """
    swap = (start[:, 0] > end[:, 0])[:, None]
    (ax, ay), (bx, by) = np.where(swap, end, start).T, np.where(swap, start, end).T
    dx, dy, length = bx - ax, by - ay, np.hypot(bx - ax, by - ay)
    r, level = clearance[:, None], (dy == 0.0)[:, None]
    # The capsule's side on the left touches it at start + t (dx, dy) + r (.., rise).
    rise = (clearance * dx * np.sign(dy) / length)[:, None]
    ax, ay, by, dx, dy = (value[:, None] for value in (ax, ay, by, dx, np.where(dy, dy, 1.0)))
    sides = []
    for widest, sign, t_level in ((ay, -1.0, 0.0), (by, 1.0, 1.0)):
        line = np.clip(widest, y - half, y + half)
        t = np.where(level, t_level, np.clip((line - ay + sign * rise) / dy, 0.0, 1.0))
        off = line - ay - t * np.where(level, 0.0, dy)
        sides.append(ax + t * dx + sign * (np.sqrt(np.maximum(r * r - off * off, 0.0)) + half))
    return sides[0], sides[1]


def _crossings(region: Region, y: Points) -> tuple[Points, NDArray[np.intp], Points]:
    """Return x, line and change of the winding number where edges cross the lines y."""
    ay, by = region.start[:, 1, None], region.end[:, 1, None]
    up, down = (ay <= y) & (y < by), (by <= y) & (y < ay)
    edge, line = np.nonzero(up | down)
    a, b = region.start[edge], region.end[edge]
    t = (y[line] - a[:, 1]) / (b[:, 1] - a[:, 1])
    x = a[:, 0] + t * (b[:, 0] - a[:, 0])
    return x, line, np.where(down[edge, line], 1.0, -1.0)
