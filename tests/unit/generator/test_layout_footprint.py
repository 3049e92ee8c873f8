"""Where a footprint may stand: cases worked by hand."""

import numpy as np
import pytest

from generator.layout.footprint import (
    blocked_intervals,
    free_grid,
    mirror_region,
    move_region,
    region_of,
)

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])


def square(clearance=1.0, hole=None):
    loops = [SQUARE] if hole is None else [SQUARE, hole]
    return region_of(loops, [np.full(len(loop), clearance) for loop in loops])


def test_a_square_leaves_the_middle_and_its_limits_count_as_free():
    x = np.array([2.9, 3.0, 5.0, 7.0, 7.1])
    free = free_grid(square(), 2.0, x, x)
    assert free.tolist() == [[2.9 < a < 7.1 and 2.9 < b < 7.1 for b in x] for a in x]


def test_each_edge_has_its_own_clearance():
    region = region_of([SQUARE], [np.array([0.0, 1.0, 2.0, 3.0])])  # bottom, right, top, left
    x, y = np.array([4.9, 5.0, 7.0, 7.1]), np.array([1.9, 2.0, 6.0, 6.1])
    expected = np.outer([False, True, True, False], [False, True, True, False])
    assert np.array_equal(free_grid(region, 2.0, y, x), expected)


def test_a_hole_keeps_its_distance_on_every_side():
    hole = np.array([[4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 4.0]])  # clockwise
    x = np.array([1.0, 2.4, 2.6, 5.0, 7.4, 7.6, 9.0])
    free = free_grid(square(0.5, hole), 0.5, np.array([5.0]), x)[0]
    assert free.tolist() == [True, True, True, False, True, True, True]
    free = free_grid(square(1.0, hole), 0.7, np.array([5.0]), x)[0]
    assert free.tolist() == [False, False, False, False, False, False, False]


def test_a_corner_is_kept_clear_by_a_circle():
    # The corner of the L at (5, 5): a footprint towards the open side is seen along the diagonal.
    corner = np.array(
        [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [5.0, 20.0], [5.0, 15.0], [0.0, 15.0]]
    )
    region = region_of([corner], [np.full(6, 2.0)])
    low, high = blocked_intervals(region, 1.0, np.array([13.0]))
    # The square's corner is 1 mm below the vertex (5, 15), so 3^0.5 mm beside it is near enough.
    edge = 3  # from (5, 20) to (5, 15)
    assert (low[edge, 0], high[edge, 0]) == pytest.approx((4 - 3**0.5, 6 + 3**0.5), abs=1e-6)


@pytest.mark.parametrize("angle", np.linspace(0.1, 6.2, 14))
def test_blocked_intervals_of_a_slanted_edge_agree_with_distances(angle):
    shapely = pytest.importorskip("shapely")
    end = 6.0 * np.array([np.cos(angle), np.sin(angle)])
    region = region_of([np.array([[0.0, 0.0], end])], [np.array([1.5, 1.5])])
    y = np.linspace(-11.0, 11.0, 45)
    low, high = blocked_intervals(region, 2.0, y)
    x = np.linspace(-11.0, 11.0, 89)
    segment = shapely.LineString([(0, 0), end])
    for line, a, b in zip(y, low[0], high[0], strict=True):
        near = [
            segment.distance(shapely.box(c - 2, line - 2, c + 2, line + 2)) < 1.5 - 1e-6 for c in x
        ]
        assert ((x > a) & (x < b)).tolist() == near


def test_moved_and_mirrored_keep_the_face_on_the_left():
    region = move_region(square(), np.pi / 2, 10.0, 0.0)
    assert np.allclose(region.start[0], (10, 0))
    x = np.array([5.0])
    assert free_grid(region, 2.0, x, x).all()
    assert free_grid(mirror_region(region), 2.0, x, x).all()
