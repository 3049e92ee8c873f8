"""A spec means the same in other units, in another order, with other comments."""

from pathlib import Path

from hypothesis import example, given
from hypothesis import strategies as st

from encoded_objects.base.settings import MILLIMETRES, length_mm
from encoded_objects.base.yaml_tree import tree_of
from generator.spec import read_specs
from generator.spec.problem import SPEC

LINES = ("name: Cube", "shape: {cube: 60 mm}", "symbols: {pitch: 8 mm, height: 1}",
         "print: {wall: 4, parts: whole}", "layout: net")  # fmt: skip


def meaning_of(lines):
    return read_specs([tree_of("\n".join(lines), "c.yaml", Path(), SPEC)])[0].meaning


@given(st.integers(1, 4_000_000), st.sampled_from(sorted(MILLIMETRES)))
def test_one_length_in_two_units_is_one_number(micrometres, unit):
    """Lengths that people write (to 1 um) come out the same, whatever the unit."""
    written = f"{micrometres / 1000 / MILLIMETRES[unit]:.15g}{unit}"
    assert abs(length_mm(written) - micrometres / 1000) <= 1e-9
    assert length_mm(f"{micrometres / 10000:.12g} cm") == micrometres / 1000


@given(st.permutations(LINES),
       st.lists(st.sampled_from(["# a comment", "", "   "]), min_size=5, max_size=5))  # fmt: skip
@example(["name: C", "shape: {cube: 6 cm}", "symbols: {height: 1 mm, pitch: 0.8 cm}",
          "print: {parts: whole, wall: 4 mm}", "layout: net"], [""] * 5)  # fmt: skip
def test_the_meaning_is_independent_of_order_comments_and_units(lines, between):
    mixed = [line for pair in zip(between, lines, strict=True) for line in pair]
    assert meaning_of(mixed) == meaning_of(LINES)
