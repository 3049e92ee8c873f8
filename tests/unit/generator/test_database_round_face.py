"""A plane rolled about a round face: it stands where the round face for which facets stand is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from generator.database.round_face import Bend, RoundFace, round_face
from generator.polyhedron.shapes import cone, cylinder

SOLIDS = [cylinder(60, 80), cylinder(200, 40), cone(110, 60, 70), cone(60, 60), cone(90, 25, 50)]
CHORD = 0.02  # mm by which facets leave the round face


@pytest.fixture(params=SOLIDS, ids=lambda solid: f"{solid.kind}-{np.ptp(solid.vertices[:, 0]):.0f}")
def face(request) -> RoundFace:
    return round_face(request.param, request.param.surfaces[0])


def places(face: RoundFace, number: int) -> np.ndarray:
    """Return places of the unrolled face, away from the tip of a cone."""
    d, rng = face.development, np.random.default_rng(1)
    facet = rng.integers(len(d.T_object_flat), size=number)
    a, b = rng.random((2, number, 1)) * [[[1.0]], [[0.7]]]
    low = (1 - a) * d.low[facet] + a * d.low[facet + 1]
    high = (1 - a) * d.high[facet] + a * d.high[facet + 1]
    return (1 - b) * low + b * high


def beside(face: RoundFace, points: np.ndarray) -> np.ndarray:
    """Return how far points (n, 3) of the object lie outside the round face, axis z, base z = 0."""
    s = face.surface
    away = np.hypot(points[:, 0], points[:, 1]) - s.radius_mm
    return away * math.cos(s.half_angle_rad) + points[:, 2] * math.sin(s.half_angle_rad)


def test_it_touches_the_round_face_with_its_normal(face):
    alpha = face.surface.half_angle_rad
    for x, y in places(face, 40):
        T = face.tangent(x, y)
        assert T[:3, :3] @ T[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
        at = (T @ (x, y, 0, 1))[:3]
        assert abs(beside(face, at[None])[0]) < CHORD
        radial = np.array([*at[:2] / np.hypot(*at[:2]), 0.0])
        outward = math.cos(alpha) * radial + math.sin(alpha) * np.array([0.0, 0.0, 1.0])
        assert T[:3, 2] == pytest.approx(outward, abs=1e-3)
        gaps = (T - face.development.T_object_flat) @ (x, y, 0, 1)
        assert np.linalg.norm(gaps, axis=1).min() < 2 * CHORD


def test_the_face_falls_away_as_its_bend_says(face):
    rng = np.random.default_rng(2)
    for x, y in places(face, 20):
        T, bend, at = face.tangent(x, y), face.bend(x, y), np.array([x, y])
        about = rng.uniform(-0.4, 0.4, (6, 2)) * min(bend.radius_mm, 30.0)
        for height in (0.0, 1.0):
            falls = bend.raised(height).falls_mm(about)
            points = np.column_stack([about + at, height - falls, np.ones(6)]) @ T.T
            assert beside(face, points[:, :3]) == pytest.approx(height, abs=CHORD)
            there = bend.unrolled_mm(about, height) + at
            for (u, v), point in zip(there, points, strict=True):
                over = face.tangent(u, v) @ (u, v, height, 1)
                assert over == pytest.approx(point, abs=CHORD)


def test_a_bend_in_turned_axes_falls_alike_and_a_wide_one_is_flat():
    points = np.random.default_rng(4).uniform(-12, 12, (20, 2))
    bend, angle = Bend(35.0, 0.4, 0.3), 1.1
    c, s = math.cos(angle), math.sin(angle)
    turned = points @ np.array([[c, -s], [s, c]])  # the same points in axes turned by the angle
    assert bend.turned(angle).falls_mm(turned) == pytest.approx(bend.falls_mm(points), abs=1e-12)
    assert Bend(1e12, 0.3).falls_mm(points) == pytest.approx(0.0, abs=1e-9)
    assert Bend(1e7, 0.3).unrolled_mm(points, 1.0) == pytest.approx(points, abs=1e-4)
    slim, straight = Bend(40.0, 0.7, 1e-7), Bend(40.0, 0.7)
    assert slim.falls_mm(points) == pytest.approx(straight.falls_mm(points), abs=1e-4)


def test_beyond_the_face_and_at_the_tip_of_a_cone_all_is_finite():
    solid = cone(60, 60)
    face = round_face(solid, solid.surfaces[0])
    tip = face.development.high[0]
    assert (face.tangent(*tip) @ (*tip, 0, 1))[:3] == pytest.approx([0, 0, 60], abs=CHORD)
    points = np.random.default_rng(5).uniform(-12, 12, (20, 2))
    far = np.array([[0.0, 500.0], [-500.0, 3.0], *points])
    for bend in (Bend(20.0, 0.0), Bend(20.0, 0.0, 0.5), face.bend(*tip)):
        assert np.isfinite(bend.falls_mm(far)).all()
        assert np.isfinite(bend.unrolled_mm(far, 1.0)).all()
