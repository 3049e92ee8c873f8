"""Deposit + face -> PrintedSurface: the plastic that a touch of one face can meet. mm.

Faces that lie level and look up are seen from above, upright ones along the bed. Others are
refused: they stand on supports or lean, where beads are not modelled.

From above, part frame: layer after layer from the top down, each bead is cut into the rows of the
grid, and only those places of a row are computed that no higher plastic covers.

Along the bed: at each level a bead is a strip with round ends as wide as its section is there, and
over each place along the face the outermost strip counts. View frame: t along the face (level with
the bed), z up, n out of the face.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from generator.errors import PrintError
from generator.printed.deposit import Beads, Deposit
from generator.printed.surface import DEPTH_MM, MARGIN_MM, STEP_MM, PrintedSurface

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

_BLOCK = 1 << 20  # places computed at once: bounds the memory
_UPRIGHT = 1e-9  # a bead whose run along t is less stands across the face
_FLAT = 1e-9  # a bead whose rise is less of its length lies along the rows
_SQUARE = 1e-6  # of a unit normal


def expand_runs(first: Index, count: Index) -> tuple[Index, Index]:
    """Return owner and number of first, first + 1, ... of each run of `count` numbers.

    >>> [each.tolist() for each in expand_runs(np.array([5, 1]), np.array([2, 1]))]
    [[0, 0, 1], [5, 6, 1]]
    """
    count = count.clip(0)
    owner = np.repeat(np.arange(len(count)), count)
    before = np.cumsum(count) - count
    return owner, np.arange(len(owner)) + (first - before)[owner]


def blocks(count: Index, size: int) -> list[Index]:
    """Return the runs' numbers in blocks of about `size` numbers together."""
    total = np.cumsum(count)
    ends = np.arange(size, int(total[-1]) if len(total) else 0, size)
    return np.split(np.arange(len(count)), np.searchsorted(total, ends) + 1)


def heights_sideways(
    beads: Beads, low_mm: Floats, shape: tuple[int, ...], step_mm: float
) -> NDArray[np.float32]:
    """Return n of the outermost plastic over a grid of `shape` nz, nt.

    Places of beads are (t, n); `low_mm`: t and z of the first place of the grid.
    """
    nz, nt = shape
    heights = np.full(shape, -np.inf, dtype=np.float32)
    row0 = np.ceil((beads.top_mm - beads.height_mm - low_mm[1]) / step_mm)
    row1 = np.floor((beads.top_mm - low_mm[1]) / step_mm) + 1
    row0, row1 = (row.clip(0, nz).astype(np.int64) for row in (row0, row1))
    owner, row = expand_runs(row0, row1 - row0)
    r = beads.height_mm[owner] / 2
    off = row * step_mm + low_mm[1] - (beads.top_mm[owner] - r)
    half = beads.width_mm[owner] / 2 - r + np.sqrt((r * r - off * off).clip(0))
    a, b = beads.start_mm[owner], beads.end_mm[owner]
    first = np.ceil((np.minimum(a[:, 0], b[:, 0]) - half - low_mm[0]) / step_mm)
    end = np.floor((np.maximum(a[:, 0], b[:, 0]) + half - low_mm[0]) / step_mm) + 1
    first, end = (column.clip(0, nt).astype(np.int64) for column in (first, end))
    count = (end - first).clip(0)
    for part in blocks(count, _BLOCK):
        strip, column = expand_runs(first[part], count[part])
        t = column * step_mm + low_mm[0]
        n = _highest_of_strips(a[part][strip], b[part][strip], half[part][strip], t)
        np.maximum.at(heights.reshape(-1), row[part][strip] * nt + column, n.astype(np.float32))
    return heights


def _highest_of_strips(a: Floats, b: Floats, half: Floats, t: Floats) -> Floats:
    """Return the highest n of strips at places t, -inf off them."""
    ends = []
    for end in (a, b):
        under = half**2 - (t - end[:, 0]) ** 2
        ends.append(np.where(under >= 0, end[:, 1] + np.sqrt(under.clip(0)), -np.inf))
    way = b - a
    length = np.hypot(way[:, 0], way[:, 1])
    along = np.abs(way[:, 0]) > _UPRIGHT * np.maximum(length, _UPRIGHT)
    run = np.where(along, way[:, 0], 1.0)
    lean = way[:, 1] / run  # dn/dt
    # The long side that faces outwards: its foot on the middle line lies at t's side.
    foot = t + half * lean / np.hypot(1.0, lean)
    within = along & (foot >= np.minimum(a[:, 0], b[:, 0])) & (foot <= np.maximum(a[:, 0], b[:, 0]))
    side = a[:, 1] + (t - a[:, 0]) * lean + half * np.hypot(1.0, lean)
    return np.maximum(np.maximum(*ends), np.where(within, side, -np.inf))


