"""Triangles, polygons and files as height fields."""

import numpy as np
import pytest
import shapely
from reference.mesh_heights import heights_by_numpy, heights_over

from probe.errors import SurfaceError
from probe.surface.body import triangulate
from probe.surface.mesh import mesh, sort_numbers
from probe.surface.polygon import polygon

SQUARE = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])
HOLE = np.array([[4.0, 4], [4, 6], [6, 6], [6, 4]])
HOOK = np.array([[0.0, 0], [10, 0], [10, 10], [7, 10], [7, 3], [0, 3]])


def box(low, high):
    """Twelve triangles of a closed box, counter-clockwise from outside."""
    x0, y0, z0 = low
    x1, y1, z1 = high
    p = np.array([[x, y, z] for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return p[[t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]]


def test_box_has_its_top_inside_and_nothing_beside():
    part = mesh(box((0, 0, -1), (4, 3, 2)))
    assert part.top_mm == 2.0
    assert len(part.corners) == 2  # of a closed mesh, walls and underside are left out
    points = np.array([[0.0, 0], [4, 3], [2, 1.5], [1, 0], [4.0001, 1], [2, -1e-9], [99, 99]])
    assert part.heights_mm(points).tolist() == [2, 2, 2, 2, -np.inf, -np.inf, -np.inf]
    assert part.heights_mm(np.zeros((0, 2))).shape == (0,)


def test_the_highest_of_several_bodies_counts_whatever_their_sense():
    bodies = np.concatenate([box((0, 0, 0), (4, 4, 1)), box((1, 1, 0), (2, 2, 3))[:, ::-1]])
    part = mesh(bodies)  # one of them inside out: no triangle is left out for its sense
    assert part.heights_mm(np.array([[0.5, 0.5], [1.5, 1.5]])).tolist() == [1.0, 3.0]


def test_frames_move_the_part_under_the_sensor():
    T = np.array([[0.0, 0, 1, 5], [0, 1, 0, 6], [-1, 0, 0, 7], [0, 0, 0, 1]])
    part = mesh(box((0, 0, 0), (1, 2, 3)), T)
    assert part.top_mm == 7.0
    assert part.heights_mm(np.array([[6.5, 7.0], [4.9, 7.0]])).tolist() == [7.0, -np.inf]


def test_slanted_triangles_are_planes_and_random_ones_as_by_brute_force():
    rng = np.random.default_rng(4)
    corners = rng.uniform(-5, 5, (300, 1, 3)) + rng.normal(size=(300, 3, 3))
    part = mesh(corners)
    points = rng.uniform(-7, 7, (400, 2))
    best = np.full(400, -np.inf)
    for a, b, c in corners:
        weights = np.linalg.solve(np.array([a, b, c]).T * [[1], [1], [0]] + [[0], [0], [1]],
                                  np.c_[points, np.ones(400)].T)  # fmt: skip
        z = np.where((weights >= 0).all(axis=0), weights.T @ [a[2], b[2], c[2]], -np.inf)
        best = np.maximum(best, z)
    ours = part.heights_mm(points)
    assert (np.isfinite(ours) == np.isfinite(best)).all()
    seen = np.isfinite(best)
    assert seen.sum() > 200
    assert np.abs(ours[seen] - best[seen]).max() < 1e-9


@pytest.mark.parametrize("turn", [0.0, 0.3])
def test_no_point_falls_through_the_edges_of_a_grid(turn):
    n = 12
    c, s = np.cos(turn), np.sin(turn)
    nodes = np.random.default_rng(2).uniform(0, 1e-3, (n + 1, n + 1, 3))
    nodes[..., :2] += np.stack(np.meshgrid(np.arange(n + 1), np.arange(n + 1)), -1)
    nodes = nodes @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    quads = [nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1]]
    a, b, d, e = (quad.reshape(-1, 3) for quad in quads)
    part = mesh(np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, e], 1)]))
    share = np.random.default_rng(3).random((3000, 1))
    inner = nodes[1:-1, 1:-1, :2].reshape(-1, 2)
    ends = np.random.default_rng(5).integers(0, len(a), 3000)
    on_diagonals = a[ends, :2] + share * (d[ends, :2] - a[ends, :2])
    for points in (inner, on_diagonals):
        # Strictly on an edge, or by rounding a hair beside it: never in a gap.
        inside = shapely.contains_xy(
            shapely.Polygon(
                np.r_[nodes[0], nodes[1:, -1], nodes[-1, -2::-1], nodes[-2:0:-1, 0]][:, :2]
            ),
            points,
        )
        assert inside.sum() > 100
        assert np.isfinite(part.heights_mm(points[inside])).all()


def test_upright_walls_cover_nothing():
    wall = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 0, 5]]])
    with pytest.raises(SurfaceError, match="no triangle covers"):
        mesh(wall)
    with pytest.raises(SurfaceError, match="NaN"):
        mesh(np.full((1, 3, 3), np.nan))


@pytest.mark.parametrize("loops", [[SQUARE], [SQUARE, HOLE], [HOOK], [HOOK[::-1]], [SQUARE[::-1]]])
def test_points_in_polygons_as_shapely_says(loops):
    region = polygon(loops)
    shape = shapely.Polygon(loops[0], loops[1:])
    points = np.random.default_rng(0).uniform(-1, 11, (5000, 2))
    points = np.concatenate([points, np.round(points)])  # corners and edges among them
    assert (region.contains(points) == shapely.intersects_xy(shape, points)).all()
    away = shapely.distance(shape.boundary, shapely.points(points))
    assert np.abs(region.distance_mm(points) - away).max() < 1e-9


@pytest.mark.parametrize("loops", [[], [SQUARE[:2]], [SQUARE * 0], [SQUARE * np.nan]])
def test_what_is_no_polygon_is_refused(loops):
    with pytest.raises(SurfaceError, match="outline"):
        polygon(loops)


