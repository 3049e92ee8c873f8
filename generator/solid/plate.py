"""The plain bodies of panels: mitred along edges, and cut where corners come near each other.

Without symbols and numbers. Lengths in mm. Thesis 6.3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from manifold3d import CrossSection, FillRule
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import distance
from generator.polyhedron.frame import dihedral, face_frame, face_polygon
from generator.polyhedron.winged import Polyhedron
from generator.printers import Printer
from generator.solid.fit import fit_panels
from generator.solid.inset import inset, regular, shared_insets
from generator.solid.mitre import ASSEMBLY_GAP_MM, GAP_IN_CLEARANCE, Mitre, mitre, top_inset_mm
from generator.solid.part import Facet, Part, edge_numbers

Ring = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlainPanels:
    """The bodies of all panels, face by face; facet 0 is the face, facet 1 the back."""

    mitred: tuple[Part, ...]  #: cut along edges alone
    fitted: tuple[Part, ...]  #: cut at corners too


@dataclass(frozen=True, slots=True)
class _Tier:
    """The outline of a panel at one height."""

    z_mm: float
    rings: tuple[Ring, ...]  #: face frame


@lru_cache(maxsize=4)
def plain_panels(
    polyhedron: Polyhedron, wall_mm: float, printer: Printer, gap_mm: float, name: str
) -> PlainPanels:
    """Return the plain bodies of all panels; cached, as layout and parts need the same ones.

    Raises `SolidError` if a face is too small for the wall, or two panels cannot be parted.
    """
    edges = edge_numbers(polyhedron)
    angles = [dihedral(polyhedron, edge) for edge in range(len(polyhedron.edges))]
    mitred = []
    for face in range(len(polyhedron.faces)):
        numbered = edge_loops(polyhedron, face, edges)
        outline = _tiers_of(polyhedron, face, numbered, angles, wall_mm, printer, gap_mm)
        mitred.append(_body(polyhedron, face, numbered, outline, wall_mm, name))
    return PlainPanels(tuple(mitred), fit_panels(polyhedron, mitred, gap_mm))


def top_insets_mm(
    polyhedron: Polyhedron,
    face: int,
    wall_mm: float,
    printer: Printer,
    *,
    gap_mm: float = ASSEMBLY_GAP_MM,
) -> tuple[NDArray[np.float64], ...]:
    """Return what a panel adds to the printer's clearance along each edge, mm, loop after loop."""
    loops = edge_loops(polyhedron, face, edge_numbers(polyhedron))
    return tuple(
        shared_insets(
            ring,
            np.array(
                [top_inset_mm(dihedral(polyhedron, e), wall_mm, printer, gap_mm) for e in loop]
            ),
        )
        for ring, loop in zip(face_polygon(polyhedron, face), loops, strict=True)
    )


def cut_corners(
    polyhedron: Polyhedron, plain: PlainPanels, printer: Printer
) -> dict[int, tuple[Ring, ...]]:
    """Return what cuts at corners take from the tops of panels where symbols could stand.

    By face: loops (k, 2) in its frame, mm, clockwise as holes run. Cuts within half the printer's
    clearance of the face's edges, where no foot comes, are left out.
    """
    found: dict[int, tuple[Ring, ...]] = {}
    for face, (before, after) in enumerate(zip(plain.mitred, plain.fitted, strict=True)):
        if before is after:
            continue
        top, left = (
            CrossSection(
                [part.vertices[list(loop), :2] for loop in part.facets[0].loops], FillRule.EvenOdd
            )
            for part in (before, after)
        )
        edges = face_polygon(polyhedron, face)
        near = GAP_IN_CLEARANCE * printer.edge_min_mm
        cut = [np.asarray(loop)[::-1].copy() for loop in (top - left).to_polygons()]
        loops = tuple(loop for loop in cut if (distance(loop, edges) > near).any())
        if loops:
            found[face] = loops
    return found


def edge_loops(
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
