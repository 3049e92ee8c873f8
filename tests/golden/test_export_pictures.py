"""Preview and array picture: what they show, and byte identity of everything written."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.export.array_svg import FaceOnArray, array_svg
from generator.layout.placement import FaceLayout, Placement

SVG = "{http://www.w3.org/2000/svg}"
SQUARE = np.array([[0.0, 0.0], [28.0, 0.0], [28.0, 28.0], [0.0, 28.0]])


def face(row: int, column: int, rows: int, columns: int) -> FaceOnArray:
    """Return a face of 4 x 4 cells whose origin is the lower left corner of the anchor cell."""
    r, c = np.mgrid[row - 3 : row + 1, column : column + 4]
    labels = np.arange(16, dtype=np.int64) % 4
    centres = np.zeros((16, 2))
    placement = Placement(row, column, 0.0, 0.0, -7.0)
    rows, columns = (min(side, 2**63 - 1) for side in (rows, columns))
    layout = FaceLayout(0, placement, r.ravel() % rows, c.ravel() % columns, labels, centres, 6)
    return FaceOnArray("F1", layout, (SQUARE,))


def drawn(rows: int, columns: int, one: FaceOnArray) -> ET.Element:
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle())
    return ET.fromstring(array_svg("A & B", rows, columns, 7.0, [one], tiers))


def texts(picture: ET.Element) -> list[str]:
    return [element.text or "" for element in picture.iter(f"{SVG}text")]


def uses(picture: ET.Element) -> set[tuple[float, float]]:
    return {(float(u.get("x", "")), float(u.get("y", ""))) for u in picture.iter(f"{SVG}use")}


def test_a_face_over_the_corner_of_the_torus_appears_four_times() -> None:
    picture = drawn(63, 65, face(1, 63, 63, 65))
    assert len(uses(picture)) == 16
    assert all(0 < x < 65 and 0 < y < 63 for x, y in uses(picture))
    assert texts(picture).count("F1") == 4


@pytest.mark.parametrize("size", [2**20 + 1, 2**62, 2**63])
def test_a_large_array_is_cropped_to_the_faces(size: int) -> None:
    picture = drawn(size, size, face(size // 2 + 5, size // 2 + 7, size, size))
    assert uses(picture) == {(x + 3.5, y + 3.5) for x in range(4) for y in range(4)}
    assert float(picture.get("width", "")) < 500
