"""Straight edges and the corners between them. Thesis 4.3, appendix 3.

An edge is the line n x = offset with the unit normal n = (cos angle, sin angle) that points into
the face: n x - offset is how far a point lies inside. Angle and offset stay finite for every
direction, unlike slope and intercept. Image frame, mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PARALLEL = 0.1  #: sine of the angle below which two edges have no corner


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """A straight edge of the pressed area."""

    angle_rad: float  #: of the normal that points into the face
    offset_mm: float  #: of the line from the image frame's origin, along that normal
    start_mm: Array  #: (2,) ends of the visible part, the face to the left of the way
    end_mm: Array  #: (2,)
    points: int  #: number of its edge points
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
        """Return how far points (..., 2) lie on the face's side of the line."""
        return np.asarray(points_mm @ self.normal - self.offset_mm)


@dataclass(frozen=True, slots=True, eq=False)
class Corner:
    """Where two edges meet."""

    at_mm: Array  #: (2,)
    first: Edge  #: walked with the face to the left, this one leads to the corner
    second: Edge  #: and this one away from it
    opening_rad: float  #: angle of the face; over pi where it goes round the corner
    covariance: Array  #: (3, 3) of x, y (mm) and theta (rad) of `T_image_corner`
    T_image_corner: Array  #: (4, 4) of a frame at the corner, x along the second edge, z outward


def fit_line(points_mm: Array, normals: Array, least_mm: float) -> Edge:
    """Return the straight line through points by least squares of their distances.

    Parameters
    ----------
    points_mm
        (n, 2), two or more, not all in one place.
    normals
        (n, 2) into the face, roughly: they define its side.
    least_mm
        Standard deviation of a point across the edge, at least.
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
    variance = max(least_mm, float(np.sqrt((across**2).sum() / max(1, len(away) - 2)))) ** 2
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
        points=len(points_mm),
        covariance=covariance,
    )


def corner_between(first: Edge, second: Edge, joint: Array | None = None) -> Corner | None:
    """Return the corner of two edges; None if they are parallel.

    Parameters
    ----------
    first, second
        In any order.
    joint
        (4, 4) covariance of the first one's angle and offset and the second one's; by default
        they are independent.
    """
    if abs(_cross(first.normal, second.normal)) < PARALLEL:
        return None
    offsets = np.array([first.offset_mm, second.offset_mm])
    at = np.asarray(np.linalg.solve(np.stack([first.normal, second.normal]), offsets), np.float64)
    spread = np.zeros((4, 4))
    spread[:2, :2], spread[2:, 2:] = first.covariance, second.covariance
    spread = spread if joint is None else joint
    # The first edge is the one that ends at the corner, the second the one that begins there.
    if _leads(first, at) + _leads(second, at, starts=True) < _leads(second, at) + _leads(
        first, at, starts=True
    ):
        first, second = second, first
        spread = spread[[2, 3, 0, 1]][:, [2, 3, 0, 1]]
    turn = math.remainder(second.angle_rad - first.angle_rad, math.tau)
    normals = np.stack([first.normal, second.normal])
    sides = np.stack([[-n[1], n[0]] for n in normals])  # derivatives of the normals by angle
    by_offset = np.linalg.inv(normals)
    jacobian = np.zeros((3, 4))
    for k in (0, 1):
        jacobian[:2, 2 * k] = -by_offset[:, k] * float(sides[k] @ at)
        jacobian[:2, 2 * k + 1] = by_offset[:, k]
    jacobian[2, 2] = 1.0
    return Corner(
        at, first, second, math.pi - turn, jacobian @ spread @ jacobian.T, _frame(at, second)
    )


def _frame(at: Array, edge: Edge) -> Array:
    theta = edge.angle_rad - math.pi / 2
    c, s = math.cos(theta), math.sin(theta)
    x, y = at.tolist()
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]], np.float64)


def _leads(edge: Edge, at: Array, *, starts: bool = False) -> float:
    """Return how far along the edge a point lies from its middle, forwards; or backwards."""
    way = edge.end_mm - edge.start_mm
    length = float(np.linalg.norm(way)) or 1.0
    ahead = float((at - (edge.start_mm + edge.end_mm) / 2) @ way) / length
    return -ahead if starts else ahead


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
