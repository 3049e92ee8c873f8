"""Round faces in STEP, read by the CAD kernel: one valid solid of cylinders, cones, tight edges."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from reference.kernel import solid_of
from reference.laid_symbols import layout_on_round_face

from generator.alphabet.known import alphabet_named
from generator.alphabet.outline import SymbolStyle, outlines
from generator.export.check import verify_step
from generator.export.step import step_chunks
from generator.polyhedron.read import read_shape
from generator.polyhedron.shapes import cone, cylinder
from generator.solid import emboss_whole

pytest.importorskip("OCP")

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
    step = tmp_path / "part.step"
    step.write_bytes(b"".join(step_chunks(part)))
    report = verify_step(part, step)
    assert report.solids == 1
    assert report.valid
    kinds, edge_mm, names = read_faces(step)
    round_kind = "Cylinder" if name in ("cylinder", "bore") else "Cone"
    assert kinds[round_kind] == len(part.analytic) + part.symbols + islands(part)
    assert kinds["Plane"] + kinds["BSplineSurface"] + kinds[round_kind] == sum(kinds.values())
    assert kinds["Plane"] < len(part.facets)
    assert edge_mm < 1e-4
    assert names >= {face.name for face in part.analytic}


def islands(part):
    return sum(len(s.rings[0]) - 1 for face in part.analytic for s in face.symbols)


def read_faces(path):
    """Return surfaces by kind, the largest tolerance of an edge, and the names of faces."""
    import re

    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE
    from OCP.TopExp import TopExp
    from OCP.TopoDS import TopoDS
    from OCP.TopTools import TopTools_IndexedMapOfShape

    shape = solid_of(path)

    def parts(kind):
        found = TopTools_IndexedMapOfShape()
        TopExp.MapShapes_s(shape, kind, found)
        return [found.FindKey(k + 1) for k in range(found.Extent())]

    kinds = Counter(
        BRepAdaptor_Surface(TopoDS.Face_s(face)).GetType().name.removeprefix("GeomAbs_")
        for face in parts(TopAbs_FACE)
    )
    edge_mm = max(BRep_Tool.Tolerance_s(TopoDS.Edge_s(edge)) for edge in parts(TopAbs_EDGE))
    return kinds, edge_mm, set(re.findall(r"ADVANCED_FACE\('([^']*)'", path.read_text()))