def heights_from_above(
    beads: Beads, low_mm: Floats, shape: tuple[int, ...], step_mm: float
) -> NDArray[np.float32]:
    """Return z of the highest plastic over a grid of `shape` ny, nx; `low_mm`: its first place."""
    heights = np.full(shape, -np.inf, dtype=np.float32)
    order = np.argsort(-beads.top_mm, kind="stable")
    tops = beads.top_mm[order]
    # Beads of one layer differ by rounding alone; a blob or a string makes a layer of its own.
    layers = np.flatnonzero(np.diff(np.round(tops / 0.01), prepend=np.inf))
    for begin, end in zip(layers, np.append(layers, len(tops))[1:], strict=True):
        _lay(heights, beads.chosen(order[begin:end]), low_mm, step_mm)
    return heights


def _lay(heights: NDArray[np.float32], beads: Beads, low: Floats, step: float) -> None:
    ny, nx = heights.shape
    a, b = beads.start_mm - low, beads.end_mm - low
    half = beads.width_mm / 2
    row0 = np.ceil((np.minimum(a[:, 1], b[:, 1]) - half) / step).clip(0, ny).astype(np.int64)
    row1 = np.floor((np.maximum(a[:, 1], b[:, 1]) + half) / step).clip(-1, ny - 1) + 1
    owner, row = expand_runs(row0, row1.astype(np.int64) - row0)
    if not len(owner):
        return
    first, end = _columns(a, b, half, owner, row.astype(np.float64) * step)
    first = np.ceil(first / step).clip(0, nx).astype(np.int64)
    end = (np.floor(end / step).clip(-1, nx - 1) + 1).astype(np.int64)
    # Only places that are still lower than this layer's tops.
    free = np.zeros((ny, nx + 1), np.int32)
    np.cumsum(heights < beads.top_mm.max(), axis=1, out=free[:, 1:])
    shows = (end > first) & (free[row, end.clip(0, nx)] > free[row, first.clip(0, nx)])
    owner, row, first, count = owner[shows], row[shows], first[shows], (end - first)[shows]
    for part in blocks(count, _BLOCK):
        span, column = expand_runs(first[part], count[part])
        rows, owners = row[part][span], owner[part][span]
        place = rows * nx + column
        lower = heights.ravel()[place] < beads.top_mm[owners]
        place, owners = place[lower], owners[lower]
        points = np.stack([column[lower] * step, rows[lower] * step], axis=1)
        z = _profile(beads, a, b, owners, points)
        np.maximum.at(heights.reshape(-1), place, z.astype(np.float32))


def _columns(a: Floats, b: Floats, half: Floats, owner: Index, y: Floats) -> tuple[Floats, Floats]:
    """Return between which x each bead may lie in a row: its box, cut by its two long sides."""
    way = b - a
    length = np.hypot(way[:, 0], way[:, 1])
    slanted = np.abs(way[:, 1]) > _FLAT * np.maximum(length, _FLAT)
    rise = np.where(slanted, way[:, 1], 1.0)
    across = np.where(slanted, half * length / np.abs(rise), np.inf)
    middle = a[owner, 0] + (y - a[owner, 1]) * (way[:, 0] / rise)[owner]
    low = (np.minimum(a[:, 0], b[:, 0]) - half)[owner]
    high = (np.maximum(a[:, 0], b[:, 0]) + half)[owner]
    reach = across[owner]
    return np.maximum(low, middle - reach), np.minimum(high, middle + reach)


def _profile(beads: Beads, a: Floats, b: Floats, owner: Index, points: Floats) -> Floats:
    """Return z of beads at points, -inf off them."""
    way = (b - a)[owner]
    to = points - a[owner]
    squared = (way * way).sum(axis=1)
    t = ((to * way).sum(axis=1) / np.where(squared > 0, squared, 1.0)).clip(0, 1)
    to -= t[:, None] * way
    off = np.hypot(to[:, 0], to[:, 1])
    r = beads.height_mm[owner] / 2
    off -= beads.width_mm[owner] / 2 - r
    np.maximum(off, 0.0, out=off)
    under = r * r - off * off
    z = beads.top_mm[owner] - r + np.sqrt(under.clip(0))
    return np.where(under >= 0, z, -np.inf)


