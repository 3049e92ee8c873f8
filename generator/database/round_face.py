"""The plane that touches a round face: place in the unrolled plane -> pose, and curvature.

A flat plate on a cylinder or cone touches it along one straight line. `RoundFace.tangent(x, y)`
is the unrolled plane rolled about the round face until it touches along the line through (x, y).
Between the middles of facets the plane turns evenly, as it does on the round face for which the
facets stand. Lengths in mm, angles in rad; plane and heights as in `development`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron.development import Development, development
from generator.polyhedron.winged import Developable, Polyhedron

Array = NDArray[np.float64]

SHARPEST_MM = 1e-3  #: radius that the tip of a cone is given


@dataclass(frozen=True, slots=True)
class Bend:
    """Curvature of a round face as a plate sees it that touches it at one point."""

    radius_mm: float  #: of curvature, across the straight line through the point
    towards_rad: float  #: direction of that line in the plane, away from the tip of a cone
    half_angle_rad: float = 0.0  #: of the cone; 0 for a cylinder

    def raised(self, height_mm: float) -> Bend:
        """Return the bend of what stands so high over the face everywhere."""
        return Bend(self.radius_mm + height_mm, self.towards_rad, self.half_angle_rad)

    def turned(self, angle_rad: float) -> Bend:
        """Return the bend in axes turned by an angle against these."""
        towards = math.remainder(self.towards_rad - angle_rad, 2.0 * math.pi)
        return Bend(self.radius_mm, towards, self.half_angle_rad)

    def falls_mm(self, points_mm: Array) -> Array:
        """Return how far below the plane (n,) the face is at points (n, 2) about the point.

        Where the face has turned away altogether it is as low as it gets.
        """
        along, across = self._along_across(points_mm)
        radius = self._radius_at(along)
        steep = 1.0 - math.tan(self.half_angle_rad) ** 2
        square = across * across
        root = np.sqrt(np.maximum(radius * radius - steep * square, 0.0))
        return np.asarray(square / (radius + root))

    def unrolled_mm(self, points_mm: Array, height_mm: float = 0.0) -> Array:
        """Return the places (n, 2) of the unrolled face under points (n, 2) of the touching plane.

        The plane touches what stands `height_mm` over the face; a place is taken down to the
        face along the face's normal.
        """
        top = self.raised(height_mm)
        along, across = self._along_across(points_mm)
        falls = top.falls_mm(points_mm)
        if self.half_angle_rad == 0.0:
            around = self.radius_mm * np.arctan2(across, top.radius_mm - falls)
            up = along
        else:
            sine, cosine = math.sin(self.half_angle_rad), math.cos(self.half_angle_rad)
            from_tip = self.radius_mm * cosine / sine  # of the point, on the face
            slant = top.radius_mm * cosine / sine + along
            angle = sine * np.arctan2(across, slant * sine - falls * cosine)
            on_face = slant + falls * sine / cosine - height_mm * cosine / sine
            around, up = on_face * np.sin(angle), on_face * np.cos(angle) - from_tip
        c, s = math.cos(self.towards_rad), math.sin(self.towards_rad)
        return np.stack([c * up - s * around, s * up + c * around], axis=-1)

    def _along_across(self, points: Array) -> tuple[Array, Array]:
        c, s = math.cos(self.towards_rad), math.sin(self.towards_rad)
        return c * points[..., 0] + s * points[..., 1], c * points[..., 1] - s * points[..., 0]

    def _radius_at(self, along: Array) -> Array:
        grown = self.radius_mm + along * math.tan(self.half_angle_rad)
        return np.asarray(np.maximum(grown, 1e-3 * self.radius_mm))


@dataclass(frozen=True, slots=True, eq=False)
class RoundFace:
    """A round face of a polyhedron, unrolled."""

    surface: Developable
    development: Development

    @property
    def outline_mm(self) -> Array:
        """Its polygon (k, 2) in the unrolled plane."""
        return self.development.outline

    def bend(self, x: float, y: float) -> Bend:
        """Return the bend where a plate touches at a place of the unrolled plane."""
        d, alpha = self.development, self.surface.half_angle_rad
        if alpha == 0.0:
            up = d.high[0] - d.low[0]
            return Bend(self.surface.radius_mm, math.atan2(up[1], up[0]))
        away = np.array([x, y]) - self._tip()
        radius = float(np.hypot(*away)) * math.tan(alpha)
        return Bend(max(radius, SHARPEST_MM), math.atan2(away[1], away[0]), alpha)

    def tangent(self, x: float, y: float) -> Array:
        """Return T_object_plane (4, 4) of the plane that touches along the line through (x, y)."""
        d, alpha = self.development, self.surface.half_angle_rad
        facet = self._facet(x, y)
        T = d.T_object_flat[facet]
        low, high = d.low[facet : facet + 2].mean(axis=0), d.high[facet : facet + 2].mean(axis=0)
        inward = -1.0 if not self.surface.concave else 1.0
        if alpha == 0.0:
            up = (high - low) / np.hypot(*(high - low))
            across = float((np.array([x, y]) - low) @ (up[1], -up[0]))
            back = np.eye(4)
            back[:2, 3] = -across * up[1], across * up[0]
            axis = T[:3, :2] @ up
            centre = T[:3, :2] @ low + T[:3, 3] + inward * self.surface.radius_mm * T[:3, 2]
            turn = -inward * across / self.surface.radius_mm
            return np.asarray(_rotation_about(centre, axis, turn) @ T @ back)
        tip = self._tip()
        middle, away = (low + high) / 2.0 - tip, np.array([x, y]) - tip
        opened = math.atan2(middle[0] * away[1] - middle[1] * away[0], middle @ away)
        down = middle / np.hypot(*middle)
        back = np.eye(4)
        c, s = math.cos(opened), math.sin(opened)
        back[:2, :2] = [[c, s], [-s, c]]
        back[:2, 3] = tip - back[:2, :2] @ tip
        axis = math.cos(alpha) * (T[:3, :2] @ down) + inward * math.sin(alpha) * T[:3, 2]
        centre = T[:3, :2] @ tip + T[:3, 3]
        turn = inward * opened / math.sin(alpha)
        return np.asarray(_rotation_about(centre, axis, turn) @ T @ back)

    def _facet(self, x: float, y: float) -> int:
        """Return the facet that holds a place, or the nearest at the sides of the face."""
        d = self.development
        if self.surface.half_angle_rad == 0.0:
            up = (d.high[0] - d.low[0]) / np.hypot(*(d.high[0] - d.low[0]))
            at = (np.array([x, y]) - d.low[0]) @ (up[1], -up[0])
            lines = (d.low - d.low[0]) @ (up[1], -up[0])
        else:
            tip = self._tip()
            first, each, away = d.low[0] - tip, d.low - tip, np.array([x, y]) - tip
            lines = np.arctan2(first[0] * each[:, 1] - first[1] * each[:, 0], each @ first)
            # The fan may open by more than half a turn.
            lines = np.unwrap(lines)
            middle = lines[-1] / 2.0
            at = math.atan2(first[0] * away[1] - first[1] * away[0], away @ first)
            at = middle + math.remainder(at - middle, 2.0 * math.pi)
        side = np.sign(lines[-1] - lines[0])
        return int(np.clip(np.searchsorted(side * lines, side * at) - 1, 0, len(lines) - 2))

    def _tip(self) -> Array:
        """Return where the lines of a cone meet in the plane."""
        d = self.development
        middle = len(d.low) // 2
        a, b = d.low[0], d.low[middle]
        u, v = d.high[0] - a, d.high[middle] - b
        share = ((b[0] - a[0]) * v[1] - (b[1] - a[1]) * v[0]) / (u[0] * v[1] - u[1] * v[0])
        return np.asarray(a + share * u)


def round_face(polyhedron: Polyhedron, surface: Developable) -> RoundFace:
    """Return a round face, unrolled."""
    return RoundFace(surface, development(polyhedron, surface))


def _rotation_about(centre: Array, axis: Array, angle: float) -> Array:
    """Return the turn (4, 4) by an angle about a line."""
    k = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -k[2], k[1]], [k[2], 0.0, -k[0]], [-k[1], k[0], 0.0]])
    turn = np.eye(4)
    turn[:3, :3] += math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    turn[:3, 3] = centre - turn[:3, :3] @ centre
    return turn
