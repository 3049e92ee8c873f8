"""Symbols from strokes: outline, height, table and lattice against independent geometry."""

import math

import numpy as np
import pytest
import shapely
from shapely.geometry import MultiPoint

from probe.errors import SurfaceError
from probe.surface.face import (
    LatticeSurface,
    call_lookup,
    endless_face,
    list_lookup,
    template,
    tile_lookup,
)
from probe.surface.symbols import Relief, emboss, outline

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


def heights(glyph, relief, x, y):
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
    theirs = heights(GLYPHS[label], relief, x, y)
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


def test_lattice_puts_each_label_into_its_cell():
    symbols = emboss(GLYPHS, UNIT, Relief())
    grid = np.random.default_rng(0).integers(-1, 3, (4, 5))
    rows, columns = np.nonzero(grid >= 0)
    x, y = np.random.default_rng(1).uniform(-3.49, 3.49, (2, 500))
    finite = LatticeSurface(
        template(symbols, PITCH), list_lookup(rows - 7, columns + 2, grid[rows, columns])
    )
    endless_ = LatticeSurface(template(symbols, PITCH), tile_lookup(grid))
    for r, c in np.ndindex(4, 5):
        label = grid[r, c]
        want = symbols.heights_mm(np.full(500, label), x, y) if label >= 0 else np.zeros(500)
        assert np.abs(cell_heights(finite, r - 7, c + 2, x, y) - want).max() < 1e-9
        for k in (0, 3, -5):
            assert np.abs(cell_heights(endless_, r + 4 * k, c + 5 * k, x, y) - want).max() < 1e-9
    beyond = np.array([[-1e4, 1e4], [1e4, -1e4], [0.0, 5 * PITCH]])
    assert (finite.heights_mm(beyond) == 0).all()


def test_array_as_a_function_is_asked_once_for_every_cell_in_view():
    asked = []

    def label(rows, columns):
        asked.append(len(rows))
        return (rows * 7 + columns) % 3

    face = endless_face(label, GLYPHS)
    points = np.random.default_rng(0).uniform(-12, 12, (5000, 2)) + 1e7 * PITCH
    heights = face.heights_mm(points)
    assert asked[0] <= 25
    assert len(asked) == 1
    table = endless_face((np.arange(3)[:, None] * 7 + np.arange(3)) % 3, GLYPHS)
    assert np.array_equal(heights, table.heights_mm(points))
    assert call_lookup(label)(np.zeros(0, int), np.zeros(0, int)).shape == (0,)


def test_two_symbols_in_one_cell_are_refused():
    with pytest.raises(SurfaceError, match="share a cell"):
        list_lookup([1, 1], [2, 2], [0, 1])
    with pytest.raises(SurfaceError, match="one face"):
        list_lookup([0, 10**6], [0, 10**6], [0, 1])
