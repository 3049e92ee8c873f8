"""Surfaces that are closed bodies: their triangles, and the library that cuts them.

Triangles (n, 3, 3) mm, counter-clockwise from outside <-> Manifold. Written parts are bodies;
what the database says of a face, and what a printer's beads leave, are heights alone.
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
    """A surface that may be known as a closed body, too."""

    @property
    def solid_mm(self) -> Array | None:
        """(n, 3, 3) corners of the triangles, counter-clockwise from outside, surface frame.

        None where what it rests on is heights alone.
        """
        ...


def body_of(surface: HeightMap) -> Array | None:
    """Return the triangles (n, 3, 3) of a surface's body, mm, surface frame; None: no body."""
    body: Array | None = getattr(surface, "solid_mm", None)
    return body


def manifold_of(triangles_mm: Array) -> Manifold:
    """Return a body that can be cut.

    Raises
    ------
    SurfaceError
        The triangles close no body.
    """
    corners, index = np.unique(triangles_mm.reshape(-1, 3), axis=0, return_inverse=True)
    return manifold_from(corners, index.reshape(-1, 3))


def manifold_from(corners_mm: Array, triangles: NDArray[np.int64]) -> Manifold:
    """Return a body of corners (n, 3) and triangles (m, 3); raises as `manifold_of`."""
    from manifold3d import Error, Manifold, Mesh

    vertices, index = corners_mm.astype(np.float32), triangles.astype(np.uint32)
    body = Manifold(Mesh(vert_properties=vertices, tri_verts=index))
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
