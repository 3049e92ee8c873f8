"""Which facets of the parts are faces of the object, and which triangles are symbols."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from generator.solid.part import Facet, Part
from generator.solid.triangulate import Mesh

Points = NDArray[np.float64]


def named_facets(part: Part, *, alone: bool) -> list[tuple[str, int]]:
    """Return name and number of the facets that are faces of the object.

    Parameters
    ----------
    part
        A panel, or the whole body.
    alone
        Whether it is the only part: then each of its facets is a face; a round face has the
        name and the number of its first facet. A panel carries one face: the facet with the
        symbols, or its first one where there are none.
    """
    if alone:
        numbers = np.unique(object_faces(part)).tolist()
        return [(part.facets[number].name, number) for number in numbers]
    embossed = [embossing.facet for embossing in part.embossings if embossing.face is not None]
    number = embossed[0] if embossed else 0
    return [(part.facets[number].name, number)]


def object_faces(part: Part) -> NDArray[np.int64]:
    """Return for each facet of a whole body the facet that stands for its face of the object.

    That is the facet itself, or the first one of a round face (F2 for F2.2, F2.3, ...); the
    facets of a symbol (F2/r1c2/top) belong to the face that it stands on.
    """
    first: dict[str, int] = {}
    faces = [facet.name.partition("/")[0].partition(".")[0] for facet in part.facets]
    return np.array([first.setdefault(face, number) for number, face in enumerate(faces)])


def symbol_triangles(part: Part, mesh: Mesh) -> NDArray[np.bool_]:
    """Return which triangles of a part's mesh belong to a symbol, not to body or marks."""
    symbols = [embossing.face is not None for embossing in part.embossings]
    # Triangles of the body have the number -1, which finds the last entry.
    found = np.array([*symbols, False], np.bool_)[mesh.embossings]
    for wrapped in part.wrapped:
        found |= (mesh.facets >= wrapped.first) & (
            mesh.facets < wrapped.first + len(wrapped.symbols)
        )
    return np.asarray(found)


def centre_and_normal(vertices: Points, facet: Facet) -> tuple[Points, Points]:
    """Return centroid, (3,), and outward unit normal, (3,), of a facet's outer loop."""
    loop = vertices[list(facet.loops[0])]
    arms = loop - loop[0]
    following = np.roll(arms, -1, axis=0)
    areas = np.cross(arms, following)
    total = areas.sum(axis=0)
    length = np.linalg.norm(total)
    normal: Points = total / length
    moment = (areas @ normal) @ (arms + following)
    centre: Points = loop[0] + moment / (3.0 * length)
    return centre, normal
