"""Files of parts read back by programs that share nothing with the writers.

STEP by the CAD kernel: exactly one solid, valid, with the analytic volume. STL by a mesh library:
closed, two-manifold, no self-intersection, with the analytic volume as far as 32-bit floats hold
it. The library finds self-intersections in floating point and so reports neighbours in a slanted
plane that only touch; `exact_crossing` decides. Panels by the booleans of manifold3d: put together
as `T_object_part` says, no two overlap, and all keep their gap. Lengths in mm. These libraries are
heavy and load when a check is asked for.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from generator.errors import GeneratorError, SolidError
from generator.polyhedron.read.brep import step_shape, sub_shapes
from generator.polyhedron.read.stl import MOST_PART_TRIANGLES, stl_triangles
from generator.solid import Part, round_volume, volume
from generator.solid.part import transform

Floats = NDArray[np.float64]

_EXTRAS = "cad,mesh"

STEP_VOLUME = 1e-9  #: greatest relative error of a volume in STEP
#: The same of a part with round faces, whose symbols bend where those of the mesh break: in
#: cylinders and cones of 30 to 80 mm, tip and chamfer included, 2e-5 at most.
BENT_VOLUME = 1e-4
STL_VOLUME = 1e-5  #: the same in STL: 32-bit coordinates
OVERLAP_MM3 = 1e-3  #: greatest volume that two panels may both fill
ROUNDING_MM = 1e-4  #: by which a gap may be smaller: 32-bit coordinates
REACH_MM = 1.0  #: up to which distances of panels are measured


@dataclass(frozen=True, slots=True)
class StepReport:
    """What the CAD kernel read."""

    solids: int
    valid: bool
    volume_mm3: float


@dataclass(frozen=True, slots=True)
class MeshReport:
    """What the mesh library read."""

    triangles: int
    boundary_edges: int
    non_manifold_edges: int
    non_manifold_vertices: int
    self_intersections: int  #: triangles that cut or touch another, decided in integers
    volume_mm3: float


@dataclass(frozen=True, slots=True)
class FitReport:
    """How the panels of an object fit."""

    pairs: int  #: that come nearer to each other than `REACH_MM`
    overlap_mm3: float  #: that two panels both fill, all pairs together
    gap_mm: float | None  #: smallest distance of two panels; None where no pair is near


def verify_step(part: Part, path: Path) -> StepReport:
    """Read the STEP file of a part and compare it with the part.

    Raises `SolidError` if it is not one valid solid of the part's volume, `MissingExtraError`
    without the CAD kernel.
    """
    report = read_step(path)
    excess = round_volume(part)
    allowed = STEP_VOLUME if excess is None else BENT_VOLUME
    volume_mm3 = volume(part) + (excess or 0.0)
    error = report.volume_mm3 / volume_mm3 - 1.0
    if report.solids != 1:
        raise _failure(part.name, path, f"holds {report.solids} solids where one is allowed")
    if not report.valid:
        raise _failure(part.name, path, "holds a solid that the CAD kernel finds invalid")
    if not abs(error) <= allowed:
        raise _failure(
            part.name,
            path,
            f"has a volume of {report.volume_mm3:.6f} mm3 where {volume_mm3:.6f} mm3 was meant "
            f"(relative error {error:.1e}, allowed {allowed:.0e})",
        )
    return report


def verify_stl(part: Part, path: Path) -> MeshReport:
    """Read the STL file of a part and compare it with the part.

    Raises `SolidError` if it is not one closed mesh of the part's volume, `MissingExtraError`
    without the mesh library, `GeneratorError` if that lacks a library of the system.
    """
    report, volume_mm3 = read_stl(path), volume(part)
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
        raise _failure(part.name, path, "has " + ", ".join(found))
    if not abs(report.volume_mm3 / volume_mm3 - 1.0) <= STL_VOLUME:
        meant = f"{report.volume_mm3:.3f} mm3 where {volume_mm3:.3f} mm3 was meant"
        raise _failure(part.name, path, f"has a volume of {meant}")
    return report


def verify_fit(parts: Sequence[Part], files: Sequence[Path], gap_mm: float) -> FitReport:
    """Put written panels, binary STL, together and measure.

    Raises `SolidError` if two panels overlap or are nearer than `gap_mm`.
    """
    solids = [_solid(part, path) for part, path in zip(parts, files, strict=True)]
    boxes = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 2, 3)
    reach = max(REACH_MM, 2 * gap_mm)
    pairs, total, smallest = 0, 0.0, reach
    for one, other in itertools.combinations(range(len(parts)), 2):
        apart = np.maximum(boxes[one, 0] - boxes[other, 1], boxes[other, 0] - boxes[one, 1])
        if apart.max() >= reach:
            continue
        gap = float(solids[one].min_gap(solids[other], reach))
        overlap = 0.0
        if apart.max() < 0:
            overlap = float((solids[one] ^ solids[other]).volume())
        names = f"panels '{parts[one].name}' and '{parts[other].name}'"
        if overlap > OVERLAP_MM3:
            raise _misfit(f"{names} overlap by {overlap:.4f} mm3", files[one])
        if gap < gap_mm - ROUNDING_MM:
            apart_by = f"{gap:.4f} mm apart where {gap_mm:g} mm was meant"
            raise _misfit(f"{names} are {apart_by}", files[one])
        pairs += gap < reach
        total += overlap
        smallest = min(smallest, gap)
    return FitReport(pairs, total, smallest if pairs else None)


def _solid(part: Part, path: Path) -> Manifold:
    """Return a written panel as it stands in the object."""
    content = path.read_bytes()
    corners = stl_triangles(content, str(path), most=MOST_PART_TRIANGLES, padded=False)
    points, numbers = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    seated = transform(part.T_object_part, points)
    solid = Manifold(Mesh64(seated, numbers.reshape(-1, 3).astype(np.uint64)))
    if solid.status() != Error.NoError:
        raise _misfit(f"'{part.name}' is no closed mesh", path)
    return solid


def _misfit(cause: str, path: Path) -> SolidError:
    fix = "do not print them; report the spec together with this message"
    return SolidError(cause, fix=fix, place=str(path))


def read_step(path: Path) -> StepReport:
    """Return what the CAD kernel makes of a file."""
    require("OCP.BRepCheck", extra=_EXTRAS, purpose="--verify")
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.Message import Message
    from OCP.TopAbs import TopAbs_SOLID

    # The kernel prints its complaints to stdout, where results belong: take its printers away.
    messenger: Any = Message.DefaultMessenger_s()
    printers = list(messenger.Printers())
    for printer in printers:
        messenger.RemovePrinter(printer)
    shape = step_shape(path)
    for printer in printers:
        messenger.AddPrinter(printer)
    if shape is None or shape.IsNull():
        return StepReport(0, False, math.nan)
    solids = len(sub_shapes(shape, TopAbs_SOLID))
    properties: Any = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, properties)
    valid = bool(BRepCheck_Analyzer(shape).IsValid())
    return StepReport(solids, valid, float(properties.Mass()))


def read_stl(path: Path) -> MeshReport:
    """Return what the mesh library makes of a file."""
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
        return MeshReport(0, 0, 0, 0, 0, math.nan)
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
        self_intersections=int(cut_triangles(points[faces], suspects).sum()),
        volume_mm3=float(meshes.get_geometric_measures().get("mesh_volume", math.nan)),
    )


def _failure(part: str, path: Path, reason: str) -> SolidError:
    fix = "do not print it; report the spec together with this message"
    return SolidError(f"part '{part}': {path.name} {reason}", fix=fix, place=str(path))


FOLDED_COS = -0.999  #: between neighbours, from which the exact test looks at them

Vector = tuple[int, int, int]
#: x, y, z and the common denominator, which is positive.
Point = tuple[int, int, int, int]
#: a, b, c, d of a x + b y + c z + d >= 0.
HalfSpace = tuple[int, int, int, int]
Triangle = tuple[Vector, Vector, Vector]


def cut_triangles(corners: NDArray[np.float64], suspects: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (n,) whether the triangles `suspects` (n,) cut or touch another where they may not.

    `corners`: (T, 3, 3) of all triangles, finite, any unit.
    """
    low, high = corners.min(axis=1), corners.max(axis=1)
    found = np.zeros(len(suspects), np.bool_)
    for k, number in enumerate(suspects.tolist()):
        near = ((low <= high[number]) & (high >= low[number])).all(axis=1)
        near[number] = False
        one, *others = _in_integers(corners[np.r_[number, np.flatnonzero(near)]])
        found[k] = any(triangles_cross(one, other) for other in others)
    return found


