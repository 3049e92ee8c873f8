"""Preview and array picture: what they show, and byte identity of everything written."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.export.array_svg import FaceOnArray, array_svg
from generator.export.colours import ANSWERED_RGB
from generator.export.preview import preview_png
from generator.export.raster import rasterise
from generator.layout.placement import FaceLayout, Placement
from generator.polyhedron.shapes import cube
from generator.solid.part import Facet, Part
from generator.solid.triangulate import triangles

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


def test_the_nearest_triangle_wins() -> None:
    points = np.array(
        [[0, 0, 0], [20, 0, 0], [0, 20, 0], [20, 20, 0], [5, 5, -1], [15, 5, 3], [5, 15, 3]], float
    )
    order = np.array([[0, 2, 1], [1, 2, 3], [4, 6, 5], [4, 5, 6]])
    screen = np.empty((20, 20), np.int64)
    seen = rasterise(points.T.copy(), order, screen)
    picture = np.zeros((20, 20), np.uint32)
    seen.paint(picture, np.array([1, 2, 3, 4], np.uint32))
    assert picture[0, 0] == 1
    assert picture[19, 19] == 2
    assert picture[5, 5] == 1  # there the third triangle lies behind
    assert picture[9, 9] == 3
    assert set(np.unique(picture).tolist()) == {1, 2, 3}  # the fourth turns its back
    assert seen.triangles_seen(5).tolist() == [0, 1, 2]
    assert seen.depths(np.array([9]), np.array([9]))[0] == pytest.approx(-1 + 4 * 9 / 10, abs=1e-6)


def body_parts() -> list[Part]:
    shape = cube(60.0)
    facets = tuple(Facet(f.name, f.loops) for f in shape.faces)
    return [Part("Cube", shape.vertices, facets, (), np.eye(4))]


def test_faces_are_coloured_by_what_they_answer() -> None:
    parts = body_parts()
    meshes = [triangles(p) for p in parts]
    names = [facet.name for facet in parts[0].facets]

    def pixels(shares: dict[str, tuple[float, float]]) -> np.ndarray:
        picture = preview_png("C", (60, 60, 60), parts, meshes, shares)
        return np.asarray(Image.open(io.BytesIO(picture)))

    plain = pixels({})
    for share, rgb in (((0.0, 0.5), ANSWERED_RGB[0]), ((1.0, 1.0), ANSWERED_RGB[2])):
        picture = pixels(dict.fromkeys(names, share))
        body = np.unique(picture[150:600, 100:500].reshape(-1, 3), axis=0, return_counts=True)
        shades = body[0][(body[1] > 5000) & (body[0] < 250).any(axis=1)].astype(float)  # no label
        assert len(shades) >= 3
        tint = np.array(rgb) / np.linalg.norm(rgb)
        assert all(shade @ tint / np.linalg.norm(shade) > 0.999 for shade in shades)
        assert (picture[50:80, 480:900] != plain[50:80, 480:900]).any()  # the legend
    one = pixels({names[0]: (0.0, 0.4)})
    assert (one[90:640] == plain[90:640]).all(axis=2).mean() > 0.6  # the other faces stay grey
