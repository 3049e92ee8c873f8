"""Straight lines of a development -> curves on the cylinder or cone, as Bezier curves.

A point (x, y) of the plane at height z lies on the surface moved outward by z: on a cylinder x
goes around and y along the axis, on a cone angle and distance about the tip do. A straight
line becomes a helix or a geodesic; its Bezier curve goes through points of it, as many as keep
it on the surface within `bend_error_mm`. Lengths in mm, frame of the face's axis.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from generator.polyhedron.development import Development
from generator.solid.analytic import AnalyticFace, Points
from generator.solid.settings import EMBOSS


class RoundSurfaceMap:
    """From the plane of a development to the round face."""

    def __init__(self, face: AnalyticFace, development: Development) -> None:
        self.face = face
        low, high = development.low, development.high
        self.origin = low[0]
        self.up = (high[0] - low[0]) / np.hypot(*(high[0] - low[0]))
        if face.slope == 0.0:
            self.right = np.array([self.up[1], -self.up[0]])
            self.spread = face.angle_rad / float((low[-1] - low[0]) @ self.right)
            return
        a, b = face.low.radius_mm, face.high.radius_mm
        self.tip = low[0] + a / (a - b) * (high[0] - low[0])
        arms = low - self.tip
        turns = np.unwrap(np.arctan2(arms[:, 1], arms[:, 0]))
        self.first, self.way = float(turns[0]), math.copysign(1.0, turns[-1] - turns[0])
        self.spread = face.angle_rad / float(turns[-1] - turns[0])
        sine = abs(math.sin(math.atan(face.slope)))
        self.slant = a / sine / float(np.hypot(*arms[0]))  # lines stand outside the round face

    def __call__(self, flat: Points, z_mm: Points) -> Points:
        """Return points (..., 2) of the plane at heights (...) on the round face, (..., 3)."""
        face = self.face
        moved = -z_mm if face.concave else z_mm
        if face.slope == 0.0:
            offset = flat - self.origin
            angle = offset @ self.right * self.spread
            radius, height = face.low.radius_mm + moved, offset @ self.up
        else:
            arms = flat - self.tip
            turned = np.arctan2(arms[..., 1], arms[..., 0]) - self.first
            angle = (self.way * turned % (2.0 * math.pi)) * self.way * self.spread
            along = np.hypot(arms[..., 0], arms[..., 1]) * self.slant
            lean = math.atan(face.slope)
            sine, cosine = abs(math.sin(lean)), math.cos(lean)
            tip = face.low.height_mm - face.low.radius_mm / face.slope
            radius = along * sine + moved * cosine
            height = tip + math.copysign(1.0, face.slope) * (along * cosine - moved * sine)
        bent: Points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=-1)
        return bent


def bend_lines(
    place: RoundSurfaceMap,
    starts: Points,
    steps: Points,
    z_mm: Points,
    walls: NDArray[np.int64],
) -> list[Points]:
    """Return the control points of lines on the round face, each (degree, 3) without its end.

    Parameters
    ----------
    place
        The round face.
    starts, steps, z_mm
        (k, 2), (k, 2), (k,): where a line begins, how far it goes, and its height.
    walls
        (k,): lines of one number get one degree, as a ruled surface needs it.
    """
    found: list[Points] = [np.zeros((0, 3))] * len(starts)
    left = np.arange(len(starts))
    for n in range(EMBOSS.bend_degrees[0], EMBOSS.bend_degrees[1] + 1):
        controls = _interpolate(place, starts[left], steps[left], z_mm[left], n)
        bad = np.unique(walls[left][_off(place.face, controls, z_mm[left]) > EMBOSS.bend_error_mm])
        again = np.isin(walls[left], bad) & (n < EMBOSS.bend_degrees[1])
        for k, own in zip(left[~again].tolist(), controls[~again], strict=True):
            found[k] = own[:-1]
        left = left[again]
        if not len(left):
            break
    return found


def _interpolate(
    place: RoundSurfaceMap, starts: Points, steps: Points, z_mm: Points, n: int
) -> Points:
    """Return the Bezier curves (k, n + 1, 3) of degree n through n + 1 points of each line."""
    t = 0.5 - 0.5 * np.cos(np.pi * np.arange(n + 1) / n)
    flat = starts[:, None, :] + t[None, :, None] * steps[:, None, :]
    points = place(flat, np.broadcast_to(z_mm[:, None], flat.shape[:2]))
    controls = np.asarray(np.linalg.solve(_bernstein(t, n), points), dtype=np.float64)
    controls[:, 0], controls[:, -1] = points[:, 0], points[:, -1]
    return controls


def _bernstein(t: Points, n: int) -> Points:
    """Return the Bernstein polynomials of degree n at t, (len(t), n + 1)."""
    binomials = np.array([math.comb(n, k) for k in range(n + 1)])
    k = np.arange(n + 1)
    polynomials: Points = binomials * np.power(t[:, None], k) * np.power(1.0 - t[:, None], n - k)
    return polynomials


def _off(face: AnalyticFace, controls: Points, z_mm: Points) -> Points:
    """Return how far curves leave the surface moved outward by z, (k,) mm."""
    t = np.linspace(0.0, 1.0, EMBOSS.bend_samples)
    points = _bernstein(t, controls.shape[1] - 1) @ controls
    radius: Points = face.radius_at(points[..., 2], z_mm[:, None])
    off: Points = np.abs(np.hypot(points[..., 0], points[..., 1]) - radius).max(axis=1)
    return off
