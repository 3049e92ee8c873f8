"""Encoding from a script: what the kernel holds becomes an object, and comes back."""

from __future__ import annotations

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Fuse
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps

from generator import encode
from generator.cad.result import _kernel_solid
from generator.errors import DatabaseError, ShapeError
from generator.solid import box, volume
from generator.spec import SpecError


def block(x: float = 30.0, y: float = 35.0, z: float = 40.0):
    return BRepPrimAPI_MakeBox(gp_Pnt(5, 6, 7), x, y, z).Solid()


def encoded(folder, solid=None, **options):
    given = {"name": "Block", "formats": (), "folder": folder / "out"} | options
    return encode(solid or block(), database=str(folder / "lab.db"), **given)


def test_parts_come_back_as_valid_solids_where_the_solid_was(tmp_path):
    result = encoded(tmp_path, print={"parts": "whole"})
    (part,) = result.parts
    solid = _kernel_solid(part)
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, properties)
    assert BRepCheck_Analyzer(solid).IsValid()
    assert properties.Mass() == pytest.approx(volume(part), rel=1e-9)
    assert properties.Mass() > 30 * 35 * 40
    centre = properties.CentreOfMass()
    assert np.abs([centre.X() - 20, centre.Y() - 23.5, centre.Z() - 27]).max() < 0.5
    low, high = box(part)
    assert high - low == pytest.approx([32, 37, 41])  # F1 is blank: it is down
    assert result.symbols == sum(len(face.labels) for face in result.layout.faces) > 50


def test_the_same_solid_again_keeps_its_cells_and_another_is_refused(tmp_path):
    first = encoded(tmp_path)
    again = encoded(tmp_path, block())
    assert (first.reused, again.reused) == (False, True)
    assert again.layout.faces[0].rows.tolist() == first.layout.faces[0].rows.tolist()
    with pytest.raises(DatabaseError, match="another spec"):
        encoded(tmp_path, block(31.0))
    replaced = encoded(tmp_path, block(31.0), replace=True)
    assert not replaced.reused
    assert any("destroy its printed parts" in said for said in replaced.warnings)
    assert replaced.layout.faces[0].placement != first.layout.faces[0].placement  # beside it
    back = encoded(tmp_path, block(), replace=True)
    assert back.layout.faces[0].placement == first.layout.faces[0].placement  # freed for others


def test_settings_are_those_of_a_spec_and_errors_name_them(tmp_path):
    result = encoded(tmp_path, symbols={"pitch": "8 mm"}, layout="faces", profile="large")
    assert result.layout.pitch_mm == 8.0
    assert result.layout.kind == "faces"
    with pytest.raises(SpecError, match=r"encode\(\):2:10: error: unknown profile 'lagre'"):
        encoded(tmp_path, profile="lagre")
    with pytest.raises(SpecError, match="unknown setting 'pich'"):
        encoded(tmp_path, symbols={"pich": 8})
    with pytest.raises(SpecError, match="not a plain value"):
        encoded(tmp_path, symbols={"pitch": object()})
    with pytest.raises(SpecError, match="one solid is encoded at a time"):
        encoded(tmp_path, copies=2)


def test_what_is_no_single_solid_is_refused_and_leaves_nothing(tmp_path):
    two = BRepAlgoAPI_Fuse(block(), BRepPrimAPI_MakeBox(gp_Pnt(90, 0, 0), 9, 9, 9).Solid()).Shape()
    for solid, cause in (
        (two, "2 solids"),
        (BRepPrimAPI_MakeSphere(20.0).Shell(), "no solid, but 1 loose face;"),
        (3.0, "float is no solid of build123d, cadquery or trimesh"),
    ):
        with pytest.raises(ShapeError, match=cause):
            encoded(tmp_path, solid)
    assert not list(tmp_path.iterdir())


def test_symbols_keep_out_of_a_slot_that_is_too_narrow_for_them(tmp_path):
    lid = BRepPrimAPI_MakeBox(gp_Pnt(20, 0, 41.5), 60, 60, 20).Solid()
    post = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 20, 60, 61.5).Solid()
    floor = BRepPrimAPI_MakeBox(gp_Pnt(0, 0, 0), 80, 60, 40).Solid()
    solid = BRepAlgoAPI_Fuse(BRepAlgoAPI_Fuse(floor, post).Shape(), lid).Shape()
    result = encoded(tmp_path, solid, print={"parts": "whole"}, formats=("stl",), verify=True)
    assert any("nearer than 2.8 mm in front of" in warning for warning in result.warnings)
    normals = {face_of(result, z) for z in (40.0, 41.5)}
    assert len(normals) == 2
    assert not any(len(result.layout.faces[face].labels) for face in normals)


def face_of(result, z):
    """Number of the face that lies in the plane of this height."""
    polyhedron = result.polyhedron
    (face,) = (
        number
        for number, face in enumerate(polyhedron.faces)
        if (abs(polyhedron.vertices[list(face.loops[0])][:, 2] - z) < 1e-9).all()
    )
    return face


def test_a_spec_is_a_file_its_text_or_its_settings(tmp_path):
    text = "name: Cube\nshape: {cube: 30 mm}\n"
    (tmp_path / "cube.yaml").write_text(text)
    settings = {"name": "Cube", "shape": {"cube": "30 mm"}}
    given = {"database": str(tmp_path / "lab.db"), "formats": ("stl",), "folder": tmp_path / "out"}
    first = encode(settings, **given)
    assert (first.name, first.faces, first.symbols) == ("Cube", 6, 150)
    assert first.folder == tmp_path / "out"
    assert str(first) == f"Cube: 6 faces, 150 symbols, {len(first.files)} files in {first.folder}"
    for again in (text, tmp_path / "cube.yaml", str(tmp_path / "cube.yaml")):
        assert encode(again, **given).objects[0].reused  # the same spec: the same cells
    two = encode({"objects": [settings, settings | {"name": "Second"}]}, **given)
    assert (two.name, two.symbols) == ("Cube, Second", 300)
    assert str(two).count("\n") == 1
    with pytest.raises(SpecError, match="'layout' stands beside a spec"):
        encode(text, layout="net", **given)
    with pytest.raises(SpecError, match=r"encode\(\):1:1: error: unknown setting 'nam'"):
        encode({"nam": "Cube", "shape": {"cube": "30 mm"}}, **given)
