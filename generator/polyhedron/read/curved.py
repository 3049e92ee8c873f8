"""The CAD kernel's part of reading solids with round faces: facets on common points.

The kernel divides every edge once, into steps of one angle for all circles, so faces meet in
the same points. A planar face becomes a polygon. A cylinder or cone face becomes a run of facets
that unroll if its outline is circles, a straight line, circles, a straight line (all around the
axis the two lines are one seam), or of a cone up to its tip circles and two lines, and both
circles are divided at the same angles. Everything else is taken as the kernel's triangles, which
no symbol stands on. A solid of very many facets is divided more coarsely, and says so. Lengths in
mm, angles in rad.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Any

import numpy as np

from generator.errors import ShapeError
from generator.polyhedron.read.brep import is_line, wires_of
from generator.polyhedron.read.soup import MOST_FACETS
from generator.polyhedron.shapes import CHORD_ERROR_MM, FACETS

SAME = 1e-6  #: share of the size within which lines and circles are what they seem
BLANK_ERROR_MM = 0.1  #: chord error of faces that carry no symbols: half a printed layer
INTERIOR_RAD = 0.35  #: between triangles of faces that carry no symbols
COARSER = (1.0, 2.0, 5.0, 10.0)  #: times the chord errors, until there are few enough facets

_REMAKE = "check the model in a CAD program, make that face anew, and export it again"


@dataclass(slots=True)
class _Found:
    points: list[list[float]] = field(default_factory=list)  #: x, y, z, mm
    faces: list[list[list[int]]] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    surfaces: list[dict[str, Any]] = field(default_factory=list)
    blank: list[int] = field(default_factory=list)  #: faces that cannot be unrolled
    kinds: dict[str, str] = field(default_factory=dict)  #: names of those -> what they are

    def add(self, name: str, loops: list[list[list[int]]]) -> list[int]:
        """Append facets of one face of the solid; return their numbers."""
        first = len(self.faces)
        self.faces += loops
        self.names += [name if k == 0 else f"{name}.{k + 1}" for k in range(len(loops))]
        return list(range(first, len(self.faces)))


def curved_faces(solid: Any, faces: list[Any], kinds: list[str]) -> dict[str, Any]:
    """Return points and facets of a solid with round faces, and which of them unroll.

    `solid` and `faces` are the kernel's, `kinds` what each face is: plane, cylinder, sphere, ...
    Raises `ShapeError` if there are too many facets, or the kernel cannot divide a face.
    """
    counts: list[int] = []
    for coarser in COARSER:
        found = _tessellate(solid, faces, kinds, coarser)
        counts.append(len(found.faces))
        if counts[-1] <= MOST_FACETS:
            break
    else:
        raise ShapeError(
            f"its round faces need {min(counts)} facets, to "
            f"{BLANK_ERROR_MM * COARSER[-1]:g} mm; {MOST_FACETS} are allowed",
            fix="leave out threads, small fillets and other round parts that carry no symbols",
        )
    notes = []
    if coarser > 1.0:
        notes.append(
            f"round faces were divided to {BLANK_ERROR_MM * coarser:g} mm, those with "
            f"symbols to {CHORD_ERROR_MM * coarser:g} mm: finer, they have {counts[-2]} "
            "facets"
        )
    return asdict(found) | {"notes": notes, "error_mm": BLANK_ERROR_MM * coarser}


def _tessellate(solid: Any, faces: list[Any], kinds: list[str], coarser: float) -> _Found:
    """Return all facets at so many times the chord errors."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools
    from OCP.IMeshTools import IMeshTools_Parameters

    step, radius = _step(faces, kinds, coarser)
    limits = IMeshTools_Parameters()
    # On circles of cylinders and cones the angle alone may count, so that those of a cone match.
    limits.Deflection = max(BLANK_ERROR_MM * coarser, 2.0 * radius * (1.0 - math.cos(step / 2.0)))
    limits.DeflectionInterior = limits.Deflection
    limits.Angle = 2.0 * step  # which the kernel halves on edges
    limits.AngleInterior = INTERIOR_RAD * math.sqrt(coarser)
    limits.MinSize = 1e-6
    BRepTools.Clean_s(solid)
    BRepMesh_IncrementalMesh(solid, limits)
    divided: set[int] = set()  # straight edges whose inner points triangles need
    while (found := _gather(faces, kinds, divided)) is None:
        pass  # a face fell back to triangles, so its neighbours must take its points
    return found


def _gather(faces: list[Any], kinds: list[str], divided: set[int]) -> _Found | None:
    """Return all facets; None after `divided` has grown, so that it must be done again."""
    found = _Found()
    nodes = _Nodes(found, divided)
    before = len(divided)
    for number, (face, kind) in enumerate(zip(faces, kinds, strict=True), 1):
        name = f"F{number}"
        try:
            wires = nodes.wires(face)
        except ShapeError as error:
            raise ShapeError(f"{error.cause} {name} ({kind})", fix=error.fix) from None
        if kind == "plane":
            found.add(name, [[_ids(wire) for wire in wires]])
            continue
        run = _run_of(face, kind, wires, found.points) if kind in ("cylinder", "cone") else None
        if run is not None:
            loops, definition = run
            facets = found.add(name, [[loop] for loop in loops])
            found.surfaces.append(definition | {"facets": facets})
        else:
            divided |= nodes.dropped
            found.blank += found.add(name, [[t] for t in nodes.triangles(face)])
            found.kinds[name] = kind
    return found if len(divided) == before else None


