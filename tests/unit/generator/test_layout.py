"""Whole layouts of known objects, islands of nets, codes; the torus; what a face promises."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from random_shapes import extruded
from reference.cells import listed

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet.outline import SymbolStyle
from generator.array.profiles import profile
from generator.errors import LayoutError
from generator.layout.layout import lay_out
from generator.layout.obstacle import solid_edges
from generator.layout.occupancy import TILE, Occupancy
from generator.layout.placement import FaceLayout, Layout, Placement, object_code
from generator.layout.recognition_rate import answered_share, measured_types
from generator.layout.sensor_view import (
    MEETS_MM2,
    SAG_MM,
    SensorView,
    beside_obstacles,
    face_views,
    round_views,
)
from generator.layout.torus import CORNER, TorusPosition, board_size, place_pieces
from generator.layout.unfold import split, unfold
from generator.polyhedron import face_polygon, shapes
from generator.polyhedron.development import development
from generator.polyhedron.frame import face_frame, face_normal

NONE = (np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
ARRAY = profile("one-touch").array()


def laid_out(solid, occupied=NONE, kind="auto", array=ARRAY, pitch=7.0, half=2.7, **options):
    clearances = [[np.ones(len(loop)) for loop in face.loops] for face in solid.faces]
    return lay_out(solid, array, pitch, half, clearances, occupied, kind, **options)


def test_the_net_falls_into_islands_where_the_array_is_too_small():
    small = {"array": profile("product").array(), "pitch": 8.0, "half": 3.0}  # 15 x 15
    layout = laid_out(shapes.tetrahedron(75.0), kind="net", **small)
    assert len({(f.placement.row, f.placement.column) for f in layout.faces}) > 1


def test_a_face_identified_by_its_rank_alone_is_one_place():
    layout = laid_out(shapes.box((80.0, 60.0, 12.0)), kind="faces")
    assert sorted(face.places for face in layout.faces) == [1, 1, 1, 1, 63, 63]


def test_faces_without_a_place_are_listed_with_what_would_help():
    solid = shapes.box((80.0, 60.0, 5.0))
    with pytest.raises(LayoutError) as caught:
        laid_out(solid)
    layout = laid_out(solid, allow_blank_faces=True)
    assert layout.blank_faces == (1, 2, 3, 4)
    assert [warning.endswith("left blank") for warning in layout.warnings] == [True]
    assert all(solid.faces[k].name in caught.value.cause for k in (1, 2, 3, 4))
    assert "80.0 x 5.0 mm, 0 cells" in caught.value.cause
    assert "3x2 cells at 7 mm pitch" in caught.value.cause
    pitch = float(caught.value.fix.split("set pitch to ")[1].split(" mm")[0])
    scale = float(caught.value.fix.split("make the object ")[1].split(" times")[0])
    larger = shapes.box((80.0 * scale, 60.0 * scale, 5.0 * scale))
    for layout in (laid_out(solid, pitch=pitch, half=2.7 * pitch / 7.0), laid_out(larger)):
        assert all(face.places > 0 for face in layout.faces)


ROWS, COLUMNS = np.mgrid[:63, :65].reshape(2, -1)[:, :-300]
CUBE = shapes.cube(60.0)


@pytest.mark.parametrize(
    ("solid", "options", "message"),
    [
        (shapes.prism(12, 40.0, side=20.0), {"kind": "net"}, "set layout to faces"),
        (CUBE, {"occupied": (ROWS, COLUMNS), "kind": "faces"},
         r"needs 384 cells, 300 of 4095 are free[\s\S]*profile: auto"),
        (shapes.cube(180.0), {}, "not in blocks"),
    ],
)  # fmt: skip
def test_what_cannot_be_laid_out_is_refused(solid, options, message):
    with pytest.raises(LayoutError, match=message):
        laid_out(solid, **options)


def code_at(*cells, rows=63, columns=65):
    """Return the code of an object with a blank face and one face for each cell."""
    place, none = Placement(0, 0, 0.0, 0.0, 0.0), np.zeros(0, dtype=np.int64)
    faces = [FaceLayout(0, place, none, none, none, np.zeros((0, 2)), 0)]
    for row, column in cells:
        one = np.ones(1, dtype=np.int64)
        faces.append(FaceLayout(1, place, row * one, column * one, one, np.zeros((1, 2)), 0))
    return object_code(Layout("faces", 7.0, tuple(faces)), rows, columns)


def test_codes_count_cells():
    assert code_at((0, 0)) == "222"
    assert code_at((1, 0)) == code_at((2, 0), (1, 0), (1, 5)) == "24Y"  # 65 = 2 * 22 + 21
    # 65534 = ((6 * 22 + 3) * 22 + 8) * 22 + 18
    assert code_at((50, 1284), rows=51, columns=1285) == "C5EU"
    assert len(code_at((2**32 - 1, 2**32 - 1), rows=2**32, columns=2**32)) == 15
    codes = {code_at((r, c)) for r in range(63) for c in range(65)}
    assert len(codes) == 63 * 65
    assert "F" not in "".join(codes)


def test_a_piece_is_split_into_halves():
    net = split(unfold(CUBE), 0)
    assert sorted(map(len, net.pieces)) in ([2, 4], [3, 3])
    assert net.parents.count(-1) == 2


def torus(rows, columns, cells=NONE, first=(0, 0)):
    return Occupancy.from_cells(*cells, SimpleNamespace(rows=rows, columns=columns, first=first))


def block(rows, columns):
    return np.ones((rows, columns), dtype=bool)


def test_the_place_with_most_contact_is_taken():
    taken = np.zeros((12, 12), dtype=bool)
    taken[5, 3:9] = taken[6, 3] = taken[6, 8] = True  # a bay, four cells wide
    (spot,) = place_pieces(torus(12, 12, np.nonzero(taken)), [(block(1, 4), (0, 1, 2, 3))])
    assert spot == TorusPosition(6, 4, 0)
    # a narrow large array wraps along its short side alone
    taken = np.ones((3, 1 << 17), dtype=bool)
    taken[[2, 0], 100:104] = False
    (spot,) = place_pieces(torus(3, 1 << 17, np.nonzero(taken)), [(block(2, 4), (0,))])
    assert spot == TorusPosition(2, 100, 0)


@pytest.mark.parametrize("size", [(63, 65), (1023, 1025)])
def test_placing_from_another_first_cell_is_a_shift_of_the_same(size):
    rows, columns = size
    pieces = [(block(5, 7), (0, 1)), (block(4, 4), (0,))] * 3
    first = (rows - 3, columns // 2)
    elsewhere = place_pieces(torus(rows, columns, first=first), pieces)
    for one, other in zip(place_pieces(torus(rows, columns), pieces), elsewhere, strict=True):
        assert other == TorusPosition(
            (one.row + first[0]) % rows, (one.column + first[1]) % columns, one.quarter
        )


def cells(row, column, height, width):
    return tuple(i.ravel() for i in np.mgrid[row : row + height, column : column + width])


@pytest.mark.parametrize("first", [(0, 0), (129, 149), (100, 60)])
def test_cells_are_taken_and_freed_one_by_one_and_seen_from_the_first_cell(first):
    chance = np.random.default_rng(7)
    held, occupancy = set(), torus(130, 150, first=first)
    for _ in range(30):
        some = np.stack([chance.integers(0, 130, 200), chance.integers(0, 150, 200)])
        if chance.random() < 0.6:
            occupancy, held = occupancy.with_cells(*some), held | set(listed(some))
        else:
            occupancy, held = occupancy.without_cells(*some), held - set(listed(some))
        assert (occupancy.used, occupancy.first) == (len(held), first)
        assert listed(occupancy.cells()) == sorted(held)
    rows, columns = occupancy.cells()
    whole = np.zeros((130, 150), dtype=bool)
    whole[rows, columns] = True
    seen = np.roll(whole, (-first[0], -first[1]), axis=(0, 1))
    for size in ((130, 150), (64, 128), (1, 149), (100, 7)):
        assert np.array_equal(occupancy.corner(*size), seen[: size[0], : size[1]])
    array = SimpleNamespace(rows=130, columns=150, first=first)
    assert Occupancy.from_tiles(occupancy.tiles, array).used == len(held)
    assert occupancy.without_cells(rows, columns).tiles == {}


def test_what_is_opened_of_a_large_array_follows_its_objects():
    far = cells(2000, 3000, 8, 8)
    assert board_size(torus(4095, 4097)) == (CORNER, CORNER)
    assert board_size(torus(4095, 4097, cells(0, 0, 700, 700))) == (704, 704)
    # another lab's objects, imported from elsewhere on the array, open nothing
    assert board_size(torus(4095, 4097, cells(0, 0, 700, 700)).with_cells(*far)) == (704, 704)
    assert board_size(torus(1023, 1025, cells(0, 0, 1023, 1025))) == (1023, 1025)
    assert board_size(torus(255, 257)) == (255, 257)
    assert min(board_size(torus(2**32 - 1, 2**32 + 1, cells(0, 0, 10, 30 * TILE)))) >= 30 * TILE
    for first in ((5, 3), (4000, 4090)):
        near = torus(4095, 4097, cells(*first, 700, 700), first)
        assert all(640 <= side <= 704 for side in board_size(near))
        away = torus(4095, 4097, cells(first[0] + 1500, first[1] + 1500, 8, 8), first)
        assert board_size(away) == (CORNER, CORNER)


VIEW = SensorView((12.7, 9.0), 2.52)
SQUARE = np.array([[0, 0], [40, 0], [40, 40], [0, 40]], dtype=float)
HOLE = np.array([[12, 12], [12, 25], [30, 25], [30, 12]], dtype=float)  # clockwise
ELL = np.array([[0, 0], [50, 0], [50, 12], [14, 12], [14, 60], [0, 60]], dtype=float)
TRIANGLE = np.array([[-3, 5], [60, -8], [25, 44]], dtype=float)


def lattice(loop, pitch=7.0, rotation=0.3, anchor=(60, 61)):
    """Symbols on a turned lattice over the box of a loop, placed across the array's seam."""
    low, size = loop.min(axis=0), np.ptp(loop, axis=0)
    j, i = (g.ravel() for g in np.meshgrid(range(6), range(6)))
    c, s = np.cos(rotation), np.sin(rotation)
    u, v = (j + 0.5) * pitch, -(i + 0.5) * pitch
    shift = np.array([5.0, -30.0])
    u_, v_ = u - shift[0], v - shift[1]
    centres = np.stack([c * u_ + s * v_, -s * u_ + c * v_], axis=1)
    inside = ((centres >= low) & (centres <= low + size)).all(axis=1)
    rows, columns = (anchor[0] + i) % 63, (anchor[1] + j) % 65
    return FaceLayout(
        0, Placement(*anchor, rotation, *shift), rows[inside], columns[inside],
        np.zeros(inside.sum(), dtype=np.int64), centres[inside], 1,
    )  # fmt: skip


