"""Panels that fit: no two come nearer than the gap, wherever they meet in the finished object.

Mitres part the panels of faces with a common edge. Faces that share only a corner, or that
come near each other behind a small face, are parted here: both panels are cut by the plane
that bisects the angle between the faces, half the gap from it. A plane is moved back a
little where it would leave a facet too narrow to print. Lengths in mm, object frame unless said.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from manifold3d import Manifold, Mesh64
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.polyhedron.frame import face_normal
from generator.polyhedron.winged import Polyhedron
from generator.solid.clip import (
    PlainBody,
    beyond,
    body_volume,
    corners_beyond,
    cut_off,
    shortest_edge_mm,
)
from generator.solid.part import Part
from generator.solid.settings import EMBOSS
from generator.solid.triangulate import triangles

Points = NDArray[np.float64]
Plane = tuple[Points, float]  #: unit normal (3,) and offset; the first panel lies below


def fit_panels(polyhedron: Polyhedron, parts: Sequence[Part], gap_mm: float) -> tuple[Part, ...]:
    """Return the plain panels of all faces, cut so that they keep `gap_mm` from each other.

    Parameters
    ----------
    polyhedron
        Closed and oriented; mm, object frame.
    parts
        One plain panel for each face, without embossings; facet 0 is the face, facet 1 the back.
    gap_mm
        Least distance between two of them.

    Raises
    ------
    SolidError
        If two panels run into each other so that no plane parts them.
    """
    fitted = list(parts)
    seats = [_in_object(part) for part in fitted]
    for one, other in _near_pairs(seats, gap_mm):
        planes = list(_planes(polyhedron, one, other))
        half = gap_mm / 2 - EMBOSS.fit_rounding_mm
        if any(_parts(plane, seats[one], seats[other], half) for plane in planes):
            continue
        if _gap(fitted[one], fitted[other], gap_mm) >= gap_mm - EMBOSS.fit_rounding_mm:
            continue
        fitted[one], fitted[other] = _cut_apart(
            polyhedron, (one, other), (fitted[one], fitted[other]), planes, gap_mm
        )
        seats[one], seats[other] = _in_object(fitted[one]), _in_object(fitted[other])
    return tuple(fitted)


def _near_pairs(seats: Sequence[Points], gap: float) -> Iterator[tuple[int, int]]:
    """Yield the pairs of panels whose boxes come nearer than the gap."""
    low = np.array([points.min(axis=0) for points in seats])
    high = np.array([points.max(axis=0) for points in seats])
    for one in range(len(seats) - 1):
        rest = slice(one + 1, None)
        near = (low[rest] < high[one] + gap).all(axis=1) & (high[rest] > low[one] - gap).all(axis=1)
        yield from ((one, one + 1 + int(k)) for k in np.flatnonzero(near))


def _planes(polyhedron: Polyhedron, one: int, other: int) -> Iterator[Plane]:
    """Yield planes that may part two panels: with the middles of their faces on either side.

    Those that bisect the angle between the faces; where they share a corner, also the one
    across the middle of the two lines from there to the middles of the faces.
    """
    loops = [polyhedron.faces[face].loops[0] for face in (one, other)]
    n, m = (face_normal(polyhedron, face) for face in (one, other))
    p, q = (polyhedron.vertices[list(loop)].mean(axis=0) for loop in loops)
    found: list[Plane] = []
    for sign in (1.0, -1.0):
        away = m - sign * n
        length = float(np.linalg.norm(away))
        if length >= EMBOSS.fit_parallel:
            offset = (float(m @ q) - sign * float(n @ p)) / length
            found += [(away / length, offset), (-away / length, -offset)]
    for corner in sorted(set(loops[0]) & set(loops[1])):
        at = polyhedron.vertices[corner]
        to_p, to_q = (float(np.linalg.norm(middle - at)) for middle in (p, q))
        if min(to_p, to_q) < EMBOSS.fit_parallel:
            continue  # the middle of an L can be its inner corner
        away = (q - at) / to_q - (p - at) / to_p
        length = float(np.linalg.norm(away))
        if length >= EMBOSS.fit_parallel:
            found.append((away / length, float(away @ at) / length))
    yield from (
        (normal, offset)
        for normal, offset in found
        if float(normal @ p) < offset < float(normal @ q)
    )


def _cut_apart(
    polyhedron: Polyhedron,
    faces: tuple[int, int],
    parts: tuple[Part, Part],
    planes: Sequence[Plane],
    gap: float,
) -> tuple[Part, Part]:
    """Return two panels cut by the plane that takes the least from them."""
    names = [polyhedron.faces[face].name for face in faces]
    seats = [_in_object(part) for part in parts]
    before = sum(body_volume(_body(part)) for part in parts)
    best: tuple[float, tuple[Part, Part]] | None = None
    for normal, offset in planes:
        first = _cut_part(parts[0], normal, offset, gap, seats[1], f"{names[0]} by {names[1]}")
        if first is None:
            continue
        second = _cut_part(parts[1], -normal, -offset, gap, seats[0], f"{names[1]} by {names[0]}")
        if second is None:
            continue
        apart = gap / 2 - EMBOSS.fit_rounding_mm
        if not _parts((normal, offset), _in_object(first), _in_object(second), apart) and (
            _gap(first, second, gap) < gap - EMBOSS.fit_rounding_mm
        ):
            continue
        lost = before - sum(body_volume(_body(part)) for part in (first, second))
        if best is None or lost < best[0] - EMBOSS.fit_rounding_mm:
            best = (lost, (first, second))
    if best is None:
        raise SolidError(
            f"the panels of {names[0]} and {names[1]} run into each other",
            fix="set wall to less, or print the object whole (parts: whole)",
            place=names[0],
        )
    return best[1]


def _cut_part(
    part: Part, normal: Points, offset: float, gap: float, other: Points, name: str
) -> Part | None:
    """Return a panel that keeps half a gap from a plane near another one; None if it breaks.

    Parameters
    ----------
    part
        Plain panel.
    normal, offset
        The plane, object frame; the panel is to lie below it.
    gap
        Twice the distance from it.
    other
        (n, 3) corners of the other panel, object frame.
    name
        Of the facet in the plane.
    """
    T = part.T_object_part
    inward, at = T[:3, :3].T @ normal, offset - gap / 2 - float(T[:3, 3] @ normal)
    low, high = other.min(axis=0) - gap, other.max(axis=0) + gap
    body = _body(part)
    allowed = min(shortest_edge_mm(body), EMBOSS.fit_edge_mm)
    best, best_edge = None, 0.0
    for step in range(EMBOSS.fit_steps):
        cut: PlainBody | None = body
        back = at - step * EMBOSS.fit_step_mm
        for _ in beyond(body, inward, back):
            assert cut is not None
            piece = _first_near(cut, T, inward, back, low, high)
            if piece is None:
                break
            cut = cut_off(cut, inward, back, piece, name)
            if cut is None:
                break
        if cut is None or [f.name for f in cut.facets[:2]] != [f.name for f in body.facets[:2]]:
            continue
        if cut is body:
            return part
        edge = shortest_edge_mm(cut)
        if edge > best_edge:
            best, best_edge = cut, edge
        if edge >= allowed:
            break
    if best is None:
        return None
    return Part(part.name, best.vertices, best.facets, (), T)


def _first_near(
    body: PlainBody, T: Points, normal: Points, offset: float, low: Points, high: Points
) -> NDArray[np.bool_] | None:
    """Return a piece beyond the plane whose box meets that of the other panel."""
    for piece in beyond(body, normal, offset):
        mine = _seated(T, corners_beyond(body, normal, offset, piece))
        if (mine.min(axis=0) <= high).all() and (mine.max(axis=0) >= low).all():
            return piece
    return None


def _parts(plane: Plane, one: Points, other: Points, half: float) -> bool:
    """Whether a plane already lies between two panels, half a gap from both."""
    normal, offset = plane
    below = float((one @ normal).max()) <= offset - half
    return below and float((other @ normal).min()) >= offset + half


def _gap(one: Part, other: Part, reach: float) -> float:
    """Return the distance of two plain panels, mm, at most `reach`; 0 where they overlap."""
    solids = [_manifold(part) for part in (one, other)]
    return float(solids[0].min_gap(solids[1], reach))


def _manifold(part: Part) -> Manifold:
    mesh = triangles(part)
    seated = _seated(part.T_object_part, mesh.vertices)
    return Manifold(Mesh64(seated, mesh.triangles.astype(np.uint64)))


def _in_object(part: Part) -> Points:
    return _seated(part.T_object_part, part.vertices)


def _seated(T_object_part: Points, points: Points) -> Points:
    """Return points (n, 3) of a part's frame in the object's."""
    seated: Points = points @ T_object_part[:3, :3].T + T_object_part[:3, 3]
    return seated


def _body(part: Part) -> PlainBody:
    return PlainBody(part.vertices, part.facets)
