"""The surface of a printed part: a regular grid of heights, as a touch meets it.

Surface frame: that of the part's face (origin at its first vertex, x along its first edge, z
outward; z = 0 is the face as designed). Grid frame: the same plane and z, its axes along the
printer's. mm. Without plastic within the depth of the view, -inf.

Files that many processes share: `NAME.npy` with heights as whole steps of 0.5 um and `NAME.json`
with all else; where the second is, the first is whole. The heights are mapped into memory: all
processes of a machine share one copy.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.files import staged_file
from generator.errors import PrintError

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

STEP_MM = 0.05  #: between two places of the grid
DEPTH_MM = 2.5  #: below the face that is looked at: deeper a touch does not reach
MARGIN_MM = 1.0  #: around the face: strings and blobs hang over its edges


@dataclass(frozen=True, slots=True, eq=False)
class PrintedSurface:
    """Heights of the highest plastic."""

    heights: NDArray[np.float32]  #: (ny, nx) mm, at origin + step (column, row)
    origin_mm: tuple[float, float]  #: x, y of heights[0, 0], grid frame
    step_mm: float
    T_surface_grid: Floats  #: (4, 4) a turn in the plane

    @property
    def top_mm(self) -> float:
        """Height of the highest plastic."""
        return float(self.heights.max(initial=-np.inf))

    def heights_mm(self, points_mm: Floats) -> Floats:
        """Return the heights at points (n, 2) of the surface frame; -inf off the grid."""
        shape = self.heights.shape
        return interpolate(self, points_mm, shape, lambda i, j: self.heights[i, j])


def interpolate(
    surface: PrintedSurface | SurfaceFile,
    points_mm: Floats,
    shape: tuple[int, ...],
    height: Callable[[Index, Index], NDArray[np.floating]],
) -> Floats:
    """Return heights (n,) at points (n, 2) between places of a grid of `shape` ny, nx, -inf off it.

    Bilinear, the nearest place's where a neighbour is empty. `height` gives heights (m,) of rows
    and columns (m,).
    """
    T, (ny, nx) = np.array(surface.T_surface_grid), shape
    at = ((points_mm - T[:2, 3]) @ T[:2, :2] - np.array(surface.origin_mm)) / surface.step_mm
    nearest = np.rint(at).astype(np.int64)
    inside = ((nearest >= 0) & (nearest < [nx, ny])).all(axis=1)
    j, i = nearest.clip(0, [nx - 1, ny - 1]).T
    found = np.where(inside, height(i, j), -np.inf).astype(np.float64)
    cell = np.floor(at).astype(np.int64).clip(0, [max(nx - 2, 0), max(ny - 2, 0)])
    if min(nx, ny) < 2:
        return found
    u, v = (at - cell).T
    j, i = cell.T
    corners = [height(i + a, j + b).astype(np.float64) for a in (0, 1) for b in (0, 1)]
    smooth = inside & np.isfinite(corners).all(axis=0)
    u, v = u[smooth].clip(0, 1), v[smooth].clip(0, 1)
    h00, h01, h10, h11 = (corner[smooth] for corner in corners)
    found[smooth] = (h00 * (1 - u) + h01 * u) * (1 - v) + (h10 * (1 - u) + h11 * u) * v
    return found


FORMAT = 1  #: of the files; another one is made again
UNIT_MM = 0.0005  #: of a stored height: far below what a slicer's files tell
MAPPED = 48  #: surfaces that a process keeps mapped; 3 MB each for 60 mm


@dataclass(frozen=True, slots=True)
class SurfaceFile:
    """A printed surface that lies in files. Level 0 is no plastic, level n is low + n units."""

    path: Path  #: of the levels, (ny, nx) uint16
    origin_mm: tuple[float, float]  #: as `PrintedSurface` has it
    step_mm: float
    T_surface_grid: tuple[tuple[float, ...], ...]  #: (4, 4) a turn in the plane
    top_mm: float  #: height of the highest plastic
    low_mm: float  #: of level 0
    moved_mm: tuple[float, float]  #: by which the print stood aside of this frame, taken out

    def heights_mm(self, points_mm: Floats) -> Floats:
        """Return the heights at points (n, 2) of the surface frame; see `interpolate`."""
        levels = map_levels(self.path)

        def height(i: Index, j: Index) -> Floats:
            level = levels[i, j]
            return np.where(level > 0, self.low_mm + UNIT_MM * level, -np.inf)

        return interpolate(self, points_mm, levels.shape, height)


def write_surface(
    surface: PrintedSurface, path: Path, *, moved_mm: tuple[float, float] = (0.0, 0.0)
) -> None:
    """Write a surface as `path` with .npy and .json, each by a rename, the second last.

    The print stands `moved_mm` (x, y) aside of its frame; the written surface is moved back.
    """
    heights = surface.heights.astype(np.float64)
    low = -DEPTH_MM - UNIT_MM
    laid = np.isfinite(heights)
    levels = np.zeros(heights.shape, np.uint16)
    levels[laid] = np.rint((heights[laid] - low) / UNIT_MM).clip(1, np.iinfo(np.uint16).max)
    T = surface.T_surface_grid.copy()
    T[:2, 3] -= moved_mm
    top = float(heights[laid].max()) if laid.any() else -np.inf
    values = {
        "format": FORMAT,
        "origin_mm": list(surface.origin_mm),
        "step_mm": surface.step_mm,
        "T_surface_grid": T.tolist(),
        "top_mm": top + UNIT_MM / 2 if laid.any() else None,
        "low_mm": low,
        "moved_mm": list(moved_mm),
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with staged_file(path.with_name(f"{path.name}.npy")) as draft:
        np.save(draft, levels)
    with staged_file(path.with_name(f"{path.name}.json")) as draft:
        draft.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def is_written(path: Path) -> bool:
    """Whether a surface of this format lies at `path` (without suffix)."""
    try:
        values = json.loads(path.with_name(f"{path.name}.json").read_bytes())
    except (OSError, ValueError):
        return False
    return values.get("format") == FORMAT and path.with_name(f"{path.name}.npy").is_file()


def read_surface(path: Path) -> SurfaceFile:
    """Return the surface that lies at `path` (without suffix); raises `PrintError` without one."""
    file = path.with_name(f"{path.name}.json")
    try:
        values = json.loads(file.read_bytes())
        found = SurfaceFile(
            path=path.with_name(f"{path.name}.npy").absolute(),
            origin_mm=(float(values["origin_mm"][0]), float(values["origin_mm"][1])),
            step_mm=float(values["step_mm"]),
            T_surface_grid=tuple(tuple(map(float, row)) for row in values["T_surface_grid"]),
            top_mm=-np.inf if values["top_mm"] is None else float(values["top_mm"]),
            low_mm=float(values["low_mm"]),
            moved_mm=(float(values["moved_mm"][0]), float(values["moved_mm"][1])),
        )
        map_levels(found.path)
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        raise PrintError(
            "a printed surface is not there or cannot be read",
            fix="print the set again: validate-set --resume, all workers on one folder",
            place=str(file),
        ) from error
    return found


@lru_cache(maxsize=MAPPED)
def map_levels(path: Path) -> NDArray[np.uint16]:
    """Return the levels of a surface, (ny, nx), read where they are asked."""
    levels: NDArray[np.uint16] = np.asarray(np.load(path, mmap_mode="r", allow_pickle=False))
    return levels
