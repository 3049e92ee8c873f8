"""Heights on a square grid -> a closed body of few triangles, within a stated error.

A right-triangulated irregular network (Evans, Kirkpatrick and Townsend, Algorithmica 30, 2001):
the square is two right triangles, and each is halved from its right angle to the middle of its
longest side as long as a height that lies within it would be missed by more than the tolerance.
What is flat takes a few large triangles, what is steep small ones, and no crack opens between
them, since two triangles at a side are halved together. mm.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def mesh_heights(heights_mm: Array, tolerance_mm: float) -> Index:
    """Return triangles over a grid whose planes miss none of its heights by more.

    Parameters
    ----------
    heights_mm
        (n + 1, n + 1), n a power of two; all finite.
    tolerance_mm
        Largest error of a height.

    Returns
    -------
    (m, 3) places of the corners in the flat grid, counter-clockwise where x runs along columns
    and y along rows.

    Raises
    ------
    SurfaceError
        For a grid of another size.
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
                beside = np.maximum(inner[:, ::2], inner[:, 1::2])
                within = np.zeros_like(missed)
                within[:-1] = beside[::2]
                within[1:] = np.maximum(within[1:], beside[1::2])
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
    """Return the body between triangles over a grid and a level below all of them.

    Parameters
    ----------
    heights_mm, triangles
        As `mesh_heights` takes and gives them.
    step_mm
        Between two places of the grid; its middle is the origin.
    bottom_mm
        Height of the body's underside.

    Returns
    -------
    corners_mm
        (k, 3).
    triangles
        (m, 3) counter-clockwise from outside.
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
