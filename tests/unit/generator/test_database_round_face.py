"""A plane rolled about a round face, in turned axes, nearly flat, beyond it and at its tip.

Where it lies and falls is held against written files: `tests/loop/test_round_faces.py`.
"""

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
