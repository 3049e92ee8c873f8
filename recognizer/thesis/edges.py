"""Image -> edges and corners in the thesis's way. Thesis 4.3, appendix 3.

Edge points are samples where the slope (Sobel) is large and larger than that of its neighbours up
and down the slope; a parabola through the three gives the place between the samples.

Segments come from an adaptive Hough transform, the longest first: every point votes for the lines
n x = offset through it whose normal agrees with its slope. The accumulator is small: around its
maximum it is refined, until its cells are as fine as the points are good. The points of the longest
unbroken run on that line become a segment, are removed, and the rest votes again, until no line
holds three (Illingworth, Kittler, "The adaptive Hough transform", IEEE Trans. PAMI 9 (1987)).

Production rules make edges and corners:

    EDGE   := EDGE1 or EDGE2     if they continue each other
    EDGE   := EDGE1 or BREAK     a short piece that continues it
    VERTEX := EDGE1 and EDGE2    if they turn

Angles are those between the two directions: straight on is 180 degrees, as in the thesis. A BREAK
that continues no EDGE is dropped. Image frame, mm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.thesis.filters import magnify_image, median, sobel, subtract_bias
from recognizer.thesis.line import Corner, Edge, corner_between, fit_line
from recognizer.touch.tactile_image import TactileImage

Array = NDArray[np.float64]

DOUBLINGS = 2  #: of the image before its slopes are taken; a mosaic is fine already
STEEP = 0.3  #: share of the steepest slopes, from which a sample can be an edge point

# Segments
TURN_RAD = math.radians(35)  #: of a point's slope against the segment's normal
NEAR_MM = 0.7  #: of a point from the line
GAP_MM = 4.0  #: between points of one unbroken run
LEAST_POINTS = 3
LEAST_MM = 2.0  #: length of a segment
SPREAD_MM = 0.2  #: least standard deviation of a point across the line
MOST_SEGMENTS = 12
DIRECTIONS = 24  #: of the coarse accumulator, round the whole circle
COARSE_MM = 1.6  #: cell of the coarse accumulator
FINE_MM = 0.1  #: cell at which refinement ends: as fine as the points are good
AROUND = 2  #: cells of the refined accumulator to each side of its middle
STARTS = 4  #: cells of the coarse accumulator that are refined

# Production rules
STRAIGHT_RAD = math.radians(155)  #: angle from which two segments are one edge
BREAK_MM = 5.0  #: shorter segments are breaks
ACROSS_MM = 1.0  #: from one's line to the other's ends, for being one edge
APART_MM = 12.0  #: along the way, between their ends
BEYOND_MM = 5.0  #: how far from the visible parts of its edges a corner may lie


@dataclass(frozen=True, slots=True, eq=False)
class EdgePoints:
    """Places on edges."""

    at_mm: Array  #: (n, 2)
    normals: Array  #: (n, 2) unit vectors up the slope

    def __len__(self) -> int:
        return len(self.at_mm)

    def chosen(self, mask: NDArray[np.bool_] | NDArray[np.intp]) -> EdgePoints:
        """Return some of them."""
        return EdgePoints(self.at_mm[mask], self.normals[mask])


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Points on one line."""

    points: EdgePoints
    edge: Edge


def classical_edges(image: TactileImage, *, despike: bool = True) -> tuple[Edge, ...]:
    """Return the edges in an image by the thesis's way, the longest first.

    Parameters
    ----------
    image
        Readings of a touch or a mosaic.
    despike
        Take the median first: it removes spikes and keeps edges.
    """
    over = subtract_bias(image)
    if despike:
        over = median(over)
    return fuse_segments(segments(edge_points(magnify_image(over, DOUBLINGS))))


def edge_points(image: TactileImage) -> EdgePoints:
    """Return the edge points of an image over its bias, in reading order.

    Samples next to an undefined one have no slope, and those at the rim none across it.
    """
    from scipy.ndimage import binary_erosion, map_coordinates

    x, y = sobel(image)
    slope = np.hypot(x, y)
    known = binary_erosion(image.defined, np.ones((3, 3)), border_value=1)
    slope[~known] = 0.0
    if not slope.any():
        return EdgePoints(np.zeros((0, 2)), np.zeros((0, 2)))
    least = STEEP * np.quantile(slope[slope > 0], 0.95)
    rows, columns = np.nonzero(slope > least)
    at = slope[rows, columns]
    normals = np.stack([x[rows, columns], y[rows, columns]], axis=-1) / at[:, None]
    across = [
        map_coordinates(
            slope,
            [rows - side * normals[:, 1], columns + side * normals[:, 0]],
            order=1,
            mode="constant",
        )
        for side in (-1, 1)
    ]
    highest = (at >= across[0]) & (at > across[1])
    rows, columns, normals, at = rows[highest], columns[highest], normals[highest], at[highest]
    before, after = across[0][highest], across[1][highest]
    bend = before - 2 * at + after
    between = np.where(bend < 0, (before - after) / np.where(bend < 0, 2 * bend, 1.0), 0.0)
    offsets = np.clip(between, -0.5, 0.5)[:, None] * normals * image.step_mm
    return EdgePoints(image.xy_mm(rows, columns) + offsets, normals)


