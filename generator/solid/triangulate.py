"""Part -> triangles, without a boolean.

Each symbol is triangulated once inside its own lattice square and stamped; the rest of the
facet, the polygon less the union of these squares, is triangulated once in the frame of the
lattice: the facet frame turned into the symbols' axes, mm. Squares share their corners by number,
so nothing is welded by distance. A symbol whose square does not lie inside its facet, or that
stands on no lattice, cuts its foot out of the facet instead. Points on a line are kept everywhere.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from manifold3d import triangulate as ear_clipped
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers, foot_half_mm
from generator.errors import SolidError
from generator.plane.polygon import boxes_inside, face_vector, signed_area, triangle_areas
from generator.solid.part import Embossing, Facet, Part, in_frame, plane_frame, to_part, turn

Ring = NDArray[np.float64]
Index = NDArray[np.int64]

#: Triangles thinner than this share of their longest side are flat: the rounding of STL, 1e-6 mm
#: at 20 mm, turns them over.
FLAT = 1e-6
_BENT_FLAT = 1e-5  # the same of pieces of symbols on round faces
#: By which an area is turned where its triangles do not come out right.
_CLIPPING_TURNS_RAD = (0.0, 0.3, 1.1, 2.0)
#: A centre is on the lattice, and a square inside its facet, within this share of the pitch.
_ON_LATTICE = 1e-6


def triangulate_rings(
    rings: Sequence[Ring], numbers: Index, name: str, flat: float = FLAT
) -> Index:
    """Return the (m, 3) triangles of an area bounded by rings, proven by their area.

    Parameters
    ----------
    rings
        (k, 2) each; the area lies to the left of every edge.
    numbers
        (sum of k,) names of the points, ring after ring.
    name
        Of the facet, for the error.
    flat
        Share of its longest side by which a triangle is flat, and avoided if it can be.

    Raises
    ------
    SolidError
        If the triangles do not cover the area exactly once.
    """
    points = np.concatenate(rings)
    if len(points) == 3:
        found: Index = np.array([[0, 1, 2]])
    elif len(points) == 4 and len(rings) == 1 and _strictly_convex(points):
        found = np.array([[0, 1, 2], [0, 2, 3]])
    else:
        found = _clip_ears(rings, points, flat)
    if not _covers(rings, points, found):
        raise SolidError(
            "its outline, holes or symbols overlap, so it has no triangulation",
            fix="keep symbols inside their face and apart from each other",
            place=name,
        )
    named: Index = numbers[found]
    return named


def _clip_ears(rings: Sequence[Ring], points: Ring, flat: float) -> Index:
    """Return triangles; rings whose points line up are turned until they come out right.

    Ears are clipped from a bridge to each hole, which goes wrong now and then where many holes
    have corners on one line, as the letters of a name do.
    """
    found: Index = np.zeros((0, 3), dtype=np.int64)
    for angle in _CLIPPING_TURNS_RAD:
        R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        turned = [ring @ R.T for ring in rings] if angle else list(rings)
        # The fast path for convex rings makes triangles of three points on a line.
        found = np.asarray(ear_clipped(turned, allow_convex=False), dtype=np.int64)
        found = without_slivers(points, found, flat)
        if _covers(rings, points, found):
            break
    return found


def _covers(rings: Sequence[Ring], points: Ring, triangles: Index) -> bool:
    areas = triangle_areas(points[triangles])
    size = float(np.ptp(points, axis=0).max()) ** 2
    wanted = sum(signed_area(ring) for ring in rings)
    if len(triangles) == 0 or areas.min() < -1e-12 * size:
        return False
    return bool(abs(areas.sum() - wanted) <= 1e-9 * size)


def without_slivers(points: Ring, triangles: Index, share: float = FLAT) -> Index:
    """Return a triangulation (m, 3) in which triangles of three points on a line are flipped away.

    Such a triangle shares its longest side with another one; exchanging that side for the other
    diagonal leaves two proper triangles. The outline stays. A triangle is flat when thinner than
    `share` of its longest side.
    """
    flat = _is_sliver(points, triangles, share)
    if not flat.any():
        return triangles
    faces = [tuple(face) for face in triangles.tolist()]
    holder = {
        (face[k], face[(k + 1) % 3]): number for number, face in enumerate(faces) for k in range(3)
    }
    waiting = np.flatnonzero(flat).tolist()
    for _ in range(10 * len(faces)):
        if not waiting:
            break
        number = waiting.pop()
        face = faces[number]
        if not _is_sliver(points, np.array([face]), share)[0]:
            continue
        sides = [(face[k], face[(k + 1) % 3]) for k in range(3)]
        a, c = max(sides, key=lambda side: float(np.hypot(*(points[side[1]] - points[side[0]]))))
        b = next(corner for corner in face if corner not in (a, c))
        other = holder.get((c, a))
        if other is None:
            continue
        d = next(corner for corner in faces[other] if corner not in (a, c))
        for place, made in ((number, (a, d, b)), (other, (d, c, b))):
            faces[place] = made
            for k in range(3):
                holder[made[k], made[(k + 1) % 3]] = place
        waiting += [number, other]
    return np.array(faces, dtype=np.int64)


def _is_sliver(points: Ring, triangles: Index, share: float) -> NDArray[np.bool_]:
    """Whether triangles are thinner than a share of their longest side."""
    corners = points[triangles]
    u = np.roll(corners, -1, axis=1) - corners
    longest = (u**2).sum(axis=2).max(axis=1)
    twice = u[:, 0, 0] * u[:, 1, 1] - u[:, 0, 1] * u[:, 1, 0]
    thin: NDArray[np.bool_] = np.abs(twice) <= share * longest
    return thin


def _strictly_convex(ring: Ring) -> bool:
    edge = np.roll(ring, -1, axis=0) - ring
    ahead = np.roll(edge, -1, axis=0)
    turn = edge[:, 0] * ahead[:, 1] - edge[:, 1] * ahead[:, 0]
    return bool((turn > 1e-9 * np.hypot(*edge.T) * np.hypot(*ahead.T)).all())


@dataclass(slots=True)
class Squares:
    """The full squares of one embossing."""

    full: NDArray[np.bool_]  #: (n,) which symbols have theirs
    corners: Index  #: (n, 4) numbers into `points`, counter-clockwise; -1 without a square
    points: Ring  #: (c, 2) lattice frame
    outline: list[Index]  #: loops of `points` around the union, the union to the right
    first: int = 0  #: mesh number of the first of `points`


def squares_of(embossing: Embossing, rings: Sequence[Ring]) -> Squares | None:
    """Return the full squares of an embossing; its facet's `rings` in the lattice frame."""
    pitch = embossing.pitch_mm
    if pitch <= 0 or not len(embossing.labels):
        return None
    centres = embossing.centres_mm @ turn(embossing.rotation_rad)
    cells = np.rint((centres - centres[0]) / pitch).astype(np.int64)
    on_lattice = np.abs(centres - centres[0] - cells * pitch).max(axis=1) <= _ON_LATTICE * pitch
    halves = np.array([foot_half_mm(tiers) for tiers in embossing.tiers])
    full = on_lattice & (halves[embossing.labels] < pitch * (0.5 - _ON_LATTICE))
    full &= boxes_inside(centres, pitch * (0.5 + _ON_LATTICE), rings)
    cells -= cells.min(axis=0)
    stride = int(cells[:, 1].max()) + 2
    steps = np.array([0, stride, stride + 1, 1])  # lower left, lower right, upper right, upper left
    keys = (cells[:, 0] * stride + cells[:, 1])[:, None] + steps
    _, once = np.unique(keys[:, 0], return_index=True)
    full &= np.isin(np.arange(len(full)), once)
    _drop_pinches(full, keys)
    if not full.any():
        return None
    known, numbers = np.unique(keys[full], return_inverse=True)
    corners = np.full((len(full), 4), -1, dtype=np.int64)
    corners[full] = numbers.reshape(-1, 4)
    origin = centres[0] - pitch * np.rint((centres[0] - centres.min(axis=0)) / pitch)
    places = np.stack([known // stride, known % stride], axis=1)
    points = origin + (places - 0.5) * pitch
    return Squares(full, corners, points, _outline(corners[full], len(known)))


def _drop_pinches(full: NDArray[np.bool_], keys: Index) -> None:
    """Take squares away until no two of them touch in a corner alone."""
    while full.any():
        chosen = np.flatnonzero(full)
        known, numbers = np.unique(keys[chosen], return_inverse=True)
        # Sums of 1, 2, 4, 8: which quarters around a corner are covered, exact as floats.
        weights = np.tile([1.0, 2.0, 4.0, 8.0], len(chosen))
        quarters = np.bincount(numbers.ravel(), weights, len(known))
        pinched = (quarters == 5) | (quarters == 10)
        if not pinched.any():
            return
        # Of the two, the one that has the corner at its lower side goes.
        at = pinched[numbers.reshape(-1, 4)]
        full[chosen[at[:, 0] | at[:, 1]]] = False


def _outline(corners: Index, count: int) -> list[Index]:
    """Return the loops around a union of squares, with the squares to the right."""
    start = corners.ravel()
    end = np.roll(corners, -1, axis=1).ravel()
    border = ~np.isin(start * count + end, end * count + start)
    after = np.full(count, -1, dtype=np.int64)
    after[end[border]] = start[border]
    ahead = after.tolist()
    loops = []
    for first in np.flatnonzero(after >= 0).tolist():
        loop, at = [], first
        while ahead[at] >= 0:
            loop.append(at)
            ahead[at], at = -1, ahead[at]
        if loop:
            loops.append(np.array(loop, dtype=np.int64))
    return loops


@dataclass(frozen=True, slots=True)
class SymbolSolid:
    """Points in the symbol's axes, tier after tier and ring after ring, and its triangles."""

    points: NDArray[np.float64]  #: (k, 3) mm
    own: Index  #: (m, 3) points: sides and top; with the foot where the symbol is a solid
    base: Index  #: (b, 3) of the four corners of the square (0-3) and points (from 4): the facet
    foot: tuple[Index, ...]  #: points of each ring in the facet


@lru_cache(maxsize=256)  # some 10 KB each
def template_of(tiers: Tiers, pitch_mm: float = 0.0, *, closed: bool = False) -> SymbolSolid:
    """Return the template of a symbol on a facet.

    With a pitch it holds the facet inside its lattice square, corners counter-clockwise from the
    lower left; with pitch 0 the foot is cut out of the facet, or closes a solid of its own.
    """
    rings = number_rings(tuple(tuple(map(len, tier)) for tier in tiers.rings))
    base = np.zeros((0, 3), dtype=np.int64)
    if pitch_mm > 0:
        h = pitch_mm / 2
        square = np.array([[-h, -h], [h, -h], [h, h], [-h, h]])
        foot = [ring[::-1] for ring in tiers.rings[0]]
        numbers = [np.arange(4), *(4 + ring[::-1] for ring in rings[0])]
        base = triangulate_rings([square, *foot], np.concatenate(numbers), "a symbol's square")
    top = triangulate_rings(tiers.rings[-1], np.concatenate(rings[-1]), "a symbol's top")
    own = [_sides(rings), top]
    if closed:
        bottom = triangulate_rings(tiers.rings[0], np.concatenate(rings[0]), "a symbol's foot")
        own.append(bottom[:, ::-1])
    return SymbolSolid(outline_points(tiers), np.concatenate(own), base, tuple(rings[0]))


@lru_cache(maxsize=256)
def outline_points(tiers: Tiers) -> NDArray[np.float64]:
    """Return all points of an outline, (n, 3) mm in the symbol's axes, ring after ring."""
    levels = zip(tiers.z_mm, tiers.rings, strict=True)
    return np.concatenate(
        [np.c_[ring, np.full(len(ring), z)] for z, rings in levels for ring in rings]
    )


def number_rings(sizes: tuple[tuple[int, ...], ...]) -> list[list[Index]]:
    """Return the numbers of the points, [tier][ring] (k,), of rings of these sizes."""
    ends = itertools.accumulate(size for tier in sizes for size in tier)
    return [[np.arange(-size, 0) + next(ends) for size in tier] for tier in sizes]


def _sides(numbers: list[list[Index]]) -> Index:
    """Return the triangles between neighbouring tiers; the same order rises and falls."""
    found = []
    for lower, upper in itertools.pairwise(numbers):
        for a, b in zip(lower, upper, strict=True):
            ahead_a, ahead_b = np.roll(a, -1), np.roll(b, -1)
            found += [np.stack([a, ahead_a, ahead_b], 1), np.stack([a, ahead_b, b], 1)]
    return np.concatenate(found)


@dataclass(frozen=True, slots=True)
class Mesh:
    """A triangle mesh; a vertex is shared by number."""

    vertices: NDArray[np.float64]  #: (N, 3) mm, part frame
    triangles: Index  #: (M, 3) vertices, counter-clockwise from outside
    facets: Index  #: (M,) facet of the part that a triangle lies in or stands on
    embossings: Index  #: (M,) embossing that a triangle belongs to, -1 for the body
    symbols: Index  #: (M,) symbol within that embossing, -1 for the body


def triangles(part: Part) -> Mesh:
    """Return the closed mesh of a part with all that is embossed or engraved.

    Raises `SolidError` if loops or feet of a facet overlap.
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
    """Return each face's symbols as closed solids; embossing numbers are those of the part."""
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
        share = _BENT_FLAT if "/" in name else FLAT
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
        tiers = embossing.tiers[label]
        try:
            return template_of(tiers, pitch, closed=closed)
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
