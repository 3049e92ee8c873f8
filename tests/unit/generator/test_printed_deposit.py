"""Beads keep their volume, the highest is the surface, and faults do what they do by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from generator.errors import PrintError
from generator.printed.deposit import (
    Beads,
    Deposit,
    beads_of,
    deposit,
    dot_size,
    seam_blobs,
    section_size,
    strings,
)
from generator.printed.faults import NAMED, PrintFaults, faulty_path, print_faults
from generator.printed.gcode import toolpath_of
from generator.printed.slicer import SlicedPart
from generator.printed.view import DEPTH_MM, face_surface, heights_from_above, heights_sideways

FILAMENT = math.pi * 1.75**2 / 4
W, H = 0.5, 0.2
SECTION = H * (W - H) + math.pi * H**2 / 4


def one_line(length=10.0, section=SECTION):
    e = length * section / FILAMENT
    return toolpath_of(f"M83\nG1 X0 Y0 Z.2\nG1 X{length} E{e:.8f}")


def volume(beads, step=0.01):
    """Volume of one straight bead from its heights: its lower half mirrors its upper half."""
    low = np.minimum(beads.start_mm, beads.end_mm).min(axis=0) - 1
    high = np.maximum(beads.start_mm, beads.end_mm).max(axis=0) + 1
    shape = tuple((np.ceil((high - low)[::-1] / step)).astype(int))
    heights = heights_from_above(beads, low, shape, step)
    middle = beads.top_mm[0] - beads.height_mm[0] / 2
    over = heights[np.isfinite(heights)].astype(np.float64) - middle
    return float(2 * over.sum() * step**2)


@pytest.mark.parametrize("length", [10.0, 1.0, 0.5, 0.3, 0.05])
def test_a_stroke_is_as_wide_as_its_volume_says_and_holds_it_ends_included(length):
    bead = beads_of(one_line(length))
    if length > W:
        assert (*bead.width_mm, *bead.height_mm) == pytest.approx((W, H))
    assert volume(bead) == pytest.approx(length * SECTION, rel=0.02)


def test_too_little_for_its_layer_is_a_string_on_the_layer_below():
    thin = beads_of(one_line(section=math.pi * 0.05**2))
    assert (*thin.width_mm, *thin.height_mm, *thin.top_mm) == pytest.approx([0.1] * 3, rel=1e-3)
    sizes = section_size(np.array([math.pi / 100]), np.array([0.2]))
    assert np.concatenate(sizes) == pytest.approx([0.2, 0.2])
    sizes = dot_size(np.array([math.pi * 0.1**3 / 6]), np.array([0.2]))
    assert np.concatenate(sizes) == pytest.approx([0.1, 0.1])


def test_short_moves_share_their_strokes_volume():
    text = "M83\nG1 X0 Y0 Z.2\nG1 X5 E.2\nG1 X5.02 E.0004\nG1 X5.04 E.0012\nG1 X10 E.1984"
    beads = beads_of(toolpath_of(text))
    assert beads.width_mm == pytest.approx(np.full(4, beads.width_mm[0]), rel=0.02)


def test_starved_strokes_begin_late():
    usual, starved = beads_of(one_line()), beads_of(one_line(), starved_mm=0.3)
    assert starved.start_mm[0, 0] - usual.start_mm[0, 0] == pytest.approx(0.3)
    assert starved.end_mm == pytest.approx(usual.end_mm)


def some_beads(count):
    """Random beads; some are dots, some lie along the axes."""
    rng = np.random.default_rng(17)
    height = np.where(rng.random(count) < 0.5, 0.2, 0.3)
    start = rng.uniform(0, 4, (count, 2))
    end = start + rng.normal(0, 1.0, (count, 2))
    end[:3] = start[:3]
    end[3:6, 0], end[6:9, 1] = start[3:6, 0], start[6:9, 1]
    top, width = 0.2 * rng.integers(1, 6, count), height + rng.uniform(0, 0.4, count)
    return Beads(start, end, top, width, height)


def off_the_flat(points, k, beads):
    """Return how far points (..., 2) lie outside the flat middle of a bead."""
    a = beads.start_mm[k]
    way = beads.end_mm[k] - a
    t = np.clip((points - a) @ way / max(way @ way, 1e-12), 0, 1)
    off = np.linalg.norm(points - a - t[..., None] * way, axis=-1)
    return np.maximum(off - (beads.width_mm[k] - beads.height_mm[k]) / 2, 0.0)


def test_from_above_the_highest_of_all_beads_counts():
    beads = some_beads(40)
    low, step, shape = np.array([-0.53, -0.51]), 0.13, (45, 40)
    points = np.stack(np.meshgrid(np.arange(40), np.arange(45)), axis=-1) * step + low
    expected = np.full(shape, -np.inf)
    for k in range(len(beads)):
        off, r = off_the_flat(points, k, beads), beads.height_mm[k] / 2
        z = beads.top_mm[k] - r + np.sqrt((r * r - off * off).clip(0))
        expected = np.maximum(expected, np.where(off <= r, z, -np.inf))
    assert np.isfinite(expected).mean() > 0.2
    assert heights_from_above(beads, low, shape, step) == pytest.approx(expected, abs=1e-5)


def test_sideways_the_outermost_of_all_beads_counts():
    beads = some_beads(25)
    low, step, shape = np.array([-0.53, 0.013]), 0.1, (11, 50)
    heights = heights_sideways(beads, low, shape, step)
    n = np.arange(-3.0, 8.0, 0.004)
    for i, j in np.ndindex(shape[0], 17):
        z, t = low[1] + step * i, low[0] + step * 3 * j
        points = np.stack([np.full(len(n), t), n], axis=1)
        reach = -np.inf
        for k in range(len(beads)):
            r = beads.height_mm[k] / 2
            up = z - (beads.top_mm[k] - r)
            if abs(up) <= r:
                inside = np.hypot(off_the_flat(points, k, beads), up) <= r
                reach = max(reach, n[inside].max(initial=-np.inf))
        assert heights[i, 3 * j] == pytest.approx(reach, abs=0.012)


def block(T, *, bow_mm=0.0, **options):
    """A block of 4 x 2 x 0.6 mm of three layers along x, seen on one of its faces."""
    y, top = (each.ravel() for each in np.meshgrid([0.25, 0.65, 1.05, 1.45, 1.75], [0.2, 0.4, 0.6]))
    start, end = (np.stack([np.full(15, x), y], axis=1) for x in (0.25, 3.75))
    beads = Beads(start, end, top, np.full(15, W), np.full(15, H))
    return face_surface(
        Deposit(beads, np.zeros(3), np.array([4.0, 2.0, 0.6]), bow_mm), T, **options
    )


def test_an_upright_face_has_a_step_for_each_layer():
    front = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])  # y = 0
    surface = block(front)
    found = surface.heights_mm(np.stack([np.full(4, 2.0), [0.1, 0.2, 0.3, 0.45]], axis=1))
    # The outermost bead reaches y = 0 at the middle of each layer, and is round between.
    assert found[[0, 2]] == pytest.approx([0.0, 0.0], abs=2e-3)
    assert found[1] == pytest.approx(-0.1, abs=0.01)
    assert found[3] == pytest.approx(-0.1 + math.sqrt(0.0075), abs=5e-3)
    assert np.isneginf(surface.heights_mm(np.array([[2.0, 0.8], [4.5, 0.3]]))).all()
    other = np.array([[-1.0, 0, 0, 4], [0, 0, 1, 2], [0, 1, 0, 0], [0, 0, 0, 1]])  # y = 2
    assert block(other).heights_mm(np.array([[2.0, 0.3]])) == pytest.approx([0.0], abs=2e-3)


def test_a_bowed_part_stands_up_at_its_corners():
    T = np.eye(4)
    T[2, 3] = 0.6
    at = np.array([[2.0, 1.05], [0.25, 1.05], [3.75, 0.25]])
    lifted = block(T, bow_mm=0.4).heights_mm(at) - block(T).heights_mm(at)
    assert lifted == pytest.approx([0.0, 0.4 * 3.0625 / 5, 0.4 * (3.0625 + 0.5625) / 5], abs=2e-3)


def test_deeper_plastic_and_leaning_faces_are_left_out():
    T = np.eye(4)
    for above in (2.45, 2.55):  # the block
        T[2, 3] = 0.6 + above
        region = block(T, outline_mm=np.array([[0.0, 0], [1, 0], [1, 1]]))
        assert region.heights.shape == (61, 61)
        assert region.top_mm == (pytest.approx(-above, abs=1e-6) if above < DEPTH_MM else -np.inf)
    for z, y in ((-1.0, 0.0), (0.6, 0.8)):
        lean = np.eye(4)
        lean[:3, 1:3] = [[0, 0], [z, y], [-y, z]]
        with pytest.raises(PrintError, match="leans"):
            block(lean)


#: Two layers, each a square of 10 mm and a line of 5 mm in its middle.
PATH = toolpath_of("M83\nF3000\n" + "".join(
    f"G1 Z{z}\nG1 X0 Y0 F3000\nG1 X10 E.33\nG1 Y10 E.33\nG1 X0 E.33\nG1 Y0.1 E.327\n"
    "G1 X2.5 Y5\nG1 X7.5 E.16\n"
    for z in (0.2, 0.4)
))  # fmt: skip


def printed_with(path=PATH, datum_mm=(0.0, 0.0), **faults):
    return faulty_path(path, PrintFaults(**faults), np.random.default_rng(5), datum_mm=datum_mm)


def test_scale_and_skew_act_about_the_datum():
    skew = math.degrees(math.atan(0.02))
    moved = printed_with(datum_mm=(10.0, 0.0), scale_x=0.99, scale_y=1.01, skew_deg=skew)
    corner = moved.end_mm[PATH.of_part][:3, :2]
    assert corner[0] == pytest.approx([10.0, 0.0])  # the datum itself stays
    assert corner[1] == pytest.approx([10 + 0.99 * 0.02 * 10, 10.1])
    assert corner[2] - corner[1] == pytest.approx([-9.9, 0.0])


def test_each_axis_follows_when_its_play_is_used_up():
    text = "M83\nG1 Z.2\nG1 X10 E1\nG1 X9.95 E1\nG1 X9 E1\nG1 X9 Y5 E1\nG1 X9.5 E1"
    moved = printed_with(toolpath_of(text), backlash_mm=0.2)
    laid = moved.of_part
    assert moved.end_mm[laid, 0] == pytest.approx([9.9, 9.9, 9.1, 9.1, 9.4])
    assert moved.end_mm[laid, 1] == pytest.approx([0, 0, 0, 4.9, 4.9])
    assert moved.start_mm[1:] == pytest.approx(moved.end_mm[:-1])


def test_a_nozzle_swings_after_a_corner_along_the_change_of_its_direction():
    swung = printed_with(ringing_mm=0.1)
    assert swung.volume_mm3.sum() == pytest.approx(PATH.volume_mm3.sum())
    laid = swung.of_part
    assert laid.sum() > 3 * PATH.of_part.sum()
    first = swung.end_mm[laid & (swung.end_mm[:, 2] < 0.3)]
    right = first[(np.abs(first[:, 0] - 10) < 0.2) & (first[:, 1] > 0.01)]  # from (10, 0) up
    off = right[:, 0] - 10
    assert right[-1, 1] == pytest.approx(10.0)
    # At 50 mm/s a wave is 1.25 mm: the first swing is over at .6 mm, back past the corner.
    early = off[(right[:, 1] > 0.1) & (right[:, 1] < 0.6)]
    assert 0.05 < np.abs(early).max() < 0.1
    assert (np.sign(early) == np.sign(early[0])).all()
    assert np.abs(off[right[:, 1] > 3.8]).max() == 0


def test_layers_are_shifted_each_as_a_whole():
    by = (printed_with(jitter_mm=0.1).end_mm - PATH.end_mm)[PATH.of_part]
    layer = PATH.end_mm[PATH.of_part, 2] > 0.3
    for which in (layer, ~layer):
        assert by[which] == pytest.approx(np.tile(by[which][0], (int(which.sum()), 1)))
    assert np.linalg.norm(by[layer][0] - by[~layer][0]) > 0.01


def test_flow_has_the_mean_and_the_spread_that_are_asked():
    moves = "".join(f"G1 X{50 * (k % 2)} Y{k / 2} E1.6\n" for k in range(1, 2000))
    long = toolpath_of("M83\nG1 Z.2\n" + moves)
    flowing = printed_with(long, flow=1.1, flow_spread=0.05)
    share = flowing.volume_mm3[long.of_part] / long.volume_mm3[long.of_part]
    assert share.mean() == pytest.approx(1.1, abs=0.01)
    assert share.std() == pytest.approx(0.055, abs=0.008)
    assert np.abs(np.diff(share)).mean() < 1.5 * share.std()  # it drifts, it does not jump


def test_blobs_stand_where_loops_begin_and_strings_hang_between_the_ends_of_travels():
    blobs = seam_blobs(PATH, 0.25)
    assert blobs.start_mm == pytest.approx(np.zeros((2, 2)))  # not on the two lines
    assert blobs.top_mm == pytest.approx([0.325, 0.525])
    assert blobs.width_mm == pytest.approx([0.25, 0.25])
    drawn = strings(PATH, 1.0, 0.15, np.random.default_rng(5))
    # From each square to its line; the way up to the second layer draws none.
    assert drawn.start_mm == pytest.approx(np.array([[0, 0.1], [0, 0.1]]))
    assert drawn.end_mm == pytest.approx(np.array([[2.5, 5], [2.5, 5]]))
    assert drawn.top_mm == pytest.approx([0.2, 0.4])
    assert len(strings(PATH, 0.0, 0.15, np.random.default_rng(5))) == 0


def test_a_deposit_is_in_the_parts_frame():
    T = np.eye(4)
    T[:3, 3] = [-5.0, -5.0, 1.0]
    sliced = SlicedPart(PATH, T, np.array([-5.0, -5, 1]), np.array([5.0, 5, 1.4]))
    perfect = deposit(sliced)
    assert perfect.beads.end_mm[0] == pytest.approx([5.0, -5.0])
    assert sorted(set(perfect.beads.top_mm.round(6))) == [1.2, 1.4]
    shrunk = deposit(sliced, PrintFaults(scale_x=0.9, bow_mm=0.2))
    assert shrunk.beads.end_mm[0] == pytest.approx([4.5, -5.0])  # about the middle of the box
    lifted = shrunk.bow_at(np.array([[0.0, 0.0], [5.0, 5.0], [5.0, 0.0]]))
    assert lifted == pytest.approx([0.0, 0.2, 0.1])
    strung = deposit(sliced, PrintFaults(seam_mm=0.2, strings=1.0))
    assert len(strung.beads) == len(perfect.beads) + 2 + 2


def test_names_and_numbers():
    assert print_faults("none") == PrintFaults() == print_faults("")
    assert print_faults("usual,flow=1.3") == replace(NAMED["usual"], flow=1.3)
    own = print_faults("scale_x=.995, backlash_mm=0.1")
    assert own == PrintFaults(scale_x=0.995, backlash_mm=0.1)
    for text, says in (
        ("flow=1,bad", "unknown fault 'bad'"), ("backlash=0.1", "did you mean backlash_mm"),
        ("flow=much", "flow 'much'"), ("flow=3", "from 0.3 to 2"),
        ("scale_x=nan", "scale_x 'nan'"), ("seam_mm=-1", "from 0 to 1"),
    ):  # fmt: skip
        with pytest.raises(PrintError, match=says):
            print_faults(text)
