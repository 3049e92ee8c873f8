"""A spec means the same in other units, in another order, with other comments."""

import os
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import example, given
from hypothesis import strategies as st

from encoded_objects.base.settings import MILLIMETRES, length_mm
from generator.spec import read_specs


@contextmanager
def spec_file(data):
    """Write a spec into a folder that holds nothing else."""
    before = Path.cwd()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            Path("c.yaml").write_bytes(data)
            yield Path("c.yaml")
        finally:
            os.chdir(before)


@given(
    st.integers(1, 4_000_000),
    st.sampled_from(sorted(MILLIMETRES)),
)
def test_one_length_in_two_units_is_one_number(micrometres, unit):
    """Lengths that people write (to 1 um) come out the same, whatever the unit."""
    written = f"{micrometres / 1000 / MILLIMETRES[unit]:.15g}{unit}"
    assert abs(length_mm(written) - micrometres / 1000) <= 1e-9
    assert length_mm(f"{micrometres / 10000:.12g} cm") == micrometres / 1000


@given(st.permutations(["name: Cube", "shape: {cube: 60 mm}", "symbols: {pitch: 8 mm, height: 1}",
                        "print: {wall: 4, parts: whole}", "layout: net"]),
       st.lists(st.sampled_from(["# a comment", "", "   "]), min_size=5, max_size=5))  # fmt: skip
@example(["name: Cube", "shape: {cube: 6 cm}", "symbols: {height: 1 mm, pitch: 0.8 cm}",
          "print: {parts: whole, wall: 4 mm}", "layout: net"], [""] * 5)  # fmt: skip
def test_hash_is_independent_of_order_comments_and_units(lines, between):
    text = "\n".join(line for pair in zip(between, lines, strict=True) for line in pair) + "\n"
    with spec_file(text.encode()) as file:
        (one,) = read_specs([file])
    assert one.meaning == REFERENCE_MEANING


def _reference_hash():
    text = "name: C\nshape: {cube: 60}\nsymbols: {pitch: 8}\nprint: {wall: 4, parts: whole}\n"
    with spec_file(f"{text}layout: net\n".encode()) as file:
        return read_specs([file])[0].meaning


REFERENCE_MEANING = _reference_hash()
