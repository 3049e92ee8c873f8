"""Thinning, end-points and vertices: the thesis's counts, and symbols drawn at any turn."""

import math

import numpy as np
import pytest

from generator.alphabet import SymbolStyle, alphabet_named
from recognizer.thesis.skeleton import graph, length, points_of_glyph, points_of_skeleton
from recognizer.thesis.symbols import COUNTS, CUT, symbols
from recognizer.touch.tactile_image import tactile_image

STEP = 0.4


def style(alphabet, pitch=12.0):
    return SymbolStyle(
        pitch_mm=pitch, height_mm=1.0, stroke_mm=alphabet.stroke_ratio * pitch, draft_rad=0.17
    )


def drawn(alphabet, placed, size_mm=50.0, pitch=12.0, half_mm=None):
    """An image of (label, x, y, theta), strokes with soft sides."""
    n = round(size_mm / STEP)
    at = (np.arange(n) - (n - 1) / 2) * STEP
    z = at[None, :] - 1j * at[:, None]
    half = alphabet.stroke_ratio * pitch / 2 if half_mm is None else half_mm
    image = np.zeros((n, n))
    unit = alphabet.reach * pitch
    for label, x, y, theta in placed:
        own = (z - complex(x, y)) * np.exp(-1j * theta)
        for a, b in alphabet.glyphs[label].strokes:
            p, u = complex(*a) * unit, (complex(*b) - complex(*a)) * unit
            t = np.clip(((own - p) * u.conjugate()).real / abs(u) ** 2, 0, 1)
            image = np.maximum(image, np.clip((half + 0.4 - abs(own - p - t * u)) / 0.8, 0, 1))
    return tactile_image(image, step_mm=STEP)


# --- counts -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("thesis-2", [(2, 1, 0), (3, 2, 0)]),  # thesis, figure 6.4
        ("dense-4", [(2, 1, 0), (3, 3, 0), (3, 2, 0), (2, 2, 0)]),  # figure 6.12
        ("letters-4", [(2, 1, 0), (3, 3, 0), (3, 2, 0), (2, 2, 0)]),
    ],
)
def test_glyphs_have_the_end_points_and_vertices_of_the_thesis(name, expected):
    assert [points_of_glyph(glyph).counts for glyph in alphabet_named(name).glyphs] == expected


def test_glyphs_of_the_large_alphabet_differ_in_their_counts():
    counts = [points_of_glyph(glyph).counts for glyph in alphabet_named("dense-8").glyphs]
    assert len(set(counts)) == 8
    assert any(loops for _, _, loops in counts)


def skeleton(text):
    return np.array([[c == "#" for c in line] for line in text.split()], bool)


T_SHAPE = """
.........
.#######.
....#....
....#....
....#....
....#....
"""


def test_graph_of_a_branching_line():
    found = graph(skeleton(T_SHAPE))
    assert sorted(found.degree(node) for node in found.nodes) == [1, 1, 1, 3]
    assert sum(length(branch.path) for branch in found.branches) == pytest.approx(10, abs=1.5)


def test_spurs_are_pruned_and_the_line_runs_through():
    found = graph(skeleton(T_SHAPE), shortest=4.6)
    assert len(found.branches) <= 1  # the two arms are shorter than that, the longest stays
    kept = graph(skeleton("..........\n.########.\n....#.....\n.........."), shortest=2.0)
    assert len(kept.branches) == 1
    assert length(kept.branches[0].path) == pytest.approx(7, abs=1)


def test_a_ring_is_one_loop_without_ends():
    ring = skeleton(".....\n..#..\n.#.#.\n..#..\n.....")
    points = points_of_skeleton(ring, 100.0)
    assert points.counts == (0, 0, 1)


# --- symbols ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["thesis-2", "letters-4"])
@pytest.mark.parametrize("degrees", [0, 17, 45, 90, 133, 201, 290])
def test_symbols_are_named_placed_and_turned(name, degrees):
    alphabet = alphabet_named(name)
    theta = math.radians(degrees)
    for label in range(alphabet.order):
        image = drawn(alphabet, [(label, 1.3, -2.2, theta)], size_mm=24)
        (found,) = symbols(image, alphabet, style(alphabet))
        assert found.label == label
        assert math.hypot(found.x_mm - 1.3, found.y_mm + 2.2) < 0.5
        assert abs(math.remainder(found.theta_rad - theta, math.tau)) < math.radians(8)


def test_no_symbol_is_named_without_one():
    alphabet = alphabet_named("thesis-2")
    assert symbols(tactile_image(np.zeros((40, 40)), step_mm=STEP), alphabet, style(alphabet)) == []
    bar = np.zeros((60, 60))
    bar[28:32, 10:40] = 1
    (found,) = symbols(tactile_image(bar, step_mm=STEP), alphabet, style(alphabet))
    assert (found.label, found.rejected) == (-1, COUNTS)


def test_symbols_that_the_image_cuts_are_rejected():
    alphabet = alphabet_named("thesis-2")
    image = drawn(alphabet, [(0, 10.5, 0, 0.0)], size_mm=24)
    (found,) = symbols(image, alphabet, style(alphabet))
    assert (found.label, found.rejected) == (-1, CUT)


def test_right_counts_in_the_wrong_shape_are_rejected():
    alphabet = alphabet_named("letters-4")
    wide = drawn(alphabet, [(0, 0, 0, 0.0)], size_mm=40, pitch=22.0, half_mm=0.9)
    (found,) = symbols(wide, alphabet, style(alphabet))
    assert (found.label, found.rejected) == (-1, "shape")
    assert math.isfinite(found.off_mm)  # its counts are those of a glyph
