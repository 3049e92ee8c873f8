"""Polygons as a file holds them: loops of points, before anything is known of their order.

The points of a mesh file are welded here: STL repeats every corner for each triangle, and
float32 or short decimals move the copies apart by a rounding. T-vertices, corners that lie on
another polygon's edge, divide that edge: programs that cut faces one by one leave an edge whole
where its neighbour has two. Shares are of the size, the diagonal of the bounding box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError

Integers = NDArray[np.intp]

MOST_FACETS = 6000  #: of a solid with round faces, or of a mesh after merging: bounds the time
WELD = 1e-6  #: points nearer than this share of the size are one point
COARSE_WELD = 1e-5  #: the same where `WELD` makes no solid: notches as wide as a rounding
DIGITS = 1e-6  #: share of a coordinate that is noise: seven digits, in float32 as in ASCII STL (%e)
LARGEST_COORDINATE_MM = 1e6  #: no object is larger than this; larger numbers are garbage
TEE_NOISE = 4.0  #: a point this many times the noise off an edge lies on it


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
    """Return the soup with points joined that lie nearer than `COARSE_WELD` says."""
    after = np.append(soup.following[:-1] != np.arange(1, len(soup.following)), True)
    last = np.flatnonzero(after)  # half-edges of a loop stand one behind another
    lengths = np.diff(last, prepend=-1)
    owner = soup.face[last]
    return _soup(soup.points, soup.origin, lengths, owner, "", COARSE_WELD)


def _soup(
    points: NDArray[np.float64],
    starts: NDArray[np.intp],
    lengths: NDArray[np.intp],
    owner: NDArray[np.intp],
    place: str,
    share: float = WELD,
) -> Soup:
    if len(starts) == 0:
        raise ShapeError("the file holds no faces", fix="export the solid as a mesh", place=place)
    used = points[starts]
    reach = float(np.abs(used).max()) if np.isfinite(used).all() else np.inf
    if reach > LARGEST_COORDINATE_MM:
        raise ShapeError(
            f"a coordinate is {reach:.3g} mm; {LARGEST_COORDINATE_MM:.0e} mm are allowed",
            fix="check the unit of the export, or export the model again",
            place=place,
        )
    size = float(np.linalg.norm(np.ptp(used, axis=0)))
    noise = share * size + DIGITS * reach
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


def middle_text(points: NDArray[np.float64]) -> str:
    """Return the middle of the box of points (n, 3), mm, as messages say it."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return "({:.4g}, {:.4g}, {:.4g})".format(*middle.tolist())


def split_at_tees(soup: Soup) -> Soup:
    """Return the soup with open edges divided at the open corners that lie on them."""
    target = soup.origin[soup.following]
    count = len(soup.points)
    ahead, back = soup.origin * count + target, target * count + soup.origin
    lonely = np.flatnonzero(~np.isin(ahead, back))
    if len(lonely) == 0:
        return soup
    corners = np.unique(np.concatenate([soup.origin[lonely], target[lonely]]))
    tolerance = TEE_NOISE * soup.noise
    inserted: dict[int, list[int]] = {}
    for edge in lonely.tolist():
        on_edge = _corners_on(soup, int(soup.origin[edge]), int(target[edge]), corners, tolerance)
        if on_edge:
            inserted[edge] = on_edge
    return _divided(soup, inserted) if inserted else soup


def _corners_on(soup: Soup, start: int, end: int, corners: Integers, tolerance: float) -> list[int]:
    """Return the corners inside an edge, from its start on."""
    a, b = soup.points[start], soup.points[end]
    along = b - a
    length = float(np.linalg.norm(along))
    from_a = soup.points[corners] - a
    at = from_a @ along / length
    aside = np.linalg.norm(from_a - np.outer(at / length, along), axis=1)
    inside = (at > tolerance) & (at < length - tolerance) & (aside <= tolerance)
    return [int(corners[k]) for k in np.flatnonzero(inside)[np.argsort(at[inside], kind="stable")]]


def _divided(soup: Soup, inserted: dict[int, list[int]]) -> Soup:
    """Return the soup with points put into edges: the new half-edges stand behind the old ones."""
    origin, following, face = (list(a.tolist()) for a in (soup.origin, soup.following, soup.face))
    for edge, points in inserted.items():
        after = following[edge]
        last = edge
        for point in points:
            following[last] = len(origin)
            last = len(origin)
            origin.append(point)
            following.append(after)
            face.append(face[edge])
    return Soup(
        soup.points,
        np.array(origin, np.intp),
        np.array(following, np.intp),
        np.array(face, np.intp),
        soup.noise,
    )
