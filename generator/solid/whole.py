"""The whole body as one part: every face a facet, every face embossed.

Polyhedron + layout + outlines -> Part. Thesis 6.3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.layout.placement import Layout
from generator.polyhedron.frame import face_frame
from generator.polyhedron.winged import Polyhedron
from generator.solid.emboss import embossing_of
from generator.solid.measure import box
from generator.solid.part import Facet, Part


def whole(polyhedron: Polyhedron, layout: Layout, tiers: tuple[Tiers, ...], name: str) -> Part:
    """Return the body with all its symbols as one solid.

    Parameters
    ----------
    polyhedron
        Closed and oriented; mm, object frame.
    layout
        Symbols per face; faces without symbols stay plain.
    tiers
        One outline per label.
    name
        Of the part.

    Returns
    -------
    Part
        In a local frame: the box, symbols included, centred on x and y, standing on z = 0.

    Raises
    ------
    SolidError
        If a label has no outline.
    """
    part = Part(
        name=name,
        vertices=polyhedron.vertices,
        facets=tuple(Facet(face.name, face.loops) for face in polyhedron.faces),
        embossings=tuple(
            embossing_of(face, tiers, face.face, face_frame(polyhedron, face.face), layout.pitch_mm)
            for face in layout.faces
            if len(face.labels)
        ),
        T_object_part=np.eye(4),
    )
    low, high = box(part)
    return moved(part, -np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]))


def moved(part: Part, by_mm: NDArray[np.float64]) -> Part:
    """Return the part shifted by (3,) mm in its own frame; it stays where it is in the object."""
    T_new_old = np.eye(4)
    T_new_old[:3, 3] = by_mm
    T_object_part = part.T_object_part.copy()
    T_object_part[:3, 3] -= T_object_part[:3, :3] @ by_mm
    return replace(
        part,
        vertices=part.vertices + by_mm,
        embossings=tuple(
            replace(embossing, T_part_facet=T_new_old @ embossing.T_part_facet)
            for embossing in part.embossings
        ),
        T_object_part=T_object_part,
    )
