"""Which lattice is chosen: against every shift tried one by one with another library's geometry."""

import numpy as np
import pytest
import shapely

from generator.layout.footprint import region_of
from generator.layout.lattice import LatticeRequest, edge_rotations

HALF, PITCH = 2.7, 7.0
WINDOW = (3, 2)  # rows and columns
REQUEST = LatticeRequest(HALF, PITCH, WINDOW)


def rectangle(width, height, x=0.0, y=0.0):
    return [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]


def region(loop, clearance=1.0):
    points = np.array(loop, float)
    return region_of([points], [np.broadcast_to(np.asarray(clearance, float), len(points)).copy()])


def room(cells, play=0.0):
    """Width of a rectangle that holds so many cells in a line, and lets them move by `play`."""
    return (cells - 1) * PITCH + 2 * HALF + 2.0 + play


def shown(loop, clearance, rotation, x, y):
    """The cells (j, i) that a lattice shows, by the distance of each square to each edge."""
    points = np.array(loop, float) @ np.array(
        [[np.cos(rotation), np.sin(rotation)], [-np.sin(rotation), np.cos(rotation)]]
    )
    face = shapely.Polygon(points)
    edges = [
        shapely.LineString([a, b]) for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)
    ]
    low, high = points.min(axis=0), points.max(axis=0)
    i = np.arange(np.floor((low[0] - x) / PITCH), np.ceil((high[0] - x) / PITCH) + 1)
    j = np.arange(np.floor((low[1] - y) / PITCH), np.ceil((high[1] - y) / PITCH) + 1)
    j, i = (each.ravel() for each in np.meshgrid(j, i, indexing="ij"))
    u, v = x + i * PITCH, y + j * PITCH
    squares = shapely.box(u - HALF, v - HALF, u + HALF, v + HALF)
    free = shapely.contains_xy(face, u, v)
    for edge, least in zip(edges, np.broadcast_to(clearance, len(edges)), strict=True):
        free &= shapely.distance(squares, edge) >= least - 1e-9
    return {(int(a), int(b)) for a, b in zip(j[free], i[free], strict=True)}


def windows(cells, down, right):
    """At how many places a window of so many rows and columns lies in cells."""
    return sum(
        all((j + a, i + b) in cells for a in range(down) for b in range(right)) for j, i in cells
    )


def worth(faces, rotation, x, y, window=WINDOW):
    """(faces with a place, places, cells) of a lattice, the better of two orientations."""
    every = [shown(loop, clearance, rotation, x, y) for loop, clearance in faces]
    best = max(
        (sum(n > 0 for n in counts), sum(counts))
        for counts in (
            [windows(cells, *window) for cells in every],
            [windows(cells, *window[::-1]) for cells in every],
        )
    )
    return (*best, sum(len(cells) for cells in every))


TRIANGLE = [(0, 0), (52, 0), (14, 41)]
HEXAGON = [(3, 0), (40, 5), (55, 24), (38, 47), (11, 44), (-4, 20)]
ELBOW = [(0, 0), (45, 0), (45, 17), (20, 17), (20, 44), (0, 44)]
FACES = {
    "triangle": (TRIANGLE, 1.0),
    "hexagon": (HEXAGON, np.array([0.5, 1.0, 1.5, 2.0, 1.0, 0.7])),
    "elbow": (ELBOW, 1.0),
    "rectangle": (rectangle(37.0, 24.0, 5.0, -40.0), np.array([1.0, 2.0, 0.5, 3.0])),
}


def play(loop, clearance, lattice):
    """How far the cells may move left, right, down and up before one is not free."""
    cells = {tuple(cell) for cell in lattice.cells[0].tolist()}
    found = []
    for dx, dy in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        low, high = 0.0, PITCH
        for _ in range(14):
            middle = (low + high) / 2
            x, y = lattice.x_mm + middle * dx, lattice.y_mm + middle * dy
            kept = cells <= shown(loop, clearance, lattice.rotation_rad, x, y)
            low, high = (middle, high) if kept else (low, middle)
        found.append(low)
    return found


