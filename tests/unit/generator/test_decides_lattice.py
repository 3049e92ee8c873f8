"""Which lattice is chosen: against every shift tried one by one with another library's geometry."""

import numpy as np
import pytest
import shapely

from generator.layout import lattice as lattice_module
from generator.layout.footprint import move_region, region_of
from generator.layout.lattice import (
    CellSet,
    Lattice,
    LatticeCandidate,
    _centre,
    _unique_sets,
    _with_places,
    choose_lattice,
    edge_rotations,
    lattice_candidates,
)

HALF, PITCH = 2.7, 7.0
WINDOW = (3, 2)  # rows and columns


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


@pytest.mark.parametrize("name", FACES)
def test_the_lattice_shows_what_it_says(name):
    loop, clearance = FACES[name]
    for search in (False, True):
        found = choose_lattice([region(loop, clearance)], HALF, PITCH, WINDOW, search=search)
        cells = shown(loop, clearance, found.rotation_rad, found.x_mm, found.y_mm)
        assert {tuple(cell) for cell in found.cells[0].tolist()} == cells
        places = windows(cells, *(WINDOW if found.quarter % 2 == 0 else WINDOW[::-1]))
        assert found.places == (places,)
        other = windows(cells, *(WINDOW if found.quarter % 2 else WINDOW[::-1]))
        assert places > other or (places == other and found.quarter == 0)
        assert found.quarter in (0, 1)


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
def test_the_lattice_is_in_the_middle_of_its_play(name):
    loop, clearance = FACES[name]
    found = choose_lattice([region(loop, clearance)], HALF, PITCH, WINDOW, search=False)
    left, right, down, up = play(loop, clearance, found)
    assert left == pytest.approx(right, abs=0.02)
    assert down == pytest.approx(up, abs=0.02)
    assert found.margin_mm == pytest.approx(min(left + right, down + up) / 2, abs=0.02)


def two_strips(first, second, gap):
    """Two faces of three columns each that one lattice cannot both give all three."""
    height = room(3, 3.0)
    right = gap + room(3, first)
    faces = [rectangle(room(3, first), height), rectangle(room(3, second), height, x=right)]
    return faces, [region(loop) for loop in faces]


@pytest.mark.parametrize(("first", "second"), [(0.4, 2.0), (2.0, 0.4), (0.5, 0.9), (0.9, 0.5)])
def test_of_equal_lattices_the_one_with_the_most_play_is_taken(first, second):
    # the second face begins half a pitch beside the first one's lattice
    gap = 10 * PITCH + 3.5 - room(3, first)
    faces, regions = two_strips(first, second, gap)
    found = choose_lattice(regions, HALF, PITCH, WINDOW, search=False)
    columns = [len(set(cells[:, 1].tolist())) for cells in found.cells]
    assert columns == ([3, 2] if first > second else [2, 3])
    assert found.margin_mm == pytest.approx(max(first, second) / 2, abs=1e-5)
    for loop, cells in zip(faces, found.cells, strict=True):
        assert {tuple(cell) for cell in cells.tolist()} == shown(
            loop, 1.0, found.rotation_rad, found.x_mm, found.y_mm
        )


def test_a_face_that_shows_a_place_outweighs_places_elsewhere():
    # one shift gives the large face 6 columns and the small one 1; another 5 and 2
    large, small = rectangle(room(6, 0.5), room(6, 2.0)), room(2, 0.5)
    beside = rectangle(small, room(3, 2.0), x=12 * PITCH + 3.5)
    found = choose_lattice([region(large), region(beside)], HALF, PITCH, WINDOW, search=False)
    assert [len(cells) for cells in found.cells] == [30, 6]
    assert found.places == (4 * 4, 1)
    alone = choose_lattice([region(large)], HALF, PITCH, WINDOW, search=False)
    assert len(alone.cells[0]) == 36


