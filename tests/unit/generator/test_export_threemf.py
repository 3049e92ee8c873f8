"""3MF: text as Python formats it, packages as zipfile reads them, meshes in both files."""

from __future__ import annotations

import io
import re
import zipfile

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.array.profiles import profile
from generator.errors import WriteError
from generator.export import threemf as package_module
from generator.export.bed import BedPlace, Plate
from generator.export.fixed_text import number_lines
from generator.export.threemf import PrintFile, deflate_text, print_file, zip_package
from generator.layout.layout import lay_out
from generator.polyhedron.shapes import cube
from generator.solid import Part, emboss_whole
from generator.solid.triangulate import body_mesh, symbol_meshes


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


@pytest.fixture(scope="module")
def part() -> Part:
    solid = cube(25.0)
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle())
    half = max(float(np.abs(ring).max()) for symbol in tiers for ring in symbol.rings[0])
    clearances = [[np.full(4, 1.0)] for _ in solid.faces]
    nothing = np.zeros(0, np.int64)
    layout = lay_out(solid, profile().array(), 7.0, half, clearances, (nothing, nothing))
    return emboss_whole(solid, layout, tiers, "a")


@pytest.fixture(scope="module")
def file(part: Part) -> PrintFile:
    return print_file("A", [part], Plate((BedPlace(0, 10.0, 20.0, True),)))


def numbers(pattern: str, text: str) -> np.ndarray:
    return np.array(re.findall(pattern, text), np.float64)


def model(content: bytes) -> str:
    with zipfile.ZipFile(io.BytesIO(content)) as package:
        return package.read("3D/3dmodel.model").decode()


VERTEX = r'<vertex x="(.*?)" y="(.*?)" z="(.*?)"/>'
TRIANGLE = r'<triangle v1="(\d+)" v2="(\d+)" v3="(\d+)"'


def corners(text: str) -> np.ndarray:
    """(T, 3, 3) mm, of one mesh."""
    return numbers(VERTEX, text)[numbers(TRIANGLE, text).astype(int)]


def test_both_files_hold_the_part_turned_on_the_bed(part: Part, file: PrintFile) -> None:
    meshes = (body_mesh(part), *symbol_meshes(part))
    found = np.concatenate([mesh.vertices[mesh.triangles] for mesh in meshes])
    turned = np.stack([-found[..., 1], found[..., 0], found[..., 2]], axis=-1)
    turned += np.array([10.0, 20.0, 0.0]) - turned.min(axis=(0, 1))
    components = [corners(text) for text in model(file.content).split("<object")[1:3]]
    assert np.allclose(np.concatenate(components), turned, rtol=0, atol=1e-6)
    assert np.allclose(corners(model(file.prusaslicer)), turned, rtol=0, atol=1e-6)


def test_volumes_name_body_and_symbols(part: Part, file: PrintFile) -> None:
    with zipfile.ZipFile(io.BytesIO(file.prusaslicer)) as package:
        settings = package.read("Metadata/Slic3r_PE_model.config").decode()
    pairs = re.findall(r'firstid="(\d+)" lastid="(\d+)"', settings)
    ranges = [tuple(map(int, pair)) for pair in pairs]
    body = len(body_mesh(part).triangles)
    symbols = sum(len(mesh.triangles) for mesh in symbol_meshes(part))
    assert ranges == [(0, body - 1), (body, body + symbols - 1)]
    of_body = re.findall(r"<triangle [^>]*>", model(file.prusaslicer))
    assert [' p1="0"' in line for line in of_body] == [True] * body + [False] * symbols
    assert 'pid="1" pindex="1"' in model(file.prusaslicer)


def test_meshes_are_deflated_once(file: PrintFile) -> None:
    """The symbols' blocks of one file stand in the other, byte by byte."""
    symbols = model(file.content).split("<object")[2]
    for inside in ("vertices", "triangles"):
        text = symbols.split(f"<{inside}>")[1].removeprefix("\n").split(f"</{inside}>")[0]
        blocks = deflate_text([text.encode()]).blocks
        assert blocks in file.content
        assert blocks in file.prusaslicer
