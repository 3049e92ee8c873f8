"""Simple bodies: heights worked by hand, and bounds that hold."""

import math

import numpy as np
import pytest
from reference.indenters import half_plane, sphere

from probe.errors import SurfaceError
from probe.surface import indenters

ALL = [
    indenters.FlatPlate(),
    indenters.TiltedPlane(0.05, -0.1),
    indenters.RaisedStrip(),
    indenters.Cross(),
    indenters.Washer(),
    indenters.RoughSurface(seed=3),
]


@pytest.mark.parametrize("surface", ALL, ids=lambda surface: type(surface).__name__)
def test_no_height_exceeds_the_top_and_none_is_nan(surface):
    heights = surface.heights_mm(np.random.default_rng(1).uniform(-150, 150, (20_000, 2)))
    assert heights.shape == (20_000,)
    assert not np.isnan(heights).any()
    assert heights.max() <= surface.top_mm < math.inf
    assert surface.heights_mm(np.zeros((0, 2))).shape == (0,)


@pytest.mark.parametrize(
    ("surface", "inside", "outside"),
    [
        (indenters.Washer(), [(7.5, 0), (3.5, 0), (0, -5)], [(7.51, 0), (3.49, 0), (0, 0)]),
        (indenters.RaisedStrip(2.0, 10.0), [(1, 5), (-1, -5), (0, 0)], [(1.01, 0), (0, 5.01)]),
        (indenters.Cross(2.0, 20.0), [(10, 1), (-1, 10), (0, 0)], [(10.1, 0), (1.1, 1.1)]),
        (half_plane(), [(0, 99), (-5, 0)], [(1e-9, 0)]),
    ],
)
def test_outlines_belong_to_the_body(surface, inside, outside):
    assert (surface.heights_mm(np.array(inside, float)) == 0).all()
    assert (surface.heights_mm(np.array(outside, float)) == -math.inf).all()


def test_sphere_is_round_and_exact_near_its_top():
    heights = sphere(20.0).heights_mm(np.array([[12.0, 0.0], [1e-8, 0.0], [20.1, 0.0]]))
    # z = -r^2 / 2R to 16 digits where the plain formula has lost all of them
    assert heights == pytest.approx([-4.0, -2.5e-18, -math.inf], rel=1e-12, abs=0)


def test_rough_surface_is_its_seed_with_the_stated_rms():
    points = np.random.default_rng(0).uniform(-400, 400, (40_000, 2))
    one, again, other = (indenters.RoughSurface(n, 0.2).heights_mm(points) for n in (5, 5, 6))
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)
    assert one.std() == pytest.approx(0.2, rel=0.05)
    with pytest.raises(SurfaceError, match="shortest"):
        indenters.RoughSurface(shortest_mm=0.0)
