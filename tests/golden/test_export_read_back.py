"""What is written, as independent programs read it: kernel, mesh library, lib3mf, glTF, SVG."""

import io
import json
import re
import struct
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from build123d import Solid
from OCP.BRep import BRep_Tool
from OCP.BRepCheck import BRepCheck_Analyzer
from reference.cube_panels import cube_panels, embossed
from reference.kernel import inertia_of, named_parts, solid_of
from reference.laid_symbols import layout_on_round_face
from reference.strict_3mf import read_strictly

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.errors import SolidError
from generator.export.array_svg import FaceOnArray, array_svg
from generator.export.check import STEP_VOLUME, verify_step, verify_stl
from generator.export.colours import BODY_RGB, SYMBOL_RGB
from generator.export.meshes import glb_bytes, stl_chunks
from generator.export.step import assembly_chunks, step_chunks
from generator.export.threemf import print_files
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.polyhedron.read import read_shape
from generator.polyhedron.shapes import SHAPES, cone, cylinder, octahedron
from generator.printers import printer_named
from generator.solid import emboss_whole
from generator.solid.closed import edges_once
from generator.solid.measure import volume
from generator.solid.panels import panels
from generator.solid.triangulate import triangles

BED = (250.0, 210.0)


@pytest.fixture(scope="module")
def panel():
    """A panel with symbols in front and engraved numbers behind."""
    return cube_panels(30.0)[0]


@pytest.fixture(scope="module")
def slanted():
    """A whole octahedron: every face slanted, chamfered symbols, a name to be escaped."""
    return embossed(octahedron(36.0), whole=True, chamfer_mm=0.2, name="Body 'ü'")[0]


@pytest.fixture(scope="module", params=["panel", "slanted"])
def made(request, tmp_path_factory):
    """A part, its STEP file and its STL file."""
    part = request.getfixturevalue(request.param)
    return part, *written(part, tmp_path_factory.mktemp("made"))


def engraved(part):
    """Return the part with its symbols cut in: every height turned about, narrower below."""

    def turned(symbol):
        return replace(symbol, z_mm=tuple(-z / 4 for z in symbol.z_mm))

    embossings = (
        e if e.face is None else replace(e, tiers=tuple(map(turned, e.tiers)))
        for e in part.embossings
    )
    return replace(part, embossings=tuple(embossings))


def written(part, folder):
    step, stl = folder / "part.step", folder / "part.stl"
    step.write_bytes(b"".join(step_chunks(part)))
    stl.write_bytes(b"".join(stl_chunks(triangles(part))))
    return step, stl


def test_step_and_stl_are_one_valid_closed_solid(made):
    part, step, stl = made
    solid, mesh = verify_step(part, step), verify_stl(part, stl)
    assert solid.solids == 1
    assert solid.valid
    assert solid.volume_mm3 == pytest.approx(volume(part), rel=STEP_VOLUME)
    assert mesh.boundary_edges == mesh.non_manifold_edges == 0
    assert mesh.self_intersections == 0
    assert mesh.volume_mm3 == pytest.approx(volume(part), rel=1e-6)


def test_engraved_symbols(panel, tmp_path):
    part = engraved(panel)
    step, stl = written(part, tmp_path)
    assert verify_step(part, step).volume_mm3 < volume(panel)
    verify_stl(part, stl)


def test_names_and_colours_in_step(made):
    part, step, _ = made
    name, faces = named_parts(step)
    assert name == part.name
    expected = Counter((facet.name, False) for facet in part.facets)
    for embossing in part.embossings:
        facet, coloured = part.facets[embossing.facet].name, embossing.face is not None
        for name, label in zip(embossing.names, embossing.labels.tolist(), strict=True):
            rings = embossing.tiers[label].rings
            sides = (len(rings) - 1) * sum(len(ring) for ring in rings[0])
            expected[f"{facet}/{name}/side", coloured] += sides
            expected[f"{facet}/{name}/top", coloured] += 1
            if len(rings[0]) > 1:
                expected[f"{facet}/{name}/inside", False] += len(rings[0]) - 1
    found = Counter()
    for name, _, rgb in faces:
        found[name, rgb is not None] += 1
        if rgb is not None:
            assert rgb == pytest.approx([value / 255 for value in SYMBOL_RGB], abs=1e-3)
    assert found == expected


