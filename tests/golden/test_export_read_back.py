"""What is written, as independent programs read it: kernel, mesh library, lib3mf, glTF."""

import io
import json
import struct
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from reference.cube_panels import cube_panels, embossed
from reference.kernel import named_parts
from reference.strict_3mf import read_strictly

from generator.errors import SolidError
from generator.export.check import STEP_VOLUME, verify_step, verify_stl
from generator.export.colours import SYMBOL_RGB
from generator.export.meshes import glb_bytes, stl_chunks
from generator.export.step import step_chunks
from generator.export.threemf import print_files
from generator.polyhedron.shapes import octahedron
from generator.solid.measure import volume
from generator.solid.triangulate import triangles

BED = (250.0, 210.0)


@pytest.fixture(scope="module")
def panel():
    """A panel with symbols in front and engraved numbers behind."""
    return cube_panels(36.0)[0]


@pytest.fixture(scope="module")
def slanted():
    """A whole octahedron: every face slanted, chamfered symbols, a name to be escaped."""
    return embossed(octahedron(45.0), whole=True, chamfer_mm=0.2, name="Body 'ü'")[0]


@pytest.fixture(params=["panel", "slanted"])
def part(request):
    return request.getfixturevalue(request.param)


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


def test_step_and_stl_are_one_valid_closed_solid(part, tmp_path):
    step, stl = written(part, tmp_path)
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


def test_names_and_colours_in_step(part, tmp_path):
    step, _ = written(part, tmp_path)
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


def node_names(glb):
    length = struct.unpack_from("<I", glb, 12)[0]
    return [node["name"] for node in json.loads(glb[20 : 20 + length])["nodes"]]


def test_glb_has_a_node_for_each_face(slanted, panel):
    import trimesh

    content = glb_bytes("Octahedron", [slanted], [triangles(slanted)])
    assert node_names(content) == ["Octahedron", *(f.name for f in slanted.facets)]
    scene = trimesh.load(io.BytesIO(content), file_type="glb")
    merged = scene.to_geometry()
    assert merged.volume == pytest.approx(volume(slanted) * 1e-9, rel=1e-5)
    # Upright: what is z in the object frame is y in glTF.
    T = slanted.T_object_part
    points = triangles(slanted).vertices @ T[:3, :3].T + T[:3, 3]
    low, high = points.min(axis=0) / 1000, points.max(axis=0) / 1000
    expected = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]
    np.testing.assert_allclose(scene.bounds, expected, atol=1e-7)
    pair = glb_bytes("Cube", [panel, panel], [triangles(panel)] * 2)
    assert node_names(pair) == ["Cube", "F1", "F1"]
