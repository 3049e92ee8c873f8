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

from generator.alphabet.figures import in_figures
from generator.alphabet.outline import Tiers
from generator.errors import SolidError
from generator.layout.placement import FaceLayout, Layout
from generator.plane.polygon import face_vector
from generator.polyhedron.winged import Polyhedron
from generator.printers import Printer
from generator.solid.emboss import embossing_of
from generator.solid.marks import BackMarks, EdgeMark, NameMark, marks_on
from generator.solid.measure import box
from generator.solid.part import Embossing, Part, edge_numbers, in_frame, plane_frame
from generator.solid.plate import edge_loops, plain_panels
from generator.solid.settings import EMBOSS
from generator.solid.whole import move_part

Ring = NDArray[np.float64]


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
        Of the object, engraved on the backs, and put before each face's name to name the part:
        "Cube-F1".
    code
        Engraved in place of the name where that has no room, see `layout.placement.object_code`.
    gap_mm
        Least distance of two panels in the finished object.
    numbers
        Whether backs bear the numbers of their edges, and names.

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
    parts = []
    missing: dict[str, tuple[str, ...]] = {}
    nameless: list[str] = []
    letters = in_figures(name) if name else None
    for face, part in enumerate(plain.fitted):
        embossings: tuple[Embossing, ...] = ()
        if face in by_face and len(by_face[face].labels):
            embossings = (_symbols(by_face[face], tiers, wall_mm, layout.pitch_mm),)
        if numbers:
            marks = _marks(
                plain.mitred[face],
                part,
                edge_loops(polyhedron, face, edges),
                NameMark.of(letters, code, f"F{face + 1}"),
                wall_mm,
                printer,
            )
            embossings += marks.embossings
            if marks.missing:
                missing[polyhedron.faces[face].name] = marks.missing
            if not marks.named:
                nameless.append(polyhedron.faces[face].name)
        part = Part(part.name, part.vertices, part.facets, embossings, part.T_object_part)
        low, high = box(part)
        middle = (low + high) / 2
        parts.append(move_part(part, np.array([-middle[0], -middle[1], 0.0])))
    warnings = [_no_room(missing)] if missing else []
    if nameless:
        warnings.append(f"no room for a name on the back of {', '.join(nameless)}: mark by hand")
    return Panels(tuple(parts), tuple(warnings))


def _symbols(
    face: FaceLayout, tiers: tuple[Tiers, ...], wall_mm: float, pitch_mm: float
) -> Embossing:
    T_part_face = np.eye(4)
    T_part_face[2, 3] = wall_mm
    return embossing_of(face, tiers, 0, T_part_face, pitch_mm)


def _marks(
    plain: Part,
    fitted: Part,
    numbered: list[list[int]],
    name: NameMark,
    wall_mm: float,
    printer: Printer,
) -> BackMarks:
    """Return what a panel's back bears: the numbers of its edges and its name.

    The numbers stand along the edges that the back had before it was cut at corners.
    """
    corners = [plain.vertices[list(loop)] for loop in plain.facets[1].loops]
    T = plane_frame(corners[0][0], corners[0][1] - corners[0][0], face_vector(corners))
    rings = [in_frame(T, corner)[:, :2] for corner in corners]
    left = [in_frame(T, fitted.vertices[list(loop)])[:, :2] for loop in fitted.facets[1].loops]
    marks = []
    for ring, edges in zip(rings, numbered, strict=True):
        # Seen from behind, corners run the other way: edge k of the back is edge n - 2 - k.
        for k in range(len(ring)):
            edge = edges[(len(edges) - 2 - k) % len(edges)]
            marks.append(EdgeMark(str(edge + 1), ring[k], ring[(k + 1) % len(ring)]))
    return marks_on(marks, name, left, 1, T, wall_mm, printer)


def _no_room(missing: dict[str, tuple[str, ...]]) -> str:
    """Return the warning about texts that found no room, by the name of the back's face."""
    backs: dict[str, list[str]] = {}
    for face, texts in missing.items():
        edges = sorted(map(int, texts))
        what = f"edge{'s' if len(edges) > 1 else ''} {', '.join(map(str, edges))}"
        backs.setdefault(what, []).append(face)
    told = [
        f"of {what} on the back{'s' if len(faces) > 1 else ''} of {', '.join(faces)}"
        for what, faces in list(backs.items())[: EMBOSS.listed_marks]
    ]
    rest = [face for faces in list(backs.values())[EMBOSS.listed_marks :] for face in faces]
    told += [f"of others on the back{'s' if len(rest) > 1 else ''} of {', '.join(rest)}"] * bool(
        rest
    )
    return f"no room for the numbers {'; '.join(told)}"
