"""Parts and meshes -> the scene of one view: all parts in the object frame, mm.

Coordinates stand in three rows, (3, N): what a view asks for, extents and depths, runs along them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.export.faces import (
    centre_and_normal,
    named_facets,
    object_faces,
    symbol_triangles,
)
from generator.export.settings import PREVIEW
from generator.solid.part import Facet, Part
from generator.solid.triangulate import Mesh

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PreviewScene:
    """All parts in the object frame."""

    vertices: Points  #: (3, N) mm
    triangles: NDArray[np.int64]  #: (T, 3)
    symbols: NDArray[np.bool_]  #: (T,) whether a triangle belongs to a symbol
    faces: NDArray[np.int64]  #: (T,) named face that a triangle belongs to, -1 for none
    edges: Points  #: (E, 2, 3) mm, of the bodies
    names: list[str]
    centres: Points  #: (F, 3) mm, of the named faces
    normals: Points  #: (F, 3)


def both_scenes(parts: Sequence[Part], meshes: Sequence[Mesh]) -> tuple[PreviewScene, PreviewScene]:
    """Return the object as it is put together, and with its panels moved apart."""
    turned = [part.T_object_part[:3, :3] @ mesh.vertices.T
              for part, mesh in zip(parts, meshes, strict=True)]  # fmt: skip
    closed = _scene(parts, meshes, turned, 0.0)
    apart = _scene(parts, meshes, turned, PREVIEW.apart) if len(parts) > 1 else closed
    return closed, apart


def _scene(
    parts: Sequence[Part], meshes: Sequence[Mesh], turned: Sequence[Points], apart: float
) -> PreviewScene:
    """Gather all parts in the object frame; panels move out by a share of the size.

    Closed panels hide their backs, so these are left out unless the panels move apart.

    Parameters
    ----------
    turned
        (3, n) vertices of each mesh, mm, along the object's axes and from the part's origin.
    """
    placed = [part.T_object_part for part in parts]
    bodies = [part.vertices @ T[:3, :3].T + T[:3, 3] for part, T in zip(parts, placed, strict=True)]
    distance = apart * float(np.ptp(np.concatenate(bodies), axis=0).max())
    vertices, triangles, symbols, owners, edges = [], [], [], [], []
    names: list[str] = []
    centres, normals = [], []
    first = 0
    for part, mesh, body, points, T in zip(parts, meshes, bodies, turned, placed, strict=True):
        faces = named_facets(part, alone=len(parts) == 1)
        shapes = [centre_and_normal(body, part.facets[number]) for _, number in faces]
        shift = distance * shapes[0][1]
        numbers = np.arange(len(part.facets))
        if len(parts) > 1 and not apart:
            towards = [centre_and_normal(body, facet)[1] @ shapes[0][1] for facet in part.facets]
            numbers = np.flatnonzero(np.array(towards) > PREVIEW.back)
        belongs = object_faces(part) if len(parts) == 1 else np.arange(len(part.facets))
        vertices.append(points + (T[:3, 3] + shift)[:, None])
        of_symbols, owner = symbol_triangles(part, mesh), np.full(len(part.facets), -1)
        owner[[number for _, number in faces]] = np.arange(len(faces)) + len(names)
        owner = owner[belongs]
        shown = np.zeros(len(part.facets), np.bool_)
        shown[numbers] = True
        kept = np.flatnonzero(shown[mesh.facets])
        triangles.append(mesh.triangles[kept] + first)
        first += len(mesh.vertices)
        symbols.append(of_symbols[kept])
        owners.append(owner[mesh.facets[kept]])
        edges.append(body[_edges([(part.facets[k], int(belongs[k])) for k in numbers])] + shift)
        names += [name for name, _ in faces]
        centres += [centre + shift for centre, _ in shapes]
        normals += [normal for _, normal in shapes]
    return PreviewScene(
        np.concatenate(vertices, axis=1),
        np.concatenate(triangles),
        np.concatenate(symbols),
        np.concatenate(owners),
        np.concatenate(edges),
        names,
        np.array(centres),
        np.array(normals),
    )


def _edges(facets: Sequence[tuple[Facet, int]]) -> NDArray[np.int64]:
    """Return (E, 2) vertices of the edges of facets, without those inside of one face."""
    faces: dict[tuple[int, int], set[int]] = {}
    alone: set[tuple[int, int]] = set()
    for facet, face in facets:
        for loop in facet.loops:
            for a, b in zip(loop, (*loop[1:], loop[0]), strict=True):
                pair = (min(a, b), max(a, b))
                alone ^= {pair}
                faces.setdefault(pair, set()).add(face)
    kept = [pair for pair, both in faces.items() if len(both) > 1 or pair in alone]
    return np.array(sorted(kept), np.int64)