def rectangle(views, k, less_mm=0.0):
    """The sensor's rectangle at a pose, face frame."""
    c, s = np.cos(views.turn_rad[k]), np.sin(views.turn_rad[k])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * (np.array(VIEW.half_mm) - less_mm)
    return shapely.Polygon(corners @ [[c, s], [-s, c]] + views.centre_mm[k])


@pytest.mark.parametrize("loops", [(SQUARE,), (SQUARE, HOLE), (ELL,), (TRIANGLE,)])
def test_views_are_those_of_each_pose_by_itself(loops):
    face, outline = lattice(loops[0]), shapely.Polygon(loops[0], loops[1:])
    views = face_views(loops, face, 7.0, VIEW, 150)
    assert len(views.seen) == 150
    for k in range(150):
        whole = shapely.intersects_xy(rectangle(views, k, VIEW.symbol_half_mm), *face.centres_mm.T)
        assert views.seen[k] == whole.sum()
        c, s = np.cos(0.3), np.sin(0.3)
        lattice_mm = face.centres_mm[whole] @ np.array([[c, s], [-s, c]])
        lines = [len(np.unique(np.rint(one / 7.0 * 2))) for one in lattice_mm.T]
        assert views.lines[k] == min(lines)
        share = outline.intersection(rectangle(views, k)).area / rectangle(views, k).area
        assert views.loaded[k] == pytest.approx(share, abs=1e-9)
        away = np.hypot(*(face.centres_mm - views.centre_mm[k]).T)
        assert views.around[k] == (away <= 20.0).sum()


