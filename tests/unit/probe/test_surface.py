"""Surfaces: simple bodies, triangles, polygons, heights as a mesh, and symbols from strokes."""

import numpy as np
import pytest
import shapely
from reference.indenters import block, nib_region

from probe.errors import SurfaceError
from probe.surface import indenters
from probe.surface.body import close_below, manifold_from, mesh_heights, triangulate
from probe.surface.face import list_lookup, template
from probe.surface.mesh import mesh, sort_numbers
from probe.surface.polygon import polygon
from probe.surface.symbols import Relief, emboss, outline

SQUARE = np.array([[0.0, 0], [10, 0], [10, 10], [0, 10]])


def test_the_highest_of_several_bodies_counts_whatever_their_sense():
    bodies = np.concatenate([block((0, 0, 0), (4, 4, 1)), block((1, 1, 0), (2, 2, 3))[:, ::-1]])
    part = mesh(bodies)  # one of them inside out: no triangle is left out for its sense
    assert part.heights_mm(np.array([[0.5, 0.5], [1.5, 1.5]])).tolist() == [1.0, 3.0]


def test_frames_move_the_part_under_the_sensor():
    T = np.array([[0.0, 0, 1, 5], [0, 1, 0, 6], [-1, 0, 0, 7], [0, 0, 0, 1]])
    part = mesh(block((0, 0, 0), (1, 2, 3)), T)
    assert part.top_mm == 7.0
    assert part.heights_mm(np.array([[6.5, 7.0], [4.9, 7.0]])).tolist() == [7.0, -np.inf]


def heights_over(part, triangle, x, y):
    """Return the height of triangles over a point each; -inf where it is not under it."""
    (ax, bx, cx), (ay, by, cy), (az, bz, cz) = part.corners[triangle].transpose(2, 1, 0)
    # Twice the signed areas of the three parts; each edge runs up the order a < b < c.
    ab = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    bc = (cx - bx) * (y - by) - (cy - by) * (x - bx)
    ac = (cx - ax) * (y - ay) - (cy - ay) * (x - ax)
    under = ((ab >= 0) & (bc >= 0) & (ac <= 0)) | ((ab <= 0) & (bc <= 0) & (ac >= 0))
    weight = ab + bc - ac
    with np.errstate(divide="ignore", invalid="ignore"):
        z = (ab * cz + bc * az - ac * bz) / weight
    return np.where(under & (weight != 0), z, -np.inf)


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


def heights_by_levels(glyph, relief, x, y):
    """Height by level sets: a point stands at z where the outline, moved to z, holds it."""
    body, (away, at) = nib_region(glyph, relief.stroke_mm, UNIT), relief.profile()
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


WALL = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 0, 5]]])


@pytest.mark.parametrize(
    ("call", "match"),
    [
        (lambda: indenters.RoughSurface(shortest_mm=0.0), "shortest"),
        (lambda: mesh(WALL), "no triangle covers"),
        (lambda: mesh(WALL * np.nan), "NaN"),
        *((lambda loops=loops: polygon(loops), "outline")
          for loops in ([], [SQUARE[:2]], [SQUARE * 0], [SQUARE * np.nan])),
        (lambda: triangulate([SQUARE[::-1]]), "cover"),
        (lambda: mesh_heights(np.zeros((9, 5)), 0.1), "power of two"),
        (lambda: mesh_heights(np.zeros((13, 13)), 0.1), "power of two"),
        *((lambda given=given: emboss(GLYPHS, UNIT, Relief(**given)), match)
          for given, match in (
              ({"height_mm": 0.0}, "high"), ({"draft_rad": 1.5}, "draft"),
              ({"chamfer_mm": 1.2}, "chamfer"),
              ({"height_mm": 3.0, "stroke_mm": 0.4, "draft_rad": 1.0}, "vanish"))),
        *((lambda strokes=strokes, width=width: outline(strokes, width), "stroke")
          for strokes, width in ((np.zeros((0, 2, 2)), 1.0), ([[[0, 0], [0, 0]]], 1.0),
                                 ([[[0, 0], [1, 0]]], 0.0))),
        (lambda: template(emboss(GLYPHS, UNIT, Relief()), 5.0), "overlap"),
        (lambda: list_lookup([1, 1], [2, 2], [0, 1]), "share a cell"),
        (lambda: list_lookup([0, 10**6], [0, 10**6], [0, 1]), "one face"),
    ],
)  # fmt: skip
def test_what_is_no_surface_is_refused(call, match):
    with pytest.raises(SurfaceError, match=match):
        call()
