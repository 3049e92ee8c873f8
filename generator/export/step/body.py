"""The plain body in STEP: its points and straight edges, its facets as planes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.export.step.entities import (
    PLACES,
    Entities,
    reference_list,
    step_string,
    triple,
    unit,
)
from generator.solid.part import Part


class StepBody:
    """The plain body: its points and edges, and the bounds of each facet so far."""

    def __init__(self, part: Part, entities: Entities) -> None:
        self.part = part
        self.entities = entities
        self.vertices = np.round(part.vertices, PLACES)
        self.points = [
            entities.add(f"CARTESIAN_POINT('',{triple(vertex, PLACES)})")
            for vertex in self.vertices
        ]
        self.corners = [entities.add(f"VERTEX_POINT('',{point})") for point in self.points]
        self.edges: dict[tuple[int, int], str] = {}
        self.bounds = [
            [
                self._bound(loop, "FACE_BOUND" if i else "FACE_OUTER_BOUND")
                for i, loop in enumerate(facet.loops)
            ]
            for facet in part.facets
        ]

    def faces(self) -> NDArray[np.int64]:
        """Write the facets, with all footprints cut out; return their numbers."""
        numbers = []
        add, direction = self.entities.add, self.entities.direction
        for facet, bounds in zip(self.part.facets, self.bounds, strict=True):
            corners = self.vertices[list(facet.loops[0])]
            following = np.roll(corners, -1, axis=0)
            normal = unit(np.cross(corners - corners[0], following - corners[0]).sum(axis=0))
            longest = int(np.argmax(np.linalg.norm(following - corners, axis=1)))
            along = unit(following[longest] - corners[longest])
            placement = add(
                f"AXIS2_PLACEMENT_3D('',{self.points[facet.loops[0][0]]},"
                f"{direction(normal)},{direction(along)})"
            )
            plane = add(f"PLANE('',{placement})")
            numbers.append(self.entities.next)
            add(
                f"ADVANCED_FACE('{step_string(facet.name)}',({reference_list(bounds)}),{plane},.T.)"
            )
        return np.array(numbers, np.int64)

    def _bound(self, loop: tuple[int, ...], kind: str) -> str:
        add = self.entities.add
        oriented = [
            add(f"ORIENTED_EDGE('',*,*,{self._edge(start, end)},.{'T' if start < end else 'F'}.)")
            for start, end in zip(loop, (*loop[1:], loop[0]), strict=True)
        ]
        edge_loop = add(f"EDGE_LOOP('',({reference_list(oriented)}))")
        return add(f"{kind}('',{edge_loop},.T.)")

    def _edge(self, start: int, end: int) -> str:
        low, high = min(start, end), max(start, end)
        edge = self.edges.get((low, high))
        if edge is None:
            add = self.entities.add
            along = self.entities.vector(unit(self.vertices[high] - self.vertices[low]))
            line = add(f"LINE('',{self.points[low]},{along})")
            edge = add(f"EDGE_CURVE('',{self.corners[low]},{self.corners[high]},{line},.T.)")
            self.edges[low, high] = edge
        return edge
