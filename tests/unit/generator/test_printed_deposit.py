"""Beads keep their volume, the highest is the surface; names of faults.

What faults do to touches of a print is in the corpus `counts`, and on a whole panel in
`tests/loop/test_printed_panel.py`.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from generator.errors import PrintError
from generator.printed.deposit import Beads, Deposit, beads_of, dot_size, section_size
from generator.printed.faults import NAMED, PrintFaults, print_faults
from generator.printed.gcode import toolpath_of
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
