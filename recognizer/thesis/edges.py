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
that continues no EDGE is dropped.

An edge is the line n x = offset with the unit normal n = (cos angle, sin angle) that points into
the face: n x - offset is how far a point lies inside. Image frame, mm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recognizer.thesis.filters import magnify_image, median, sobel, subtract_bias
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
PARALLEL = 0.1  #: sine of the angle below which two edges have no corner
BEYOND_MM = 5.0  #: how far from the visible parts of its edges a corner may lie


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A straight edge of the pressed area."""

    angle_rad: float  #: of the normal that points into the face
    offset_mm: float  #: of the line from the image frame's origin, along that normal
    start_mm: Array  #: (2,) ends of the visible part, the face to the left of the way
    end_mm: Array  #: (2,)
    covariance: Array  #: (2, 2) of angle (rad) and offset (mm)

    @property
    def normal(self) -> Array:
        """Unit vector (2,) into the face."""
        return np.array([math.cos(self.angle_rad), math.sin(self.angle_rad)])

    @property
    def length_mm(self) -> float:
        """Length of the visible part."""
        return float(np.linalg.norm(self.end_mm - self.start_mm))

    @property
    def middle_mm(self) -> Array:
        """Middle (2,) of the visible part."""
        return (self.start_mm + self.end_mm) / 2

    @property
    def direction_deg(self) -> float:
        """Where the edge runs with the face to its left, -180 to 180 from the image's x."""
        return math.degrees(math.remainder(self.angle_rad - math.pi / 2, math.tau))

    @property
    def across_mm(self) -> float:
        """Standard deviation of the middle across the edge."""
        lever = np.array([self.middle_mm @ (-self.normal[1], self.normal[0]), -1.0])
        return math.sqrt(float(lever @ self.covariance @ lever))

    @property
    def turn_deg(self) -> float:
        """Standard deviation of the direction."""
        return math.degrees(math.sqrt(float(self.covariance[0, 0])))

    def inside_mm(self, points_mm: Array) -> Array:
        """Return how far points (..., 2) lie inside of the line."""
        return np.asarray(points_mm @ self.normal - self.offset_mm)


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


def classical_edges(image: TactileImage) -> tuple[Edge, ...]:
    """Return the edges in the readings of a touch or a mosaic, the longest first."""
    over = median(subtract_bias(image))
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
    before, after = (
        map_coordinates(
            slope, [rows - side * normals[:, 1], columns + side * normals[:, 0]], order=1
        )
        for side in (-1, 1)
    )
    highest = (at >= before) & (at > after)
    rows, columns, normals = rows[highest], columns[highest], normals[highest]
    before, at, after = before[highest], at[highest], after[highest]
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
        taken = np.zeros(0, np.intp)
        for angle, offset in _peaks(left):
            for _ in range(2):  # the points of the peak, then those of the line through them
                run = _longest_run(left, angle, offset)
                if len(run) < LEAST_POINTS:
                    break
                members = left.chosen(run)
                edge = fit_line(members.at_mm, members.normals)
                angle, offset = edge.angle_rad, edge.offset_mm
            else:
                if best is None or edge.length_mm > best.edge.length_mm:
                    best, taken = Segment(members, edge), run
        if best is None or best.edge.length_mm < LEAST_MM:
            break
        found.append(best)
        left = left.chosen(np.delete(np.arange(len(left)), taken))
    return sorted(found, key=lambda segment: -segment.edge.length_mm)


def fuse_segments(segments: Sequence[Segment]) -> tuple[Edge, ...]:
    """Return the edges made of segments; of both the longest first."""
    edges: list[Segment] = []
    for part in segments:
        k = next((k for k, e in enumerate(edges) if _is_one_edge(e.edge, part.edge)), None)
        if k is not None:
            at = np.concatenate([edges[k].points.at_mm, part.points.at_mm])
            normals = np.concatenate([edges[k].points.normals, part.points.normals])
            edges[k] = Segment(EdgePoints(at, normals), fit_line(at, normals))
        elif part.edge.length_mm >= BREAK_MM:
            edges.append(part)
    edges.sort(key=lambda segment: -segment.edge.length_mm)
    return tuple(segment.edge for segment in edges)


