"""The CAD kernel's part of reading STEP, in a process of its own: file -> planar faces in mm.

    python -m generator.polyhedron.read.kernel model.step answer.json SCALE

A damaged file can crash the kernel; here it takes only this process with it. The answer
holds `points` and `faces` (loops of point numbers), and for round faces what `curved` adds, or
the `cause` and `fix` of a refusal.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.errors import install_line
from generator.errors import ShapeError
from generator.polyhedron.read.brep import is_line, step_shape, sub_shapes, wires_of
from generator.polyhedron.read.curved import curved_faces

PLANAR_MM = 1e-5  #: a spline surface this flat is a plane; kernel tolerances are smaller
AGAIN = "export the model again; the file may be damaged"


def main(model: str, answer: str, scale: str) -> None:
    """Read `model`, make it `scale` times larger and write `answer`."""
    with open(os.devnull, "wb") as nowhere:  # the kernel prints beneath Python
        os.dup2(nowhere.fileno(), 1)
    try:
        found = _read_model(model, float(scale))
    except ShapeError as error:
        found = {"cause": error.cause, "fix": error.fix}
    Path(answer).write_text(json.dumps(found))


def _read_model(model: str, scale: float) -> dict[str, Any]:
    try:
        import OCP.Standard
    except ImportError:  # a library of the system may be missing
        raise ShapeError(
            "reading STEP needs the CAD kernel, which cannot be loaded",
            fix=f"{install_line('cad')}, or save the model as STL",
        ) from None
    try:
        shape = step_shape(model)
        if shape is None:
            raise ShapeError("the CAD kernel finds no STEP data in it", fix=AGAIN)
        return describe_shape(_scale(shape, scale))
    except OCP.Standard.Standard_Failure as error:
        reason = str(error).strip().splitlines()
        cause = f"the CAD kernel cannot read it: {reason[0] if reason else 'no reason given'}"
        raise ShapeError(cause, fix=AGAIN) from None


def describe_shape(shape: Any) -> dict[str, Any]:
    """Return the faces of the one solid in a shape of the kernel, mm.

    Raises `ShapeError` for no solid, several, or faces that cannot be read.
    """
    from OCP.TopAbs import TopAbs_SOLID

    solids = sub_shapes(shape, TopAbs_SOLID)
    if len(solids) != 1:
        raise ShapeError(
            f"it holds {_content_of(shape, len(solids))}; one solid is needed",
            fix="join them into one solid, or save each in a file of its own",
        )
    return _faces(solids[0])


def _content_of(shape: Any, solids: int) -> str:
    from OCP.TopAbs import TopAbs_FACE

    if solids:
        return f"{solids} solids"
    if faces := len(sub_shapes(shape, TopAbs_FACE)):
        return f"no solid, but {faces} loose {'face' if faces == 1 else 'faces'}"
    return "no faces: it may be an assembly whose parts are in other files"


def _scale(shape: Any, scale: float) -> Any:
    """Return a shape made larger about the origin, so that round faces are divided at that size."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Pnt, gp_Trsf

    if scale == 1.0 or shape is None or shape.IsNull():
        return shape
    larger = gp_Trsf()
    larger.SetScale(gp_Pnt(0.0, 0.0, 0.0), scale)
    return BRepBuilderAPI_Transform(shape, larger, True).Shape()


def _faces(solid: Any) -> dict[str, Any]:
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_FACE, TopAbs_VERTEX
    from OCP.TopExp import TopExp
    from OCP.TopoDS import TopoDS
    from OCP.TopTools import TopTools_IndexedMapOfShape

    faces = [TopoDS.Face_s(face) for face in sub_shapes(solid, TopAbs_FACE)]
    kinds = [_kind(face) for face in faces]
    if set(kinds) != {"plane"}:
        return curved_faces(solid, faces, kinds)
    numbers = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(solid, TopAbs_VERTEX, numbers)
    points = np.zeros((numbers.Extent(), 3))
    for k in range(len(points)):
        point = BRep_Tool.Pnt_s(TopoDS.Vertex_s(numbers.FindKey(k + 1)))
        points[k] = point.X(), point.Y(), point.Z()
    return {"points": points.tolist(), "faces": [_loops(face, numbers) for face in faces]}


def _kind(face: Any) -> str:
    """Return what surface a face has: plane, cylinder, cone, sphere, torus, bsplinesurface, ..."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomLib import GeomLib_IsPlanarSurface

    if GeomLib_IsPlanarSurface(BRep_Tool.Surface_s(face), PLANAR_MM).IsPlanar():
        return "plane"
    kind: str = BRepAdaptor_Surface(face).GetType().name
    return kind.removeprefix("GeomAbs_").lower()


def _loops(face: Any, numbers: Any) -> list[list[int]]:
    """Return the wires of a planar face as vertex numbers, counter-clockwise from outside."""
    loops = []
    for wire in wires_of(face):
        loop = []
        for edge, vertex in wire:
            _refuse_bent(edge)
            loop.append(numbers.FindIndex(vertex) - 1)
        loops.append(loop)
    return loops


def _refuse_bent(edge: Any) -> None:
    """Refuse an edge that leaves the straight line between its ends."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve

    if is_line(edge):
        return
    curve = BRepAdaptor_Curve(edge)
    parameters = np.linspace(curve.FirstParameter(), curve.LastParameter(), 17)
    on_curve = [curve.Value(float(t)) for t in parameters]
    points = np.array([(p.X(), p.Y(), p.Z()) for p in on_curve])
    along = points[-1] - points[0]
    length = float(np.linalg.norm(along))
    offset = np.linalg.norm(np.cross(points - points[0], along), axis=1)
    if length == 0.0 or offset.max() > PLANAR_MM * length:
        x, y, z = points[0]
        raise ShapeError(
            f"an edge at ({x:.6g}, {y:.6g}, {z:.6g}) is not straight",
            fix="leave out round parts: every edge joins two planar faces",
        )


if __name__ == "__main__":
    main(*sys.argv[1:])
