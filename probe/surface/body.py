"""Surfaces that are closed bodies: their triangles, and the library that cuts them.

Triangles (n, 3, 3) mm, counter-clockwise from outside <-> Manifold. Written parts are bodies;
what the database says of a face, and what a printer's beads leave, are height maps.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from probe.errors import SurfaceError
from probe.surface.contract import HeightMap

if TYPE_CHECKING:
    from manifold3d import Manifold

Array = NDArray[np.float64]


class Solid(Protocol):
    """A surface that is also known as a closed body."""

    @property
    def solid_mm(self) -> Array:
        """(n, 3, 3) corners of the triangles, counter-clockwise from outside, surface frame."""
        ...


def body_of(surface: HeightMap) -> Array:
    """Return the triangles (n, 3, 3) of a surface's body, mm, surface frame.

    Raises
    ------
    SurfaceError
        The surface is a height map alone.
    """
    body: Array | None = getattr(surface, "solid_mm", None)
    if body is None:
        raise SurfaceError(
            "a closed body is needed; this surface is a height map",
            fix="touch written files (--surfaces files), or take --engine own",
        )
    return body


def manifold_of(triangles_mm: Array) -> Manifold:
    """Return a body that can be cut.

    Raises
    ------
    SurfaceError
        The triangles close no body.
    """
    from manifold3d import Error, Manifold, Mesh

    corners, index = np.unique(triangles_mm.reshape(-1, 3), axis=0, return_inverse=True)
    body = Manifold(
        Mesh(
            vert_properties=corners.astype(np.float32),
            tri_verts=index.reshape(-1, 3).astype(np.uint32),
        )
    )
    if body.status() != Error.NoError:
        raise SurfaceError(
            f"the triangles close no body ({body.status().name})", fix="take a written part"
        )
    return body


def indexed_triangles(body: Manifold) -> tuple[Array, NDArray[np.int64]]:
    """Return corners (n, 3) mm and triangles (m, 3) of a body; both empty if nothing is left."""
    mesh = body.to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64).reshape(
        -1, mesh.vert_properties.shape[1]
    )
    return corners[:, :3], np.asarray(mesh.tri_verts, dtype=np.int64).reshape(-1, 3)
