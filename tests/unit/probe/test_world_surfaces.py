"""Surfaces of worlds: two objects side by side, and symbols worn down to the face."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from probe.errors import SurfaceError
from probe.simulate.scene import bare_scene
from probe.simulate.world.surfaces import (
    GAP_MM,
    REACH_MM,
    STEP_MM,
    AdjacentParts,
    FramePlace,
    place_adjacent,
    worn_scene,
)
from probe.surface.face import FaceSurface
from probe.surface.mesh import mesh
from probe.surface.polygon import polygon

SQUARE = polygon([np.array([(0, 0), (40, 0), (40, 30), (0, 30)])])
TRIANGLE = polygon([np.array([(0, 0), (50, 0), (25, 45)])])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("first", "second"), [(SQUARE, TRIANGLE), (TRIANGLE, SQUARE)])
def test_faces_lie_beside_each_other_and_the_sensor_near_both(first, second, seed):
    place, at = place_adjacent(first, second, np.random.default_rng(seed))
    both = AdjacentParts(FaceSurface(None, first), FaceSurface(None, second), place)
    x, y = np.meshgrid(np.arange(-99.8, 140, 1.0), np.arange(-99.8, 140, 1.0))
    points = np.column_stack([x.ravel(), y.ravel()])
    on_first, on_second = first.contains(points), second.contains(place.into(points))
    assert not (on_first & on_second).any()
    area = {id(SQUARE): 1200.0, id(TRIANGLE): 1125.0}
    assert on_second.sum() == pytest.approx(area[id(second)], rel=0.03)
    heights = both.heights_mm(points)
    assert (heights[on_first] == 0).all()
    assert (heights[on_second] == place.z_mm).all()
    assert (heights[~on_first & ~on_second] == -np.inf).all()
    assert first.contains(at[None])[0]
    assert first.distance_mm(at[None])[0] <= REACH_MM
    beside = second.distance_mm(place.into(at[None]))[0]
    assert beside <= REACH_MM + GAP_MM
    assert abs(place.z_mm) <= STEP_MM


def test_two_bodies_are_one():
    a, b = np.zeros(3), np.array([10.0, 10.0, 10.0])
    corners = np.array([[(a, b)[i][0], (a, b)[j][1], (a, b)[k][2]]
                        for i in (0, 1) for j in (0, 1) for k in (0, 1)])  # fmt: skip
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = np.array(
        [[corners[f[i]] for i in three] for f in faces for three in ((0, 1, 2), (0, 2, 3))]
    )
    place = FramePlace(22.0, 0.0, -0.5, math.pi / 2)  # from x = 12 to 22
    both = AdjacentParts(mesh(cube), mesh(cube), place)
    solid = both.solid_mm
    volume = np.einsum("ni,ni->n", solid[:, 0], np.cross(solid[:, 1], solid[:, 2])).sum() / 6
    assert volume == pytest.approx(2000, rel=1e-5)
    again = mesh(solid)
    points = np.random.default_rng(1).uniform(-15, 30, (500, 2))
    np.testing.assert_allclose(again.heights_mm(points), both.heights_mm(points), atol=1e-4)


def test_a_face_without_an_outer_edge_is_refused():
    ring = np.linspace(0, 2 * math.pi, 20, endpoint=False)
    radius = np.where(np.arange(20) % 2, 10.0, 4.0)
    star = polygon([np.column_stack([radius * np.cos(ring), radius * np.sin(ring)])])
    with pytest.raises(SurfaceError, match="no edge beside which"):
        place_adjacent(star, SQUARE, np.random.default_rng(1))


TURN = 0.4  # of the face's x axis into the array's
CENTRES = (
    np.array([(i, j) for i in range(3) for j in range(3)])
    * 7.0
    @ np.array([[math.cos(TURN), -math.sin(TURN)], [math.sin(TURN), math.cos(TURN)]])
)


@dataclass(frozen=True)
class Dots:
    """Round dots of 2 mm at CENTRES, 1 mm high, on a face that stands .25 mm too high or low."""

    base_mm: float
    top_mm: float = 1.5

    def heights_mm(self, points_mm: np.ndarray) -> np.ndarray:
        away = np.linalg.norm(points_mm[:, None] - CENTRES, axis=2).min(axis=1)
        return self.base_mm + np.where(away < 2.0, 1.0, 0.0)


def worn_surface(surface, share, seed=1):
    rng = np.random.default_rng(seed)
    return worn_scene(bare_scene(surface), CENTRES, TURN, 7.0, share, rng).surface


@pytest.mark.parametrize("base", [0.0, 0.25, -0.25])
def test_a_worn_symbol_lies_level_with_the_face_around_it(base: float) -> None:
    surface = Dots(base)
    points = np.random.default_rng(1).uniform(-3.0, 14.0, (4000, 2))
    worn = worn_surface(surface, 1.0)
    assert worn.heights_mm(points) == pytest.approx(np.full(4000, base))
    whole = worn_surface(surface, 0.0)
    assert (whole.heights_mm(points) == surface.heights_mm(points)).all()


def test_only_what_is_drawn_is_worn() -> None:
    some = worn_surface(Dots(0.25), 0.5, seed=2)
    assert 0 < len(some.centres_mm) < len(CENTRES)
    left = some.heights_mm(CENTRES)
    gone = (np.abs(CENTRES[:, None] - some.centres_mm).max(axis=2) < 1e-9).any(axis=1)
    assert left == pytest.approx(np.where(gone, 0.25, 1.25))
