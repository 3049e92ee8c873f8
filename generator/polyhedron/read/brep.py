"""Shapes of the CAD kernel: read from STEP, and taken apart into wires and edges."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any


def step_shape(path: Path | str) -> Any:
    """Return the kernel's shape of a STEP file; None where it finds no STEP data."""
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone:
        return None
    reader.TransferRoots()
    return reader.OneShape()


def sub_shapes(shape: Any, kind: Any) -> list[Any]:
    """Return the sub-shapes of one kind, each once, in the kernel's order; of None, none."""
    from OCP.TopExp import TopExp
    from OCP.TopTools import TopTools_IndexedMapOfShape

    if shape is None or shape.IsNull():
        return []
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(k + 1) for k in range(found.Extent())]


def wires_of(face: Any) -> Iterator[Iterator[tuple[Any, Any]]]:
    """Yield the wires of a face, outer first: edges with their first vertices, material left."""
    from OCP.BRepTools import BRepTools
    from OCP.TopAbs import TopAbs_WIRE

    outer = BRepTools.OuterWire_s(face)
    for wire in sorted(sub_shapes(face, TopAbs_WIRE), key=lambda wire: not wire.IsSame(outer)):
        yield _edges_of(wire, face)


def _edges_of(wire: Any, face: Any) -> Iterator[tuple[Any, Any]]:
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopoDS import TopoDS

    walk = BRepTools_WireExplorer(TopoDS.Wire_s(wire), face)
    while walk.More():
        yield walk.Current(), walk.CurrentVertex()
        walk.Next()


def is_line(edge: Any) -> bool:
    """Whether the kernel has an edge as a straight line."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.GeomAbs import GeomAbs_Line

    return bool(BRepAdaptor_Curve(edge).GetType() == GeomAbs_Line)
