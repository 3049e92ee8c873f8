"""The plain body in STEP: points, edges, planar facets, and rims of round faces as arcs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from generator.export.step.entities import (
    PLACES,
    Entities,
    reference_list,
    step_string,
    unit,
)
from generator.solid.part import AnalyticFace, Part, Rim


class StepBody:
    """Points and edges so far, and the bounds of each facet that is written as a plane."""

    def __init__(self, part: Part, entities: Entities) -> None:
        self.part = part
        self.entities = entities
        self.vertices = np.round(part.vertices, PLACES)
        self.rims: dict[tuple[int, int], tuple[AnalyticFace, Rim]] = {}
        self.arcs: dict[tuple[int, ...], str] = {}
        curved: set[int] = set()
        for face in part.analytic:
            curved.update(face.facets)
            self._note_rims(face)
        self.planar = [k for k in range(len(part.facets)) if k not in curved]
        self.points: dict[int, str] = {}
        self.corners: dict[int, str] = {}
        for vertex in self._used():
            self.points[vertex] = entities.point(self.vertices[vertex])
        for vertex, point in self.points.items():
            self.corners[vertex] = entities.add(f"VERTEX_POINT('',{point})")
        self.edges: dict[tuple[int, int], str] = {}
        self.bounds = {
            facet: [
                self._bound(loop, "FACE_BOUND" if i else "FACE_OUTER_BOUND")
                for i, loop in enumerate(part.facets[facet].loops)
            ]
            for facet in self.planar
        }

    def faces(self) -> NDArray[np.int64]:
        """Write the planar facets, with all footprints cut out; return their numbers."""
        numbers = []
        add = self.entities.add
        for number in self.planar:
            facet = self.part.facets[number]
            corners = self.vertices[list(facet.loops[0])]
            following = np.roll(corners, -1, axis=0)
            normal = unit(np.cross(corners - corners[0], following - corners[0]).sum(axis=0))
            longest = int(np.argmax(np.linalg.norm(following - corners, axis=1)))
            along = unit(following[longest] - corners[longest])
            placement = self.entities.placement(self._on(facet.loops[0]), normal, along)
            plane = add(f"PLANE('',{placement})")
            numbers.append(self.entities.next)
            bounds = reference_list(self.bounds[number])
            add(f"ADVANCED_FACE('{step_string(facet.name)}',({bounds}),{plane},.T.)")
        return np.array(numbers, np.int64)

    def line(self, start: int, end: int) -> str:
        """Return the oriented straight edge from one vertex to another; it is written once."""
        low, high = min(start, end), max(start, end)
        add = self.entities.add
        edge = self.edges.get((low, high))
        if edge is None:
            along = self.entities.vector(unit(self.vertices[high] - self.vertices[low]))
            line = add(f"LINE('',{self.points[low]},{along})")
            edge = add(f"EDGE_CURVE('',{self.corners[low]},{self.corners[high]},{line},.T.)")
            self.edges[low, high] = edge
        return self.entities.oriented(edge, forward=start < end)

    def arc(self, face: AnalyticFace, rim: Rim, *, forward: bool) -> str:
        """Return the oriented arc of a rim, forward: to the right on its face."""
        add = self.entities.add
        edge = self.arcs.get(rim.vertices)
        if edge is None:
            T = face.T_part_axis
            centre = np.round(T[:3, 3] + rim.height_mm * T[:3, 2], PLACES)
            placement = self.entities.placement(self.entities.point(centre), T[:3, 2], T[:3, 0])
            circle = add(f"CIRCLE('',{placement},{rim.radius_mm:.{PLACES}f})")
            ends = f"{self.corners[rim.vertices[0]]},{self.corners[rim.vertices[-1]]}"
            sense = "T" if face.angle_rad > 0 else "F"
            edge = add(f"EDGE_CURVE('',{ends},{circle},.{sense}.)")
            self.arcs[rim.vertices] = edge
        return self.entities.oriented(edge, forward=forward)

    def rim_edge(self, rim: Rim, *, forward: bool) -> str:
        """Return the oriented arc of a rim, forward: to the right on the face that it is of."""
        face, shared = self.rims[rim.vertices[0], rim.vertices[1]]
        same = shared.vertices[:2] == rim.vertices[:2]
        return self.arc(face, shared, forward=forward == same)

    def _note_rims(self, face: AnalyticFace) -> None:
        """Note the arcs of a face by their steps; one that two faces share, as the first has it.

        Closed rims begin at a vertex on the round face, where a strip's vertex may stand off it.
        """
        T = face.T_part_axis
        for rim in (face.low, face.high):
            if face.closed or rim.radius_mm == 0.0:
                at = T[:3, 3] + rim.radius_mm * T[:3, 0] + rim.height_mm * T[:3, 2]
                self.vertices[rim.vertices[0]] = np.round(at, PLACES)
            if rim.radius_mm == 0.0 or rim.vertices[:2] in self.rims:
                continue
            for start, end in pairwise(rim.vertices):
                self.rims[start, end] = self.rims[end, start] = (face, rim)

    def _used(self) -> list[int]:
        used = {end for face in self.part.analytic for rim in (face.low, face.high)
                for end in (rim.vertices[0], rim.vertices[-1])}  # fmt: skip
        for facet in self.planar:
            for loop in self.part.facets[facet].loops:
                for start, end in pairwise((*loop, loop[0])):
                    if (start, end) not in self.rims:
                        used |= {start, end}
        return sorted(used)

    def _on(self, loop: tuple[int, ...]) -> str:
        return next(self.points[vertex] for vertex in loop if vertex in self.points)

    def _bound(self, loop: tuple[int, ...], kind: str) -> str:
        """Write a loop: straight edges, and each arc once for all its steps."""
        steps = list(pairwise((*loop, loop[0])))
        held = [self.rims.get(step) for step in steps]
        oriented = []
        for step, rim in zip(steps, held, strict=True):
            if rim is None:
                oriented.append(self.line(*step))
            elif step in ((v := rim[1].vertices)[:2], v[-1:] + v[-2:-1]):
                oriented.append(self.arc(*rim, forward=step == v[:2]))
        return self.entities.bound(oriented, kind)