@pytest.mark.parametrize("name", FACES)
def test_the_lattice_shows_the_most_and_lies_in_the_middle_of_its_play(name):
    loop, clearance = FACES[name]
    regions = [region(loop, clearance)]
    wide, along = (REQUEST.choose(regions, search=s) for s in (True, False))
    for found in (wide, along):
        cells = shown(loop, clearance, found.rotation_rad, found.x_mm, found.y_mm)
        assert {tuple(cell) for cell in found.cells[0].tolist()} == cells
        places, other = (windows(cells, *shape) for shape in (WINDOW, WINDOW[::-1]))
        assert (found.places, found.quarter) == ((max(places, other),), int(other > places))
    left, right, down, up = play(loop, clearance, along)
    assert left == pytest.approx(right, abs=0.02)
    assert down == pytest.approx(up, abs=0.02)
    assert along.margin_mm == pytest.approx(min(left + right, down + up) / 2, abs=0.02)
    faces, steps = [(loop, clearance)], np.arange(10) * PITCH / 10
    chosen = worth(faces, along.rotation_rad, along.x_mm, along.y_mm)
    for rotation in edge_rotations(regions):
        assert chosen >= max(worth(faces, rotation, x, y) for x in steps for y in steps)
    assert worth(faces, wide.rotation_rad, wide.x_mm, wide.y_mm) >= chosen


NOSE = [(0, 0), (room(2, 3.0), 0), (room(2, 3.0), room(3, 3.0)), (0, room(3, 3.0)),
        (0, 16.4), (-8.5, 16.4), (-8.5, 8.4), (0, 8.4)]  # fmt: skip
LARGE = rectangle(room(6, 0.5), room(6, 2.0))
HAND = {
    "one face": ([LARGE], HALF, (20,), 0, [36]),
    # One shift gives the large face 6 columns and the small one 1; another 5 and 2.
    "a face that shows a place outweighs places elsewhere": (
        [LARGE, rectangle(room(2, 0.5), room(3, 2.0), x=12 * PITCH + 3.5)],
        HALF, (16, 1), 0, [30, 6],
    ),
    # A window of 3 x 2 fits 8 and 0 times, of 2 x 3 5 and 1 times.
    "the turn that shows a place on more faces": (
        [rectangle(room(3, 0.5), room(6, 0.5)), rectangle(room(3, 0.5), room(2, 0.5), x=70)],
        HALF, (5, 1), 1, [18, 6],
    ),
    # A window fits once either way; the nose holds one more cell if the lattice is low enough.
    "of equal places more cells": ([NOSE], HALF, (1,), 0, [7]),
    "centres at 0, 7 and 14 and nowhere else": (
        [rectangle(21.5, 21.5, x=-3.75, y=-3.75)], 2.75, (2,), 0, [9],
    ),
    "no room": ([rectangle(5, 5)] * 2, HALF, (0, 0), 0, [0, 0]),
}  # fmt: skip


@pytest.mark.parametrize("case", HAND)
def test_places_of_rectangles_worked_by_hand(case):
    loops, half, places, quarter, cells = HAND[case]
    found = LatticeRequest(half, PITCH, WINDOW).choose(
        [region(loop) for loop in loops], search=False
    )
    assert (found.places, found.quarter) == (places, quarter)
    assert [len(one) for one in found.cells] == cells


@pytest.mark.parametrize(("first", "second"), [(0.4, 2.0), (2.0, 0.4), (0.5, 0.9), (0.9, 0.5)])
def test_of_equal_lattices_the_one_with_the_most_play_is_taken(first, second):
    # Three columns each; the second face begins half a pitch beside the first one's lattice.
    right = 10 * PITCH + 3.5
    faces = [rectangle(room(3, play), room(3, 3.0)) for play in (first, second)]
    faces[1] = [(x + right, y) for x, y in faces[1]]
    found = REQUEST.choose([region(loop) for loop in faces], search=False)
    columns = [len(set(cells[:, 1].tolist())) for cells in found.cells]
    assert columns == ([3, 2] if first > second else [2, 3])
    assert found.margin_mm == pytest.approx(max(first, second) / 2, abs=1e-5)


