"""Make the whole body one part: every face a facet, every face embossed. Thesis 6.3."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.layout.placement import Layout
from generator.polyhedron.frame import face_frame
from generator.polyhedron.winged import Polyhedron
from generator.solid.analytic import analytic_faces
from generator.solid.measure import box
from generator.solid.part import Facet, Part, embossing_of
from generator.solid.wrapped import Body, wrapped_onto


def emboss_whole(
    polyhedron: Polyhedron,
    layout: Layout,
    tiers: tuple[Tiers, ...],
    name: str,
    R_bed_object: NDArray[np.float64] | None = None,
) -> Part:
    """Return the body with all its symbols as one solid, its box centred on x and y, on z = 0.

    Faces of the layout without symbols stay plain; `tiers`: one outline per label. `R_bed_object`
    (3, 3) turns it as it stands on the bed. Raises `SolidError` if a label has no outline.
    """
    facets = [Facet(face.name, face.loops) for face in polyhedron.faces]
    body = Body([polyhedron.vertices], len(polyhedron.vertices), facets)
    round_faces = {surface.carrier: surface for surface in polyhedron.surfaces}
    embossings = []
    owned = {surface.carrier: surface.facets for surface in polyhedron.surfaces}
    bent = {}
    for face in layout.faces:
        if len(face.labels) and face.face in round_faces:
            first = len(body.facets)
            wrapped_onto(body, polyhedron, round_faces[face.face], face, tiers)
            owned[face.face] += tuple(range(first, len(body.facets)))
            bent[face.face] = face
        elif len(face.labels):
            frame = face_frame(polyhedron, face.face)
            embossings.append(embossing_of(face, tiers, face.face, frame, layout.pitch_mm))
    part = Part(
        name=name,
        vertices=np.concatenate(body.vertices),
        facets=tuple(body.facets),
        embossings=tuple(embossings),
        T_object_part=np.eye(4),
        wrapped=tuple(body.wrapped),
        analytic=analytic_faces(polyhedron, bent, tiers, owned),
    )
    if R_bed_object is not None:
        part = part.moved(np.zeros(3), R_bed_object)
    low, high = box(part)
    return part.moved(-np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]))
