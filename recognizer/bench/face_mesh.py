"""A registered face as the page draws and picks it: triangles on the object, places on the face.

Flat faces lie in their plane. A round face is drawn as the facets that stand for it; what is
picked on them is a place of the unrolled plane, and each of its symbols stands in the plane that
is tangent there. mm; lists of numbers for JSON.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.database.registered import RegisteredFace, RegisteredObject
from probe.surface.body import triangulate

Array = NDArray[np.float64]

DIGITS = 4  #: after the point, of mm: a tenth of a micrometre


def drawn_faces(held: RegisteredObject) -> list[int]:
    """Return the faces that are drawn, by number: of a round face's facets the carrier alone."""
    facets = {facet for face in held.faces if face.round is not None
              for facet in face.round.surface.facets}  # fmt: skip
    return [n for n, face in enumerate(held.faces) if n not in facets or face.round is not None]


def mesh_json(held: RegisteredObject, face: RegisteredFace) -> dict[str, Any]:
    """Return a face's triangles and outlines.

    `corners`: 9 numbers a triangle, object frame; `places`: 6 numbers a triangle, face frame or
    unrolled plane; `outlines`: lines of points, object frame, closed on a flat face.
    """
    if face.round is None:
        points = np.concatenate(face.polygon_mm)
        places = points[triangulate(face.polygon_mm)]
        corners = _seated(face.T_object_face, places)
        outlines = [_seated(face.T_object_face, loop) for loop in face.polygon_mm]
    else:
        d = face.round.development
        low, high = d.low, d.high
        places = np.stack(
            [np.stack([low[:-1], low[1:], high[1:]], axis=1),
             np.stack([low[:-1], high[1:], high[:-1]], axis=1)], axis=1
        )  # fmt: skip
        corners = np.stack(
            [_seated(T, two) for T, two in zip(d.T_object_flat, places, strict=True)]
        )
        outlines = [held.polyhedron.vertices[ends] for ends in d.vertices.T]
    return {
        "corners": nested_lists(corners.ravel()),
        "places": nested_lists(places.ravel()),
        "outlines": [nested_lists(loop) for loop in outlines],
    }


def stands_json(face: RegisteredFace, centres_mm: Array) -> list[list[float]]:
    """Return the pose of every symbol on the object, the first three rows of 4 x 4 in turn."""
    poses = stand_poses(face, centres_mm)
    return [nested_lists(pose[:3].ravel(), 6) for pose in poses]


def stand_poses(face: RegisteredFace, centres_mm: Array) -> Array:
    """Return T_object_symbol of every symbol of a face, (S, 4, 4); none where it is blank."""
    if face.placement is None:
        return np.zeros((0, 4, 4))
    c, s = math.cos(-face.placement.rotation_rad), math.sin(-face.placement.rotation_rad)
    T_plane_symbol = np.tile(np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]),
                             (len(centres_mm), 1, 1))  # fmt: skip
    T_plane_symbol[:, :2, 3] = centres_mm
    if face.round is None:
        return np.asarray(face.T_object_face @ T_plane_symbol)
    tangents = np.array([face.round.tangent(x, y) for x, y in centres_mm.tolist()])
    return np.asarray(tangents.reshape(-1, 4, 4) @ T_plane_symbol)


def face_sheets(face: RegisteredFace) -> Iterator[list[Array]]:
    """Yield the flat sheets of a face as loops (k, 3), object frame: of a round face its facets."""
    if face.round is None:
        yield [_seated(face.T_object_face, loop) for loop in face.polygon_mm]
        return
    d = face.round.development
    for T, low, high in zip(
        d.T_object_flat, np.stack([d.low[:-1], d.low[1:]], axis=1),
        np.stack([d.high[1:], d.high[:-1]], axis=1), strict=True,
    ):  # fmt: skip
        yield [_seated(T, np.concatenate([low, high]))]


def nested_lists(values: Array, digits: int = DIGITS) -> Any:
    """Return numbers as JSON has them."""
    return np.round(values, digits).tolist()


def _seated(T: Array, places: Array) -> Array:
    return np.asarray(places @ T[:3, :2].T + T[:3, 3])