def _step(faces: list[Any], kinds: list[str], coarser: float) -> tuple[float, float]:
    """Return the angle between two points of a circle, and the radius of the largest one."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    radii = [1.0]
    for face, kind in zip(faces, kinds, strict=True):
        surface = BRepAdaptor_Surface(face)
        if kind == "cylinder":
            radii.append(surface.Cylinder().Radius())
        elif kind == "cone":
            ends = (surface.FirstVParameter(), surface.LastVParameter())
            sine = math.sin(surface.Cone().SemiAngle())
            radii += [abs(surface.Cone().RefRadius() + v * sine) for v in ends]
    steps = math.pi / math.acos(max(0.0, 1.0 - coarser * CHORD_ERROR_MM / max(radii)))
    fewest = FACETS[0] / math.sqrt(coarser)
    wanted = min(4 * math.ceil(max(steps, fewest) / 4), FACETS[1])
    return 2.0 * math.pi / wanted * (1.0 + 1e-9), max(radii)  # so that a rounding adds no step


def _ids(wire: list[tuple[Any, list[int]]]) -> list[int]:
    return [number for _, numbers in wire for number in numbers[:-1]]


class _Nodes:
    """Points of the kernel's division by number, those of an edge shared by its faces."""

    def __init__(self, found: _Found, divided: set[int]) -> None:
        from OCP.TopTools import TopTools_IndexedMapOfShape

        self.found = found
        self.divided = divided
        self.dropped: set[int] = set()  #: straight edges of the face at work, less inner points
        self.edges = TopTools_IndexedMapOfShape()
        self.vertices = TopTools_IndexedMapOfShape()
        self.on_edge: dict[int, list[int]] = {}
        self.at_vertex: dict[int, int] = {}
        self.of_face: dict[int, int] = {}  #: node of the face at work -> point

    def wires(self, face: Any) -> list[list[tuple[Any, list[int]]]]:
        """Return the wires, outer first: edges in order with their points, material to the left."""
        from OCP.BRep import BRep_Tool
        from OCP.TopLoc import TopLoc_Location

        self.location = TopLoc_Location()
        self.mesh = BRep_Tool.Triangulation_s(face, self.location)
        if self.mesh is None:
            raise ShapeError("the CAD kernel cannot divide face", fix=_REMAKE)
        self.of_face, self.dropped = {}, set()
        found = []
        for wire in wires_of(face):
            edges = [(edge, self._along(edge)) for edge, _ in wire]
            found.append([each for each in edges if not BRep_Tool.Degenerated_s(each[0])])
        return found

    def triangles(self, face: Any) -> list[list[int]]:
        """Return the triangles of the face at work, counter-clockwise from outside."""
        from OCP.TopAbs import TopAbs_REVERSED

        flipped = face.Orientation() == TopAbs_REVERSED
        found = []
        for k in range(1, self.mesh.NbTriangles() + 1):
            a, b, c = (self._point(node) for node in self.mesh.Triangle(k).Get())
            if len({a, b, c}) == 3:
                found.append([a, c, b] if flipped else [a, b, c])
        return found

    def _along(self, edge: Any) -> list[int]:
        """Return the points of an edge in its direction."""
        from OCP.BRep import BRep_Tool
        from OCP.TopAbs import TopAbs_REVERSED
        from OCP.TopExp import TopExp

        polygon = BRep_Tool.PolygonOnTriangulation_s(edge, self.mesh, self.location)
        if polygon is None:
            raise ShapeError("the CAD kernel cannot divide an edge of face", fix=_REMAKE)
        nodes = [polygon.Node(k) for k in range(1, polygon.NbNodes() + 1)]
        key, point = self.edges.Add(edge), BRep_Tool.Degenerated_s(edge)
        if len(nodes) > 2 and key not in self.divided and not point and is_line(edge):
            nodes = [nodes[0], nodes[-1]]
            self.dropped.add(key)
        numbers = self.on_edge.get(key)
        if numbers is None:
            start = self._vertex(TopExp.FirstVertex_s(edge))
            end = self._vertex(TopExp.LastVertex_s(edge))
            if point:
                numbers = [start] * len(nodes)
            else:
                numbers = [start, *(self._new(node) for node in nodes[1:-1]), end]
            self.on_edge[key] = numbers
        self.of_face |= dict(zip(nodes, numbers, strict=True))
        return numbers[::-1] if edge.Orientation() == TopAbs_REVERSED else numbers

    def _vertex(self, vertex: Any) -> int:
        from OCP.BRep import BRep_Tool

        key = self.vertices.Add(vertex)
        if key not in self.at_vertex:
            self.at_vertex[key] = self._add(BRep_Tool.Pnt_s(vertex))
        return self.at_vertex[key]

    def _new(self, node: int) -> int:
        return self._add(self.mesh.Node(node).Transformed(self.location.Transformation()))

    def _add(self, point: Any) -> int:
        self.found.points.append([point.X(), point.Y(), point.Z()])
        return len(self.found.points) - 1

    def _point(self, node: int) -> int:
        if node not in self.of_face:
            self.of_face[node] = self._new(node)
        return self.of_face[node]


