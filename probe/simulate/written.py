"""A written part's file -> its triangles, the surface that they are, and its round faces.

A place on a round face is one of its unrolled plane. A plate that touches there stands in the
tangent plane, and under it the part falls away with its curvature, symbols and all. So every
touch has a surface of its own; its frame is that of the unrolled plane, rolled until it touches
along the line through the touch (`RegisteredFace.round`). mm.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.errors import EncodedObjectsError
from generator.database.part_file import part_triangles
from probe.contact.contract import Touch
from probe.errors import SurfaceError
from probe.simulate.scene import Scene
from probe.surface.indenters import FlatPlate
from probe.surface.mesh import MeshSurface, mesh
from probe.surface.polygon import FaceRegion, polygon

if TYPE_CHECKING:
    from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
    from generator.database.round_face import RoundFace

Array = NDArray[np.float64]

AROUND_MM = 24.0  #: triangles farther from a touch of a round face are not under the sensor


def written_triangles(file: str | os.PathLike[str]) -> Array:
    """Return the corners (n, 3, 3) of a part's triangles, mm, frame of the part.

    Raises `SurfaceError` if the file cannot be read, is no STL, is cut short, too large, empty, or
    holds NaN.
    """
    try:
        return part_triangles(file)
    except EncodedObjectsError as error:
        raise SurfaceError(error.cause, fix=error.fix, place=error.place) from error


def part_mesh(file: str | os.PathLike[str], T_surface_part: ArrayLike | None = None) -> MeshSurface:
    """Return the height field of a written part (STL).

    `T_surface_part` (4, 4) leads to the surface frame, whose z points at the sensor; without it the
    part is as it lies in the file.

    Raises `SurfaceError` when the file is no STL or nothing of it can be seen along -z.
    """
    return mesh(written_triangles(file), T_surface_part, place=str(file))


@dataclass(frozen=True, slots=True, eq=False)
class RoundPart:
    """A written part, touched on one of its round faces."""

    corners_mm: Array  #: (n, 3, 3) object frame
    low_mm: Array  #: (n, 3) least coordinates of each triangle
    high_mm: Array  #: (n, 3) greatest
    round: RoundFace
    face: str
    region: FaceRegion  #: the unrolled face: where touches may have their centre
    name: str
    object_name: str

    def under(self, touch: Touch) -> Scene:
        """Return the scene of a touch: a surface in the plane that is tangent at its place.

        Raises `SurfaceError` if nothing of the part is there.
        """
        x, y = touch.x_mm, touch.y_mm
        T_object_plane = self.round.tangent(x, y)
        middle = (T_object_plane @ (x, y, 0.0, 1.0))[:3]
        near = (self.low_mm < middle + AROUND_MM) & (self.high_mm > middle - AROUND_MM)
        corners = self.corners_mm[near.all(axis=1)]
        a, b, c = corners.transpose(1, 0, 2)
        seen = np.cross(b - a, c - a) @ T_object_plane[:3, 2] > 0
        T_plane_object = np.linalg.inv(T_object_plane)
        surface = mesh(corners[seen], T_plane_object, place=self.name)
        return Scene(surface, self.region, self.name, self.object_name, self.face,
                     T_object_plane, self.under)  # fmt: skip

    def scene(self) -> Scene:
        """Return the face, as a touch of its middle meets it."""
        x, y = Scene(FlatPlate(), self.region, self.name).centre_mm().tolist()
        return self.under(Touch(x, y, 0.0, 0.0))


def round_part(
    file: str | os.PathLike[str], held: RegisteredObject, part: RegisteredPart, face: RegisteredFace
) -> RoundPart:
    """Return a written part (STL) to be touched on a round face.

    Raises `SurfaceError` if the face is flat, or the file is no STL.
    """
    name = f"{held.entry.name}/{face.name}"
    if face.round is None:
        raise SurfaceError(f"{name} is flat", fix="touch it as a flat face")
    T = part.T_object_part
    corners = written_triangles(file) @ T[:3, :3].T + T[:3, 3]
    low, high, region = corners.min(axis=1), corners.max(axis=1), polygon([face.round.outline_mm])
    return RoundPart(corners, low, high, face.round, face.name, region, name, held.entry.name)
