"""What each face of an object shows, and how small it could be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generator.layout.blank import Request
from generator.layout.footprint import region_of
from generator.layout.placement import Layout
from generator.layout.places import rank_test
from generator.layout.smallest import extent_mm, smallest_mm
from generator.pipeline.plan import ObjectPlan
from generator.polyhedron import face_polygon

Size = tuple[float, float]  #: width and height in the face's frame, mm


@dataclass(frozen=True, slots=True)
class FaceReport:
    """One face; a round one counts as one, unrolled."""

    name: str
    kind: str  #: plane, cylinder, cone
    size_mm: Size
    symbols: int
    places: int  #: that can be told apart by touch
    smallest_mm: Size  #: at which it would still show one, in its own proportions


def face_reports(plan: ObjectPlan, layout: Layout) -> tuple[FaceReport, ...]:
    """Return a report on every face that symbols can stand on.

    Parameters
    ----------
    plan, layout
        An object and its symbols.
    """
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
        if key not in known:
            known[key] = smallest_mm(region, request)
        reports.append(
            FaceReport(
                name=plan.polyhedron.faces[face.face].name,
                kind=kinds.get(face.face, "plane"),
                size_mm=extent_mm(region),
                symbols=len(face.labels),
                places=face.places,
                smallest_mm=known[key],
            )
        )
    return tuple(reports)
