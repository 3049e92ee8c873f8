"""Random strokes, meshes, faces and lattices: heights that must hold everywhere."""

import math

import numpy as np
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from reference.indenters import nib_region
from shapely.geometry import MultiPoint

from probe.errors import SurfaceError
from probe.surface.body import symbol_triangles
from probe.surface.face import LatticeSurface, list_lookup, template
from probe.surface.mesh import mesh
from probe.surface.polygon import polygon
from probe.surface.symbols import Relief, emboss, outline

NODE = st.tuples(st.integers(-1, 1), st.integers(-1, 1))
SEEDS = st.integers(0, 2**32 - 1)


@st.composite
def glyphs(draw):
    """Strokes between nodes, joined or not, some twice or one along the other."""
    strokes = draw(st.lists(st.tuples(NODE, NODE), min_size=1, max_size=6))
    kept = tuple(stroke for stroke in strokes if stroke[0] != stroke[1])
    assume(kept)
    return kept


@settings(max_examples=60, deadline=None)
@example((((0, 0), (0, 1)), ((0, 0), (-1, -1)), ((0, 0), (-1, -1)), ((0, -1), (1, -1))), 0.1953125)
@given(glyphs(), st.floats(0.05, 1.6))
def test_outline_encloses_what_the_nib_covers(glyph, width):
    rings = outline(np.array(glyph, float), width)
    loops = [ring.moved(0.0) for ring in rings]
    turns = [1 if shapely.LinearRing(loop).is_ccw else -1 for loop in loops]
    area = sum(turn * shapely.Polygon(loop).area for turn, loop in zip(turns, loops, strict=True))
    body = nib_region(glyph, width)
    assert abs(area - body.area) < 1e-7
    for loop in loops:
        assert shapely.distance(body.boundary, shapely.points(loop)).max() < 1e-7


@settings(max_examples=60, deadline=None)
@given(glyphs(), st.floats(0.3, 0.9), st.floats(0.0, 0.5), st.floats(0.0, 0.1), SEEDS)
def test_symbol_heights_are_those_of_its_triangles(glyph, width, draft, chamfer, seed):
    relief = Relief(0.5, width, draft, chamfer if chamfer > 0.01 else 0.0)
    try:
        symbols = emboss((glyph,), 1.0, relief)
        corners = symbol_triangles(symbols, 0)
    except SurfaceError:
        assume(False)
    x, y = np.random.default_rng(seed).uniform(-2, 2, (2, 400))
    points = np.stack([x, y], axis=1)
    seen = np.maximum(mesh(corners).heights_mm(points), 0.0)
    ours = symbols.heights_mm(np.zeros(400, int), x, y)
    # Where rings that grow have met, the sides overlap: the highest one counts in both.
    edges = shapely.MultiLineString([[*t, t[0]] for t in corners[:, :, :2]])
    off = shapely.distance(edges, shapely.points(points)) > 1e-6
    assert np.abs(seen - ours)[off].max(initial=0.0) < 1e-9
    assert ours.max() <= relief.height_mm


@settings(max_examples=15, deadline=None)
@given(st.lists(glyphs(), min_size=1, max_size=3), st.floats(-7, 7), SEEDS)
def test_lattice_gives_the_heights_of_every_symbol_by_itself(alphabet, turn, seed):
    random = np.random.default_rng(seed)
    try:
        known = template(emboss(tuple(alphabet), 1.0, Relief(0.5, 0.4, 0.2)), 4.0)
    except SurfaceError:
        assume(False)
    cells = np.unique(random.integers(-3, 3, (12, 2)), axis=0)
    labels = random.integers(0, len(alphabet), len(cells))
    shift = random.uniform(-9, 9, 2)
    lattice = LatticeSurface(known, list_lookup(cells[:, 0], cells[:, 1], labels), turn, *shift)
    points = np.r_[random.uniform(-30, 30, (1500, 2)), [(-1e4, 1e4), (1e4, -1e4)]]
    c, s = math.cos(turn), math.sin(turn)
    at = points @ np.array([[c, s], [-s, c]]) + shift
    want = np.zeros(len(points))
    for (row, column), label in zip(cells, labels, strict=True):
        x, y = (at - ((column + 0.5) * 4.0, -(row + 0.5) * 4.0)).T
        near = np.flatnonzero(np.maximum(np.abs(x), np.abs(y)) <= 2)
        own = known.symbols.heights_mm(np.full(len(near), label), x[near], y[near])
        want[near] = np.maximum(want[near], own)
    assert np.abs(lattice.heights_mm(points) - want).max() < 1e-9


@settings(max_examples=80, deadline=None)
@given(SEEDS, st.integers(3, 14), st.booleans(), st.floats(1e-3, 1e3))
def test_stars_hold_the_points_that_shapely_says(seed, corners, holed, size):
    random = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(corners) + random.uniform(0.1, 0.9, corners)) / corners
    radius = size * random.uniform(0.3, 1.0, corners)
    star = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    loops = [star, 0.3 * star[::-1]] if holed else [star]
    shape = shapely.Polygon(loops[0], loops[1:])
    assume(shape.is_valid)
    region, points = polygon(loops), random.uniform(-size, size, (500, 2))
    assert (region.contains(points) == shapely.contains_xy(shape, points)).all()
    assert region.contains(np.concatenate(loops)).all()
    away = shapely.distance(shape.boundary, shapely.points(points))
    assert np.abs(region.distance_mm(points) - away).max() < 1e-9 * size
    share = random.random((len(region.starts), 1))
    assert region.contains(region.starts + share * (region.ends - region.starts)).all()


@settings(max_examples=40, deadline=None)
@given(SEEDS, st.integers(4, 40), st.floats(0, 7), st.sampled_from([1e-2, 1.0, 1e3]))
def test_a_triangulated_terrain_has_no_cracks_in_any_frame(seed, count, turn, size):
    from scipy.spatial import Delaunay

    random = np.random.default_rng(seed)
    flat = random.uniform(0, size, (count, 2))
    terrain = np.c_[flat, random.uniform(0, size, count)]
    c, s = math.cos(turn), math.sin(turn)
    T = np.array([[c, -s, 0, 3 * size], [s, c, 0, -size], [0, 0, 1, 0], [0, 0, 0, 1]])
    triangles = Delaunay(flat).simplices
    part = mesh(terrain[triangles], T)
    a, b, d = np.moveaxis(part.corners, 1, 0)
    share = random.random((len(a), 1))
    hull = MultiPoint(part.corners[:, :, :2].reshape(-1, 2)).convex_hull.buffer(-1e-9 * size)
    for p, q in ((a, b), (b, d), (a, d)):
        on = p[:, :2] + share * (q - p)[:, :2]
        inner = shapely.contains_xy(hull, on)
        assert np.isfinite(part.heights_mm(on[inner])).all()
    points = random.uniform(2 * size, 5 * size, (300, 2))
    assert part.heights_mm(points).max() <= part.top_mm
