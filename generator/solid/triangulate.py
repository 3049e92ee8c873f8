"""Part -> triangles, without a boolean.

Each symbol is triangulated once inside its own lattice square and stamped; what is left of
the facet, the polygon less the union of these squares, is triangulated once in the frame
of the lattice. Neighbouring squares share their corners by number, so nothing is welded
by distance. A symbol whose square does not lie inside its facet, or that stands on no
lattice, cuts its foot out of the facet instead. Points on a line are kept everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import face_vector
from generator.solid.emboss import to_part, turn
from generator.solid.frame import in_frame, plane_frame
from generator.solid.lattice import Squares, squares_of
from generator.solid.part import Embossing, Facet, Part
from generator.solid.polygon import triangulate_rings
from generator.solid.settings import EMBOSS
from generator.solid.template import SymbolSolid, closed_template, template_of

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Mesh:
    """A triangle mesh; a vertex is shared by number."""

    vertices: NDArray[np.float64]  #: (N, 3) mm, part frame
    triangles: Index  #: (M, 3) vertices, counter-clockwise from outside
    facets: Index  #: (M,) facet of the part that a triangle lies in or stands on
    embossings: Index  #: (M,) embossing that a triangle belongs to, -1 for the body
    symbols: Index  #: (M,) symbol within that embossing, -1 for the body


def triangles(part: Part) -> Mesh:
    """Return the closed mesh of a part with everything that is embossed or engraved.

    Raises
    ------
    SolidError
        If a facet cannot be triangulated because its loops or feet overlap.
    """
    builder = _MeshBuilder(part)
    for facet in range(len(part.facets)):
        builder.facet(facet)
    return builder.mesh()


def body_mesh(part: Part) -> Mesh:
    """Return the mesh of the body alone: no symbols; marks such as edge numbers stay."""
    marks = tuple(embossing for embossing in part.embossings if embossing.face is None)
    facets = list(part.facets)
    for wrapped in reversed(part.wrapped):
        facets[wrapped.first : wrapped.first + len(wrapped.symbols)] = wrapped.feet
    return triangles(replace(part, facets=tuple(facets), embossings=marks, wrapped=()))


def symbol_meshes(part: Part) -> tuple[Mesh, ...]:
    """Return, for each face's embossing, its symbols as closed solids that stand on the body.

    Embossing numbers in the meshes are those of the part.
    """
    meshes = []
    for number, embossing in enumerate(part.embossings):
        if embossing.face is not None:
            builder = _MeshBuilder(part, body=False)
            builder.symbols(number, None, closed=True)
            meshes.append(builder.mesh())
    for wrapped in part.wrapped:
        own = part.facets[wrapped.first : wrapped.first + len(wrapped.symbols)]
        feet = tuple(
            Facet(foot.name, tuple(loop[::-1] for loop in foot.loops)) for foot in wrapped.feet
        )
        meshes.append(triangles(replace(part, facets=own + feet, embossings=(), wrapped=())))
    return tuple(meshes)


class _MeshBuilder:
    """Vertices and triangles so far."""

    def __init__(self, part: Part, *, body: bool = True) -> None:
        self.part = part
        self.points = [part.vertices] if body else []
        self.count = len(part.vertices) if body else 0
        self.found: list[tuple[Index, int, int, Index | None]] = []
        self.on: dict[int, list[int]] = {}
        for number, embossing in enumerate(part.embossings):
            self.on.setdefault(embossing.facet, []).append(number)

    def add_points(self, points: NDArray[np.float64]) -> int:
        """Append (k, 3) points; return the number of the first."""
        first = self.count
        self.points.append(points)
        self.count += len(points)
        return first

    def facet(self, facet: int) -> None:
        """Triangulate a facet and all that stands on it."""
        plain = self.part.facets[facet].loops
        if len(plain) == 1 and len(plain[0]) == 3 and facet not in self.on:
            self.found.append((np.array(plain, dtype=np.int64), facet, -1, None))
            return
        loops = [np.array(loop, dtype=np.int64) for loop in plain]
        numbers = self.on.get(facet, [])
        corners = [self.part.vertices[loop] for loop in loops]
        if numbers:
            first = self.part.embossings[numbers[0]]
            T, R = first.T_part_facet, turn(first.rotation_rad)
        else:
            along = corners[0][1] - corners[0][0]
            T, R = plane_frame(corners[0][0], along, face_vector(corners)), np.eye(2)
        rings = [in_frame(T, corner)[:, :2] @ R for corner in corners]
        for number in numbers:
            squares = None
            if len(numbers) == 1:
                squares = squares_of(self.part.embossings[number], rings)
            for ring, ids in self.symbols(number, squares):
                rings.append(in_frame(T, ring)[:, :2] @ R)
                loops.append(ids)
            if squares is not None:
                for hole in squares.outline:
                    rings.append(squares.points[hole])
                    loops.append(squares.first + hole)
        name = self.part.facets[facet].name
        # On a round face what was a straight line bends a little: rounding could turn triangles
        # along it that are not quite flat.
        share = EMBOSS.bent_flat if "/" in name else EMBOSS.flat
        found = triangulate_rings(rings, np.concatenate(loops), name, share)
        self.found.append((found, facet, -1, None))

    def symbols(
        self, number: int, squares: Squares | None, *, closed: bool = False
    ) -> list[tuple[NDArray[np.float64], Index]]:
        """Stamp the symbols of an embossing; return the loops that cut the facet: points, ids."""
        embossing = self.part.embossings[number]
        R = turn(embossing.rotation_rad)
        cuts: list[tuple[NDArray[np.float64], Index]] = []
        in_square = np.zeros(len(embossing.labels), dtype=np.bool_)
        if squares is not None:
            in_square = squares.full
            squares.first = self.add_points(to_part(embossing, squares.points @ R.T, 0.0))
        for label in np.unique(embossing.labels).tolist():
            for square in (True, False):
                chosen = np.flatnonzero((embossing.labels == label) & (in_square == square))
                if not len(chosen):
                    continue
                pitch = embossing.pitch_mm if square else 0.0
                template = self._template(embossing, label, pitch, closed)
                ids = self._stamp(embossing, template, chosen)
                if square and squares is not None:
                    shared = squares.first + squares.corners[chosen]
                    base = np.concatenate([shared, ids], axis=1)[:, template.base]
                    self.found.append((base.reshape(-1, 3), embossing.facet, -1, None))
                elif not closed:
                    points = self.points[-1].reshape(len(chosen), -1, 3)
                    for ring in template.foot:
                        cuts += [
                            (points[k][ring[::-1]], ids[k][ring[::-1]]) for k in range(len(chosen))
                        ]
                own = ids[:, template.own].reshape(-1, 3)
                owner = np.repeat(chosen, len(template.own))
                self.found.append((own, embossing.facet, number, owner))
        return cuts

    def mesh(self) -> Mesh:
        """Put everything together."""
        sizes = [len(found) for found, *_ in self.found]
        none = np.zeros((0, 3))
        return Mesh(
            vertices=np.concatenate([none, *self.points]),
            triangles=np.concatenate([none.astype(np.int64), *(found for found, *_ in self.found)]),
            facets=np.repeat(np.array([f for _, f, _, _ in self.found], dtype=np.int64), sizes),
            embossings=np.repeat(
                np.array([number for _, _, number, _ in self.found], dtype=np.int64), sizes
            ),
            symbols=np.concatenate(
                [
                    np.zeros(0, dtype=np.int64),
                    *(
                        np.full(size, -1, dtype=np.int64) if owner is None else owner
                        for size, (_, _, _, owner) in zip(sizes, self.found, strict=True)
                    ),
                ]
            ),
        )

    def _template(
        self, embossing: Embossing, label: int, pitch: float, closed: bool
    ) -> SymbolSolid:
        """Return the template of a label."""
        tiers = embossing.tiers[label]
        try:
            return closed_template(tiers) if closed else template_of(tiers, pitch)
        except SolidError as error:
            error.place = self.part.facets[embossing.facet].name
            raise

    def _stamp(self, embossing: Embossing, template: SymbolSolid, chosen: Index) -> Index:
        """Append the template's vertices at the chosen centres; return their numbers, (m, k)."""
        T = embossing.T_part_facet
        local = template.points[:, :2] @ turn(embossing.rotation_rad).T
        shape = local @ T[:3, :2].T + template.points[:, 2:] * T[:3, 2]
        centres = to_part(embossing, embossing.centres_mm[chosen], 0.0)
        points = centres[:, None, :] + shape
        first = self.add_points(points.reshape(-1, 3))
        return first + np.arange(points.shape[0] * points.shape[1]).reshape(points.shape[:2])
