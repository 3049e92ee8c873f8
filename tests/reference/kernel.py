"""Volume, centre and inertia of written STEP files, by the CAD kernel alone."""

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


def inertia_of(solids: Iterable[tuple[Any, np.ndarray]]) -> tuple[float, np.ndarray, np.ndarray]:
    """Return volume (mm3), centre (mm) and inertia about it (mm5) in the object frame.

    Parameters
    ----------
    solids
        Shapes of the kernel with their T_object_part.
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
