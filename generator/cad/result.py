"""An encoded solid -> solids of build123d or cadquery, for scripts to go on with.

The parts go through the STEP text that is written for them: one valid solid a part, mm, in the
frame of the solid that was encoded, where the panels of an object stand assembled.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from encoded_objects.base.errors import require
from generator.cad.encode import EncodedSolid
from generator.errors import SolidError
from generator.export.step import step_chunks
from generator.polyhedron.read.brep import step_shape, sub_shapes
from generator.solid import Part


def to_build123d(result: EncodedSolid) -> Any:
    """Return a `build123d.Compound` with one labelled `Solid` for each part.

    Raises `MissingExtraError` where build123d is not installed.
    """
    require("build123d", extra="cad", purpose="to_build123d")
    from build123d import Compound, Solid

    solids = []
    for part in result.parts:
        solid = Solid(_kernel_solid(part))
        solid.label = part.name
        solids.append(solid)
    return Compound(label=result.name, children=solids)


def to_cadquery(result: EncodedSolid) -> Any:
    """Return a `cadquery.Assembly` with one named child for each part.

    Raises `MissingExtraError` where cadquery is not installed.
    """
    require("cadquery", extra="cad", purpose="to_cadquery")
    from cadquery import Assembly, Solid

    assembly = Assembly(name=result.name)
    for part in result.parts:
        assembly.add(Solid(_kernel_solid(part)), name=part.name)
    return assembly


def _kernel_solid(part: Part) -> Any:
    """Return a part as the kernel's solid, in the object frame."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Trsf
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopoDS import TopoDS

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "part.step"
        with path.open("wb") as file:
            file.writelines(step_chunks(part))
        solids = sub_shapes(step_shape(path), TopAbs_SOLID)
    if not solids:
        raise SolidError("the CAD kernel does not read the part back", place=part.name)
    motion = gp_Trsf()
    motion.SetValues(*part.T_object_part[:3].ravel().tolist())
    moved = BRepBuilderAPI_Transform(solids[0], motion, True).Shape()
    return TopoDS.Solid_s(moved)