def in_quarter(quarter, number):
    """A rank test that so many cells in a line pass where they are turned by so many quarters."""

    def identifies(rows, columns):
        along = (columns, -rows, -columns, rows)[quarter]
        return len(rows) == number and bool((np.diff(along) > 0).all())

    return identifies


@pytest.mark.parametrize("quarter", range(4))
@pytest.mark.parametrize(("number", "margin_mm"), [(4, 0.5), (2, None)])
def test_the_most_cells_that_pass_the_rank_test_are_the_place_in_their_turn(
    quarter, number, margin_mm
):
    strip = rectangle(room(4, 2.0), room(1, 1.0 if number == 4 else 2.0))
    identifies = in_quarter(quarter, number)
    found = LatticeRequest(HALF, PITCH, WINDOW, identifies).choose([region(strip)])
    assert (found.places, found.quarter, len(found.cells[0])) == ((1,), quarter, number)
    if margin_mm:
        assert found.margin_mm == pytest.approx(margin_mm, abs=1e-5)


def test_places_of_strips_into_which_no_window_fits():
    four = region(rectangle(room(4, 2.0), room(1, 1.0)))
    two = region(rectangle(room(2, 2.0), 9.0, y=63.0))
    for strips, passes, places, cells in (
        ([four], lambda _: False, (0,), 4),
        ([four], lambda _: True, (1,), 4),
        ([four], lambda number: number < 4, (1,), 1),  # the most of those tried
        ([four, two], lambda number: number == 4, (1, 0), 4),
        ([four, two], lambda number: number == 2, (0, 1), 4),
    ):
        rank = LatticeRequest(HALF, PITCH, WINDOW, lambda rows, _, f=passes: f(len(rows)))
        found = rank.choose(strips)
        assert (found.places, len(found.cells[0])) == (places, cells)


def test_the_rank_test_is_not_asked_where_a_window_fits():
    def refused(rows, columns):
        raise AssertionError

    loop = rectangle(room(3, 1.0), room(3, 1.0))
    found = LatticeRequest(HALF, PITCH, WINDOW, refused).choose([region(loop)])
    assert (found.places, found.quarter) == ((2,), 0)


def test_directions_of_edges_lie_within_an_eighth_turn_of_the_axes():
    def of(*directions):
        radians = np.radians(directions)
        points = np.cumsum([(0, 0), *zip(np.cos(radians), np.sin(radians), strict=True)], axis=0)
        return edge_rotations([region(points)])

    for direction, turn in ((30, -30), (60, 30), (-100, 10), (45, 45), (-45, 45), (135, 45),
                            (0, 0), (90, 0), (180, 0)):  # fmt: skip
        assert of(direction)[0] == pytest.approx(np.radians(turn))
    roof = edge_rotations([region([(0, 0), (60, 0), (30, 30 * 3**0.5)])])
    assert np.sort(roof) == pytest.approx(np.radians([-30, 0, 30]), abs=1e-9)
    for apart, count in ((2e-10, 1), (1e-7, 2)):
        loop = [(0, 0), (50, 0), (50, 40), (0, 40 + 50 * apart)]
        assert len(edge_rotations([region(loop)])) == count
    assert len(of(*range(-40, 40, 5))) == 12


#: Twelfths of a quarter turn -> a face of which that rotation shows the most.
TURNED = {
    1: [(0, 0), (32, 0), (16, 23), (8, 27)],
    3: [(0, 0), (17, 0), (44, 23), (12, 37)],
    4: [(0, 0), (28, 0), (42, 31), (11, 25)],
    8: [(0, 0), (35, 0), (44, 35), (10, 17)],
    11: [(0, 0), (27, 0), (21, 35), (7, 24)],
}


@pytest.mark.parametrize("twelfth", TURNED)
def test_between_the_edges_twelfths_of_a_quarter_turn_are_tried(twelfth):
    loop = TURNED[twelfth]
    found = REQUEST.choose([region(loop)])
    assert found.rotation_rad == pytest.approx(twelfth * np.pi / 24)
    along = REQUEST.choose([region(loop)], search=False)
    one, other = (worth([(loop, 1.0)], f.rotation_rad, f.x_mm, f.y_mm) for f in (found, along))
    assert one > other
