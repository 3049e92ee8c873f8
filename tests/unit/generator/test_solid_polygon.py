"""Triangles that the rounding of STL would turn over are exchanged for others."""

from __future__ import annotations

import numpy as np
import pytest

from generator.plane.polygon import triangle_areas
from generator.solid.triangulate import without_slivers

OFF_MM = 5e-7  #: of a point from a line of 10 mm: less than 32 bits hold at 20 mm


def test_a_triangle_thinner_than_stl_holds_is_flipped_away():
    points = np.array([(10.0, 10.0), (15.0, 10.0 - OFF_MM), (20.0, 10.0), (15.0, 15.0)])
    found = without_slivers(points, np.array([[0, 1, 2], [0, 2, 3]]))
    rounded = points.astype(np.float32).astype(float)
    assert triangle_areas(rounded[found]).min() > 1.0
    assert triangle_areas(points[found]).sum() == pytest.approx(25.0 + 5.0 * OFF_MM, rel=1e-12)