def test_a_broken_file_is_named_with_its_reason(panel, tmp_path, capfd):
    step, stl = written(panel, tmp_path)
    larger = replace(panel, vertices=panel.vertices * (1 + 4e-9))
    with pytest.raises(SolidError, match=r"part 'Cube-F1'.*volume"):
        verify_step(larger, step)
    step.write_bytes(step.read_bytes()[:-5000])
    with pytest.raises(SolidError, match="0 solids") as caught:
        verify_step(panel, step)
    assert caught.value.place == str(step)
    whole_file = stl.read_bytes()
    count = struct.unpack_from("<I", whole_file, 80)[0]
    stl.write_bytes(whole_file[:80] + struct.pack("<I", count - 1) + whole_file[84:-50])
    with pytest.raises(SolidError, match="3 open edges"):
        verify_stl(panel, stl)
    stl.write_bytes(b"")
    with pytest.raises(SolidError, match="no triangles"):
        verify_stl(panel, stl)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("grouping", ["components", "volumes"])
def test_3mf_passes_the_strict_reader(panel, grouping, tmp_path):
    parts = [panel, replace(panel, name='A & "B" <ü>')]
    (file,) = print_files("Two panels", parts, BED)
    path = tmp_path / "plate.3mf"
    path.write_bytes(file.content if grouping == "components" else file.prusaslicer)
    names, built = read_strictly(path)
    kinds = (" body", " symbols") if grouping == "components" else ("",)
    assert names == [part.name + kind for part in parts for kind in kinds]
    (_, low, high), (_, other, end) = built
    assert (np.minimum(low, other)[:2] >= 0).all()
    assert (np.maximum(high, end)[:2] <= BED).all()
    assert [low[2], other[2], high[2], end[2]] == pytest.approx([0, 0, 4, 4], abs=1e-5)
    assert high[0] + 5 <= other[0] + 1e-4


def read_glb(content):
    """Return the JSON and the data of a GLB."""
    length = struct.unpack_from("<I", content, 12)[0]
    return json.loads(content[20 : 20 + length]), content[28 + length :]


def node_names(content):
    return [node["name"] for node in read_glb(content)[0]["nodes"]]


def test_glb_has_a_node_for_each_face(slanted, panel):
    content = glb_bytes("Octahedron", [slanted], [triangles(slanted)])
    assert node_names(content) == ["Octahedron", *(f.name for f in slanted.facets)]
    scene = trimesh.load(io.BytesIO(content), file_type="glb")
    assert scene.to_geometry().volume == pytest.approx(volume(slanted) * 1e-9, rel=1e-5)
    # Upright: what is z in the object frame is y in glTF.
    low, high = placed(slanted).bounds / 1000
    expected = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]
    np.testing.assert_allclose(scene.bounds, expected, atol=1e-7)
    pair = glb_bytes("Cube", [panel, panel], [triangles(panel)] * 2)
    assert node_names(pair) == ["Cube", "F1", "F1"]


def placed(part):
    """Return the triangles of a part in the object frame."""
    mesh, T = triangles(part), part.T_object_part
    return trimesh.Trimesh(mesh.vertices @ T[:3, :3].T + T[:3, 3], mesh.triangles, process=False)


def plain_panels(kind, *sizes, wall_mm=2.0, name="A"):
    empty, printer = Layout("faces", 7.0, ()), printer_named("fdm-0.4")
    return panels(SHAPES[kind](*sizes), empty, (), wall_mm, printer, name=name, code="K").parts


def test_panels_stand_where_they_belong_with_names_and_colours(tmp_path):
    parts, path = plain_panels("triangular_prism", 60, 40, wall_mm=3, name="Würfel"), tmp_path / "a"
    path.write_bytes(b"".join(assembly_chunks("Würfel", parts)))
    name, components = named_parts(path)
    assert name == "Würfel"
    assert [component[0] for component in components] == [f"Würfel-F{k}" for k in range(1, 6)]
    for (_, shape, rgb), part in zip(components, parts, strict=True):
        assert BRepCheck_Analyzer(shape).IsValid()
        mm3, centre, _ = inertia_of([(shape, np.eye(4))])
        assert mm3 == pytest.approx(volume(part), rel=1e-9)
        assert centre == pytest.approx(placed(part).center_mass, abs=1e-6)
        assert [round(255 * value) for value in rgb] == list(BODY_RGB)


@pytest.mark.parametrize(("kind", "size"), [("cube", 40), ("octahedron", 60), ("dodecahedron", 30)])
def test_a_glb_closes_in_its_own_32_bit_positions(kind, size):
    parts = plain_panels(kind, size)
    meta, data = read_glb(glb_bytes("A", parts, [triangles(part) for part in parts]))

    def values(number, kind, columns):
        accessor = meta["accessors"][number]
        offset = meta["bufferViews"][accessor["bufferView"]]["byteOffset"]
        return np.frombuffer(data, kind, accessor["count"] * columns, offset).reshape(-1, columns)

    for mesh in meta["meshes"]:
        first, *_ = mesh["primitives"]
        positions = values(first["attributes"]["POSITION"], "<f4", 3)
        _, number = np.unique(positions, axis=0, return_inverse=True)
        found = [values(p["indices"], "<u4", 1).reshape(-1, 3) for p in mesh["primitives"]]
        corners = number.ravel()[np.concatenate(found)]
        assert edges_once(corners.ravel(), np.roll(corners, -1, axis=1).ravel())


