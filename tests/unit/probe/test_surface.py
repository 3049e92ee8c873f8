"""Surfaces: simple bodies, triangles, polygons, heights as a mesh, and symbols from strokes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from reference.indenters import block, half_plane, sphere
from reference.mesh_heights import heights_by_numpy, heights_over
from shapely.geometry import MultiPoint

from probe.errors import SurfaceError
from probe.surface import indenters
from probe.surface.body import close_below, manifold_from, mesh_heights, triangulate
from probe.surface.face import (
    LatticeSurface,
    list_lookup,
    template,
    tile_lookup,
)
from probe.surface.mesh import mesh, sort_numbers
from probe.surface.polygon import polygon
from probe.surface.symbols import Relief, emboss, outline

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


SQUARE = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])
HOLE = np.array([[4.0, 4], [4, 6], [6, 6], [6, 4]])
HOOK = np.array([[0.0, 0], [10, 0], [10, 10], [7, 10], [7, 3], [0, 3]])


def test_box_has_its_top_inside_and_nothing_beside():
    part = mesh(block((0, 0, -1), (4, 3, 2)))
    assert part.top_mm == 2.0
    assert len(part.corners) == 2  # of a closed mesh, walls and underside are left out
    points = np.array([[0.0, 0], [4, 3], [2, 1.5], [1, 0], [4.0001, 1], [2, -1e-9], [99, 99]])
    assert part.heights_mm(points).tolist() == [2, 2, 2, 2, -np.inf, -np.inf, -np.inf]
    assert part.heights_mm(np.zeros((0, 2))).shape == (0,)


def test_the_highest_of_several_bodies_counts_whatever_their_sense():
    bodies = np.concatenate([block((0, 0, 0), (4, 4, 1)), block((1, 1, 0), (2, 2, 3))[:, ::-1]])
    part = mesh(bodies)  # one of them inside out: no triangle is left out for its sense
    assert part.heights_mm(np.array([[0.5, 0.5], [1.5, 1.5]])).tolist() == [1.0, 3.0]


def test_frames_move_the_part_under_the_sensor():
    T = np.array([[0.0, 0, 1, 5], [0, 1, 0, 6], [-1, 0, 0, 7], [0, 0, 0, 1]])
    part = mesh(block((0, 0, 0), (1, 2, 3)), T)
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
        np.concatenate([block((0, 0, -1), (4, 3, 0)), block((1, 1, -0.5), (2, 2, 0.7))]),
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


STEP, BOTTOM = 0.1, -9.0


def scene(cells, rng):
    """Return heights with spikes, a slope and a step: nothing that a mesh could do at once."""
    heights = rng.normal(size=(cells + 1, cells + 1)) * (rng.random((cells + 1, cells + 1)) < 0.05)
    heights += np.linspace(0, 0.3, cells + 1)
    heights[cells // 4 : cells // 2, cells // 3 :] += 1.0
    return heights


def missed(heights, triangles):
    """Return the largest error of the mesh at the places within the grid."""
    corners, faces = close_below(heights, triangles, STEP, BOTTOM)
    cells = len(heights) - 1
    at = STEP * (np.arange(cells + 1) - cells / 2)
    points = np.stack(np.meshgrid(at, at), axis=-1)[1:-1, 1:-1].reshape(-1, 2)
    found = mesh(corners[faces]).heights_mm(points).reshape(cells - 1, cells - 1)
    return float(np.abs(found - heights[1:-1, 1:-1]).max())


@pytest.mark.parametrize("cells", [2, 8, 32])
@pytest.mark.parametrize("tolerance", [0.0, 0.05, 0.5])
def test_no_height_is_missed_by_more_than_the_tolerance(cells, tolerance):
    heights = scene(cells, np.random.default_rng([5, cells]))
    triangles = mesh_heights(heights, tolerance)
    assert missed(heights, triangles) <= tolerance + 1e-9
    assert len(triangles) <= 2 * cells**2


def test_a_tolerance_is_used():
    heights = scene(32, np.random.default_rng(5))
    counts = [len(mesh_heights(heights, t)) for t in (0.0, 0.1, 0.5, 9.0)]
    assert counts[0] > counts[1] > counts[2] > counts[3] == 2
    assert missed(heights, mesh_heights(heights, 0.5)) > 0.25


def test_a_slope_is_two_triangles_and_a_corner_of_it_a_few():
    row, column = np.indices((17, 17)).astype(float)
    assert len(mesh_heights(0.3 * row - 0.2 * column, 1e-9)) == 2
    raised = np.zeros((17, 17))
    raised[0, 0] = 1.0
    # Halved from the whole square down to the smallest triangle at that corner, and no further.
    assert len(mesh_heights(raised, 0.1)) == 2 + 2 * 8


@pytest.mark.parametrize("tolerance", [0.0, 0.2])
def test_the_body_is_closed_and_holds_what_lies_below_the_heights(tolerance):
    heights = scene(16, np.random.default_rng(8))
    triangles = mesh_heights(heights, tolerance)
    body = manifold_from(*close_below(heights, triangles, STEP, BOTTOM))  # refuses cracks
    side = heights.ravel()[triangles].mean(axis=1)
    at = np.stack([triangles % 17, triangles // 17], axis=-1) * STEP
    (x1, y1), (x2, y2) = ((at[:, k] - at[:, 0]).T for k in (1, 2))
    area = (x1 * y2 - x2 * y1) / 2
    assert (area > 0).all()
    assert area.sum() == pytest.approx((16 * STEP) ** 2)
    assert body.volume() == pytest.approx(float((area * (side - BOTTOM)).sum()), rel=1e-5)
    box = body.bounding_box()
    assert box[:3] == pytest.approx((-0.8, -0.8, BOTTOM))
    assert box[3:5] == pytest.approx((0.8, 0.8))


@pytest.mark.parametrize("shape", [(9, 5), (2, 2), (13, 13)])
def test_other_grids_are_refused(shape):
    with pytest.raises(SurfaceError, match="power of two"):
        mesh_heights(np.zeros(shape), 0.1)


# An L, a glyph with a closed loop, one with a shallow diagonal, and strokes that only touch.
L = (((-1, 1), (-1, -1)), ((-1, -1), (1, -1)))
LOOP = (*L, ((-1, 0), (0, 1)), ((0, -1), (0, 0)), ((-1, 0), (0, 0)))
SHALLOW = (((-1, 0), (1, 1)), ((-1, 0), (1, 0)), ((0, 0), (1, -1)))
GLYPHS = (L, LOOP, SHALLOW)
UNIT, PITCH = 1.82, 7.0
RELIEFS = [
    Relief(),
    Relief(chamfer_mm=0.15),
    Relief(draft_rad=0.0),
    Relief(draft_rad=0.0, chamfer_mm=0.1),
    Relief(height_mm=0.5, stroke_mm=1.1, draft_rad=0.3),
]


def region(glyph, stroke):
    """Union of the nib's hulls, by shapely."""
    turns = (np.arange(8) + 0.5) * math.pi / 4
    nib = stroke / 2 / math.cos(math.pi / 8) * np.stack([np.cos(turns), np.sin(turns)], 1)
    hulls = [
        MultiPoint(np.concatenate([UNIT * np.array(a) + nib, UNIT * np.array(b) + nib])).convex_hull
        for a, b in glyph
    ]
    return shapely.union_all(hulls)