def test_filled_loops_cover_their_area_once():
    points, triangles = np.concatenate([SQUARE, HOLE]), triangulate([SQUARE, HOLE])
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    areas = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert areas.min() > 0
    assert areas.sum() / 2 == pytest.approx(96.0)
    with pytest.raises(SurfaceError, match="cover"):
        triangulate([SQUARE[::-1]])


def test_level_ground_is_answered_by_its_bins_as_by_its_triangles():
    """A plate at z = 0 with a block on it: inside each bin, and on the plate's rim."""
    n = 40
    x, y = np.meshgrid(np.linspace(0, 10, n + 1), np.linspace(0, 10, n + 1), indexing="ij")
    high = ((x > 4.9) & (x < 7.1) & (y > 2.9) & (y < 8.1)).astype(float)
    top = np.stack([x, y, high], -1)
    low = np.stack([x, y, np.full_like(x, -1)], -1)
    quads = [(top[:-1, :-1], top[1:, :-1], top[1:, 1:], top[:-1, 1:]),
             (low[:-1, :-1], low[:-1, 1:], low[1:, 1:], low[1:, :-1])]  # fmt: skip
    for way in (0, 1):  # walls along x and along y, at both ends
        for end in (0, -1):
            a, b = top.take(end, axis=way), low.take(end, axis=way)
            a, b = (a[::-1], b[::-1]) if (way == 0) == (end == 0) else (a, b)
            quads.append((a[:-1], b[:-1], b[1:], a[1:]))
    found = []
    for corners in quads:
        a, b, c, d = (corner.reshape(-1, 3) for corner in corners)
        found += [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    triangles = np.concatenate(found)
    closed, apart = mesh(triangles), mesh(triangles[:-1])  # without one wall it is no body
    assert len(closed.corners) == 2 * n * n
    assert closed.level.sum() > n * n
    assert not apart.level.any()
    points = np.random.default_rng(7).uniform(-1, 11, (20_000, 2))
    points = np.concatenate([points, np.round(4 * points) / 4, np.round(points)])
    heights = closed.heights_mm(points)
    assert np.array_equal(heights, apart.heights_mm(points))
    inside = ((points >= 0) & (points <= 10)).all(axis=1)
    assert (np.isfinite(heights) == inside).all()
    assert 0.4 < closed.bins.level.mean() < 0.95


@pytest.mark.parametrize("width", [3.0, 1e-7])
def test_bins_hold_every_triangle_that_points_lie_under(width):
    """Long, thin and almost upright triangles, turned any way, against all triangles."""
    rng = np.random.default_rng(11)
    a = rng.uniform(-20, 20, (150, 2))
    along, angle = rng.uniform(0.5, 25, 150), rng.choice([0, np.pi / 2, 0.3, 2.0], 150)
    b = a + along[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    c = (a + b) / 2 + width * np.column_stack([-np.sin(angle), np.cos(angle)])
    heights = rng.uniform(0, 5, (150, 3, 1))
    part = mesh(np.concatenate([np.stack([a, b, c], 1), heights], axis=2))
    weights = rng.dirichlet([0.3, 0.3, 0.3], (len(part.corners), 6))
    points = np.einsum("npk,nkj->npj", weights, part.corners[:, :, :2]).reshape(-1, 2)
    x, y = points.T
    number = np.arange(len(part.corners))
    over = [heights_over(part, number, np.full(len(number), u), np.full(len(number), v)).max()
            for u, v in zip(x, y, strict=True)]  # fmt: skip
    assert np.isfinite(over).mean() > 0.4
    assert np.array_equal(part.heights_mm(points), np.minimum(over, part.top_mm))


@pytest.mark.parametrize("most", [1, 1 << 17, 1 << 50])
def test_numbers_are_sorted_as_numpy_sorts_them(most):
    numbers = np.random.default_rng(2).integers(0, most, 4000)
    numbers = np.concatenate([numbers, numbers[::3]])
    assert np.array_equal(sort_numbers(numbers), np.argsort(numbers, kind="stable"))
    assert len(sort_numbers(numbers[:0])) == 0


def scattered(rng):
    """Triangles of all slopes, some of them upright or level."""
    corners = rng.uniform(-5, 5, (300, 1, 3)) + rng.normal(size=(300, 3, 3))
    corners[::7, :, 2] = 0.0
    corners[::11, 1] = corners[::11, 0]
    return corners


@pytest.mark.parametrize(
    "triangles",
    [
        scattered(np.random.default_rng(8)),
        np.concatenate([box((0, 0, -1), (4, 3, 0)), box((1, 1, -0.5), (2, 2, 0.7))]),
        np.c_[np.concatenate([SQUARE, HOLE]), np.arange(8.0)][triangulate([SQUARE, HOLE])],
    ],
    ids=["scattered", "bodies", "square with a hole"],
)
def test_compiled_heights_are_those_of_numpy(triangles):
    part = mesh(triangles)
    rng = np.random.default_rng(9)
    corners = part.corners[:, :, :2].reshape(-1, 2)
    middles = (corners + np.roll(corners, 1, axis=0)) / 2
    anywhere = rng.uniform(corners.min(axis=0) - 1, corners.max(axis=0) + 1, (4000, 2))
    beside = np.array([[np.nan, 0.0], [np.inf, 0.0], [0.0, -np.inf], [1e300, 1e300]])
    points = np.concatenate([corners, middles, anywhere, beside])
    for some in (points, points[::-1], points[:0], points[::3]):
        expected = heights_by_numpy(part, some)
        assert (part.heights_mm(some) == expected).all()  # to the bit, but for the sign of 0
    assert np.isfinite(part.heights_mm(corners)).all()
