"""One mitred panel per face: embossed side up, flat back on the bed.

Polyhedron + layout + outlines + wall -> parts. Every edge is cut back as `mitre` says, so
that the panels of a whole object meet in its edges; the numbers of edges, counted from 1 as
the polyhedron lists them, stand on the backs beside them. Lengths in mm. Thesis 6.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import FaceLayout, Layout
from generator.plane.polygon import face_vector
from generator.polyhedron.frame import dihedral, face_frame, face_polygon
from generator.polyhedron.winged import Polyhedron
from generator.printers import Printer
from generator.solid.emboss import embossing_of
from generator.solid.frame import edge_numbers, in_frame, plane_frame
from generator.solid.inset import inset, regular, shared_insets
from generator.solid.marks import BackMark, marks_on
from generator.solid.measure import box
from generator.solid.mitre import Mitre, mitre
from generator.solid.part import Embossing, Facet, Part
from generator.solid.settings import EMBOSS
from generator.solid.whole import move_part

Ring = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Panels:
    """The panels of an object, in the order of its faces."""

    parts: tuple[Part, ...]
    warnings: tuple[str, ...]  #: at most one: numbers that found no room on a back


@dataclass(frozen=True, slots=True)
class _Tier:
    """The outline of a panel at one height."""

    z_mm: float
    rings: tuple[Ring, ...]  #: face frame


def panels(
    polyhedron: Polyhedron,
    layout: Layout,
    tiers: tuple[Tiers, ...],
    wall_mm: float,
    printer: Printer,
    *,
    name: str = "",
    gap_mm: float = EMBOSS.assembly_gap_mm,
    numbers: bool = True,
) -> Panels:
    """Return one panel per face.

    Parameters
    ----------
    polyhedron
        Closed and oriented; mm, object frame.
    layout
        Symbols per face; faces without symbols get a plain panel.
    tiers
        One outline per label.
    wall_mm
        Thickness of the panels.
    printer
        Limits the overhang of the sides and gives the stroke of the numbers.
    name
        Put before each face's name to name the part: "Cube-F1".
    gap_mm
        By which the back edges stay away from the bisecting planes.
    numbers
        Whether backs bear the numbers of their edges and faces.

    Raises
    ------
    SolidError
        If a face is too small for the wall; names the largest wall that fits.
    """
    if not (math.isfinite(wall_mm) and wall_mm > 0):
        raise SolidError(f"wall {wall_mm:g} mm", fix="set wall to more than 0 mm, 3 prints well")
    by_face = {face.face: face for face in layout.faces}
    edges = edge_numbers(polyhedron)
    angles = [dihedral(polyhedron, edge) for edge in range(len(polyhedron.edges))]
    parts = []
    missing: dict[str, tuple[str, ...]] = {}
    for face in range(len(polyhedron.faces)):
        numbered = _edge_loops(polyhedron, face, edges)
        outline = _tiers_of(polyhedron, face, numbered, angles, wall_mm, printer, gap_mm)
        part = _body(polyhedron, face, numbered, outline, wall_mm, name)
        embossings: tuple[Embossing, ...] = ()
        if face in by_face and len(by_face[face].labels):
            embossings = (_symbols(by_face[face], tiers, wall_mm, layout.pitch_mm),)
        if numbers:
            marks, without_room = _numbers(part, numbered, face, wall_mm, printer)
            embossings += marks
            if without_room:
                missing[polyhedron.faces[face].name] = without_room
        part = Part(part.name, part.vertices, part.facets, embossings, part.T_object_part)
        low, high = box(part)
        middle = (low + high) / 2
        parts.append(move_part(part, np.array([-middle[0], -middle[1], 0.0])))
    return Panels(tuple(parts), (_no_room(missing),) if missing else ())


def top_insets_mm(
    polyhedron: Polyhedron, face: int, wall_mm: float, printer: Printer
) -> tuple[NDArray[np.float64], ...]:
    """Return how far a panel's top stands back from each edge of a face, loop after loop.

    `top_inset_mm` of each edge, raised where nearly parallel neighbours share one inset.
    """
    loops = _edge_loops(polyhedron, face, edge_numbers(polyhedron))
    return tuple(
        shared_insets(
            ring,
            np.array([mitre(dihedral(polyhedron, edge), wall_mm, printer).top_mm for edge in loop]),
        )
        for ring, loop in zip(face_polygon(polyhedron, face), loops, strict=True)
    )


def _edge_loops(
    polyhedron: Polyhedron, face: int, edges: dict[tuple[int, int], int]
) -> list[list[int]]:
    """Return the edge numbers along each loop of a face."""
    return [
        [edges[a, b] for a, b in zip(loop, loop[1:] + loop[:1], strict=True)]
        for loop in polyhedron.faces[face].loops
    ]


def _tiers_of(
    polyhedron: Polyhedron,
    face: int,
    numbered: list[list[int]],
    angles: list[float],
    wall_mm: float,
    printer: Printer,
    gap_mm: float,
) -> list[_Tier]:
    """Return the outlines of a panel from the top down, proven regular."""
    rings = face_polygon(polyhedron, face)

    def outline(wall: float) -> list[_Tier] | None:
        cut = [[mitre(angles[e], wall, printer, gap_mm) for e in loop] for loop in numbered]
        found = _outline(rings, cut, wall)
        ok = all(regular(rings, tier.rings, printer.layer_mm) for tier in found)
        return found if ok else None

    found = outline(wall_mm)
    if found is not None:
        return found
    fits, fails = 0.0, wall_mm
    for _ in range(24):
        trial = (fits + fails) / 2
        fits, fails = (fits, trial) if outline(trial) is None else (trial, fails)
    largest = math.floor(fits * 10) / 10
    fix = "make the object larger, or print it whole (parts: whole)"
    if largest >= printer.stroke_min_mm:
        fix = f"set wall to {largest:g} mm or less, or {fix}"
    raise SolidError(
        f"the face is too small for a wall of {wall_mm:g} mm: its mitred back closes up",
        fix=fix,
        place=polyhedron.faces[face].name,
    )


def _outline(rings: tuple[Ring, ...], cut: list[list[Mitre]], wall: float) -> list[_Tier]:
    """Return the outlines at the top, under the land if there is one, and at the back."""
    land = max(side.land_mm for loop in cut for side in loop)
    tops, middles, backs = [], [], []
    for ring, loop in zip(rings, cut, strict=True):
        top = shared_insets(ring, np.array([side.top_mm for side in loop]))
        back = shared_insets(ring, np.array([side.back_mm for side in loop]))
        sloped = np.array([side.land_mm == 0 for side in loop])
        middle = np.where(sloped, top + (back - top) * (land / wall), top)
        tops.append(inset(ring, top))
        middles.append(inset(ring, shared_insets(ring, middle)))
        backs.append(inset(ring, back))
    found = [_Tier(wall, tuple(tops)), _Tier(wall - land, tuple(middles)), _Tier(0.0, tuple(backs))]
    return found if land > 0 else [found[0], found[2]]


def _body(
    polyhedron: Polyhedron,
    face: int,
    numbered: list[list[int]],
    outline: list[_Tier],
    wall_mm: float,
    name: str,
) -> Part:
    """Return the plain panel: facet 0 is the face, facet 1 the back, then the sides."""
    face_name = polyhedron.faces[face].name
    sizes = [len(loop) for loop in numbered]
    total = sum(sizes)
    firsts = np.cumsum([0, *sizes[:-1]]).tolist()
    vertices = np.concatenate(
        [np.c_[ring, np.full(len(ring), tier.z_mm)] for tier in outline for ring in tier.rings]
    )
    bottom = total * (len(outline) - 1)
    top = tuple(tuple(range(a, a + n)) for a, n in zip(firsts, sizes, strict=True))
    back = tuple(
        tuple(bottom + a + k for k in reversed(range(n)))
        for a, n in zip(firsts, sizes, strict=True)
    )
    facets = [Facet(face_name, top), Facet(f"{face_name} back", back)]
    for a, loop in zip(firsts, numbered, strict=True):
        for k, edge in enumerate(loop):
            ahead = (k + 1) % len(loop)
            for level in range(len(outline) - 1):
                high, low = level * total + a, (level + 1) * total + a
                land = " land" if level + 2 < len(outline) else ""
                quad = (low + k, low + ahead, high + ahead, high + k)
                facets.append(Facet(f"{face_name} edge {edge + 1}{land}", (quad,)))
    T_face_part = np.eye(4)
    T_face_part[2, 3] = -wall_mm
    return Part(
        name=f"{name}-{face_name}" if name else face_name,
        vertices=vertices,
        facets=tuple(facets),
        embossings=(),
        T_object_part=face_frame(polyhedron, face) @ T_face_part,
    )


def _symbols(
    face: FaceLayout, tiers: tuple[Tiers, ...], wall_mm: float, pitch_mm: float
) -> Embossing:
    T_part_face = np.eye(4)
    T_part_face[2, 3] = wall_mm
    return embossing_of(face, tiers, 0, T_part_face, pitch_mm)


def _numbers(
    part: Part, numbered: list[list[int]], face: int, wall_mm: float, printer: Printer
) -> tuple[tuple[Embossing, ...], tuple[str, ...]]:
    """Return the engraved numbers of a plain panel's back, and those without room."""
    corners = [part.vertices[list(loop)] for loop in part.facets[1].loops]
    T = plane_frame(corners[0][0], corners[0][1] - corners[0][0], face_vector(corners))
    rings = [in_frame(T, corner)[:, :2] for corner in corners]
    marks = []
    for ring, edges in zip(rings, numbered, strict=True):
        # Seen from behind, corners run the other way: edge k of the back is edge n - 2 - k.
        for k in range(len(ring)):
            edge = edges[(len(edges) - 2 - k) % len(edges)]
            marks.append(BackMark(str(edge + 1), ring[k], ring[(k + 1) % len(ring)]))
    centre = (rings[0].min(axis=0) + rings[0].max(axis=0)) / 2
    marks.append(BackMark(f"F{face + 1}", centre, centre))
    return marks_on(marks, rings, 1, T, wall_mm, printer)


def _no_room(missing: dict[str, tuple[str, ...]]) -> str:
    """Return the warning about texts that found no room, by the name of the back's face."""
    backs: dict[str, list[str]] = {}
    for face, texts in missing.items():
        edges = sorted(int(text) for text in texts if text.isdecimal())
        what = (
            [f"edge{'s' if len(edges) > 1 else ''} {', '.join(map(str, edges))}"] if edges else []
        )
        what += ["the face itself"] if len(edges) < len(texts) else []
        backs.setdefault(" and ".join(what), []).append(face)
    told = [
        f"of {what} on the back{'s' if len(faces) > 1 else ''} of {', '.join(faces)}"
        for what, faces in list(backs.items())[: EMBOSS.listed_marks]
    ]
    rest = [face for faces in list(backs.values())[EMBOSS.listed_marks :] for face in faces]
    told += [f"of others on the back{'s' if len(rest) > 1 else ''} of {', '.join(rest)}"] * bool(
        rest
    )
    return f"no room for the numbers {'; '.join(told)}"
