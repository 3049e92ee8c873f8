"""Polygons as a file holds them: loops of points, before anything is known of their order.

The points of a mesh file are welded here: STL repeats every corner for each triangle, and
float32 or short decimals move the copies apart by a rounding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.read.settings import MODEL


@dataclass(frozen=True, slots=True)
class Soup:
    """Loops of welded points: half-edges in flat arrays."""

    points: NDArray[np.float64]  #: (V, 3) mm
    origin: NDArray[np.intp]  #: (H,) the vertex at which a half-edge starts
    following: NDArray[np.intp]  #: (H,) the next half-edge around the same loop
    face: NDArray[np.intp]  #: (H,) the polygon it belongs to; numbers rise from 0 without gaps
    noise: float  #: how far points may be off by the file's number format, mm


def soup_of_loops(
    points: NDArray[np.float64], faces: Sequence[Sequence[Sequence[int]]], place: str
) -> Soup:
    """Return the half-edges of polygons given as lists of loops; points are welded."""
    starts = [v for loops in faces for loop in loops for v in loop]
    lengths = [len(loop) for loops in faces for loop in loops]
    owner = [f for f, loops in enumerate(faces) for _ in loops]
    return _soup(points, np.array(starts, np.intp), np.array(lengths), np.array(owner), place)


def soup_of_triangles(corners: NDArray[np.float64], place: str) -> Soup:
    """Return the half-edges of triangles (n, 3, 3), mm; points are welded."""
    count = len(corners)
    starts = np.arange(3 * count, dtype=np.intp)
    return _soup(corners.reshape(-1, 3), starts, np.full(count, 3), np.arange(count), place)


def weld_coarsely(soup: Soup) -> Soup:
    """Return the soup with points joined that lie nearer than `MODEL.coarse_weld` says."""
    after = np.append(soup.following[:-1] != np.arange(1, len(soup.following)), True)
    last = np.flatnonzero(after)  # half-edges of a loop stand one behind another
    lengths = np.diff(last, prepend=-1)
    owner = soup.face[last]
    return _soup(soup.points, soup.origin, lengths, owner, "", MODEL.coarse_weld)


def _soup(
    points: NDArray[np.float64],
    starts: NDArray[np.intp],
    lengths: NDArray[np.intp],
    owner: NDArray[np.intp],
    place: str,
    share: float = MODEL.weld,
) -> Soup:
    if len(starts) == 0:
        raise ShapeError("the file holds no faces", fix="export the solid as a mesh", place=place)
    used = points[starts]
    reach = float(np.abs(used).max()) if np.isfinite(used).all() else np.inf
    if reach > MODEL.largest_coordinate_mm:
        raise ShapeError(
            f"a coordinate is {reach:.3g} mm; {MODEL.largest_coordinate_mm:.0e} mm are allowed",
            fix="check the unit of the export, or export the model again",
            place=place,
        )
    size = float(np.linalg.norm(np.ptp(used, axis=0)))
    noise = share * size + MODEL.digits * reach
    welded, number = weld(points, noise)
    origin = number[starts]
    loop = np.repeat(np.arange(len(lengths)), lengths)
    first = np.cumsum(lengths) - lengths

    # A polygon that lost corners to the weld loses its empty edges; with two corners, itself.
    following = _next_in_loop(loop, first, lengths)
    keep = origin != origin[following]
    origin, loop = origin[keep], loop[keep]
    lengths = np.bincount(loop, minlength=len(lengths))
    keep = lengths[loop] >= 3
    origin, loop = origin[keep], loop[keep]
    lengths = np.where(lengths >= 3, lengths, 0)
    if len(origin) == 0:
        raise ShapeError(
            "all its faces are smaller than a rounding", fix="export the model again", place=place
        )
    first = np.cumsum(lengths) - lengths
    _, face = np.unique(owner[loop], return_inverse=True)
    return Soup(welded, origin, _next_in_loop(loop, first, lengths), face, noise)


def _next_in_loop(
    loop: NDArray[np.intp], first: NDArray[np.intp], lengths: NDArray[np.intp]
) -> NDArray[np.intp]:
    following = np.arange(1, len(loop) + 1)
    last = first[lengths > 0] + lengths[lengths > 0] - 1
    following[last] = first[lengths > 0]
    return following


def weld(
    points: NDArray[np.float64], tolerance: float
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Make points nearer than `tolerance` one point: points (W, 3) and numbers (V,) into them.

    Points share a cell in one of eight shifted grids if they are near; what hangs together
    through cells is one point, the first of them in the file. Order is kept.
    """
    unique, first, number = np.unique(points, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(first, kind="stable")  # back to the order of the file
    unique = unique[rank]
    number = np.argsort(rank)[number.ravel()]
    label = np.arange(len(unique))
    step = 2.0 * max(tolerance, np.finfo(np.float64).tiny)
    low = unique.min(axis=0)
    for shift in np.ndindex(2, 2, 2):
        cell = np.floor((unique - low) / step + 0.5 * np.array(shift)).astype(np.int64)
        order = np.lexsort(cell.T)
        same = (np.diff(cell[order], axis=0) == 0).all(axis=1)
        label = cluster_labels(label, order[:-1][same], order[1:][same])
    kept, compact = np.unique(label, return_inverse=True)
    return unique[kept], compact.ravel()[number].astype(np.intp)


def cluster_labels(
    label: NDArray[np.intp], a: NDArray[np.intp], b: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return labels after joining items a and b pairwise: the least number of each cluster."""
    label = label.copy()
    while True:
        p, q = label[a], label[b]
        open_pairs = p != q
        if not open_pairs.any():
            return label
        p, q = p[open_pairs], q[open_pairs]
        np.minimum.at(label, np.maximum(p, q), np.minimum(p, q))
        while True:
            jumped = label[label]
            if (jumped == label).all():
                break
            label = jumped
