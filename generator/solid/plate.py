"""The plain bodies of panels: mitred along edges, and cut where corners come near each other.

A panel of thickness `wall` ends in the plane that bisects the interior dihedral angle theta: at
depth t that plane lies t cot(theta/2) inward from the edge (outward where theta is over pi). Lying
on its back, the side overhangs by 90 degrees - theta/2 from the vertical. Where the printer cannot
do that, the outer edge is cut back: the side then rises at the printer's limit from the mitred
back edge. Insets keep the corners of a face's rings, each on two moved lines, so that sides between
two insets are planar. Without symbols and numbers. Lengths in mm, angles in rad. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from manifold3d import CrossSection, FillRule
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.plane.polygon import distance, edges_cross, keeps_edges, points_inside, signed_area
from generator.polyhedron.frame import dihedral, face_frame, face_polygon
from generator.polyhedron.winged import Polyhedron
from generator.printers import Printer
from generator.solid.fit import fit_panels
from generator.solid.part import Facet, Part, edge_numbers

Ring = NDArray[np.float64]  #: (k, 2) mm
Insets = NDArray[np.float64]  #: (k,) mm, of edge i from corner i to i + 1
_Tier = tuple[float, tuple[Ring, ...]]  #: height and outline of a panel there, mm, face frame

#: Between two assembled panels, wherever they meet; glue and a filament printer's errors.
ASSEMBLY_GAP_MM = 0.14
GAP_IN_CLEARANCE = 0.5  #: share of the clearance of symbols that a panel's own edge may take
_GAP_STEPS_PER_MM = 500  # half the gap, measured in the face, is rounded up to one of these
_USUAL_GAP_INSET_MM = 0.1  # half the gap, in the face, that the layout counts at edges cut back
_REFLEX_LIMIT = 2.0  # a reflex edge's back reaches out at most so many walls (up to 307 degrees)
_RIGHT_RAD = math.pi / 2 + 1e-6  # angles up to this count as a right angle
#: Neighbours that turn by less share one inset where theirs would push the corner far.
_FLAT_TURN_RAD = math.radians(15)


@dataclass(frozen=True, slots=True)
class Mitre:
    """The side of a panel along one edge, from the top face down."""

    top_mm: float  #: inset of the top edge from the object's edge
    land_mm: float  #: height of the vertical land under the top edge, 0 for none
    back_mm: float  #: inset of the back edge; negative if it reaches out


def mitre(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float = ASSEMBLY_GAP_MM
) -> Mitre:
    """Return the side along an edge with interior dihedral angle `theta_rad`.

    It keeps half of `gap_mm` from the bisecting plane at every depth, and overhangs by at most
    `printer.overhang_max_rad`.
    """
    gap = _gap_inset_mm(theta_rad, gap_mm)
    land = 0.0 if theta_rad > _RIGHT_RAD else min(printer.layer_mm, wall_mm / 4)
    top = _top_inset_mm(theta_rad, wall_mm, printer, gap, gap)
    return Mitre(top, land, _back_inset_mm(theta_rad, wall_mm) + gap)


def top_inset_mm(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float = ASSEMBLY_GAP_MM
) -> float:
    """Return what the layout adds to the printer's clearance along an edge, mm.

    It is how far the top edge of a panel stands back from the object's edge. The gap counts only
    beyond a share of the clearance, so that panels and a whole body show the same symbols.
    """
    usual = _USUAL_GAP_INSET_MM
    whole = _top_inset_mm(theta_rad, wall_mm, printer, usual, 0.0)
    gap = _gap_inset_mm(theta_rad, gap_mm)
    top = _top_inset_mm(theta_rad, wall_mm, printer, gap, gap)
    return max(whole, top - GAP_IN_CLEARANCE * printer.edge_min_mm)


def symbol_clearance_mm(theta_rad: float, height_mm: float) -> float:
    """Return how far symbols keep from a reflex edge, so that those of both faces stay apart.

    Symbols `height_mm` high fill two layers of the void, which part where they meet its bisecting
    plane; 0 at a convex edge.
    """
    return max(0.0, -height_mm * _cotangent_of_half(theta_rad))


def _top_inset_mm(
    theta_rad: float, wall_mm: float, printer: Printer, gap_mm: float, least_mm: float
) -> float:
    """Return the inset of the top edge, with an inset for the gap, the least one at whole edges."""
    back = _back_inset_mm(theta_rad, wall_mm) + gap_mm
    steepest = math.tan(printer.overhang_max_rad)
    if theta_rad > _RIGHT_RAD:
        return max(least_mm, back - wall_mm * steepest)
    land = min(printer.layer_mm, wall_mm / 4)
    return max(back - (wall_mm - land) * steepest, land * _cotangent_of_half(theta_rad) + least_mm)


def _back_inset_mm(theta_rad: float, wall_mm: float) -> float:
    """Return where the bisecting plane meets the back; limited where it reaches far out."""
    return max(wall_mm * _cotangent_of_half(theta_rad), -_REFLEX_LIMIT * wall_mm)


def _gap_inset_mm(theta_rad: float, gap_mm: float) -> float:
    """Return how far inward half the gap is, measured in the face; rounded up to 0.01 mm."""
    exact = gap_mm / 2 / max(math.sin(theta_rad / 2), 1e-9)
    return math.ceil(exact * _GAP_STEPS_PER_MM - 1e-6) / _GAP_STEPS_PER_MM


def _cotangent_of_half(theta_rad: float) -> float:
    """Return cot(theta/2), finite at both ends of (0, 2 pi)."""
    return math.cos(theta_rad / 2) / max(math.sin(theta_rad / 2), 1e-9)


def shared_insets(ring: Ring, insets: Insets) -> Insets:
    """Return insets in which nearly parallel neighbours that differ take the larger one.

    Two such lines meet far away, or not at all: their corner would run along the edge by
    (difference / sin of the turn). It may run by an eighth of the shorter edge, no more.
    """
    along, length = _directions(ring)
    before = np.roll(along, 1, axis=0)
    turn = np.arctan2(
        before[:, 0] * along[:, 1] - before[:, 1] * along[:, 0], (before * along).sum(axis=1)
    )
    shorter = np.minimum(length, np.roll(length, 1))
    slack = np.abs(np.sin(turn)) * shorter / 8
    flat = np.abs(turn) < _FLAT_TURN_RAD
    result = insets.astype(np.float64)
    for _ in range(len(ring)):
        previous = np.roll(result, 1)
        joined = flat & (np.abs(result - previous) > slack)
        if not joined.any():
            break
        larger = np.maximum(result, previous)
        raised = np.where(joined, larger, result)
        result = np.maximum(raised, np.where(np.roll(joined, -1), np.roll(larger, -1), raised))
    return result


def inset(ring: Ring, insets: Insets) -> Ring:
    """Return the ring whose edge i has moved to its left, into the material, by insets[i].

    Corner i is where the moved lines i - 1 and i meet: the mean of both insets along the bisector
    and half their difference across it, which has no singularity where the insets are equal.
    """
    along, _ = _directions(ring)
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)  # to the left: inward
    before = np.roll(normal, 1, axis=0)
    cosine = (normal * before).sum(axis=1)
    mean = (insets + np.roll(insets, 1)) / 2
    half = (insets - np.roll(insets, 1)) / 2
    tiny = np.finfo(np.float64).tiny
    # 1 - cosine from the difference itself: no cancellation at flat corners.
    apart = ((normal - before) ** 2).sum(axis=1) / 2
    bisector = mean / np.maximum(1 + cosine, tiny)
    across = np.where(half == 0.0, 0.0, half / np.maximum(apart, tiny))
    moved: Ring = ring + bisector[:, None] * (normal + before) + across[:, None] * (normal - before)
    return moved


def regular(before: Sequence[Ring], after: Sequence[Ring], shortest_mm: float) -> bool:
    """Whether an inset kept every edge, crosses nowhere, and keeps its holes inside."""
    if not all(np.isfinite(ring).all() for ring in after):
        return False
    if not all(keeps_edges(a, b, shortest_mm) for a, b in zip(before, after, strict=True)):
        return False
    if edges_cross(after) or signed_area(after[0]) <= 0:
        return False
    return all(
        signed_area(hole) < 0 and bool(points_inside(hole[:1], after[:1])[0]) for hole in after[1:]
    )


def _directions(ring: Ring) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit vectors along the edges, and their lengths."""
    edge = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(edge[:, 0], edge[:, 1])
    return edge / length[:, None], length


@dataclass(frozen=True, slots=True)
class PlainPanels:
    """The bodies of all panels, face by face; facet 0 is the face, facet 1 the back."""

    mitred: tuple[Part, ...]  #: cut along edges alone
    fitted: tuple[Part, ...]  #: cut at corners too


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
        ok = all(regular(rings, tier, printer.layer_mm) for _, tier in found)
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
    found = [(wall, tuple(tops)), (wall - land, tuple(middles)), (0.0, tuple(backs))]
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
        [np.c_[ring, np.full(len(ring), z)] for z, tier in outline for ring in tier]
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
