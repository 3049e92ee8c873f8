"""Mesh -> binary STL, mm, in the part's own frame.

Coordinates are 32-bit floats: near the local origin they resolve 1e-5 mm at 100 mm. The
mesh shares vertices by number, so a vertex has the same bytes in all its triangles and the
file is as closed as the mesh.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from generator.solid.triangulate import Mesh

_HEADER = b"encoded-objects binary STL, mm".ljust(80, b" ")
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_BLOCK = 16_384  # triangles written at once: they stay in the cache


def stl_chunks(mesh: Mesh) -> Iterator[bytes | memoryview]:
    """Yield the file of a mesh, piece by piece.

    Normals are of unit length, or zero where the corners lie on a line.
    """
    yield _HEADER + struct.pack("<I", len(mesh.triangles))
    for start in range(0, len(mesh.triangles), _BLOCK):
        corners = mesh.vertices[mesh.triangles[start : start + _BLOCK]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        facets = np.zeros(len(corners), _FACET)
        facets["normal"] = np.divide(normals, lengths, out=normals, where=lengths > 0)
        facets["corners"] = corners
        yield facets.view(np.uint8).data