def test_of_equal_places_more_cells_are_taken():
    # a window fits once either way; the nose holds one more cell if the lattice is low enough
    body = room(2, 3.0)
    nose = [(0, 0), (body, 0), (body, room(3, 3.0)), (0, room(3, 3.0)), (0, 16.4), (-8.5, 16.4),
            (-8.5, 8.4), (0, 8.4)]  # fmt: skip
    found = choose_lattice([region(nose)], HALF, PITCH, WINDOW, search=False)
    assert found.places == (1,)
    best = max(
        worth([(nose, 1.0)], 0.0, x, y)
        for x in np.arange(0, PITCH, 0.5)
        for y in np.arange(0, PITCH, 0.25)
    )
    assert best == (1, 1, 7)
    assert len(found.cells[0]) == 7


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
    found = choose_lattice([region(strip)], HALF, PITCH, WINDOW, identifies)
    assert (found.places, found.quarter, len(found.cells[0])) == ((1,), quarter, number)
    if margin_mm:
        assert found.margin_mm == pytest.approx(margin_mm, abs=1e-5)


def test_fewer_cells_are_taken_where_more_of_them_do_not_pass():
    strip = rectangle(room(4, 2.0), room(1, 1.0))
    most = choose_lattice([region(strip)], HALF, PITCH, WINDOW, lambda *_: False)
    assert (most.places, len(most.cells[0])) == ((0,), 4)
    tried = []

    def identifies(rows, columns):
        tried.append(len(rows))
        return len(rows) < 4

    fewer = choose_lattice([region(strip)], HALF, PITCH, WINDOW, identifies)
    assert fewer.places == (1,)
    assert 0 < len(fewer.cells[0]) < 4
    assert len(fewer.cells[0]) == max(n for n in tried if n < 4)  # the most that pass


def test_all_cells_are_taken_where_any_pass():
    strip = [region(rectangle(room(4, 2.0), room(1, 2.0)))]
    found = choose_lattice(strip, HALF, PITCH, WINDOW, lambda *_: True)
    assert len(found.cells[0]) == 4
    two = [*strip, region(rectangle(room(1, 0.5), room(1, 0.5), y=63.0))]
    found = choose_lattice(two, HALF, PITCH, WINDOW, lambda rows, _: len(rows) == 2)
    assert found.places == (1, 0)


def test_one_of_two_faces_that_passes_the_rank_test_is_enough():
    strips = [rectangle(room(4, 2.0), room(1, 1.0)), rectangle(room(2, 2.0), 9.0, y=63.0)]
    regions = [region(loop) for loop in strips]
    for number, places in ((4, (1, 0)), (2, (0, 1))):
        found = choose_lattice(
            regions, HALF, PITCH, WINDOW, lambda rows, _, number=number: len(rows) == number
        )
        assert found.places == places


def test_the_rank_test_is_not_asked_where_a_window_fits():
    def refused(rows, columns):
        raise AssertionError

    loop = rectangle(room(3, 1.0), room(3, 1.0))
    found = choose_lattice([region(loop)], HALF, PITCH, WINDOW, refused)
    assert found.places == (2,)
    assert found.quarter == 0


def test_nothing_is_shown_where_nothing_fits():
    found = choose_lattice([region(rectangle(5, 5))] * 2, HALF, PITCH, WINDOW)
    assert (found.rotation_rad, found.x_mm, found.y_mm, found.margin_mm) == (0.0, 0.0, 0.0, 0.0)
    assert (found.places, found.quarter) == ((0, 0), 0)
    assert [cells.shape for cells in found.cells] == [(0, 2), (0, 2)]


def test_directions_of_edges_within_an_eighth_turn_of_the_axes():
    def of(*directions):
        points = np.cumsum([np.zeros(2), *([np.cos(d), np.sin(d)] for d in directions)], axis=0)
        return edge_rotations([region(points.tolist())])

    degree = np.pi / 180
    assert of(30 * degree)[0] == pytest.approx(-30 * degree)
    assert of(60 * degree)[0] == pytest.approx(30 * degree)
    assert of(-100 * degree)[0] == pytest.approx(10 * degree)
    for eighth in (45, 135, -45, -135):
        assert of(eighth * degree)[0] == pytest.approx(45 * degree)
    for axis in (0, 90, 180, -90):
        assert of(axis * degree)[0] == 0.0


