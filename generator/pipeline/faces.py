"""What each face of an object shows and promises, and how small it could be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generator.layout.blank import Request
from generator.layout.footprint import region_of
from generator.layout.placement import Layout
from generator.layout.places import rank_test
from generator.layout.smallest import extent_mm, smallest_mm
from generator.pipeline.plan import ObjectPlan
from generator.pipeline.promise import FacePromise, promise_faces
from generator.plane.polygon import signed_area
from generator.polyhedron import Polyhedron, face_normal, face_polygon

Size = tuple[float, float]  #: width and height in the face's frame, mm


@dataclass(frozen=True, slots=True)
class FaceReport:
    """One face; a round one counts as one, unrolled."""

    name: str
    place: str  #: which one it is: "the 12 x 70 mm face at x = 40"
    kind: str  #: plane, cylinder, cone
    size_mm: Size
    area_mm2: float
    symbols: int
    places: int  #: windows that fit, or one where all its symbols together name it
    promise: FacePromise | None  #: None where a touch promises nothing that was measured
    smallest_mm: Size | None = None  #: at which it would still show a place, in its proportions


def face_reports(
    plan: ObjectPlan, layout: Layout, *, smallest: bool = False
) -> tuple[FaceReport, ...]:
    """Return a report on every face that symbols can stand on.

    Parameters
    ----------
    plan, layout
        An object and its symbols.
    smallest
        Say also how small each face could be, for which its layout is searched many times.
    """
    promises = promise_faces(plan, layout)
    request = Request(
        plan.footprint_half_mm, plan.spec.style.pitch_mm, plan.array.window, rank_test(plan.array)
    )
    kinds = {surface.carrier: surface.kind for surface in plan.polyhedron.surfaces}
    known: dict[bytes, Size] = {}
    reports = []
    for face in layout.faces:
        if face.face in plan.blank_faces:
            continue
        outline = plan.developed.get(face.face) or face_polygon(plan.polyhedron, face.face)
        region = region_of(outline, plan.clearances_mm[face.face])
        edges = np.column_stack([region.start, region.end, region.clearance])
        key = (np.round(edges, 6) + 0.0).tobytes()
        if smallest and key not in known:
            known[key] = smallest_mm(region, request)
        size = extent_mm(region)
        reports.append(
            FaceReport(
                name=plan.polyhedron.faces[face.face].name,
                place=_place(plan.polyhedron, face.face, size, kinds.get(face.face, "")),
                kind=kinds.get(face.face, "plane"),
                size_mm=size,
                area_mm2=round(float(sum(signed_area(loop) for loop in outline)), 3),
                symbols=len(face.labels),
                places=face.places,
                promise=promises.get(face.face),
                smallest_mm=known.get(key),
            )
        )
    return tuple(reports)


def _place(polyhedron: Polyhedron, face: int, size: Size, kind: str) -> str:
    """Return words by which a person finds a face: its size, and where it lies (mm)."""
    width, height = sorted(size)
    corners = polyhedron.vertices[list(polyhedron.faces[face].loops[0])]
    axis = int(np.argmax(np.abs(face_normal(polyhedron, face))))
    middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
    if kind:
        where = f"of the {kind}"
    elif np.ptp(corners[:, axis]) < 1e-6 * np.ptp(polyhedron.vertices):
        where = f"at {'xyz'[axis]} = {middle[axis] + 0.0:.4g}"
    else:
        where = "about ({})".format(", ".join(f"{value + 0.0:.3g}" for value in middle))
    return f"the {width:.3g} x {height:.3g} mm face {where}"
