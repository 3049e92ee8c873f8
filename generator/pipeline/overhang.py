"""How a whole body lies on the bed, and what of it hangs over.

Plan + layout -> the face below and the faces that lean over more than the printer bears.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from generator.layout.placement import Layout
from generator.pipeline.plan import ObjectPlan
from generator.plane.polygon import face_vector

_FLAT = 0.999  # cosine from which a face looks straight down


@dataclass(frozen=True, slots=True)
class Overhang:
    """Of one body as it lies."""

    bottom: str  #: name of the face on the bed; empty where an edge or corner is
    faces: tuple[str, ...]  #: that lean over too much, the one on the bed without symbols left out
    symbols: int  #: on these faces
    beside: int  #: symbols on upright faces: their lower sides hang over by their height
    resin: bool
    round: bool  #: it cannot be made of panels

    def __str__(self) -> str:
        lies = f"{self.bottom} down" if self.bottom else "as the file has it"
        if self.resin:
            return f"{lies}, supports where no symbols are"
        needed = "no supports needed below"
        if self.faces:
            counted = f"{self.symbols} symbols hang over" if self.symbols else "they hang over"
            needed = f"supports needed under {', '.join(self.faces)} ({counted})"
        if self.beside:
            needed += f", {self.beside} symbols stand out sideways"
        advice = "" if self.round else "; with  parts: panels  nothing hangs over"
        return f"{lies}, {needed}{advice}"


def overhang_of(plan: ObjectPlan, layout: Layout) -> Overhang:
    """Return what a whole body of this plan does on the bed; z of the object frame is up."""
    polyhedron, limit = plan.polyhedron, math.sin(plan.printer.overhang_max_rad)
    counts = {face.face: len(face.labels) for face in layout.faces}
    lowest = float(polyhedron.vertices[:, 2].min())
    size = float(np.ptp(polyhedron.vertices, axis=0).max())
    bottom, faces, symbols, beside = "", [], 0, 0
    for number, face in enumerate(polyhedron.faces):
        loops = [polyhedron.vertices[list(loop)] for loop in face.loops]
        normal = face_vector(loops)
        up = float(normal[2] / np.linalg.norm(normal))
        name, count = face.name.partition(".")[0], counts.get(number, 0)
        on_bed = up < -_FLAT and abs(loops[0][:, 2].min() - lowest) < 1e-6 * size
        if on_bed:
            bottom = bottom or name
        if up < -limit - 1e-9 and (count or not on_bed):
            faces.append(name)
            symbols += count
        elif abs(up) <= limit:
            beside += count
    return Overhang(
        bottom, tuple(dict.fromkeys(faces)), symbols, beside,
        resin=not plan.printer.nozzle_mm, round=bool(polyhedron.surfaces or polyhedron.blank),
    )  # fmt: skip
