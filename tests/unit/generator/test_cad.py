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
    assert properties.CentreOfMass().Distance(gp_Pnt(20, 23.5, 27)) < 0.5
    low, high = box(part)
    assert high - low == pytest.approx([32, 37, 41])  # F1 is blank: it is down


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
    pitch = np.float64(8)  # of a notebook
    result = encoded(tmp_path, symbols={"pitch": pitch}, layout="faces", profile="large")
    assert (result.layout.pitch_mm, result.layout.kind) == (8.0, "faces")
    for given, said in (
        ({"profile": "lagre"}, r"encode\(\):2:10: error: unknown profile 'lagre'"),
        ({"symbols": {"pich": 8}}, "unknown setting 'pich'"),
        ({"symbols": {"pitch": object()}}, "not a plain value"),
        ({"copies": 2}, "one solid is encoded at a time"),
    ):
        with pytest.raises(SpecError, match=said):
            encoded(tmp_path, **given)


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
    vertices = result.polyhedron.vertices
    slot = [
        len(laid.labels)
        for face, laid in zip(result.polyhedron.faces, result.layout.faces, strict=True)
        if np.ptp(z := vertices[list(face.loops[0])][:, 2]) < 1e-9 and z[0] in (40.0, 41.5)
    ]
    assert slot == [0, 0]


def test_a_spec_is_a_file_its_text_or_its_settings(tmp_path):
    text = "name: Cube\nshape: {cube: 30 mm}\n"
    (tmp_path / "cube.yaml").write_text(text)
    settings = {"name": "Cube", "shape": {"cube": "30 mm"}}
    given = {"database": str(tmp_path / "lab.db"), "formats": ("stl",), "folder": tmp_path / "out"}
    first = encode(settings, **given)
    assert (first.name, first.faces, first.symbols, first.folder) == (
        "Cube", 6, 150, tmp_path / "out",
    )  # fmt: skip
    assert str(first) == f"Cube: 6 faces, 150 symbols, {len(first.files)} files in {first.folder}"
    for again in (text, tmp_path / "cube.yaml", str(tmp_path / "cube.yaml")):
        assert encode(again, **given).objects[0].reused  # the same spec: the same cells
    two = encode({"objects": [settings, settings | {"name": "Second"}]}, **given)
    assert (two.name, two.symbols, str(two).count("\n")) == ("Cube, Second", 300, 1)
    assert (
        encode(text, **given | {"formats": "STL", "database": tmp_path / "lab.db"})
        .objects[0]
        .reused
    )
    for wrong in ("", ["obj"], 5):
        with pytest.raises(SpecError, match="--format: error: "):
            encode(text, **given | {"formats": wrong})
    with pytest.raises(SpecError, match="'layout' stands beside a spec"):
        encode(text, layout="net", **given)
    with pytest.raises(SpecError, match=r"encode\(\):1:1: error: unknown setting 'nam'"):
        encode({"nam": "Cube", "shape": {"cube": "30 mm"}}, **given)
