"""3MF: text as Python formats it, packages as zipfile reads them, meshes in both files."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.errors import WriteError
from generator.export import threemf as package_module
from generator.export.fixed_text import number_lines
from generator.export.threemf import deflate_text, zip_package


@given(st.lists(st.tuples(*[st.floats(-1e5, 1e5, allow_nan=False)] * 3), max_size=20))
def test_decimals_of_a_line_are_the_shortest(rows: list[tuple[float, float, float]]) -> None:
    text = number_lines(("<", ",", ";", ">\n"), np.array(rows).reshape(-1, 3), 3).decode()
    wanted = [[f"{value:.3f}" for value in np.round(row, 3) + 0.0] for row in rows]
    short = [[one.rstrip("0").rstrip(".") for one in row] for row in wanted]
    assert text == "".join(f"<{a},{b};{c}>\n" for a, b, c in short)


@given(st.lists(st.tuples(*[st.integers(-(10**12), 10**12)] * 2), max_size=20))
def test_integers_of_a_line(rows: list[tuple[int, int]]) -> None:
    text = number_lines(("a", "b", "c\n"), np.array(rows, np.int64).reshape(-1, 2), 0).decode()
    assert text == "".join(f"a{one}b{other}c\n" for one, other in rows)


@given(st.lists(st.lists(st.binary(max_size=300), max_size=4), min_size=1, max_size=4))
def test_a_package_holds_its_pieces_in_order(entries: list[list[bytes]]) -> None:
    named = {f"e{number}": pieces for number, pieces in enumerate(entries)}
    content = zip_package({name: [deflate_text([p]) for p in ps] for name, ps in named.items()})
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        assert file.testzip() is None
        assert file.namelist() == list(named)
        for name, pieces in named.items():
            assert file.read(name) == b"".join(pieces)
            assert file.getinfo(name).date_time == (1980, 1, 1, 0, 0, 0)


def test_a_long_piece_behind_another() -> None:
    """Longer than the zeros that its checksum is moved over at once."""
    pieces = [b"head", bytes(range(256)) * 1000, b"tail"]
    content = zip_package({"a": [deflate_text([piece]) for piece in pieces]})
    with zipfile.ZipFile(io.BytesIO(content)) as file:
        assert file.read("a") == b"".join(pieces)


def test_a_package_that_no_zip_can_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(package_module, "_LARGEST", 5)
    zip_package({"a": [deflate_text([b"12345"])]})
    with pytest.raises(WriteError, match="exceeds 4 GiB"):
        zip_package({"a": [deflate_text([b"123"]), deflate_text([b"456"])]})
