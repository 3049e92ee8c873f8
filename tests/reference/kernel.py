"""Names, colours, volume, centre and inertia of written STEP files, by the CAD kernel alone."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np


def solid_of(step: Path) -> Any:
    """Return what the CAD kernel reads."""
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(step))
    reader.TransferRoots()
    return reader.OneShape()


def named_parts(step: Path) -> tuple[str, list[tuple[str, Any, Any]]]:
    """Return the name of the one shape of a file, and name, shape and sRGB (or None) of its parts.

    Parts are the components of an assembly where they stand, or the faces of a solid.
    """
    from OCP.Interface import Interface_Static
    from OCP.Quantity import Quantity_Color, Quantity_TOC_sRGB
    from OCP.STEPCAFControl import STEPCAFControl_Controller, STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDataStd import TDataStd_Name
    from OCP.TDF import TDF_ChildIterator, TDF_Label, TDF_LabelSequence
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_ColorSurf, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

    def name_of(label: Any) -> str:
        name = TDataStd_Name()
        return name.Get().ToExtString() if label.FindAttribute(name.GetID_s(), name) else ""

    STEPCAFControl_Controller.Init_s()
    Interface_Static.SetIVal_s("read.stepcaf.subshapes.name", 1)
    document = TDocStd_Document(TCollection_ExtendedString("document"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    reader.ReadFile(str(step))
    assert reader.Transfer(document)
    free = TDF_LabelSequence()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(free)
    assert free.Length() == 1
    colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())
    parts = []
    children = TDF_ChildIterator(free.Value(1))
    while children.More():
        own, colour = TDF_Label(), Quantity_Color()
        if not XCAFDoc_ShapeTool.GetReferredShape_s(children.Value(), own):
            own = children.Value()
        coloured = colours.GetColor_s(own, XCAFDoc_ColorSurf, colour)
        shape = XCAFDoc_ShapeTool.GetShape_s(children.Value())
        rgb = colour.Values(Quantity_TOC_sRGB) if coloured else None
        parts.append((name_of(children.Value()), shape, rgb))
        children.Next()
    return name_of(free.Value(1)), parts


def inertia_of(solids: Iterable[tuple[Any, np.ndarray]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Return volume (mm3), centre (mm) and inertia about it (mm5) in the object frame.

    Solids are shapes of the kernel with their T_object_part.
    """
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    volume, moment, about = 0.0, np.zeros(3), np.zeros((3, 3))
    for shape, T in solids:
        found = GProp_GProps()
        BRepGProp.VolumeProperties_s(shape, found)
        centre, matrix = found.CentreOfMass(), found.MatrixOfInertia()
        own = np.array([[matrix.Value(i, k) for k in (1, 2, 3)] for i in (1, 2, 3)])
        at = T[:3, :3] @ (centre.X(), centre.Y(), centre.Z()) + T[:3, 3]
        volume += found.Mass()
        moment += found.Mass() * at
        about += T[:3, :3] @ own @ T[:3, :3].T
        about += found.Mass() * (at @ at * np.eye(3) - np.outer(at, at))
    middle = moment / volume
    return volume, middle, about - volume * (middle @ middle * np.eye(3) - np.outer(middle, middle))
