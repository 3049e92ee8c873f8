"""Beads keep their volume, the highest is the surface, and faults do what they do by hand."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from generator.errors import PrintError
from generator.printed.deposit import (
    Beads,
    Deposit,
    beads_of,
    cap_mm,
    deposit,
    dot_size,
    seam_blobs,
    section_size,
    strings,
)
from generator.printed.faults import NAMED, PrintFaults, faulty_path, print_faults
from generator.printed.gcode import Toolpath, toolpath_of
from generator.printed.slicer import SlicedPart
from generator.printed.view import DEPTH_MM, face_surface, heights_from_above, heights_sideways

FILAMENT = math.pi * 1.75**2 / 4
W, H = 0.5, 0.2
SECTION = H * (W - H) + math.pi * H**2 / 4


def one_line(length: float = 10.0, section: float = SECTION) -> Beads:
    e = length * section / FILAMENT
    return beads_of(toolpath_of(f"M83\nG1 X0 Y0 Z.2\nG1 X{length} E{e:.8f}"))


def volume(beads: Beads, step: float = 0.01) -> float:
    """Volume of one straight bead from its heights: its lower half mirrors its upper half."""
    low = np.minimum(beads.start_mm, beads.end_mm).min(axis=0) - 1
    high = np.maximum(beads.start_mm, beads.end_mm).max(axis=0) + 1
    shape = tuple((np.ceil((high - low)[::-1] / step)).astype(int))
    heights = heights_from_above(beads, low, shape, step)
    middle = beads.top_mm[0] - beads.height_mm[0] / 2
    over = heights[np.isfinite(heights)].astype(np.float64) - middle
    return float(2 * over.sum() * step**2)


def test_the_section_is_a_stadium_as_wide_as_its_volume_says() -> None:
    (bead,) = (one_line(),)
    assert bead.width_mm == pytest.approx([W])
    assert bead.height_mm == pytest.approx([H])
    low, step = np.array([5.0, -0.4]), 0.05
    heights = heights_from_above(bead, low, (17, 3), step)
    column = heights[:, 1].astype(np.float64)
    y = low[1] + step * np.arange(17)
    # Flat to 0.15 mm from the middle, then a quarter circle of 0.1 mm, then nothing.
    for at, z in ((0.0, 0.2), (0.1, 0.2), (0.15, 0.2), (0.2, 0.1 + math.sqrt(0.0075)), (0.3, None)):
        found = column[np.isclose(np.abs(y), at)]
        assert len(found) == (1 if at == 0 else 2)
        assert (np.isneginf(found) if z is None else np.isclose(found, z, atol=1e-6)).all()


@pytest.mark.parametrize("length", [10.0, 1.0, 0.5, 0.3, 0.05])
def test_a_stroke_holds_what_was_extruded_ends_included(length: float) -> None:
    assert volume(one_line(length)) == pytest.approx(length * SECTION, rel=0.02)


def test_ends_are_set_back_by_what_their_round_caps_hold() -> None:
    bead = one_line()
    back = float(cap_mm(np.array([W]), np.array([H]))[0])
    assert bead.start_mm == pytest.approx(np.array([[back, 0.0]]))
    assert bead.end_mm == pytest.approx(np.array([[10 - back, 0.0]]))
    assert 0.7 * W / 2 < back < math.pi * W / 8  # that of a plain cylinder's half


def test_too_little_for_its_layer_is_a_string_on_the_layer_below() -> None:
    thin = one_line(section=math.pi * 0.05**2)
    assert thin.width_mm == pytest.approx([0.1], rel=1e-4)
    assert thin.height_mm == pytest.approx([0.1], rel=1e-4)
    assert thin.top_mm == pytest.approx([0.1], abs=1e-4)
    assert section_size(np.array([math.pi / 100]), np.array([0.2])) == (
        pytest.approx([0.2]), pytest.approx([0.2]),
    )  # fmt: skip
    width, height = dot_size(np.array([math.pi * 0.1**3 / 6]), np.array([0.2]))
    assert (width, height) == (pytest.approx([0.1]), pytest.approx([0.1]))


def test_short_moves_share_their_strokes_volume() -> None:
    text = "M83\nG1 X0 Y0 Z.2\nG1 X5 E.2\nG1 X5.02 E.0004\nG1 X5.04 E.0012\nG1 X10 E.1984"
    beads = beads_of(toolpath_of(text))
    assert beads.width_mm == pytest.approx(np.full(4, beads.width_mm[0]), rel=0.02)


def test_starved_strokes_begin_late() -> None:
    path = toolpath_of(f"M83\nG1 X0 Y0 Z.2\nG1 X10 E{10 * SECTION / FILAMENT:.8f}")
    usual, starved = beads_of(path), beads_of(path, starved_mm=0.3)
    assert starved.start_mm[0, 0] - usual.start_mm[0, 0] == pytest.approx(0.3)
    assert starved.end_mm == pytest.approx(usual.end_mm)


def some_beads(rng: np.random.Generator, count: int = 40) -> Beads:
    height = np.where(rng.random(count) < 0.5, 0.2, 0.3)
    start = rng.uniform(0, 4, (count, 2))
    end = start + rng.normal(0, 1.0, (count, 2))
    end[:3] = start[:3]  # dots
    end[3:6, 0], end[6:9, 1] = start[3:6, 0], start[6:9, 1]  # along the axes
    return Beads(start, end, 0.2 * rng.integers(1, 6, count), height + rng.uniform(0, 0.4, count),
                 height)  # fmt: skip


def each_bead(beads: Beads) -> Iterator[tuple]:
    """Ends, top, width and height of each."""
    sizes = (beads.top_mm, beads.width_mm, beads.height_mm)
    return zip(beads.start_mm, beads.end_mm, *sizes, strict=True)


def test_from_above_the_highest_of_all_beads_counts(rng: np.random.Generator) -> None:
    beads = some_beads(rng)
    low, step, shape = np.array([-0.53, -0.51]), 0.13, (45, 40)
    heights = heights_from_above(beads, low, shape, step)
    x, y = low[0] + step * np.arange(40), low[1] + step * np.arange(45)
    expected = np.full(shape, -np.inf)
    for a, b, top, w, h in each_bead(beads):
        way = b - a
        for i, yy in enumerate(y):
            for j, xx in enumerate(x):
                t = np.clip(np.dot((xx, yy) - a, way) / max(way @ way, 1e-12), 0, 1)
                off = max(math.dist((xx, yy), a + t * way) - (w - h) / 2, 0.0)
                if off <= h / 2:
                    z = top - h / 2 + math.sqrt(h * h / 4 - off * off)
                    expected[i, j] = max(expected[i, j], z)
    assert np.isfinite(expected).mean() > 0.2
    assert heights == pytest.approx(expected, abs=1e-5)


def test_sideways_the_outermost_of_all_beads_counts(rng: np.random.Generator) -> None:
    beads = some_beads(rng, 25)
    low, step, shape = np.array([-0.53, 0.013]), 0.1, (11, 50)
    heights = heights_sideways(beads, low, shape, step)
    n = np.arange(-3.0, 8.0, 0.004)
    for i in range(shape[0]):
        z = low[1] + step * i
        for j in range(0, shape[1], 3):
            t = low[0] + step * j
            reach = -np.inf
            for a, b, top, w, h in each_bead(beads):
                if not top - h <= z <= top:
                    continue
                way, points = b - a, np.stack([np.full(len(n), t), n], axis=1)
                s = np.clip((points - a) @ way / max(way @ way, 1e-12), 0, 1)
                off = np.linalg.norm(points - a - s[:, None] * way, axis=1) - (w - h) / 2
                inside = np.hypot(off.clip(0), z - (top - h / 2)) <= h / 2
                reach = max(reach, n[inside].max(initial=-np.inf))
            assert heights[i, j] == pytest.approx(reach, abs=0.012)


def block(T: np.ndarray, **options: object) -> object:
    """A block of 4 x 2 x 0.6 mm of three layers along x, seen on one of its faces."""
    layers = []
    for k in range(3):
        for y in (0.25, 0.65, 1.05, 1.45, 1.75):
            layers.append(([0.25, y], [3.75, y], 0.2 * (k + 1)))
    start, end, top = (np.array(each, dtype=float) for each in zip(*layers, strict=True))
    size = np.full(len(top), 1.0)
    printed = Deposit(Beads(start, end, top, 0.5 * size, 0.2 * size), np.zeros(3),
                      np.array([4.0, 2.0, 0.6]), options.pop("bow_mm", 0.0))  # fmt: skip
    return face_surface(printed, T, **options)


def test_a_face_that_looks_up_in_its_own_frame() -> None:
    quarter = np.array([[0.0, -1, 0, 4], [1, 0, 0, 0], [0, 0, 1, 0.6], [0, 0, 0, 1]])
    surface = block(quarter)  # origin at the corner (4, 0), x along the part's y
    assert surface.heights.dtype == np.float32
    assert surface.top_mm == pytest.approx(0.0, abs=1e-6)
    points = np.array([[0.65, 2.0], [0.85, 2.0], [0.65, 0.05], [3.0, 2.0], [0.65, -3.0]])
    found = surface.heights_mm(points)
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    assert -0.1 < found[1] < -0.01  # the groove between two beads
    assert found[2] == pytest.approx(-0.1 + math.sqrt(0.0075), abs=1e-3)  # a round end
    assert np.isneginf(found[3:]).all()


def test_an_upright_face_has_a_step_for_each_layer() -> None:
    front = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # y = 0
    surface = block(front)
    x = np.full(4, 2.0)
    found = surface.heights_mm(np.stack([x, [0.1, 0.2, 0.3, 0.45]], axis=1))
    # The outermost bead reaches y = 0 at the middle of each layer, and is round between.
    assert found[[0, 2]] == pytest.approx([0.0, 0.0], abs=2e-3)
    assert found[1] == pytest.approx(-0.1, abs=0.01)
    assert found[3] == pytest.approx(-0.1 + math.sqrt(0.0075), abs=5e-3)
    assert np.isneginf(surface.heights_mm(np.array([[2.0, 0.8], [4.5, 0.3]]))).all()
    other = np.array([[-1.0, 0, 0, 4], [0, 0, 1, 2], [0, 1, 0, 0], [0, 0, 0, 1]])  # y = 2
    assert block(other).heights_mm(np.array([[2.0, 0.3]])) == pytest.approx([0.0], abs=2e-3)


def test_a_bowed_part_stands_up_at_its_corners() -> None:
    T = np.eye(4)
    T[2, 3] = 0.6
    bowed, flat = block(T, bow_mm=0.4), block(T)
    at = np.array([[2.0, 1.05], [0.25, 1.05], [3.75, 0.25]])
    lifted = bowed.heights_mm(at) - flat.heights_mm(at)
    assert lifted == pytest.approx([0.0, 0.4 * 3.0625 / 5, 0.4 * (3.0625 + 0.5625) / 5], abs=2e-3)


def test_deeper_plastic_and_leaning_faces_are_left_out() -> None:
    T = np.eye(4)
    for above in (2.45, 2.55):  # the block
        T[2, 3] = 0.6 + above
        region = block(T, outline_mm=np.array([[0.0, 0], [1, 0], [1, 1]]))
        assert region.heights.shape == (61, 61)
        assert region.top_mm == (pytest.approx(-above, abs=1e-6) if above < DEPTH_MM else -np.inf)
    for z, y in ((-1.0, 0.0), (0.6, 0.8)):
        lean = np.eye(4)
        lean[:3, 1] = [0, z, -y]
        lean[:3, 2] = [0, y, z]
        with pytest.raises(PrintError, match="leans"):
            block(lean)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(17)


#: Two layers, each a square of 10 mm and a line of 5 mm in its middle.
TEXT = "M83\nF3000\n" + "".join(
    f"G1 Z{z}\nG1 X0 Y0 F3000\nG1 X10 E.33\nG1 Y10 E.33\nG1 X0 E.33\nG1 Y0.1 E.327\n"
    "G1 X2.5 Y5\nG1 X7.5 E.16\n"
    for z in (0.2, 0.4)
)


@pytest.fixture
def path() -> Toolpath:
    return toolpath_of(TEXT)


def chance() -> np.random.Generator:
    return np.random.default_rng(5)


def test_scale_and_skew_act_about_the_datum(path: Toolpath) -> None:
    faults = PrintFaults(scale_x=0.99, scale_y=1.01, skew_deg=math.degrees(math.atan(0.02)))
    moved = faulty_path(path, faults, chance(), datum_mm=(10.0, 0.0))
    corner = moved.end_mm[path.of_part][:3, :2]
    assert corner[0] == pytest.approx([10.0, 0.0])  # the datum itself stays
    assert corner[1] == pytest.approx([10 + 0.99 * 0.02 * 10, 10.1])
    assert corner[2] - corner[1] == pytest.approx([-9.9, 0.0])


def test_each_axis_follows_when_its_play_is_used_up() -> None:
    text = "M83\nG1 Z.2\nG1 X10 E1\nG1 X9.95 E1\nG1 X9 E1\nG1 X9 Y5 E1\nG1 X9.5 E1"
    moved = faulty_path(toolpath_of(text), PrintFaults(backlash_mm=0.2), chance())
    laid = moved.of_part
    assert moved.end_mm[laid, 0] == pytest.approx([9.9, 9.9, 9.1, 9.1, 9.4])
    assert moved.end_mm[laid, 1] == pytest.approx([0, 0, 0, 4.9, 4.9])
    assert moved.start_mm[1:] == pytest.approx(moved.end_mm[:-1])


def test_a_nozzle_swings_after_a_corner_along_the_change_of_its_direction(path: Toolpath) -> None:
    swung = faulty_path(path, PrintFaults(ringing_mm=0.1), chance())
    assert swung.volume_mm3.sum() == pytest.approx(path.volume_mm3.sum())
    laid = swung.of_part
    assert laid.sum() > 3 * path.of_part.sum()
    first = swung.end_mm[laid & (swung.end_mm[:, 2] < 0.3)]
    right = first[(np.abs(first[:, 0] - 10) < 0.2) & (first[:, 1] > 0.01)]  # from (10, 0) up
    off = right[:, 0] - 10
    assert right[-1, 1] == pytest.approx(10.0)
    assert off[-1] == 0
    # At 50 mm/s a wave is 1.25 mm: the first swing is over at .6 mm, back past the corner.
    early = off[(right[:, 1] > 0.1) & (right[:, 1] < 0.6)]
    assert 0.05 < np.abs(early).max() < 0.1
    assert (np.sign(early) == np.sign(early[0])).all()
    assert np.abs(off[right[:, 1] > 3.8]).max() == 0


def test_layers_are_shifted_each_as_a_whole(path: Toolpath) -> None:
    moved = faulty_path(path, PrintFaults(jitter_mm=0.1), chance())
    by = (moved.end_mm - path.end_mm)[path.of_part]
    layer = path.end_mm[path.of_part, 2] > 0.3
    for which in (layer, ~layer):
        assert by[which] == pytest.approx(np.tile(by[which][0], (int(which.sum()), 1)))
    assert np.linalg.norm(by[layer][0] - by[~layer][0]) > 0.01


def test_flow_has_the_mean_and_the_spread_that_are_asked() -> None:
    long = toolpath_of(
        "M83\nG1 Z.2\n" + "".join(f"G1 X{50 * (k % 2)} Y{k / 2} E1.6\n" for k in range(1, 2000))
    )
    flowing = faulty_path(long, PrintFaults(flow=1.1, flow_spread=0.05), chance())
    share = flowing.volume_mm3[long.of_part] / long.volume_mm3[long.of_part]
    assert share.mean() == pytest.approx(1.1, abs=0.01)
    assert share.std() == pytest.approx(0.055, abs=0.008)
    assert np.abs(np.diff(share)).mean() < 1.5 * share.std()  # it drifts, it does not jump


def test_blobs_stand_where_loops_begin(path: Toolpath) -> None:
    blobs = seam_blobs(path, 0.25)
    assert blobs.start_mm == pytest.approx(np.zeros((2, 2)))  # not on the two lines
    assert blobs.top_mm == pytest.approx([0.325, 0.525])
    assert blobs.width_mm == pytest.approx([0.25, 0.25])


def test_strings_hang_between_the_ends_of_travels(path: Toolpath) -> None:
    drawn = strings(path, 1.0, 0.15, chance())
    # From each square to its line; the way up to the second layer draws none.
    assert drawn.start_mm == pytest.approx(np.array([[0, 0.1], [0, 0.1]]))
    assert drawn.end_mm == pytest.approx(np.array([[2.5, 5], [2.5, 5]]))
    assert drawn.top_mm == pytest.approx([0.2, 0.4])
    assert len(strings(path, 0.0, 0.15, chance())) == 0


def test_a_deposit_is_in_the_parts_frame(path: Toolpath) -> None:
    T = np.eye(4)
    T[:3, 3] = [-5.0, -5.0, 1.0]
    sliced = SlicedPart(path, T, np.array([-5.0, -5, 1]), np.array([5.0, 5, 1.4]))
    perfect = deposit(sliced)
    assert perfect.beads.end_mm[0] == pytest.approx([5.0, -5.0])
    assert sorted(set(perfect.beads.top_mm.round(6))) == [1.2, 1.4]
    shrunk = deposit(sliced, PrintFaults(scale_x=0.9, bow_mm=0.2))
    assert shrunk.beads.end_mm[0] == pytest.approx([4.5, -5.0])  # about the middle of the box
    assert shrunk.bow_at(np.array([[0.0, 0.0], [5.0, 5.0], [5.0, 0.0]])) == pytest.approx(
        [0.0, 0.2, 0.1]
    )
    strung = deposit(sliced, PrintFaults(seam_mm=0.2, strings=1.0), chance())
    assert len(strung.beads) == len(perfect.beads) + 2 + 2


def test_names_and_numbers() -> None:
    assert print_faults("none") == PrintFaults() == print_faults("")
    assert print_faults("bad") == NAMED["bad"]
    assert print_faults("scale_x=.995, backlash_mm=0.1") == PrintFaults(
        scale_x=0.995, backlash_mm=0.1
    )
    assert print_faults("usual,flow=1.3") == replace(NAMED["usual"], flow=1.3)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("flow=1,bad", "unknown fault 'bad'"),
        ("backlash=0.1", "did you mean backlash_mm"),
        ("flow=much", "flow 'much'"),
        ("flow=3", "from 0.3 to 2"),
        ("scale_x=nan", "scale_x 'nan'"),
        ("seam_mm=-1", "from 0 to 1"),
    ],
)
def test_what_is_no_fault(text: str, says: str) -> None:
    with pytest.raises(PrintError, match=says):
        print_faults(text)