def heights_by_levels(glyph, relief, x, y):
    """Height by level sets: a point stands at z where the outline, moved to z, holds it."""
    body, (away, at) = region(glyph, relief.stroke_mm), relief.profile()
    found = np.zeros(len(x))
    for d in np.linspace(away[0], away[-1], 400):
        grown = body.buffer(d, join_style="mitre", mitre_limit=20.0)
        z = np.interp(d, away, at)
        found = np.where((found == 0) & shapely.contains_xy(grown, x, y), z, found)
    return found


@pytest.mark.parametrize("relief", RELIEFS)
@pytest.mark.parametrize("label", range(len(GLYPHS)))
def test_heights_are_those_of_the_moved_outline(label, relief):
    symbols = emboss(GLYPHS, UNIT, relief)
    x, y = np.random.default_rng(label).uniform(-PITCH / 2, PITCH / 2, (2, 3000))
    ours = symbols.heights_mm(np.full(3000, label), x, y)
    theirs = heights_by_levels(GLYPHS[label], relief, x, y)
    # Level sets are 1/399 of the way from the first to the last apart.
    away, at = relief.profile()
    steepest = np.abs(np.diff(at) / np.diff(away)).max(initial=0.0)
    step = 1.01 * steepest * (away[-1] - away[0]) / 399 + 1e-9
    assert (np.abs(ours - theirs) <= step).all()
    assert (theirs > 0).mean() > 0.15


