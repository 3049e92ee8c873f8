"""Make one mitred panel per face: embossed side up, flat back on the bed.

Every edge is cut back as `mitre` says, so that the panels of an object meet in its edges; the
numbers of edges, counted from 1 as the polyhedron lists them, stand on the backs. Thesis 6.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.output import some_of
from generator.alphabet.figures import in_figures
from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import Layout
from generator.plane.polygon import face_vector
from generator.polyhedron.winged import Polyhedron
from generator.printers import Printer
from generator.solid.marks import BackMarks, EdgeMark, NameMark, marks_on
from generator.solid.measure import box
from generator.solid.part import Embossing, Part, edge_numbers, embossing_of, in_frame, plane_frame
from generator.solid.plate import ASSEMBLY_GAP_MM, edge_loops, plain_panels

_LISTED = 3  # kinds of missing numbers that a warning lists in full


@dataclass(frozen=True, slots=True)
class Panels:
    """The panels of an object, in the order of its faces."""

    parts: tuple[Part, ...]
    warnings: tuple[str, ...]  #: numbers and names that found no room on a back


def panels(
    polyhedron: Polyhedron,
    layout: Layout,
    tiers: tuple[Tiers, ...],
    wall_mm: float,
    printer: Printer,
    *,
    name: str = "",
    code: str = "",
    gap_mm: float = ASSEMBLY_GAP_MM,
) -> Panels:
    """Return one panel per face; faces without symbols get a plain one.

    Parameters
    ----------
    tiers
        One outline per label.
    wall_mm
        Thickness of the panels.
    name
        Of the object: engraved on the backs, and before each face's name to name the part.
    code
        Engraved where the name has no room, see `layout.placement.object_code`.
    gap_mm
        Least distance of two panels in the finished object.

    Raises
    ------
    SolidError
        If a face is too small for the wall; names the largest wall that fits.
    """
    if not (math.isfinite(wall_mm) and wall_mm > 0):
        raise SolidError(f"wall {wall_mm:g} mm", fix="set wall to more than 0 mm, 3 prints well")
    if not (math.isfinite(gap_mm) and gap_mm > 0):
        raise SolidError(f"gap {gap_mm:g} mm", fix="set gap to more than 0 mm, 0.14 fits well")
    by_face = {face.face: face for face in layout.faces}
    edges = edge_numbers(polyhedron)
    plain = plain_panels(polyhedron, wall_mm, printer, gap_mm, name)
    T_part_face = np.eye(4)
    T_part_face[2, 3] = wall_mm
    parts = []
    missing: dict[str, tuple[str, ...]] = {}
    nameless: list[str] = []
    letters = in_figures(name) if name else None
    for face, part in enumerate(plain.fitted):
        embossings: tuple[Embossing, ...] = ()
        if face in by_face and len(by_face[face].labels):
            embossings = (embossing_of(by_face[face], tiers, 0, T_part_face, layout.pitch_mm),)
        marks = _marks(
            plain.mitred[face],
            part,
            edge_loops(polyhedron, face, edges),
            NameMark.of(letters, code, f"F{face + 1}"),
            wall_mm,
            printer,
        )
        if marks.missing:
            missing[polyhedron.faces[face].name] = marks.missing
        if not marks.named:
            nameless.append(polyhedron.faces[face].name)
        part = replace(part, embossings=embossings + marks.embossings)
        low, high = box(part)
        middle = (low + high) / 2
        parts.append(part.moved(np.array([-middle[0], -middle[1], 0.0])))
    warnings = [_no_room(missing)] if missing else []
    if nameless:
        warnings.append(f"no room for a name on the back of {some_of(nameless)}: mark by hand")
    return Panels(tuple(parts), tuple(warnings))


def _marks(
    plain: Part,
    fitted: Part,
    numbered: list[list[int]],
    name: NameMark,
    wall_mm: float,
    printer: Printer,
) -> BackMarks:
    """Return the name on a panel's back, and the numbers of the edges it had before cuts."""
    T, rings = _facet_frame(plain, 1)
    left = [in_frame(T, fitted.vertices[list(loop)])[:, :2] for loop in fitted.facets[1].loops]
    marks = []
    for ring, edges in zip(rings, numbered, strict=True):
        # Seen from behind, corners run the other way: edge k of the back is edge n - 2 - k.
        for k in range(len(ring)):
            edge = edges[(len(edges) - 2 - k) % len(edges)]
            marks.append(EdgeMark(str(edge + 1), ring[k], ring[(k + 1) % len(ring)]))
    return marks_on(marks, name, left, 1, T, wall_mm, printer)


def with_name(part: Part, facet: int, name: NameMark, wall_mm: float, printer: Printer) -> Part:
    """Return a part with a name engraved on a facet, where there is room for it."""
    T, rings = _facet_frame(part, facet)
    marks = marks_on([], name, rings, facet, T, wall_mm, printer)
    return replace(part, embossings=part.embossings + marks.embossings)


def _facet_frame(part: Part, facet: int) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Return the frame of a facet, and its loops (k, 2) there."""
    corners = [part.vertices[list(loop)] for loop in part.facets[facet].loops]
    T = plane_frame(corners[0][0], corners[0][1] - corners[0][0], face_vector(corners))
    return T, [in_frame(T, corner)[:, :2] for corner in corners]


def _no_room(missing: dict[str, tuple[str, ...]]) -> str:
    """Return the warning about numbers that found no room, by the name of the back's face."""
    backs: dict[str, list[str]] = {}
    for face, texts in missing.items():
        edges = sorted(map(int, texts))
        what = f"edge{'s' if len(edges) > 1 else ''} {some_of(list(map(str, edges)))}"
        backs.setdefault(what, []).append(face)
    kinds = list(backs.items())
    if rest := [face for _, faces in kinds[_LISTED:] for face in faces]:
        kinds = [*kinds[:_LISTED], ("others", rest)]
    places = [
        f"of {what} on the back{'s' if len(faces) > 1 else ''} of {some_of(faces)}"
        for what, faces in kinds
    ]
    return f"no room for the numbers {'; '.join(places)}"
