"""Counts of end-points and vertices are those of thesis figures 6.4 and 6.12."""

import pytest

from generator.alphabet import Counts, Glyph, alphabet_from, alphabet_named, counts
from generator.alphabet.figures import FIGURES, figures_of, in_figures
from generator.alphabet.known import line
from generator.alphabet.outline import engrave
from generator.alphabet.strokes import same_shape
from generator.errors import AlphabetError
from generator.solid.marks import MARK_DEPTH, MARK_SIZES

L, E, F, C = (2, 1), (3, 3), (3, 2), (2, 2)


@pytest.mark.parametrize(
    ("name", "wanted"),
    [("thesis-2", [L, F]), ("dense-4", [L, E, F, C]), ("letters-4", [L, E, F, C])],
)
def test_ends_and_vertices_are_the_thesis_ones(name, wanted):
    found = [counts(glyph) for glyph in alphabet_named(name).glyphs]
    assert [(c.ends, c.vertices) for c in found] == wanted
    assert all(c.pieces == 1 and c.loops == 0 for c in found)


@pytest.mark.parametrize(
    ("strokes", "wanted"),
    [
        (line((-1, 0), (0, 0), (1, 0)), Counts(2, 0, 0, 1)),  # straight on: no vertex
        (line((-1, 0), (1, 0)) + line((0, 0), (0, 1)), Counts(3, 1, 0, 1)),  # T on an interior
        (line((-1, -1), (1, 1)) + line((-1, 1), (1, -1)), Counts(4, 1, 0, 1)),  # X
        (line((-1, 0), (0, 1)) + line((-1, 1), (0, 0)), Counts(4, 1, 0, 1)),  # X off the nodes
        (line((-1, 0), (1, 0)) + line((0, 0), (1, 0)), Counts(2, 0, 0, 1)),  # drawn twice
        (line((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)), Counts(0, 4, 1, 1)),
        (line((-1, -1), (0, -1)) + line((-1, 1), (0, 1)), Counts(4, 0, 0, 2)),
    ],
)
def test_counts_split_strokes_where_they_meet(strokes, wanted):
    assert counts(Glyph("x", strokes)) == wanted


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"glyphs": [{"name": "a", "strokes": [[[-1, 0], [1, 0]]]}] * 2}, "a name of its own"),
        (
            {
                "glyphs": [
                    {"name": "a", "strokes": [[[-1, 0], [1, 0]]]},
                    {"name": "b", "strokes": [[[-1, 0], [0, 0]], [[0, 0], [0, 1]]]},
                ]
            },
            "looks the same after 180 degrees",
        ),
        (
            {
                "glyphs": [
                    {"name": "a", "strokes": [[[-1, 0], [0, 0]], [[0, 0], [0, 1]]]},
                    {"name": "b", "strokes": [[[0, 1], [0, 0]], [[0, 0], [1, 0]]]},
                ]
            },
            "turned by",
        ),
        ({"glyphs": [{"name": "a", "strokes": [[[-2, 0], [1, 0]]]}]}, "outside"),
        ({"glyphs": [{"name": "a", "strokes": [[[0.5, 0], [1, 0]]]}]}, "not understood"),
        ({"reach": "wide"}, "not understood"),
        ({"reach": 0.7}, "reach 0.7"),
    ],
)
def test_bad_definitions_say_why(change, words):
    with pytest.raises(AlphabetError, match=words):
        alphabet_from(alphabet_named("thesis-2").definition() | change)


def test_unknown_alphabet_lists_the_known():
    with pytest.raises(AlphabetError, match="thesis-2, dense-4, letters-4, dense-8"):
        alphabet_named("morse")


def test_figures_are_single_pieces_and_all_different():
    assert all(counts(figure).pieces == 1 for figure in FIGURES)
    digits = [figure for figure in FIGURES if figure.name in "0123456789F-"]
    assert not any(same_shape(a, b) for i, a in enumerate(digits) for b in digits[:i])
    assert len({frozenset(map(frozenset, figure.strokes)) for figure in FIGURES}) == len(FIGURES)


def test_names_are_written_in_capitals_or_not_at_all():
    every = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.+()"
    assert in_figures(every.lower()) == every == "".join(FIGURES[k].name for k in figures_of(every))
    assert [in_figures(text) for text in ("Bügel 1", "a:b", "\u7acb")] == ["BUGEL 1", None, None]


@pytest.mark.parametrize("size", MARK_SIZES)
def test_every_figure_is_engraved_in_every_size(size):
    for figure in FIGURES:
        for stroke in (0.4, 0.8, 1.6):
            depth = MARK_DEPTH * stroke
            assert engrave(figure, size * stroke, stroke, depth).z_mm == (0.0, -depth)