def test_a_type_of_your_own_is_taken_for_the_one_most_like_it():
    mine = SensorType(33, 31, 2.0, name="mine")  # 62 x 66 mm: the mat is 64 x 64
    assert answered_share(mine) is measured_types()["mat-32x32"]
    fine = SensorType(40, 40, 0.6, name="fine")
    assert answered_share(fine) is measured_types()["gel-24x32"]
    small = SensorType(12, 12, 2.2, name="small")  # 26 mm, as fsr-8x8, and three tactels a symbol
    assert answered_share(small) is None
    same = SensorType(name="same")
    assert answered_share(same) is None


STAIRS = [(0, 0), (120, 0), (120, 20), (80, 20), (80, 35), (40, 35), (40, 50), (0, 50)]
RAMP = [(0, 0), (110, 0), (110, 50), (60, 20), (0, 20)]
LOW = [(0, 0), (90, 0), (90, 20), (45, 20), (45, 20.9), (0, 20.9)]  # a step lower than a symbol


def above(corners, height):
    """The part of a polygon in space above a height, seen from above."""
    kept = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if a[2] >= height:
            kept.append(a)
        if (a[2] - height) * (b[2] - height) < 0:
            kept.append(a + (b - a) * (height - a[2]) / (b[2] - a[2]))
    return shapely.Polygon([corner[:2] for corner in kept])