def perhaps_folded(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the triangles (T, 3) that may lie folded over a neighbour, or have no area."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    starts, ends = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    owner = np.tile(np.arange(len(triangles)), 3)
    order = np.lexsort((np.maximum(starts, ends), np.minimum(starts, ends)))
    edges = np.sort(np.stack([starts, ends], axis=1), axis=1)[order]
    same = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    one, other = owner[order][same], owner[order][same + 1]
    cosine = (normals[one] * normals[other]).sum(axis=1)
    back = cosine <= FOLDED_COS * lengths[one] * lengths[other]
    return np.unique(np.concatenate([one[back], other[back], np.flatnonzero(lengths == 0)]))


def triangles_cross(one: Triangle, other: Triangle) -> bool:
    """Return whether two triangles have more in common than the vertices they share."""
    shared = sorted(set(one) & set(other))
    if len(shared) == 3:
        return True
    return any(not _on_shared(point, shared) for point in _intersection_points(one, other))


def _in_integers(corners: NDArray[np.float64]) -> list[Triangle]:
    """Return triangles, (T, 3, 3), times the least power of two that makes all integers."""
    ratios = [float(value).as_integer_ratio() for value in corners.ravel()]
    scale = max(denominator for _, denominator in ratios)
    whole = iter([numerator * (scale // denominator) for numerator, denominator in ratios])
    vectors = list(zip(whole, whole, whole, strict=True))
    return [(vectors[k], vectors[k + 1], vectors[k + 2]) for k in range(0, len(vectors), 3)]


def _intersection_points(one: Triangle, other: Triangle) -> list[Point]:
    """Return points whose convex hull is what two triangles have in common."""
    points: list[Point] = [(*corner, 1) for corner in one]
    for a, b, c, d in _half_spaces(other):
        values = [a * x + b * y + c * z + d * w for x, y, z, w in points]
        kept: list[Point] = []
        for k, (point, s) in enumerate(zip(points, values, strict=True)):
            ahead = (k + 1) % len(points)
            t = values[ahead]
            if s >= 0:
                kept.append(point)
            if (s > 0 > t) or (s < 0 < t):
                p, q = (point, points[ahead]) if s > 0 else (points[ahead], point)
                s, t = max(s, t), min(s, t)
                x, y, z, w = (s * v - t * u for u, v in zip(p, q, strict=True))
                kept.append((x, y, z, w))
        points = kept
        if not points:
            break
    return points


def _half_spaces(triangle: Triangle) -> Iterator[HalfSpace]:
    """Yield half spaces whose intersection is the triangle; it may be a segment or a point."""
    a, b, c = triangle
    normal = _cross(_subtract(b, a), _subtract(c, a))
    if any(normal):
        yield from _plane(normal, a)
        for p, q in ((a, b), (b, c), (c, a)):
            yield _half_space_from(_cross(normal, _subtract(q, p)), p)
        return
    start, end = min(triangle), max(triangle)  # on a line the first and last in order
    along = _subtract(end, start)
    for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        across = _cross(along, axis) if any(along) else axis
        if any(across):
            yield from _plane(across, start)
    if any(along):
        yield _half_space_from(along, start)
        yield _half_space_from(_subtract(start, end), end)


def _plane(normal: Vector, point: Vector) -> Iterator[HalfSpace]:
    x, y, z = normal
    yield _half_space_from(normal, point)
    yield _half_space_from((-x, -y, -z), point)


def _half_space_from(normal: Vector, point: Vector) -> HalfSpace:
    return (*normal, -_dot(normal, point))


def _on_shared(point: Point, shared: Sequence[Vector]) -> bool:
    """Return whether a point lies on the vertex or the segment that two triangles share."""
    if not shared:
        return False
    x, y, z, w = point
    start, end = shared[0], shared[-1]
    arm = (x - w * start[0], y - w * start[1], z - w * start[2])
    along = _subtract(end, start)
    reach = _dot(arm, along)
    if any(_cross(arm, along)) or not 0 <= reach <= w * _dot(along, along):
        return False
    return any(along) or not any(arm)


def _subtract(p: Vector, q: Vector) -> Vector:
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


def _dot(u: Vector, v: Vector) -> int:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _cross(u: Vector, v: Vector) -> Vector:
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )
