"""A solid of the CAD kernel -> STEP text and triangles, each the same on every run; and its check.

The kernel counts products and writes the time into its header; both are taken out. Triangles share
their vertices by number, so the mesh is as closed as the solid.
"""

from __future__ import annotations

import io
import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from generator.errors import SolidError
from generator.export.check import MeshReport, StepReport, read_step, read_stl
from generator.solid import Mesh
from probe.kit.settings import KitSettings

_TIME = datetime(2000, 1, 1)
_COUNTED = re.compile(rb"Open CASCADE STEP translator [0-9.]+ [0-9]+")
_WELD_MM = 1e-6  #: corners of neighbouring faces differ by less
STEP_VOLUME, MESH_VOLUME = 1e-6, 5e-3  #: relative errors: as text; of chords


@dataclass(frozen=True, slots=True)
class KitPartReport:
    """What other programs read of a part."""

    name: str
    volume_mm3: float  #: of the solid
    step: StepReport
    stl: MeshReport


def step_text(solid: Any, name: str) -> bytes:
    """Return a solid as STEP (mm), the same bytes for the same solid."""
    from build123d import export_step

    solid.label = name
    out = io.BytesIO()
    export_step(solid, out, timestamp=_TIME)
    return _COUNTED.sub(b"Open CASCADE STEP translator", out.getvalue())


def mesh_of(solid: Any, settings: KitSettings) -> Mesh:
    """Return the triangles of a solid, which share vertices by number.

    Raises
    ------
    SolidError
        The kernel's triangles leave a gap.
    """
    points, faces = solid.tessellate(settings.chord_mm, settings.chord_rad)
    corners = np.array([(p.X, p.Y, p.Z) for p in points])
    grid, numbers = np.unique(np.rint(corners / _WELD_MM), axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[np.array(faces, np.int64)]
    distinct = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    triangles = triangles[distinct]
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    there = set(map(tuple, edges.tolist()))
    if len(there) != len(edges) or any((b, a) not in there for a, b in there):
        raise SolidError("the kernel's triangles do not close", fix="report the sensor type")
    none = np.zeros(len(triangles), np.int64)
    return Mesh(grid * _WELD_MM, triangles, none, none - 1, none - 1)


def check_part(name: str, solid: Any, step: Path, stl: Path) -> KitPartReport:
    """Read the files of a part back by other programs.

    Raises
    ------
    SolidError
        They hold something else than one closed solid of its volume.
    MissingExtraError
        The CAD kernel or the mesh library is not installed.
    """
    volume = float(solid.volume)
    found, mesh = read_step(step), read_stl(stl)
    faults = {
        f"{found.solids} solids in STEP": found.solids != 1,
        "a solid that the CAD kernel finds invalid": not found.valid,
        f"{found.volume_mm3:.3f} mm3 in STEP": abs(found.volume_mm3 / volume - 1) > STEP_VOLUME,
        f"{mesh.volume_mm3:.3f} mm3 in STL": not abs(mesh.volume_mm3 / volume - 1) < MESH_VOLUME,
        f"{mesh.boundary_edges} open edges": mesh.boundary_edges > 0,
        f"{mesh.non_manifold_edges} edges of more than two triangles": mesh.non_manifold_edges > 0,
        f"{mesh.non_manifold_vertices} vertices where it touches itself": (
            mesh.non_manifold_vertices > 0
        ),
        f"{mesh.self_intersections} triangles that cut others": mesh.self_intersections > 0,
    }
    if wrong := [text for text, bad in faults.items() if bad]:
        raise SolidError(
            f"part '{name}' of {volume:.3f} mm3 has {', '.join(wrong)}",
            fix="do not print it; report the sensor type together with this message",
            place=str(step),
        )
    return KitPartReport(name, volume, found, mesh)