@pytest.mark.parametrize("outline", [STAIRS, RAMP, LOW])
def test_a_sensor_meets_what_rises_inside_its_rectangle(outline):
    along_y = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # outlines are (x, z)
    solid, height = extruded([np.array(outline, float)], 60.0, pose=along_y), 1.0
    for number in range(len(solid.faces)):
        loops, frame = face_polygon(solid, number), face_frame(solid, number)
        views = face_views(loops, lattice(loops[0]), 7.0, VIEW, 60)
        views = beside_obstacles(views, solid_edges(solid), frame, height, VIEW)
        rising = [
            above((solid.vertices[list(face.loops[0])] - frame[:3, 3]) @ frame[:3, :3], height)
            for other, face in enumerate(solid.faces)
            if face_normal(solid, other) @ frame[:3, 2] > 1e-9
        ]
        for k in range(60):
            met = sum(part.intersection(rectangle(views, k)).area for part in rising)
            assert views.blocked[k] == (met > MEETS_MM2)
        meets = {4: ("F6",), 5: ("F5",), 6: ("F8",), 8: ()} if outline is STAIRS else {}
        assert views.meets == meets.get(number, views.meets)  # walls, not their tops
        assert bool(views.meets) == views.blocked.any()


def test_a_round_face_shows_what_lies_near_the_line_that_it_is_touched_along():
    radius, height = 30.0, 80.0
    solid = shapes.cylinder(2 * radius, height)
    (surface,) = solid.surfaces
    flat = development(solid, surface)
    width = float(np.ptp(flat.outline[:, 0]))
    at = np.stack(np.meshgrid(np.arange(4, width, 7), np.arange(4, height, 7)), -1).reshape(-1, 2)
    none = np.zeros(len(at), np.int64)
    face = FaceLayout(surface.carrier, Placement(0, 0, 0.0, -0.5, -0.5), none, none, none, at, 1)
    style = SymbolStyle(pitch_mm=7.0)
    views = round_views(solid_edges(solid), surface, flat, face, style, VIEW, 200)
    half = radius * math.acos(1 - SAG_MM / radius)
    for k in range(200):
        near = abs(at[:, 0] - views.centre_mm[k, 0]) <= half
        whole = shapely.intersects_xy(rectangle(views, k, VIEW.symbol_half_mm), *at.T)
        assert views.seen[k] == (near & whole).sum()
        there = shapely.Polygon(flat.outline).intersection(rectangle(views, k))
        assert views.loaded[k] == pytest.approx(there.area / rectangle(views, k).area, abs=1e-9)
    assert not views.blocked.any()
