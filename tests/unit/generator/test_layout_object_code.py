"""Codes of objects: one for each first cell, in letters that are told apart."""

from __future__ import annotations

import numpy as np
import pytest

from generator.layout.placement import (
    CODE_LETTERS,
    FaceLayout,
    Layout,
    Placement,
    object_code,
)


def layout_at(*cells: tuple[int, int]) -> Layout:
    """Return a layout of a blank face and one face for each cell."""
    place = Placement(0, 0, 0.0, 0.0, 0.0)
    blank = np.zeros(0, dtype=np.int64)
    faces = [FaceLayout(0, place, blank, blank, blank, np.zeros((0, 2)), 0)]
    for row, column in cells:
        one = np.ones(1, dtype=np.int64)
        faces.append(FaceLayout(1, place, row * one, column * one, one, np.zeros((1, 2)), 0))
    return Layout("faces", 7.0, tuple(faces))


@pytest.mark.parametrize(
    ("rows", "columns", "cells", "code"),
    [
        (63, 65, [(0, 0)], "222"),
        (63, 65, [(1, 0)], "24Y"),  # 65 = 2 * 22 + 21
        (63, 65, [(2, 0), (1, 0), (1, 5)], "24Y"),  # the first cell
        (51, 1285, [(50, 1284)], "C5EU"),  # 65534 = ((6 * 22 + 3) * 22 + 8) * 22 + 18
        (2**32, 2**32, [(2**32 - 1, 2**32 - 1)], "D" + "?" * 14),
    ],
)
def test_codes_count_cells(rows, columns, cells, code):
    found = object_code(layout_at(*cells), rows, columns)
    number = 0
    for letter in found:
        number = number * len(CODE_LETTERS) + CODE_LETTERS.index(letter)
    row, column = min(cells)
    assert number == row * columns + column
    assert len(found) == len(code)
    if "?" not in code:
        assert found == code


def test_every_cell_has_its_own_code():
    codes = {object_code(layout_at((r, c)), 63, 65) for r in range(63) for c in range(65)}
    assert len(codes) == 63 * 65
    assert "F" not in "".join(codes)
