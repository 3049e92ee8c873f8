"""What was written, read back by independent programs: the CAD kernel and a mesh library.

STEP: exactly one solid, valid, with the analytic volume. STL: closed, two-manifold, no
self-intersection, with the analytic volume as far as 32-bit floats hold it. The mesh library
finds self-intersections in floating point and so reports neighbours in a slanted plane that
only touch; `exact_crossing` decides. Both libraries are heavy and load when a check is asked
for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from encoded_objects.base.errors import require
from generator.errors import GeneratorError, SolidError
from generator.export.exact_crossing import cut_triangles, perhaps_folded
from generator.export.settings import READ_BACK

_EXTRAS = "cad,mesh"


@dataclass(frozen=True, slots=True)
class StepReport:
    """What the CAD kernel read."""

    solids: int
    valid: bool
    volume_mm3: float
    volume_error: float  #: relative to the analytic volume


@dataclass(frozen=True, slots=True)
class MeshReport:
    """What the mesh library read."""

    triangles: int
    boundary_edges: int
    non_manifold_edges: int
    non_manifold_vertices: int
    flagged: int  #: triangles that, in floats, seem to cut another
    self_intersections: int  #: those of them that do cut or touch it, decided in integers
    volume_mm3: float
    volume_error: float  #: relative to the analytic volume


@dataclass(frozen=True, slots=True)
class PartReport:
    """The checks of one part; None where a format was not written."""

    part: str
    step: StepReport | None
    stl: MeshReport | None


def verify(
    part: str,
    volume_mm3: float,
    *,
    step: Path | None = None,
    stl: Path | None = None,
    round_mm3: float | None = None,
) -> PartReport:
    """Read the files of one part back and compare them with what was meant.

    Parameters
    ----------
    part
        Name of the part, for the report and for errors.
    volume_mm3
        The analytic volume, mm^3.
    step, stl
        The files; None for a format that was not written.
    round_mm3
        Of a part with round faces in STEP, by how much they hold more than facets do.

    Raises
    ------
    SolidError
        A check failed; the error names the file, the part and what is wrong.
    MissingExtraError
        The CAD kernel or the mesh library is not installed.
    GeneratorError
        The mesh library lacks one of the system.
    """
    return PartReport(
        part,
        _verified_step(part, volume_mm3, step, round_mm3) if step is not None else None,
        _verified_stl(part, volume_mm3, stl) if stl is not None else None,
    )


def read_step(path: Path) -> StepReport:
    """Return what the CAD kernel makes of a file; the volume error is not known (NaN)."""
    require("OCP.BRepCheck", extra=_EXTRAS, purpose="--verify")
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Message import Message
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    # The kernel prints its complaints to stdout, where results belong: take its printers away.
    messenger: Any = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    reader: Any = STEPControl_Reader()
    status = reader.ReadFile(str(path))
    for printer in printers:
        messenger.AddPrinter(printer)
    if status != IFSelect_ReturnStatus.IFSelect_RetDone:
        return StepReport(0, False, math.nan, math.nan)
    reader.TransferRoots()
    shape: Any = reader.OneShape()
    if shape is None or shape.IsNull():
        return StepReport(0, False, math.nan, math.nan)
    solids = 0
    explorer: Any = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    while explorer.More():
        solids += 1
        explorer.Next()
    properties: Any = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    return StepReport(
        solids, bool(BRepCheck_Analyzer(shape).IsValid()), float(properties.Mass()), math.nan
    )


def read_stl(path: Path) -> MeshReport:
    """Return what the mesh library makes of a file; the volume error is not known (NaN)."""
    require("pymeshlab", extra=_EXTRAS, purpose="--verify")
    import pymeshlab

    meshes: Any = pymeshlab.MeshSet(verbose=False)
    try:
        meshes.load_new_mesh(str(path))
    except pymeshlab.PyMeshLabException as error:
        if "Unknown format" in str(error):  # its plugins need a system library
            raise GeneratorError(
                f"--verify needs all of the mesh library, which did not load ({error})",
                fix="run: apt-get install libopengl0",
            ) from error
        return MeshReport(0, 0, 0, 0, 0, 0, math.nan, math.nan)
    meshes.meshing_remove_duplicate_vertices()
    topology = meshes.get_topological_measures()
    meshes.compute_selection_by_self_intersections_per_face()
    mesh: Any = meshes.current_mesh()
    points, faces = mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)
    # The library does not compare neighbours with a common side.
    folded = perhaps_folded(points, faces)
    suspects = np.union1d(np.flatnonzero(mesh.face_selection_array()), folded)
    return MeshReport(
        triangles=int(topology["faces_number"]),
        boundary_edges=int(topology["boundary_edges"]),
        non_manifold_edges=int(topology["non_two_manifold_edges"]),
        non_manifold_vertices=int(topology["non_two_manifold_vertices"]),
        flagged=len(suspects),
        self_intersections=int(cut_triangles(points[faces], suspects).sum()),
        volume_mm3=float(meshes.get_geometric_measures().get("mesh_volume", math.nan)),
        volume_error=math.nan,
    )


def _verified_step(part: str, volume_mm3: float, path: Path, round_mm3: float | None) -> StepReport:
    read = read_step(path)
    allowed = READ_BACK.step_volume if round_mm3 is None else READ_BACK.bent_volume
    volume_mm3 += round_mm3 or 0.0
    report = replace(read, volume_error=float(read.volume_mm3 / volume_mm3 - 1.0))
    if report.solids != 1:
        raise _failure(part, path, f"holds {report.solids} solids where one is allowed")
    if not report.valid:
        raise _failure(part, path, "holds a solid that the CAD kernel finds invalid")
    if not abs(report.volume_error) <= allowed:
        raise _failure(
            part,
            path,
            f"has a volume of {read.volume_mm3:.6f} mm3 where {volume_mm3:.6f} mm3 was meant "
            f"(relative error {report.volume_error:.1e}, allowed {allowed:.0e})",
        )
    return report


def _verified_stl(part: str, volume_mm3: float, path: Path) -> MeshReport:
    read = read_stl(path)
    report = replace(read, volume_error=float(read.volume_mm3 / volume_mm3 - 1.0))
    faults = {
        "open edges": report.boundary_edges,
        "edges with more than two triangles": report.non_manifold_edges,
        "vertices where the surface touches itself": report.non_manifold_vertices,
        "triangles that cut another one": report.self_intersections,
    }
    found = [f"{count} {what}" for what, count in faults.items() if count]
    if report.triangles == 0:
        found = ["no triangles that can be read"]
    if found:
        raise _failure(part, path, "has " + ", ".join(found))
    if not abs(report.volume_error) <= READ_BACK.stl_volume:
        raise _failure(
            part,
            path,
            f"has a volume of {read.volume_mm3:.3f} mm3 where {volume_mm3:.3f} mm3 was meant",
        )
    return report


def _failure(part: str, path: Path, reason: str) -> SolidError:
    return SolidError(
        f"part '{part}': {path.name} {reason}",
        fix="do not print it; report the spec together with this message",
        place=str(path),
    )