def fit_line(points_mm: Array, normals: Array) -> Edge:
    """Return the straight line through points by least squares of their distances.

    Parameters
    ----------
    points_mm
        (n, 2), two or more, not all in one place.
    normals
        (n, 2) roughly into the face.
    """
    middle = points_mm.mean(axis=0)
    away = points_mm - middle
    xx, yy, xy = (away[:, 0] ** 2).sum(), (away[:, 1] ** 2).sum(), away.prod(axis=1).sum()
    along = 0.5 * math.atan2(2 * xy, xx - yy)
    angle = along + math.pi / 2
    if normals.sum(axis=0) @ (math.cos(angle), math.sin(angle)) < 0:
        angle -= math.pi
    n = np.array([math.cos(angle), math.sin(angle)])
    t = np.array([n[1], -n[0]])  # the face lies to its left
    across, places = away @ n, away @ t
    variance = max(SPREAD_MM, float(np.sqrt((across**2).sum() / max(1, len(away) - 2)))) ** 2
    spread = float((places**2).sum())
    # offset = n(angle) middle: a turn of the line moves it at the origin, too
    lever = float(middle @ t)
    turning = variance / spread if spread > 0 else math.pi**2
    by_turn = np.array([1.0, -lever])
    covariance = turning * np.outer(by_turn, by_turn) + np.diag([0.0, variance / len(away)])
    return Edge(
        angle_rad=angle,
        offset_mm=float(middle @ n),
        start_mm=middle + places.min() * t,
        end_mm=middle + places.max() * t,
        covariance=covariance,
    )


def vertices(edges: Sequence[Edge]) -> list[Array]:
    """Return the corners (2,) of edges that turn and are visible up to them."""
    found = []
    for pair in itertools.combinations(edges, 2):
        normals = np.stack([edge.normal for edge in pair])
        between = _angle_between(*pair)
        if between >= STRAIGHT_RAD or abs(math.sin(between)) < PARALLEL:
            continue
        at = np.asarray(np.linalg.solve(normals, [edge.offset_mm for edge in pair]), np.float64)
        if all(_reaches(edge, at) for edge in pair):
            found.append(at)
    return found


def _peaks(points: EdgePoints) -> list[tuple[float, float]]:
    """Return angle and offset of the fullest lines, refined."""
    reach = float(np.abs(points.at_mm).max()) * math.sqrt(2) + COARSE_MM
    angles = (np.arange(DIRECTIONS) + 0.5) * math.tau / DIRECTIONS
    offsets = np.arange(-reach, reach + COARSE_MM, COARSE_MM)
    votes = _votes(points, angles, offsets, COARSE_MM)
    order = np.argsort(-votes, axis=None, kind="stable")[:STARTS]
    starts = zip(*np.unravel_index(order, votes.shape), strict=True)
    return [_refine_line(points, angles[row], offsets[column]) for row, column in starts]


def _refine_line(points: EdgePoints, angle: float, offset: float) -> tuple[float, float]:
    turn, cell = math.tau / DIRECTIONS, COARSE_MM
    around = np.arange(-AROUND, AROUND + 1.0)
    while cell > FINE_MM:
        turn, cell = turn / 2, cell / 2
        angles, offsets = angle + around * turn, offset + around * cell
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
    if _angle_between(edge, part) < STRAIGHT_RAD:
        return False
    ends = np.stack([part.start_mm, part.end_mm])
    if np.abs(edge.inside_mm(ends)).max() > ACROSS_MM:
        return False
    way = np.array([edge.normal[1], -edge.normal[0]])
    own = sorted([float(edge.start_mm @ way), float(edge.end_mm @ way)])
    others: list[float] = sorted((ends @ way).tolist())
    return max(others[0] - own[1], own[0] - others[1]) <= APART_MM


def _angle_between(one: Edge, other: Edge) -> float:
    """Return the angle between two directions; straight on is pi."""
    return math.pi - abs(math.remainder(other.angle_rad - one.angle_rad, math.tau))


def _reaches(edge: Edge, corner_mm: Array) -> bool:
    along = float((corner_mm - edge.start_mm) @ (edge.end_mm - edge.start_mm))
    along /= max(edge.length_mm, 1e-9)
    return -BEYOND_MM <= along <= edge.length_mm + BEYOND_MM
