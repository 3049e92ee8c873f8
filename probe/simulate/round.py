"""A written cylinder or cone as what a flat plate touches: the STL seen along the plate's normal.

A place on a round face is one of its unrolled plane. A plate that touches there stands in the
tangent plane, and under it the part falls away with its bend, symbols and all. So every touch
has a surface of its own; its frame is that of the unrolled plane, rolled until it touches along
the line through the touch (`RegisteredFace.round`). mm.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.database.open import normal_url, part_path
from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
from probe.contact.contract import Touch
from probe.errors import SurfaceError
from probe.simulate.scene import Scene
from probe.simulate.settings import FACE_AROUND
from probe.simulate.written import written_triangles
from probe.surface.indenters import FlatPlate
from probe.surface.mesh import mesh
from probe.surface.polygon import FaceRegion, polygon

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RoundPart:
    """A written part, touched on one of its round faces."""

    corners_mm: Array  #: (n, 3, 3) object frame
    low_mm: Array  #: (n, 3) least coordinates of each triangle
    high_mm: Array  #: (n, 3) greatest
    face: RegisteredFace
    region: FaceRegion  #: the unrolled face: where touches may have their centre
    name: str
    object_name: str

    def under(self, touch: Touch) -> Scene:
        """Return what a touch meets: a surface in the plane that is tangent at its place.

        Raises
        ------
        SurfaceError
            Nothing of the part is there.
        """
        x, y = touch.x_mm, touch.y_mm
        T_object_plane = self.tangent(x, y)
        middle = (T_object_plane @ (x, y, 0.0, 1.0))[:3]
        near = (self.low_mm < middle + FACE_AROUND.around_mm) & (
            self.high_mm > middle - FACE_AROUND.around_mm
        )
        corners = self.corners_mm[near.all(axis=1)]
        a, b, c = corners.transpose(1, 0, 2)
        seen = np.cross(b - a, c - a) @ T_object_plane[:3, 2] > 0
        T_plane_object = np.linalg.inv(T_object_plane)
        return Scene(
            surface=mesh(corners[seen], T_plane_object, place=self.name),
            region=self.region,
            name=self.name,
            object_name=self.object_name,
            face=self.face.name,
            T_object_surface=T_object_plane,
            rolled=self.under,
        )

    def scene(self) -> Scene:
        """Return the face, as a touch of its middle meets it."""
        x, y = Scene(FlatPlate(), self.region, self.name).centre_mm().tolist()
        return self.under(Touch(x, y, 0.0, 0.0))

    def tangent(self, x: float, y: float) -> Array:
        """Return T_object_plane (4, 4) of the plane that touches at a place."""
        if self.face.round is None:
            raise SurfaceError(f"{self.name} is flat", fix="touch it as a flat face")
        return self.face.round.tangent(x, y)


def round_scene(database: str, held: RegisteredObject, face: RegisteredFace) -> Scene:
    """Return a round face of a registered object as its STL file has it.

    Raises
    ------
    SurfaceError
        No such file is registered, or it is not there.
    """
    for part in held.parts:
        if part.format == "stl":
            return round_part(part_path(normal_url(database), part.file), held, part, face).scene()
    raise SurfaceError(
        f"{held.entry.name} has no STL file, and a round face is touched as it was written",
        fix="make it again with --format stl",
        place=database,
    )


def round_part(
    file: str | os.PathLike[str], held: RegisteredObject, part: RegisteredPart, face: RegisteredFace
) -> RoundPart:
    """Return a written part to be touched on a round face.

    Parameters
    ----------
    file
        STL of `part`.
    held, part, face
        Of the database.

    Raises
    ------
    SurfaceError
        The face is flat, or the file is no STL.
    """
    name = f"{held.entry.name}/{face.name}"
    if face.round is None:
        raise SurfaceError(f"{name} is flat", fix="touch it as a flat face")
    T = part.T_object_part
    corners = written_triangles(file) @ T[:3, :3].T + T[:3, 3]
    return RoundPart(
        corners_mm=corners,
        low_mm=corners.min(axis=1),
        high_mm=corners.max(axis=1),
        face=face,
        region=polygon([face.round.outline_mm]),
        name=name,
        object_name=held.entry.name,
    )
