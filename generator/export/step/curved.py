"""Round faces in STEP: cylinders and cones with the symbols on them.

A face is bounded by two arcs and two straight lines (all around: one seam), and by the feet of
its symbols. A foot or top is bounded by Bezier curves, or lines where it is straight;
tops lie on the face moved outward, and sides are ruled between two curves. Lengths in mm.
ISO 10303-42 (geometry): CYLINDRICAL_SURFACE, CONICAL_SURFACE, B_SPLINE_SURFACE_WITH_KNOTS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain, pairwise

import numpy as np
from numpy.typing import NDArray

from generator.export.step.body import StepBody
from generator.export.step.entities import (
    PLACES,
    Entities,
    reference_list,
    step_string,
    unit,
)
from generator.solid.part import AnalyticFace, BentSymbol, transform

Points = NDArray[np.float64]

_STRAIGHT_MM = 1e-7  #: control points this near to a line are one
_PLANAR_MM = 2e-7  #: sides this near to a plane are planes: roundings of four corners
_PLACES = 7  #: decimals of a symbol's coordinates in mm: the kernel's own precision


def write_round_faces(
    body: StepBody, entities: Entities, style: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Write all round faces of a part; return the numbers of faces and of styled items."""
    faces: list[int] = []
    coloured: list[int] = []
    for face in body.part.analytic:
        writer = _RoundFace(face, body, entities, style)
        writer.write()
        faces += writer.faces
        coloured += writer.coloured
    return np.array(faces, np.int64), np.array(coloured, np.int64)


def round_entities(face: AnalyticFace) -> int:
    """Return a bound on the entities of a round face."""
    corners = sum(len(ring) for s in face.symbols for tier in s.rings for ring in tier)
    return 100 + 40 * corners


class _RoundFace:
    def __init__(self, face: AnalyticFace, body: StepBody, entities: Entities, style: str) -> None:
        self.face, self.body, self.style = face, body, style
        self.file = entities
        self.surfaces: dict[float, str] = {}
        self.faces: list[int] = []
        self.coloured: list[int] = []
        self.bounds: list[str] = []

    def write(self) -> None:
        """Write the face, its symbols first."""
        face, body = self.face, self.body
        low, high = face.low, face.high
        edges = [body.rim_edge(low, forward=True), body.line(low.vertices[-1], high.vertices[-1])]
        if high.radius_mm > 0.0:
            edges.append(body.rim_edge(high, forward=False))
        edges.append(body.line(high.vertices[0], low.vertices[0]))
        own = self.file.bound(edges, "FACE_OUTER_BOUND")
        for symbol in face.symbols:
            _RoundSymbol(self, symbol).write()
        self.add_face([own, *self.bounds], 0.0, step_string(face.name))

    def add_face(self, bounds: list[str], z_mm: float, name: str) -> int:
        """Write a face on the surface moved outward by z."""
        sense = "F" if self.face.concave else "T"
        return self.add_any_face(bounds, self.surface(z_mm), name, sense)

    def add_any_face(self, bounds: list[str], surface: str, name: str, sense: str = "T") -> int:
        """Write a face; return its number."""
        number = self.file.next
        self.file.add(f"ADVANCED_FACE('{name}',({reference_list(bounds)}),{surface},.{sense}.)")
        self.faces.append(number)
        return number

    def surface(self, z_mm: float) -> str:
        found = self.surfaces.get(z_mm)
        if found is None:
            face, add = self.face, self.file.add
            T = face.T_part_axis
            point = self.file.point(np.round(T[:3, 3], PLACES))
            widening = T[:3, 2] if face.slope >= 0.0 else -T[:3, 2]
            placement = self.file.placement(point, widening, T[:3, 0])
            (at_origin,) = face.radius_at(np.zeros(1), np.array([z_mm])).tolist()
            radius = f"{at_origin:.{PLACES}f}"
            if face.slope == 0.0:
                found = add(f"CYLINDRICAL_SURFACE('',{placement},{radius})")
            else:
                angle = f"{math.atan(abs(face.slope)):.13f}"
                found = add(f"CONICAL_SURFACE('',{placement},{radius},{angle})")
            self.surfaces[z_mm] = found
        return found


@dataclass(slots=True)
class _Corner:
    """A corner of one ring of a symbol, and the edge from it to the next corner."""

    places: Points  #: (n, 3) mm, part frame: the corner, then the inner control points of the edge
    point: str = ""
    vertex: str = ""
    edge: str = ""
    inner: tuple[str, ...] = ()  #: control points of a bent edge