def is_seen(T_part_face: Floats) -> bool:
    """Whether a face lies level and looks up, or stands upright, as the part is printed."""
    z = float(T_part_face[2, 2])
    return z > 1 - _SQUARE or abs(z) < _SQUARE


def face_surface(
    printed: Deposit, T_part_face: Floats, *, outline_mm: Floats | None = None
) -> PrintedSurface:
    """Return the surface over one face of the whole part.

    T_part_face (4, 4): z outward, the face in z = 0. The grid covers the box of `outline_mm`, (k,
    2) points of the face frame, and a margin; of the part's box if left out. Raises `PrintError`
    for a face that leans, or looks down on the bed.
    """
    normal = T_part_face[:3, 2]
    if not is_seen(T_part_face):
        angle = math.degrees(math.acos(max(-1.0, min(1.0, float(normal[2])))))
        raise PrintError(
            f"this face leans {angle:.0f} degrees from facing up: its print is not simulated",
            fix="print panels (print: {parts: panels}), or look at level and upright faces",
        )
    above = normal[2] > 0.5
    T_part_grid = np.eye(4)
    if not above:
        T_part_grid[:3, :3] = np.stack(
            [np.cross([0.0, 0.0, 1.0], normal), [0.0, 0.0, 1.0], normal], axis=1
        )
    T_part_grid[:3, 3] = T_part_face[:3, 3]
    T_surface_grid = np.linalg.inv(T_part_face) @ T_part_grid
    low, high = _region(printed, T_part_grid, T_surface_grid, outline_mm)
    shape = tuple((np.ceil((high - low)[::-1] / STEP_MM).astype(np.int64) + 1).tolist())
    beads = _in_grid(printed.beads, T_part_grid, upright=not above)
    half, a, b = beads.width_mm / 2, beads.start_mm, beads.end_mm
    least, most = np.minimum(a, b) - half[:, None], np.maximum(a, b) + half[:, None]
    if above:
        near = (beads.top_mm > -DEPTH_MM) & ((most >= low) & (least <= high)).all(axis=1)
        heights = heights_from_above(beads.chosen(near), low, shape, STEP_MM)
        if printed.bow_mm:
            y, x = (low[k] + T_part_grid[k, 3] + STEP_MM * np.arange(shape[1 - k]) for k in (1, 0))
            points = np.stack(np.meshgrid(x, y), axis=-1)
            heights += printed.bow_at(points).astype(np.float32)
    else:
        near = (most[:, 1] > -DEPTH_MM) & (most[:, 0] >= low[0]) & (least[:, 0] <= high[0])
        near &= (beads.top_mm >= low[1]) & (beads.top_mm - beads.height_mm <= high[1])
        heights = heights_sideways(beads.chosen(near), low, shape, STEP_MM)
    heights[heights < -DEPTH_MM] = -np.inf
    return PrintedSurface(heights, (float(low[0]), float(low[1])), STEP_MM, T_surface_grid)


def _in_grid(beads: Beads, T_part_grid: Floats, *, upright: bool) -> Beads:
    """Return the beads as their view has them: (x, y) and z, or (t, n) and z."""
    origin = T_part_grid[:3, 3]
    moved = beads.shifted(-origin)
    if not upright:
        return moved
    A = np.stack([T_part_grid[:2, 0], T_part_grid[:2, 2]], axis=1)
    return Beads(
        moved.start_mm @ A, moved.end_mm @ A, moved.top_mm, beads.width_mm, beads.height_mm
    )


def _region(
    printed: Deposit, T_part_grid: Floats, T_surface_grid: Floats, outline: Floats | None
) -> tuple[Floats, Floats]:
    if outline is not None:
        points = (outline - T_surface_grid[:2, 3]) @ T_surface_grid[:2, :2]
    else:
        ends = np.stack([printed.low_mm, printed.high_mm])
        corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]]
                            for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # fmt: skip
        points = ((corners - T_part_grid[:3, 3]) @ T_part_grid[:3, :3])[:, :2]
    return points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
