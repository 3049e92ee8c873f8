"""Deposit + face -> PrintedSurface: the plastic that a touch of one face can meet.

Faces that lie level and look up are seen from above, upright ones along the bed. Others are
refused: they stand on supports or lean, and what a bead does there is not modelled. mm.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from generator.errors import PrintError
from generator.printed.above import heights_from_above
from generator.printed.beads import Beads
from generator.printed.deposit import Deposit
from generator.printed.sideways import heights_sideways
from generator.printed.surface import DEPTH_MM, MARGIN_MM, STEP_MM, Coverage, PrintedSurface

Floats = NDArray[np.float64]

_SQUARE = 1e-6  # of a unit normal


def is_seen(T_part_face: Floats) -> bool:
    """Whether a face lies level and looks up, or stands upright, as the part is printed."""
    z = float(T_part_face[2, 2])
    return z > 1 - _SQUARE or abs(z) < _SQUARE


def face_surface(
    printed: Deposit,
    T_part_face: Floats,
    *,
    outline_mm: Floats | None = None,
    step_mm: float = STEP_MM,
    depth_mm: float = DEPTH_MM,
) -> PrintedSurface:
    """Return the surface over one face.

    Parameters
    ----------
    printed
        The whole part.
    T_part_face
        (4, 4) the face's frame: z outward, the face in z = 0.
    outline_mm
        (k, 2) points of the face frame whose box, and a margin, is looked at; the part's box
        if left out.
    step_mm
        Between two places of the grid.
    depth_mm
        Below the face; deeper plastic is left out.

    Raises
    ------
    PrintError
        For a face that leans, or looks down on the bed.
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
    shape = tuple((np.ceil((high - low)[::-1] / step_mm).astype(np.int64) + 1).tolist())
    beads = printed.beads
    near = _in_grid(beads, T_part_grid, upright=not above)
    if above:
        heights, samples, within = _from_above(near, low, high, shape, step_mm, depth_mm)
        if printed.bow_mm:
            y, x = (low[k] + T_part_grid[k, 3] + step_mm * np.arange(shape[1 - k]) for k in (1, 0))
            points = np.stack(np.meshgrid(x, y), axis=-1)
            heights += printed.bow_at(points).astype(np.float32)
    else:
        heights, samples, within = _view_sideways(near, low, high, shape, step_mm, depth_mm)
    heights[heights < -depth_mm] = -np.inf
    return PrintedSurface(
        heights=heights,
        origin_mm=(float(low[0]), float(low[1])),
        step_mm=step_mm,
        T_surface_grid=T_surface_grid,
        T_part_surface=T_part_face.copy(),
        coverage=Coverage(len(beads), within, samples),
    )


def _from_above(
    beads: Beads, low: Floats, high: Floats, shape: tuple[int, ...], step: float, depth: float
) -> tuple[NDArray[np.float32], int, int]:
    half = beads.width_mm[:, None] / 2
    near = beads.top_mm > -depth
    near &= (np.maximum(beads.start_mm, beads.end_mm) + half >= low).all(axis=1)
    near &= (np.minimum(beads.start_mm, beads.end_mm) - half <= high).all(axis=1)
    heights, samples = heights_from_above(beads.chosen(near), low, (shape[0], shape[1]), step)
    return heights, samples, int(near.sum())


def _view_sideways(
    beads: Beads, low: Floats, high: Floats, shape: tuple[int, ...], step: float, depth: float
) -> tuple[NDArray[np.float32], int, int]:
    half = beads.width_mm / 2
    a, b = beads.start_mm, beads.end_mm
    near = np.maximum(a[:, 1], b[:, 1]) + half > -depth
    near &= np.maximum(a[:, 0], b[:, 0]) + half >= low[0]
    near &= np.minimum(a[:, 0], b[:, 0]) - half <= high[0]
    near &= (beads.top_mm >= low[1]) & (beads.top_mm - beads.height_mm <= high[1])
    heights, samples = heights_sideways(beads.chosen(near), low, (shape[0], shape[1]), step)
    return heights, samples, int(near.sum())


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
    """Return the lowest and highest x, y of the grid."""
    if outline is not None:
        points = (outline - T_surface_grid[:2, 3]) @ T_surface_grid[:2, :2]
    else:
        ends = np.stack([printed.low_mm, printed.high_mm])
        corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]]
                            for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # fmt: skip
        points = ((corners - T_part_grid[:3, 3]) @ T_part_grid[:3, :3])[:, :2]
    return points.min(axis=0) - MARGIN_MM, points.max(axis=0) + MARGIN_MM
