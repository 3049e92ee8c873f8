"""Fixed-width text and STEP strings against Python's own formatting."""

from __future__ import annotations

import re

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from generator.export.fixed_text import (
    DECIMAL,
    NAMES,
    NUMBER,
    decimal_numbers,
    decimal_width,
    pad,
    reference_field,
    stamp,
    template_of,
    with_references,
)
from generator.export.step.entities import step_string

lengths = st.floats(-1e6, 1e6, allow_nan=False)


@given(st.lists(lengths, min_size=1, max_size=20), st.integers(1, 10))
def test_decimals_are_the_rounded_number(values: list[float], places: int) -> None:
    width = decimal_width(max(map(abs, values)), places)
    rows = decimal_numbers(np.array(values), width, places)
    assert rows.shape == (len(values), width)
    for row, value in zip(rows, values, strict=True):
        text = row.tobytes().decode("ascii")
        assert len(text.split(".")[1]) == places
        scaled = int(np.rint(value * 10.0**places))
        assert int(text.strip().replace(".", "")) == scaled
        assert "-0." not in text or scaled < 0


def test_decimals_by_hand() -> None:
    values = np.array([0.0, -0.0, -0.04, 12.5, -12.5, 999.96, -0.5])
    rows = decimal_numbers(values, decimal_width(1000.0, 1), 1)
    texts = [row.tobytes().decode("ascii") for row in rows]
    assert texts == ["    0.0", "    0.0", "    0.0", "   12.5", "  -12.5", " 1000.0", "   -0.5"]


def test_a_template_is_stamped_with_numbers_decimals_and_names() -> None:
    text = f"#{NUMBER * 3}=P('',{DECIMAL * 6});#{NUMBER * 3}=N({NAMES[0] * 5},#{NUMBER * 3});\n"
    template = template_of(text, [0, 1, 0], 3)
    decimals = decimal_numbers(np.array([[1.5], [-20.25]]), 6, 2)[:, :, :]
    nothing = pad(["", ""])
    out = stamp(
        template, np.array([100, 107]), 3, decimals, (pad(["'ab'", "'abc'"]), nothing, nothing)
    )
    assert bytes(out).decode("ascii") == (
        "#100=P('',  1.50);#101=N('ab' ,#100);\n#107=P('',-20.25);#108=N('abc',#107);\n"
    )


@given(st.lists(st.integers(0, 4), max_size=30), st.integers(5, 8))
def test_references_are_filled_in(asked: list[int], width: int) -> None:
    known = [f"#{10 ** (width - 1) + 7 * k}" for k in range(5)]
    text = "A(" + "),(".join(reference_field(k, width) for k in asked) + ");"
    row = with_references(np.frombuffer(text.encode(), np.uint8), known, width)
    assert row.tobytes().decode() == "A(" + "),(".join(known[k] for k in asked) + ");"


@given(st.text(max_size=30))
def test_step_strings_read_back(text: str) -> None:
    """Part 21, 6.4.3: doubled quotes and backslashes, hexadecimal beyond printable ASCII."""
    written = step_string(text)
    assert written.isascii()
    assert written.isprintable()
    back = re.sub(
        r"\\X[24]\\([0-9A-F]+)\\X0\\|''|\\\\",
        lambda found: chr(int(found[1], 16)) if found[1] else found[0][0],
        written,
    )
    assert back == text
