"""The assembly STEP and the GLB of a panelled object, as independent programs read them."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from reference.kernel import named_parts

from generator.export.colours import BODY_RGB
from generator.export.meshes import glb_bytes
from generator.export.step import assembly_chunks
from generator.layout.placement import Layout
from generator.polyhedron.shapes import SHAPES
from generator.printers import printer_named
from generator.solid import measure
from generator.solid.panels import panels
from generator.solid.triangulate import triangles

pytest.importorskip("OCP")

EMPTY = Layout("faces", 7.0, ())


@pytest.fixture(scope="module")
def parts():
    solid = SHAPES["triangular_prism"](60.0, 40.0)
    return panels(solid, EMPTY, (), 3.0, printer_named("fdm-0.4"), name="Würfel", code="K").parts


def test_panels_stand_where_they_belong_with_names_and_colours(parts, tmp_path):
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    path = tmp_path / "a.step"
    path.write_bytes(b"".join(assembly_chunks("Würfel", parts)))
    name, components = named_parts(path)
    assert name == "Würfel"
    assert [component[0] for component in components] == [f"Würfel-F{k}" for k in range(1, 6)]
    for (_, shape, rgb), part in zip(components, parts, strict=True):
        assert BRepCheck_Analyzer(shape).IsValid()
        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(shape, properties)
        assert properties.Mass() == pytest.approx(measure.volume(part), rel=1e-9)
        mesh = triangles(part)
        corners = mesh.vertices[mesh.triangles] @ part.T_object_part[:3, :3].T
        corners += part.T_object_part[:3, 3]
        sixfold = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        middle = (sixfold[:, None] * corners.sum(axis=1)).sum(axis=0) / 4 / sixfold.sum()
        at = properties.CentreOfMass()
        assert (at.X(), at.Y(), at.Z()) == pytest.approx(middle.tolist(), abs=1e-6)
        assert [round(255 * value) for value in rgb] == list(BODY_RGB)


@pytest.mark.parametrize(
    ("kind", "sizes"), [("cube", (40.0,)), ("octahedron", (60.0,)), ("dodecahedron", (30.0,))]
)
def test_a_glb_closes_in_its_own_32_bit_positions(kind, sizes):
    solid = SHAPES[kind](*sizes)
    parts = panels(solid, EMPTY, (), 2.0, printer_named("fdm-0.4"), name="A", code="K").parts
    content = glb_bytes("A", parts, [triangles(part) for part in parts])
    length = struct.unpack_from("<I", content, 12)[0]
    meta, data = json.loads(content[20 : 20 + length]), content[28 + length :]

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
        edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
        ahead, back = set(map(tuple, edges.tolist())), set(map(tuple, edges[:, ::-1].tolist()))
        assert len(ahead) == len(edges)
        assert ahead == back
