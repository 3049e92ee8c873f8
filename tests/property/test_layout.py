"""Random faces, solids and masks: what a layout must never do."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from random_shapes import random_convex, random_nonconvex

from generator.array.profiles import profile
from generator.errors import LayoutError
from generator.layout.footprint import region_of
from generator.layout.lattice import LatticeRequest
from generator.layout.layout import lay_out
from generator.layout.occupancy import Occupancy
from generator.layout.places import array_cells, count_places
from generator.layout.torus import place_pieces
from generator.layout.unfold import split, unfold
from generator.polyhedron.frame import face_polygon

PITCH, HALF = 7.0, 2.7
NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
ARRAY = profile("one-touch").array()


def star(random, corners, radius):
    """Star-shaped polygon: convex or not, counter-clockwise."""
    angle = 2 * np.pi * (np.arange(corners) + random.uniform(0.1, 0.9, corners)) / corners
    r = radius * random.uniform(0.45, 1.0, corners)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle)])


@st.composite
def faces(draw):
    """Loops of a face and a clearance per edge; some faces have a hole."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    loops = [star(random, draw(st.integers(3, 9)), draw(st.floats(12.0, 45.0)))]
    outer = shapely.Polygon(loops[0])
    if draw(st.booleans()):
        hole = 0.25 * star(random, draw(st.integers(3, 6)), 20.0)
        if outer.buffer(-0.5).contains(shapely.Polygon(hole)):
            loops.append(hole[::-1])
    loops = [loop + random.uniform(-50, 50, 2) for loop in loops[:1]] if len(loops) == 1 else loops
    return loops, [random.uniform(0.0, 2.5, len(loop)) for loop in loops]


def footprints(centres, rotation, half):
    c, s = np.cos(rotation), np.sin(rotation)
    corners = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ np.array([[c, s], [-s, c]])
    return shapely.polygons(centres[:, None] + corners)


def check_clearance(loops, clearances, centres, rotation, half=HALF):
    """Every footprint lies in the face and keeps the clearance of every edge."""
    squares = footprints(centres, rotation, half)
    face = shapely.Polygon(loops[0], loops[1:])
    assert shapely.contains(face.buffer(1e-6), squares).all()
    for loop, clearance in zip(loops, clearances, strict=True):
        edges = shapely.linestrings(np.stack([loop, np.roll(loop, -1, axis=0)], axis=1))
        distance = shapely.distance(edges[:, None], squares)
        assert (distance >= np.asarray(clearance)[:, None] - 1e-6).all()


@given(faces(), st.sampled_from([(3, 2), (2, 2), (6, 2)]))
@settings(max_examples=60, deadline=None)
def test_footprints_lie_in_the_face_and_keep_every_clearance(face, window):
    loops, clearances = face
    lattice = LatticeRequest(HALF, PITCH, window).choose([region_of(loops, clearances)])
    (cells,) = lattice.cells
    assume(len(cells))
    j, i = cells.T
    turned = np.column_stack([lattice.x_mm + PITCH * i, lattice.y_mm + PITCH * j])
    c, s = np.cos(-lattice.rotation_rad), np.sin(-lattice.rotation_rad)
    centres = turned @ np.array([[c, s], [-s, c]])
    check_clearance(loops, clearances, centres, -lattice.rotation_rad)
    assert lattice.places == (count_places(*array_cells(cells, lattice.quarter), window, None),)


solids = st.builds(
    lambda make, seed: make(np.random.default_rng(seed)),
    st.sampled_from([random_convex, random_nonconvex]),
    st.integers(0, 10**6),
)


def laid_flat(solid, net, face):
    T = net.T_net_face[face]
    loops = [loop @ T[:2, :2].T + T[:2, 2] for loop in face_polygon(solid, face)]
    return shapely.Polygon(loops[0], loops[1:])


@given(solids, st.integers(0, 3))
@settings(max_examples=40, deadline=None)
def test_unfolding_keeps_areas_and_never_overlaps(solid, cuts):
    net = unfold(solid)
    for _ in range(cuts):
        largest = max(range(len(net.pieces)), key=lambda k: len(net.pieces[k]))
        if len(net.pieces[largest]) > 1:
            net = split(net, largest)
    assert sorted(face for piece in net.pieces for face in piece) == list(range(len(solid.faces)))
    for piece in net.pieces:
        polygons = [laid_flat(solid, net, face) for face in piece]
        areas = sum(polygon.area for polygon in polygons)
        # Grown a little, so that shared edges close; grown outlines add at most that seam.
        union = shapely.union_all([polygon.buffer(1e-7) for polygon in polygons])
        assert union.geom_type == "Polygon"  # connected along folds
        assert union.area == pytest.approx(areas, rel=1e-5)
        for face in piece:
            loops = face_polygon(solid, face)
            exact = shapely.Polygon(loops[0], loops[1:]).area
            assert laid_flat(solid, net, face).area == pytest.approx(exact, rel=1e-12)