BORE = Path(__file__).parents[2] / "fixtures" / "shapes" / "block_with_bore.step"
SOLIDS = {
    "cylinder": (cylinder(40, 40), [(20.0, 12.0), (40.0, 20.0)], 0.0),
    "cone": (cone(60, 50, 40), [(20.0, 12.0), (50.0, 24.0)], 0.4),
    "pointed": (cone(60, 50), [(20.0, 12.0), (45.0, 44.0)], 0.4),
    "bore": (read_shape(BORE), [], 0.0),
}


def part_of(name, chamfer_mm=0.0):
    solid, centres, rotation = SOLIDS[name]
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle(chamfer_mm=chamfer_mm))
    layout = layout_on_round_face(solid, centres, range(1, len(centres) + 1), rotation)
    return emboss_whole(solid, layout, tiers, name)


@pytest.mark.parametrize(
    ("name", "chamfer_mm"), [("cylinder", 0.0), ("cylinder", 0.2), ("cone", 0.0), ("pointed", 0.0),
                             ("bore", 0.0)],
)  # fmt: skip
def test_round_faces_are_one_valid_solid(name, chamfer_mm, tmp_path):
    part = part_of(name, chamfer_mm)
    step, _ = written(part, tmp_path)
    report = verify_step(part, step)
    assert report.solids == 1
    assert report.valid
    kinds, edge_mm, names = read_faces(step)
    round_kind = "CYLINDER" if name in ("cylinder", "bore") else "CONE"
    islands = sum(len(s.rings[0]) - 1 for face in part.analytic for s in face.symbols)
    assert kinds[round_kind] == len(part.analytic) + part.symbols + islands
    assert kinds["PLANE"] + kinds["BSPLINE"] + kinds[round_kind] == sum(kinds.values())
    assert kinds["PLANE"] < len(part.facets)
    assert edge_mm < 1e-4
    assert names >= {face.name for face in part.analytic}


def read_faces(path):
    """Return surfaces by kind, the largest tolerance of an edge, and the names of faces."""
    solid = Solid(solid_of(path))
    kinds = Counter(face.geom_type.name for face in solid.faces())
    edge_mm = max(BRep_Tool.Tolerance_s(edge.wrapped) for edge in solid.edges())
    return kinds, edge_mm, set(re.findall(r"ADVANCED_FACE\('([^']*)'", path.read_text()))


def drawn(rows, columns, row, column):
    """Return a picture of an array with a face of 4 x 4 cells: its width, texts and symbols.

    The face's origin is the lower left corner of the anchor cell at (row, column).
    """
    r, c = (index.ravel() for index in np.mgrid[row - 3 : row + 1, column : column + 4])
    r, c = r % min(rows, 2**63 - 1), c % min(columns, 2**63 - 1)
    place, labels = Placement(row, column, 0.0, 0.0, -7.0), np.arange(16, dtype=np.int64) % 4
    square = np.array([[0.0, 0.0], [28.0, 0.0], [28.0, 28.0], [0.0, 28.0]])
    face = FaceOnArray("F1", FaceLayout(0, place, r, c, labels, np.zeros((16, 2)), 6), (square,))
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle())
    picture = ET.fromstring(array_svg("A & B", rows, columns, 7.0, [face], tiers))
    texts, uses = (
        list(picture.iter(f"{{http://www.w3.org/2000/svg}}{x}")) for x in ("text", "use")
    )
    places = {(float(one.get("x")), float(one.get("y"))) for one in uses}
    return float(picture.get("width")), [one.text for one in texts], places


def test_a_face_over_the_corner_of_the_torus_appears_four_times():
    _, texts, symbols = drawn(63, 65, 1, 63)
    assert len(symbols) == 16
    assert all(0 < x < 65 and 0 < y < 63 for x, y in symbols)
    assert texts.count("F1") == 4


@pytest.mark.parametrize("size", [2**20 + 1, 2**62, 2**63])
def test_a_large_array_is_cropped_to_the_faces(size):
    width, _, symbols = drawn(size, size, size // 2 + 5, size // 2 + 7)
    assert symbols == {(x + 3.5, y + 3.5) for x in range(4) for y in range(4)}
    assert width < 500