def test_the_first_edge_comes_first_then_the_longest_and_twelve_at_most():
    degree = np.pi / 180
    lengths = [3.0, *np.linspace(5.0, 20.0, 15)]
    angles = np.array([20.0, *np.linspace(-40, 40, 15)]) * degree + 1e-3
    points, at = [], 0j
    for length, angle in zip(lengths, angles, strict=True):
        points.append((at.real, at.imag))
        at += length * np.exp(1j * angle)
    points.append((at.real, at.imag))
    closing = -np.angle(0j - at)
    found = edge_rotations([region(points)])
    assert len(found) == 12
    assert found[0] == pytest.approx(-angles[0])
    longest = [-a for a in angles[:0:-1]]
    assert found[1] == pytest.approx((closing + np.pi / 4) % (np.pi / 2) - np.pi / 4, abs=1e-9)
    assert found[2:] == pytest.approx(longest[:10])


def test_directions_that_mirror_each_other_are_two():
    roof = edge_rotations([region([(0, 0), (60, 0), (30, 30 * 3**0.5)])])
    assert np.sort(roof) == pytest.approx(np.pi / 6 * np.array([-1, 0, 1]), abs=1e-9)


def test_directions_that_differ_by_less_than_rounding_are_one():
    for apart, count in ((0.0, 1), (2e-10, 1), (1e-7, 2)):
        loop = [(0, 0), (50, 0), (50 + 0.0, 40), (0, 40 + 50 * apart)]
        assert len(edge_rotations([region(loop)])) == count


def test_a_face_turned_and_moved_keeps_its_cells():
    base = region(HEXAGON)
    for turn, x, y in ((0.3, 100.0, -300.0), (-1.2, -45.0, 20.0)):
        one = choose_lattice([base], HALF, PITCH, WINDOW, search=False)
        other = choose_lattice([move_region(base, turn, x, y)], HALF, PITCH, WINDOW, search=False)
        assert (other.places, len(other.cells[0])) == (one.places, len(one.cells[0]))


@pytest.mark.parametrize("name", FACES)
def test_no_shift_along_an_edge_shows_more(name):
    loop, clearance = FACES[name]
    faces = [(loop, clearance)]
    found = choose_lattice([region(loop, clearance)], HALF, PITCH, WINDOW, search=False)
    chosen = worth(faces, found.rotation_rad, found.x_mm, found.y_mm)
    steps = np.arange(10) * PITCH / 10
    for rotation in edge_rotations([region(loop, clearance)]):
        best = max(worth(faces, rotation, x, y) for x in steps for y in steps)
        assert chosen >= best
    wide = choose_lattice([region(loop, clearance)], HALF, PITCH, WINDOW)
    assert worth(faces, wide.rotation_rad, wide.x_mm, wide.y_mm) >= chosen


#: Twelfths of a quarter turn -> a face of which that rotation shows the most.
TURNED = {
    1: [(0, 0), (32, 0), (16, 23), (8, 27)],
    2: [(0, 0), (35, 0), (24, 26), (9, 35)],
    3: [(0, 0), (17, 0), (44, 23), (12, 37)],
    4: [(0, 0), (28, 0), (42, 31), (11, 25)],
    5: [(0, 0), (16, 0), (34, 39), (10, 17)],
    7: [(0, 0), (26, 0), (44, 39), (5, 20)],
    8: [(0, 0), (35, 0), (44, 35), (10, 17)],
    9: [(0, 0), (27, 0), (39, 30), (7, 20)],
    10: [(0, 0), (26, 0), (16, 31), (6, 29)],
    11: [(0, 0), (27, 0), (21, 35), (7, 24)],
}


