"""Round faces in STEP: cylinders and cones with the symbols on them.

A face is bounded by two arcs and two straight lines (all around: one seam), and by the feet of
its symbols. A foot or top is bounded by Bezier curves, or lines where it is straight;
tops lie on the face moved outward, and sides are ruled between two curves. Lengths in mm.
ISO 10303-42 (geometry): CYLINDRICAL_SURFACE, CONICAL_SURFACE, B_SPLINE_SURFACE_WITH_KNOTS.
"""

from __future__ import annotations

import math

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


class _RoundSymbol:
    def __init__(self, on: _RoundFace, symbol: BentSymbol) -> None:
        self.on, self.symbol = on, symbol
        self.file, self.add = on.file, on.file.add
        T = on.face.T_part_axis
        self.places = [
            [[np.round(transform(T, edge), _PLACES) for edge in ring] for ring in tier]
            for tier in symbol.rings
        ]
        self.points = [
            [[on.file.point(edge[0], _PLACES) for edge in ring] for ring in tier]
            for tier in self.places
        ]
        self.corners = [
            [[self.add(f"VERTEX_POINT('',{point})") for point in ring] for ring in tier]
            for tier in self.points
        ]
        self.controls: dict[tuple[int, int, int], tuple[str, ...]] = {}
        self.edges = [
            [[self.curve(t, r, k) for k in range(len(ring))] for r, ring in enumerate(tier)]
            for t, tier in enumerate(self.places)
        ]
        self.name = step_string(f"{on.face.name}/{symbol.name}")

    def write(self) -> None:
        """Write sides, top and what of the face is inside; note the foot as a bound of it."""
        on, heights = self.on, self.symbol.z_mm
        foot, *holes = range(len(self.edges[0]))
        on.bounds.append(self.ring(0, foot, forward=False, kind="FACE_BOUND"))
        for hole in holes:
            outline = self.ring(0, hole, forward=False, kind="FACE_OUTER_BOUND")
            on.add_face([outline], heights[0], f"{self.name}/inside")
        for tier in range(len(heights) - 1):
            for ring in range(len(self.edges[0])):
                self.sides(tier, ring)
        bounds = [
            self.ring(-1, ring, forward=True, kind="FACE_BOUND" if ring else "FACE_OUTER_BOUND")
            for ring in range(len(self.edges[-1]))
        ]
        self.colour(on.add_face(bounds, heights[-1], f"{self.name}/top"))

    def sides(self, tier: int, ring: int) -> None:
        low, high = self.edges[tier][ring], self.edges[tier + 1][ring]
        risers = []
        for k in range(len(low)):
            a, b = self.places[tier][ring][k][0], self.places[tier + 1][ring][k][0]
            along = self.file.vector(unit(b - a))
            line = self.add(f"LINE('',{self.points[tier][ring][k]},{along})")
            ends = f"{self.corners[tier][ring][k]},{self.corners[tier + 1][ring][k]}"
            risers.append(self.add(f"EDGE_CURVE('',{ends},{line},.T.)"))
        for k in range(len(low)):
            j = (k + 1) % len(low)
            edges = [
                self.file.oriented(edge, forward=forward)
                for edge, forward in (
                    (low[k], True), (risers[j], True), (high[k], False), (risers[k], False)
                )
            ]  # fmt: skip
            bound = self.file.bound(edges, "FACE_OUTER_BOUND")
            surface = self.side_surface(tier, ring, k)
            self.colour(self.on.add_any_face([bound], surface, f"{self.name}/side"))

    def side_surface(self, tier: int, ring: int, k: int) -> str:
        """Return the plane, or the ruled surface, of a side."""
        below, above = (tier, ring, k), (tier + 1, ring, k)
        j = (k + 1) % len(self.edges[tier][ring])
        a, b = self.places[tier][ring][k][0], self.places[tier][ring][j][0]
        d, c = self.places[tier + 1][ring][k][0], self.places[tier + 1][ring][j][0]
        if below not in self.controls and above not in self.controls:
            normal = unit(np.cross(c - a, d - b))
            if (
                abs(float((b - a) @ normal)) < _PLANAR_MM
                and abs(float((c - a) @ normal)) < _PLANAR_MM
            ):
                at = self.points[tier][ring][k]
                placement = self.file.placement(at, normal, unit(b - a))
                return self.add(f"PLANE('',{placement})")
        rows = list(zip(self.control_points(*below), self.control_points(*above), strict=True))
        grid = ",".join(f"({low},{high})" for low, high in rows)
        n = len(rows)
        return self.add(
            f"B_SPLINE_SURFACE_WITH_KNOTS('',{n - 1},1,({grid}),.RULED_SURF.,.F.,.F.,.F.,"
            f"({n},{n}),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)"
        )

    def control_points(self, tier: int, ring: int, k: int) -> tuple[str, ...]:
        inner = self.controls.get((tier, ring, k))
        points = self.points[tier][ring]
        if inner is None:
            inner = tuple(
                self.file.point(place, _PLACES) for place in self.places[tier][ring][k][1:]
            )
        return (points[k], *inner, points[(k + 1) % len(points)])

    def curve(self, tier: int, ring: int, k: int) -> str:
        """Return the edge from one corner to the next."""
        own = self.places[tier][ring]
        j = (k + 1) % len(own)
        a, b = own[k][0], own[j][0]
        off = np.linalg.norm(np.cross(own[k][1:] - a, unit(b - a)), axis=1)
        ends = f"{self.corners[tier][ring][k]},{self.corners[tier][ring][j]}"
        if off.max() < _STRAIGHT_MM:
            line = f"LINE('',{self.points[tier][ring][k]},{self.file.vector(unit(b - a))})"
            return self.add(f"EDGE_CURVE('',{ends},{self.add(line)},.T.)")
        self.controls[tier, ring, k] = tuple(self.file.point(p, _PLACES) for p in own[k][1:])
        through = self.control_points(tier, ring, k)
        n = len(through)
        spline = self.add(
            f"B_SPLINE_CURVE_WITH_KNOTS('',{n - 1},({','.join(through)}),.UNSPECIFIED.,.F.,.F.,"
            f"({n},{n}),(0.,1.),.UNSPECIFIED.)"
        )
        return self.add(f"EDGE_CURVE('',{ends},{spline},.T.)")

    def ring(self, tier: int, ring: int, *, forward: bool, kind: str) -> str:
        edges = self.edges[tier][ring]
        order = edges if forward else edges[::-1]
        return self.file.bound([self.file.oriented(edge, forward=forward) for edge in order], kind)

    def colour(self, face: int) -> None:
        self.on.coloured.append(self.file.next)
        self.add(f"STYLED_ITEM('',({self.on.style}),#{face})")