@given(solids, st.sampled_from(["faces", "net"]), st.integers(0, 10**6))
@settings(max_examples=7, deadline=None)
def test_layouts_use_no_cell_twice_and_keep_clear_of_edges(solid, kind, seed):
    rng = np.random.default_rng(seed)
    clearances = [[rng.uniform(0.3, 2.0, len(loop)) for loop in face.loops] for face in solid.faces]
    occupied = rng.integers(0, 63, 40), rng.integers(0, 65, 40)
    pitch, half = 4.0, 1.5
    try:
        laid = (solid, ARRAY, pitch, half, clearances, occupied, kind)
        layout = lay_out(*laid, allow_blank_faces=True)
    except LayoutError as error:
        assert "full" in error.cause  # noqa: PT017
        assume(False)
    taken = set(zip(*(values.tolist() for values in occupied), strict=True))
    count = len(taken)
    for face in layout.faces:
        here = list(zip(face.rows.tolist(), face.columns.tolist(), strict=True))
        taken.update(here)
        count += len(here)
        assert len(taken) == count
        assert (face.places == 0) == (len(here) == 0) == (face.face in layout.blank_faces)
        if not here:
            continue
        assert np.array_equal(face.labels, ARRAY.symbols(face.rows, face.columns))
        rotation = -face.placement.rotation_rad
        here = face_polygon(solid, face.face), clearances[face.face]
        check_clearance(*here, face.centres_mm, rotation, half)
        p, c, s = face.placement, np.cos(rotation), np.sin(rotation)
        x, y = face.centres_mm.T
        u, v = c * x + s * y + p.x_mm, c * y - s * x + p.y_mm
        assert np.allclose((u / pitch - 0.5 + p.column - face.columns + 32.5) % 65, 32.5)
        assert np.allclose((-v / pitch - 0.5 + p.row - face.rows + 31.5) % 63, 31.5)
        rows, columns = np.rint(-v / pitch - 0.5), np.rint(u / pitch - 0.5)
        unwrapped = rows.astype(np.int64), columns.astype(np.int64)
        assert count_places(*unwrapped, ARRAY.window, ARRAY.identifies) >= face.places


@given(
    st.integers(5, 30),
    st.integers(5, 30),
    st.lists(
        st.tuples(st.integers(1, 8), st.integers(1, 8), st.integers(0, 2**32 - 1)), max_size=14
    ),
    st.floats(0.0, 0.6),
    st.sampled_from([(0,), (0, 2), (0, 1, 2, 3)]),
)
@settings(max_examples=60, deadline=None)
def test_placing_uses_free_cells_once_and_refuses_the_rest(rows, columns, sizes, load, turns):
    random = np.random.default_rng(rows * 31 + columns)
    before = random.random((rows, columns)) < load
    size = SimpleNamespace(rows=rows, columns=columns, first=(0, 0))
    occupancy = Occupancy.from_cells(*np.nonzero(before), size)
    masks = [np.random.default_rng(seed).random((h, w)) < 0.8 for h, w, seed in sizes]
    spots = place_pieces(occupancy, [(mask, turns) for mask in masks])
    count = before.astype(int)
    for mask, spot in zip(masks, spots, strict=True):
        if spot is not None:
            assert spot.quarter in turns
            r, c = np.nonzero(np.rot90(mask, spot.quarter))
            np.add.at(count, ((r + spot.row) % rows, (c + spot.column) % columns), 1)
    assert count.max(initial=0) <= 1
    for mask, spot in zip(masks, spots, strict=True):
        if spot is None and mask.any():
            assert not any(fits(count, np.rot90(mask, quarter)) for quarter in turns)


def fits(count, form):
    """Whether a form fits anywhere on the torus, by trying every place."""
    if form.shape[0] > count.shape[0] or form.shape[1] > count.shape[1]:
        return False
    blocked = np.zeros_like(count)
    for r, c in np.argwhere(form):
        blocked += np.roll(count, (-r, -c), axis=(0, 1))
    return bool((blocked == 0).any())