def segments(points: EdgePoints) -> list[Segment]:
    """Return the line segments among edge points, the longest first."""
    found: list[Segment] = []
    left = points
    while len(left) >= LEAST_POINTS and len(found) < MOST_SEGMENTS:
        best: Segment | None = None
        taken = np.zeros(len(left), np.bool_)
        for angle, offset in _peaks(left):
            run = _longest_run(left, angle, offset)
            if len(run) < LEAST_POINTS:
                continue
            members = left.chosen(run)
            edge = fit_line(members.at_mm, members.normals, SPREAD_MM)
            run = _longest_run(left, edge.angle_rad, edge.offset_mm)
            if len(run) < LEAST_POINTS:
                continue
            members = left.chosen(run)
            edge = fit_line(members.at_mm, members.normals, SPREAD_MM)
            if best is None or edge.length_mm > best.edge.length_mm:
                best = Segment(members, edge)
                taken = np.zeros(len(left), np.bool_)
                taken[run] = True
        if best is None or best.edge.length_mm < LEAST_MM:
            break
        found.append(best)
        # points as near to the line without being of the run belong to no other line
        left = left.chosen(~taken)
    return sorted(found, key=lambda segment: -segment.edge.length_mm)


def fuse_segments(segments: Sequence[Segment]) -> tuple[Edge, ...]:
    """Return the edges made of segments, the longest first."""
    parts = sorted(segments, key=lambda segment: -segment.edge.length_mm)
    edges: list[Segment] = []
    for part in parts:
        k = next((k for k, e in enumerate(edges) if _is_one_edge(e.edge, part.edge)), None)
        if k is not None:
            edges[k] = _union(edges[k], part)
        elif part.edge.length_mm >= BREAK_MM:
            edges.append(part)
    edges.sort(key=lambda segment: -segment.edge.length_mm)
    return tuple(segment.edge for segment in edges)


def vertices(edges: Sequence[Edge]) -> tuple[Corner, ...]:
    """Return the corners of edges that are visible up to them."""
    found = []
    for first, second in itertools.combinations(edges, 2):
        between = math.pi - abs(math.remainder(second.angle_rad - first.angle_rad, math.tau))
        corner = corner_between(first, second) if between < STRAIGHT_RAD else None
        if corner is not None and all(_reaches_corner(e, corner) for e in (first, second)):
            found.append(corner)
    return tuple(found)


def _peaks(points: EdgePoints) -> list[tuple[float, float]]:
    """Return angle and offset of the fullest lines, refined."""
    cell = COARSE_MM
    reach = float(np.abs(points.at_mm).max()) * math.sqrt(2) + cell
    angles = (np.arange(DIRECTIONS) + 0.5) * math.tau / DIRECTIONS
    offsets = np.arange(-reach, reach + cell, cell)
    votes = _votes(points, angles, offsets, cell)
    order = np.argsort(-votes, axis=None, kind="stable")[:STARTS]
    found = []
    for row, column in zip(*np.unravel_index(order, votes.shape), strict=True):
        found.append(_refine_line(points, float(angles[row]), float(offsets[column])))
    return found


def _refine_line(points: EdgePoints, angle: float, offset: float) -> tuple[float, float]:
    turn, cell = math.tau / DIRECTIONS, COARSE_MM
    around = np.arange(-AROUND, AROUND + 1.0)
    while cell > FINE_MM:
        turn, cell = turn / 2, cell / 2
        angles = angle + around * turn
        offsets = offset + around * cell
        votes = _votes(points, angles, offsets, max(cell, NEAR_MM))
        row, column = np.unravel_index(int(votes.argmax()), votes.shape)
        angle, offset = float(angles[row]), float(offsets[column])
    return angle, offset


def _votes(points: EdgePoints, angles: Array, offsets: Array, width_mm: float) -> Array:
    """Return how many points (a, o) lie within half a width of each line, nearer ones more."""
    normals = np.stack([np.cos(angles), np.sin(angles)])
    alike = points.normals @ normals >= math.cos(TURN_RAD)
    away = np.abs((points.at_mm @ normals)[..., None] - offsets) / width_mm
    return np.asarray((alike[..., None] * np.maximum(0.0, 1.0 - away)).sum(axis=0))


def _longest_run(points: EdgePoints, angle: float, offset: float) -> NDArray[np.intp]:
    """Return the points of the longest unbroken run along a line, in order."""
    n = np.array([math.cos(angle), math.sin(angle)])
    near = np.abs(points.at_mm @ n - offset) <= NEAR_MM
    on = np.flatnonzero(near & (points.normals @ n >= math.cos(TURN_RAD)))
    if len(on) == 0:
        return on
    places = points.at_mm[on] @ (n[1], -n[0])
    order = np.argsort(places, kind="stable")
    on, places = on[order], places[order]
    breaks = np.flatnonzero(np.diff(places) > GAP_MM) + 1
    runs = np.split(np.arange(len(on)), breaks)
    longest = max(runs, key=lambda run: float(places[run[-1]] - places[run[0]]))
    return np.asarray(on[longest])


def _is_one_edge(edge: Edge, part: Edge) -> bool:
    between = math.pi - abs(math.remainder(part.angle_rad - edge.angle_rad, math.tau))
    if between < STRAIGHT_RAD:
        return False
    ends = np.stack([part.start_mm, part.end_mm])
    if np.abs(edge.inside_mm(ends)).max() > ACROSS_MM:
        return False
    way = np.array([edge.normal[1], -edge.normal[0]])
    own = sorted([float(edge.start_mm @ way), float(edge.end_mm @ way)])
    others: list[float] = sorted((ends @ way).tolist())
    return max(others[0] - own[1], own[0] - others[1]) <= APART_MM


def _union(a: Segment, b: Segment) -> Segment:
    points = EdgePoints(
        np.concatenate([a.points.at_mm, b.points.at_mm]),
        np.concatenate([a.points.normals, b.points.normals]),
    )
    return Segment(points, fit_line(points.at_mm, points.normals, SPREAD_MM))


def _reaches_corner(edge: Edge, corner: Corner) -> bool:
    way = edge.end_mm - edge.start_mm
    length = max(float(np.linalg.norm(way)), 1e-9)
    along = float((corner.at_mm - edge.start_mm) @ way) / length
    return -BEYOND_MM <= along <= length + BEYOND_MM