@pytest.mark.parametrize("relief", RELIEFS)
def test_table_gives_the_exact_heights(relief):
    symbols = emboss(GLYPHS, UNIT, relief)
    known = template(symbols, PITCH)
    rng = np.random.default_rng(3)
    labels = rng.integers(-1, len(GLYPHS), 60_000)
    right, down = rng.random((2, 60_000))
    exact = np.zeros(60_000)
    on = labels >= 0
    x, y = (right - 0.5) * PITCH, (0.5 - down) * PITCH
    exact[on] = symbols.heights_mm(labels[on], x[on], y[on])
    assert np.abs(known.heights_mm(labels, right, down) - exact).max() < 1e-12


@pytest.mark.parametrize(
    ("relief", "match"),
    [
        (Relief(height_mm=0.0), "high"),
        (Relief(draft_rad=1.5), "draft"),
        (Relief(chamfer_mm=1.2), "chamfer"),
        (Relief(height_mm=3.0, stroke_mm=0.4, draft_rad=1.0), "vanish"),
    ],
)
def test_impossible_reliefs_are_refused(relief, match):
    with pytest.raises(SurfaceError, match=match):
        emboss(GLYPHS, UNIT, relief)


@pytest.mark.parametrize(
    ("strokes", "width"),
    [(np.zeros((0, 2, 2)), 1.0), ([[[0, 0], [0, 0]]], 1.0), ([[[0, 0], [1, 0]]], 0.0)],
)
def test_strokes_that_draw_nothing_are_refused(strokes, width):
    with pytest.raises(SurfaceError, match="stroke"):
        outline(strokes, width)


def test_symbols_wider_than_their_cell_are_refused():
    with pytest.raises(SurfaceError, match="overlap"):
        template(emboss(GLYPHS, UNIT, Relief()), 5.0)


def cell_heights(lattice, row, column, x, y):
    """Heights at symbol-frame places of a cell of a lattice that is not turned."""
    centre = np.array([(column + 0.5) * PITCH, -(row + 0.5) * PITCH])
    return lattice.heights_mm(centre + np.stack([x, y], axis=1))


def test_an_endless_lattice_repeats_its_tile():
    symbols = emboss(GLYPHS, UNIT, Relief())
    grid = np.random.default_rng(0).integers(-1, 3, (4, 5))
    x, y = np.random.default_rng(1).uniform(-3.49, 3.49, (2, 500))
    endless = LatticeSurface(template(symbols, PITCH), tile_lookup(grid))
    for r, c in np.ndindex(4, 5):
        label = grid[r, c]
        want = symbols.heights_mm(np.full(500, label), x, y) if label >= 0 else np.zeros(500)
        for k in (0, 3, -5):
            assert np.abs(cell_heights(endless, r + 4 * k, c + 5 * k, x, y) - want).max() < 1e-9


def test_two_symbols_in_one_cell_are_refused():
    with pytest.raises(SurfaceError, match="share a cell"):
        list_lookup([1, 1], [2, 2], [0, 1])
    with pytest.raises(SurfaceError, match="one face"):
        list_lookup([0, 10**6], [0, 10**6], [0, 1])