@pytest.mark.parametrize("twelfth", TURNED)
def test_between_the_edges_twelfths_of_a_quarter_turn_are_tried(twelfth):
    loop = TURNED[twelfth]
    faces, steps = [(loop, 1.0)], np.arange(7) * PITCH / 7
    found = choose_lattice([region(loop)], HALF, PITCH, WINDOW)
    assert found.rotation_rad == pytest.approx(twelfth * np.pi / 24)
    chosen = worth(faces, found.rotation_rad, found.x_mm, found.y_mm)
    for rotation in edge_rotations([region(loop)]):
        assert chosen > max(worth(faces, rotation, x, y) for x in steps for y in steps)
    along = choose_lattice([region(loop)], HALF, PITCH, WINDOW, search=False)
    assert chosen > worth(faces, along.rotation_rad, along.x_mm, along.y_mm)
    # a rank test that nothing passes changes nothing
    same = choose_lattice([region(loop)], HALF, PITCH, WINDOW, lambda *_: False)
    assert (same.rotation_rad, same.x_mm, same.y_mm) == (
        found.rotation_rad, found.x_mm, found.y_mm
    )  # fmt: skip


def test_the_turn_that_shows_a_place_on_more_faces_is_taken():
    # rows x columns 6 x 3 and 2 x 3: a window of 3 x 2 fits 8 and 0 times, of 2 x 3 5 and 1 times
    large = rectangle(room(3, 0.5), room(6, 0.5))
    small = rectangle(room(3, 0.5), room(2, 0.5), x=10 * PITCH)
    found = choose_lattice([region(large), region(small)], HALF, PITCH, WINDOW, search=False)
    assert (found.places, found.quarter) == ((5, 1), 1)


def block(rows, columns):
    return np.argwhere(np.ones((rows, columns), dtype=bool))


def test_no_number_of_places_outweighs_a_face_that_shows_one():
    cells = block(70_000, 3), block(2, 3)
    found = _with_places(Lattice(0.0, 0.0, 0.0, cells, (), 0, 0.0), WINDOW, None)
    assert (found.places, found.quarter) == ((69_999, 1), 1)


def test_cells_that_fit_at_no_shift_but_the_first_are_found():
    loop = rectangle(21.5, 21.5, x=-3.75, y=-3.75)  # centres at 0, 7 and 14 and nowhere else
    found = choose_lattice([region(loop)], 2.75, PITCH, WINDOW, search=False)
    assert len(found.cells[0]) == 9


def test_shifts_that_show_less_are_left_out():
    # a single cell has a place of its own; most shifts show none
    loop = rectangle(room(1, 1.0), room(1, 1.0))
    found = choose_lattice([region(loop)], HALF, PITCH, (1, 1), search=False)
    assert (found.places, len(found.cells[0])) == ((1,), 1)
    assert found.margin_mm == pytest.approx(0.5, abs=1e-5)


def looks(monkeypatch, regions, answers=()):
    """(rotation, steps, best so far) of every look at a rotation, answered as is told."""
    calls, left = [], list(answers)

    def look(regions, half, pitch, window, rotation, steps, best):
        calls.append((rotation, steps, best))
        score = left.pop(0) if left else None
        return [LatticeCandidate(*score, rotation, ())] if score else []

    monkeypatch.setattr(lattice_module, "_best_shifts", look)
    found = lattice_candidates(regions, HALF, PITCH, WINDOW, search=True)
    return calls, [(one.worth, one.cells) for one in found]


@pytest.mark.parametrize(
    ("faces", "steps"),
    [
        # steps^2 (2 area + 8) <= 2^17, area in squares of the pitch; at least 4, at most 16
        ([(2, 2)], 16),
        ([(14, 18)], 16),  # 2 x 252 + 8 = 512 = 2^17 / 16^2
        ([(10, 10), (8, 19)], 16),
        ([(11, 23)], 15),
        ([(40, 50)], 5),
        ([(62, 66)], 4),  # 2 x 4092 + 8 = 8192 = 2^17 / 4^2
        ([(100, 100)], 4),
    ],
)
def test_small_faces_are_looked_at_in_finer_steps(monkeypatch, faces, steps):
    regions = [region(rectangle(PITCH * a, PITCH * b, x=-30, y=55)) for a, b in faces]
    calls, _ = looks(monkeypatch, regions)
    assert calls[0] == (0.0, steps, (0, 0))
    assert {coarse for _, coarse, _ in calls[1:]} == {4}