def _run_of(
    face: Any, kind: str, wires: list[list[tuple[Any, list[int]]]], points: list[Any]
) -> tuple[list[list[int]], dict[str, Any]] | None:
    """Return the facets of a cylinder or cone between two circles; None for any other outline."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    if len(wires) != 1:
        return None
    surface = BRepAdaptor_Surface(face)
    shape = surface.Cylinder() if kind == "cylinder" else surface.Cone()
    axis = shape.Axis()
    origin = np.array([axis.Location().X(), axis.Location().Y(), axis.Location().Z()])
    ahead = np.array([axis.Direction().X(), axis.Direction().Y(), axis.Direction().Z()])
    where = np.array(points)
    sides = [_side(numbers, where[numbers] - origin, ahead) for _, numbers in wires[0]]
    chains = _two_chains(sides)
    if chains is None:
        return None
    low, high = chains
    angles = [_angles(where[chain] - origin, ahead) for chain in (low, high) if len(chain) > 1]
    if len(angles) == 2 and (
        len(low) != len(high) or np.abs(angles[0] - angles[1]).max() > math.radians(0.01)
    ):
        return None
    pairs = list(zip(low, high if len(high) > 1 else high * len(low), strict=True))
    loops = [[a, b, d, c] if c != d else [a, b, c] for (a, c), (b, d) in pairwise(pairs)]
    chosen = where[[*low, *high]] - origin
    reach = np.linalg.norm(chosen - (chosen @ ahead)[:, None] * ahead, axis=1).max()
    turn = float(np.abs(np.diff(angles[0])).max())
    corners = where[loops[0]] - origin
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    middle = corners[:2].mean(axis=0)
    return loops, {
        "kind": kind,
        "radius_mm": float(reach),
        "half_angle_rad": abs(float(shape.SemiAngle())) if kind == "cone" else 0.0,
        "closed": low[0] == low[-1],
        "concave": bool(normal @ (middle - (middle @ ahead) * ahead) < 0.0),
        "chord_error_mm": float(reach * (1.0 - math.cos(turn / 2.0))),
    }


Side = tuple[str, list[int]]  #: circle, line, other; its points, in order around the face


def _side(numbers: list[int], place: Any, ahead: Any) -> Side:
    """Return what an edge of a round face is; `place` (k, 3) from a point of the axis `ahead`."""
    height = place @ ahead
    radial = place - height[:, None] * ahead
    radius = np.linalg.norm(radial, axis=1)
    slack = SAME * max(1.0, float(np.abs(place).max()))
    if len(numbers) > 2 and np.ptp(height) <= slack and np.ptp(radius) <= slack:
        return "circle", numbers
    if len(numbers) == 2 and _is_upright(radial, radius):
        return "line", numbers
    return "other", numbers


def _is_upright(radial: Any, radius: Any) -> bool:
    """Whether both ends of a straight edge lie on one side of the axis; the tip counts."""
    if radius.min() <= SAME * radius.max():
        return True
    cosine = float(radial[0] @ radial[1]) / float(radius[0] * radius[1])
    return cosine > 1.0 - 1e-9


def _two_chains(sides: list[Side]) -> tuple[list[int], list[int]] | None:
    """Return the points below and above, both to the right; None for another outline.

    The outline is circles, a line, circles, a line; or, of a cone up to its tip, circles and two
    lines.
    """
    kinds = [kind for kind, _ in sides]
    starts = [k for k, kind in enumerate(kinds) if kind == "circle" and kinds[k - 1] == "line"]
    if not starts:
        return None
    sides = sides[starts[0] :] + sides[: starts[0]]
    runs = [(kind, [own for _, own in same]) for kind, same in groupby(sides, key=itemgetter(0))]
    shape = [kind if kind == "circle" else f"{len(same)} {kind}" for kind, same in runs]
    below = _join_chains(runs[0][1])
    if shape == ["circle", "1 line", "circle", "1 line"]:
        return below, _join_chains(runs[2][1])[::-1]
    if shape == ["circle", "2 line"]:
        return below, [runs[1][1][0][-1]]
    return None


def _join_chains(chains: list[list[int]]) -> list[int]:
    return [*(number for chain in chains for number in chain[:-1]), chains[-1][-1]]


def _angles(place: Any, ahead: Any) -> Any:
    """Return the angles of points about the axis, without jumps."""
    radial = place - (place @ ahead)[:, None] * ahead
    x = radial[0] / np.linalg.norm(radial[0])
    y = np.cross(ahead, x)
    return np.unwrap(np.arctan2(radial @ y, radial @ x))