class _RoundSymbol:
    def __init__(self, on: _RoundFace, symbol: BentSymbol) -> None:
        self.on, self.symbol = on, symbol
        self.file, self.add = on.file, on.file.add
        T = on.face.T_part_axis
        self.tiers = [
            [[_Corner(np.round(transform(T, edge), _PLACES)) for edge in ring] for ring in tier]
            for tier in symbol.rings
        ]
        rings = [ring for tier in self.tiers for ring in tier]
        for corner in chain(*rings):
            corner.point = self.file.point(corner.places[0], _PLACES)
        for corner in chain(*rings):
            corner.vertex = self.add(f"VERTEX_POINT('',{corner.point})")
        for ring in rings:
            for corner, following in zip(ring, ring[1:] + ring[:1], strict=True):
                self.draw_edge(corner, following)
        self.name = step_string(f"{on.face.name}/{symbol.name}")

    def write(self) -> None:
        """Write sides, top and what of the face is inside; note the foot as a bound of it."""
        on, heights = self.on, self.symbol.z_mm
        foot, *holes = self.tiers[0]
        on.bounds.append(self.ring(foot, forward=False, kind="FACE_BOUND"))
        for hole in holes:
            outline = self.ring(hole, forward=False, kind="FACE_OUTER_BOUND")
            on.add_face([outline], heights[0], f"{self.name}/inside")
        for below, above in pairwise(self.tiers):
            for low, high in zip(below, above, strict=True):
                self.sides(low, high)
        bounds = [
            self.ring(ring, forward=True, kind="FACE_BOUND" if k else "FACE_OUTER_BOUND")
            for k, ring in enumerate(self.tiers[-1])
        ]
        self.colour(on.add_face(bounds, heights[-1], f"{self.name}/top"))

    def sides(self, low: list[_Corner], high: list[_Corner]) -> None:
        """Write the sides between two rings."""
        risers = []
        for a, d in zip(low, high, strict=True):
            along = self.file.vector(unit(d.places[0] - a.places[0]))
            line = self.add(f"LINE('',{a.point},{along})")
            risers.append(self.add(f"EDGE_CURVE('',{a.vertex},{d.vertex},{line},.T.)"))
        for k in range(len(low)):
            j = (k + 1) % len(low)
            a, b, c, d = low[k], low[j], high[j], high[k]
            edges = [
                self.file.oriented(edge, forward=forward)
                for edge, forward in (
                    (a.edge, True), (risers[j], True), (d.edge, False), (risers[k], False)
                )
            ]  # fmt: skip
            bound = self.file.bound(edges, "FACE_OUTER_BOUND")
            surface = self.side_surface(a, b, c, d)
            self.colour(self.on.add_any_face([bound], surface, f"{self.name}/side"))

    def side_surface(self, a: _Corner, b: _Corner, c: _Corner, d: _Corner) -> str:
        """Return the plane, or the ruled surface, of a side: a to b is below, d to c above."""
        if not a.inner and not d.inner:
            p, q, r, s = (corner.places[0] for corner in (a, b, c, d))
            normal = unit(np.cross(r - p, s - q))
            if max(abs(float((q - p) @ normal)), abs(float((r - p) @ normal))) < _PLANAR_MM:
                return self.add(f"PLANE('',{self.file.placement(a.point, normal, unit(q - p))})")
        rows = list(zip(self.control_points(a, b), self.control_points(d, c), strict=True))
        grid = ",".join(f"({low},{high})" for low, high in rows)
        n = len(rows)
        return self.add(
            f"B_SPLINE_SURFACE_WITH_KNOTS('',{n - 1},1,({grid}),.RULED_SURF.,.F.,.F.,.F.,"
            f"({n},{n}),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)"
        )

    def control_points(self, corner: _Corner, following: _Corner) -> tuple[str, ...]:
        inner = corner.inner or [self.file.point(place, _PLACES) for place in corner.places[1:]]
        return (corner.point, *inner, following.point)

    def draw_edge(self, corner: _Corner, following: _Corner) -> None:
        """Write the edge from one corner to the next."""
        a, b = corner.places[0], following.places[0]
        off = np.linalg.norm(np.cross(corner.places[1:] - a, unit(b - a)), axis=1)
        if off.max() < _STRAIGHT_MM:
            curve = self.add(f"LINE('',{corner.point},{self.file.vector(unit(b - a))})")
        else:
            corner.inner = tuple(self.file.point(p, _PLACES) for p in corner.places[1:])
            through = self.control_points(corner, following)
            n = len(through)
            curve = self.add(
                f"B_SPLINE_CURVE_WITH_KNOTS('',{n - 1},({','.join(through)}),.UNSPECIFIED.,.F.,"
                f".F.,({n},{n}),(0.,1.),.UNSPECIFIED.)"
            )
        ends = f"{corner.vertex},{following.vertex}"
        corner.edge = self.add(f"EDGE_CURVE('',{ends},{curve},.T.)")

    def ring(self, ring: list[_Corner], *, forward: bool, kind: str) -> str:
        order = ring if forward else ring[::-1]
        edges = [self.file.oriented(corner.edge, forward=forward) for corner in order]
        return self.file.bound(edges, kind)

    def colour(self, face: int) -> None:
        self.on.coloured.append(self.file.next)
        self.add(f"STYLED_ITEM('',({self.on.style}),#{face})")
