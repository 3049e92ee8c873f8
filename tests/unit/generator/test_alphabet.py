"""Symbols: their ends and vertices (thesis figures 6.4, 6.12), outlines, and what is refused."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from generator.alphabet import (
    ALPHABETS,
    SymbolStyle,
    alphabet_from,
    alphabet_named,
    check_printable,
    counts,
    outlines,
)
from generator.alphabet.figures import FIGURES, figures_of, in_figures
from generator.alphabet.outline import engrave
from generator.alphabet.strokes import check_distinguishable, same_shape
from generator.errors import AlphabetError
from generator.plane.polygon import edges_cross, points_inside, signed_area
from generator.printers import PRINTERS
from generator.solid.marks import MARK_DEPTH, MARK_SIZES
from generator.spec import read_specs

BAR = [[[-1, 0], [1, 0]]]
L, E, F, C = (2, 1), (3, 3), (3, 2), (2, 2)


def glyphs(*strokes):
    """Return what a definition says of glyphs a, b and so on."""
    named = zip("ab", strokes, strict=False)
    return {"glyphs": [{"name": name, "strokes": lines} for name, lines in named]}


@pytest.mark.parametrize(
    ("name", "wanted"),
    [("thesis-2", [L, F]), ("dense-4", [L, E, F, C]), ("letters-4", [L, E, F, C])],
)
def test_ends_and_vertices_are_the_thesis_ones(name, wanted):
    found = [counts(glyph) for glyph in alphabet_named(name).glyphs]
    assert [(c.ends, c.vertices) for c in found] == wanted
    assert all(c.pieces == 1 and c.loops == 0 for c in found)


def test_letters_that_ship_tell_their_turn():
    for alphabet in ALPHABETS.values():
        check_distinguishable(alphabet.name, alphabet.glyphs)


@pytest.mark.parametrize("order", [4, 8, 16])
def test_letters_made_for_tactels_print_and_have_about_the_same_ink(order, tmp_path):
    alphabet = alphabet_named(f"tactel-{order}")
    assert alphabet.order == order
    assert alphabet_from(alphabet.definition()) == alphabet
    for pitch, printer in ((4.5, "fdm-0.4"), (8, "fdm-0.6")):
        (tmp_path / "cube.yaml").write_text(
            f"name: Cube\nshape: {{cube: 60 mm}}\nprint: {{printer: {printer}}}\n"
            f"symbols: {{alphabet: {alphabet.name}, pitch: {pitch} mm}}\n"
        )
        (spec,) = read_specs([tmp_path / "cube.yaml"])
        check_printable(alphabet, spec.style, PRINTERS[printer])
        tops = [sum(map(signed_area, tiers.rings[-1])) for tiers in outlines(alphabet, spec.style)]
        assert max(tops) < 1.6 * min(tops)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (glyphs(BAR) | {"glyphs": 2 * glyphs(BAR)["glyphs"]}, "a name of its own"),
        (glyphs(BAR, [[[-1, 0], [0, 0]], [[0, 0], [0, 1]]]), "looks the same after 180 degrees"),
        (glyphs([[[-1, 0], [0, 0]], [[0, 0], [0, 1]]], [[[0, 1], [0, 0]], [[0, 0], [1, 0]]]),
         "turned by"),
        (glyphs([[[-2, 0], [1, 0]]]), "outside"),
        (glyphs([[[0.5, 0], [1, 0]]]), "not understood"),
        ({"reach": 0.7}, "reach 0.7"),
    ],
)  # fmt: skip
def test_bad_definitions_say_why(change, words):
    with pytest.raises(AlphabetError, match=words):
        alphabet_from(alphabet_named("thesis-2").definition() | change)


def test_figures_are_single_pieces_and_all_different():
    assert all(counts(figure).pieces == 1 for figure in FIGURES)
    digits = [figure for figure in FIGURES if figure.name in "0123456789F-"]
    assert not any(same_shape(a, b) for i, a in enumerate(digits) for b in digits[:i])
    assert len({frozenset(map(frozenset, figure.strokes)) for figure in FIGURES}) == len(FIGURES)
    every = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.+()"
    assert in_figures(every.lower()) == every == "".join(FIGURES[k].name for k in figures_of(every))
    assert [in_figures(text) for text in ("Bügel 1", "a:b", "\u7acb")] == ["BUGEL 1", None, None]
    for stroke in (0.4, 0.8, 1.6):  # every figure is engraved in the smallest size
        depth, size = MARK_DEPTH * stroke, min(MARK_SIZES) * stroke
        assert {engrave(one, size, stroke, depth).z_mm for one in FIGURES} == {(0.0, -depth)}


DENSE = alphabet_named("dense-4")


@pytest.mark.parametrize(
    ("style", "words"),
    [
        (SymbolStyle(height_mm=0.2), "cannot be felt"),
        (SymbolStyle(pitch_mm=3.9, stroke_mm=0.8, height_mm=0.5), "two strokes of symbol '1'"),
        (SymbolStyle(pitch_mm=7.0, stroke_mm=3.0), "touch at a pitch of 7 mm"),
        (SymbolStyle(draft_rad=math.radians(14)), "collapse"),
        (SymbolStyle(stroke_mm=1.2), "."),
        (SymbolStyle(pitch_mm=8.0, stroke_mm=2.0, chamfer_mm=0.9), "chamfer"),
        (SymbolStyle(chamfer_mm=1e-9), "chamfer 1e-09 mm"),
        (SymbolStyle(stroke_mm=math.nan), "stroke nan"),
    ],
)
def test_what_cannot_be_printed_is_refused_with_ways_out_that_work(style, words):
    with pytest.raises(AlphabetError, match=words) as caught:
        check_printable(DENSE, style, PRINTERS["fdm-0.4"])
    assert "set " in caught.value.fix
    for name, value in re.findall(r"(\w+) to ([0-9.]+) (?:mm|degrees)(?=,|$)", caught.value.fix):
        number = math.radians(float(value)) if name == "draft" else float(value)
        unit = "rad" if name == "draft" else "mm"
        check_printable(DENSE, replace(style, **{f"{name}_{unit}": number}), PRINTERS["fdm-0.4"])


def test_a_chamfer_as_wide_as_the_stroke_is_refused():
    with pytest.raises(AlphabetError, match="a chamfer of 1 mm leaves"):
        check_printable(DENSE, SymbolStyle(height_mm=1.2, chamfer_mm=1.0), PRINTERS["fdm-0.4"])


def test_rings_tell_crossings_and_points_inside():
    square = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
    hole = np.array([[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]])
    turned = np.linspace(0, 2 * math.pi, 700, endpoint=False)
    many = np.stack([np.cos(turned), np.sin(turned)], axis=1)
    for apart in ([square, hole], [many]):
        assert not edges_cross(apart)
    aside, narrow = hole - np.array([1.0, 0.0]), 0.5 * many + [0.7, 0.0]
    beyond, twisted = hole + np.array([2.5, 0.0]), square[[0, 2, 1, 3]]
    for crossing in ([square, beyond], [twisted], [square, aside], [many, narrow]):
        assert edges_cross(crossing)  # touching counts
    points = np.array([[0.5, 0.5], [1.5, 1.5], [3.0, 3.0], [5.0, 1.0]])
    assert points_inside(points, [square, hole]).tolist() == [True, False, True, False]