def test_between_edges_a_coarse_look_decides_whether_a_fine_one_is_worth_it(monkeypatch):
    # three edges show nothing, two rotations cells alone, the third one a place
    answers = [None, None, None, (0, 3), (0, 2), (5, 7), (6, 7), (8, 7), None, (9, 1)]
    calls, found = looks(monkeypatch, [region(TRIANGLE)], answers)
    edges = edge_rotations([region(TRIANGLE)])
    twelfths = [np.pi / 24 * k for k in range(1, 12)]
    assert [c[0] for c in calls] == pytest.approx(
        [*edges, *twelfths[:4], twelfths[3], *twelfths[4:6], twelfths[5], *twelfths[6:]]
    )
    assert [c[1] for c in calls] == [16, 16, 16, 4, 4, 4, 4, 16, 4, 4, 16, *([4] * 5)]
    assert [c[2] for c in calls] == [
        *([(0, 0)] * 4), (0, 3), (0, 3), (5, 7), (5, 7), (8, 7), (8, 7), (8, 7), *([(8, 7)] * 5)
    ]  # fmt: skip
    assert found == [(0, 3), (0, 2), (5, 7), (8, 7)]


def test_the_best_of_all_edges_so_far_has_to_be_reached(monkeypatch):
    calls, _ = looks(monkeypatch, [region(TRIANGLE)], [(0, 5), (9, 4)])
    assert [best for *_, best in calls] == [(0, 0), (0, 5), *([(9, 4)] * 12)]


def unique_sets(numbers):
    """Which shifts are kept of some along x that show these sets of cells, as binary numbers."""
    free = np.array([[n >> bit & 1 for n in numbers] for bit in range(8)], dtype=bool)
    grids = [(free[None, None], (0, 0))]
    at = np.array([(0, k) for k in range(len(numbers))])
    return [int(one.x) for one in _unique_sets(grids, at, np.zeros(1), np.arange(len(numbers)))]


def test_of_many_shifts_64_are_looked_at_and_eight_sets_compared():
    assert unique_sets(range(1, 65)) == list(range(8))
    # every 99 / 63 of a hundred
    assert unique_sets(range(1, 101)) == [0, 1, 3, 4, 6, 7, 9, 11]
    # of 72 the ninth is passed over
    assert unique_sets([1] * 8 + [2] + [1] * 63) == [0]
    assert unique_sets([1] * 9 + [2] + [1] * 62) == [0, 9]


def test_a_lattice_is_centred_in_three_passes():
    # legs along the axes: the centre may be anywhere with x, y >= 2 and x + y <= 16
    loop = [(0, 0), (20, 0), (0, 20)]
    face = region_of([np.array(loop, float)], [np.array([1.0, 2**0.5, 1.0])])
    found = _centre([face], 1.0, PITCH, 0.0, CellSet(2.5, 3.0, (np.array([[0, 0]]),)))
    x, y, margin = 3.0, 2.5, 0.0
    for _ in range(3):
        x, across = (2 + 16 - y) / 2, 16 - y - 2
        y, down = (2 + 16 - x) / 2, 16 - x - 2
        margin = min(across, down) / 2
    assert (found.x_mm, found.y_mm) == pytest.approx((x, y), abs=1e-6)
    assert found.margin_mm == pytest.approx(margin, abs=1e-5)
    assert y == pytest.approx(6 - 3.5 / 64)  # a quarter of the error is left by each


def test_faces_that_share_a_lattice_bound_its_play_together():
    loops = rectangle(10, 6), rectangle(10, 6, x=21 + 0.3, y=0.4)
    cells = (np.array([[0, 0]]), np.array([[0, 3]]))
    regions = [region(loop) for loop in loops]
    for order in (slice(None), slice(None, None, -1)):
        found = _centre(regions[order], 1.0, PITCH, 0.0, CellSet(2.5, 3.0, cells[order]))
        # x from 2.3 to 8, y from 2.4 to 4
        assert (found.x_mm, found.y_mm) == pytest.approx((5.15, 3.2))
        assert found.margin_mm == pytest.approx(0.8, abs=1e-5)
