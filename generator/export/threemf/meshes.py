"""Part -> the meshes that it puts on a bed: body and symbols, each as the text of 3MF.

Part frame in, plate frame out; mm.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.export.bed import BedPlace, Size
from generator.export.fixed_text import number_lines
from generator.export.threemf.package import DeflatedText, deflate_text
from generator.solid.part import Part
from generator.solid.triangulate import Mesh, body_mesh, symbol_meshes

PLACES = 6  #: decimals of a coordinate in mm
BODY, SYMBOLS = 0, 1  #: materials
_BLOCK = 8_192  # vertices or triangles formatted at once: their text stays in the cache


@dataclass(frozen=True, slots=True)
class BedMesh:
    """A mesh whose vertices are all in use."""

    name: str
    material: int  #: `BODY` or `SYMBOLS`
    vertices: NDArray[np.float64]  #: (N, 3) mm
    triangles: NDArray[np.int64]  #: (M, 3)

    def vertex_text(self) -> DeflatedText:
        """Return the elements of its vertices."""
        return deflate_text(self._vertex_lines())

    def triangle_text(self, first: int = 0, properties: str = "") -> DeflatedText:
        """Return the elements of its triangles, whose vertices are numbered from `first`."""
        return deflate_text(self._triangle_lines(first, properties))

    def _vertex_lines(self) -> Iterator[bytes]:
        for start in range(0, len(self.vertices), _BLOCK):
            some = self.vertices[start : start + _BLOCK]
            yield number_lines(('<vertex x="', '" y="', '" z="', '"/>\n'), some, PLACES)

    def _triangle_lines(self, first: int, properties: str) -> Iterator[bytes]:
        words = ('<triangle v1="', '" v2="', '" v3="', f'"{properties}/>\n')
        for start in range(0, len(self.triangles), _BLOCK):
            yield number_lines(words, self.triangles[start : start + _BLOCK] + first, 0)


@dataclass(frozen=True, slots=True)
class BedPart:
    """What one part puts on the bed: body and symbols (None without symbols)."""

    name: str
    body: BedMesh
    symbols: BedMesh | None
    low: NDArray[np.float64]  #: (3,) lowest x, y, z, mm
    size: Size

    @property
    def meshes(self) -> tuple[BedMesh, ...]:
        """Body and symbols."""
        return (self.body,) if self.symbols is None else (self.body, self.symbols)


def bed_part(part: Part) -> BedPart:
    """Return the meshes of a part."""
    symbols = [mesh for mesh in symbol_meshes(part) if len(mesh.triangles)]
    return _bed_part(part.name, f"{part.name} body", (body_mesh(part),), symbols)


def bed_part_of_mesh(name: str, mesh: Mesh) -> BedPart:
    """Return a mesh without symbols."""
    return _bed_part(name, f"{name} body", (mesh,), ())


def move_to_bed(mesh: BedMesh, part: BedPart, place: BedPlace) -> BedMesh:
    """Return a mesh of a part where it lies on the bed."""
    x, y, z = part.low.tolist()
    points = mesh.vertices
    if place.turned:  # (x, y) -> (-y, x)
        points = np.column_stack([-points[:, 1], points[:, 0], points[:, 2]])
        corner = (-(y + part.size[1]), x)
    else:
        corner = (x, y)
    shift = np.array([place.x_mm - corner[0], place.y_mm - corner[1], -z])
    return BedMesh(mesh.name, mesh.material, points + shift, mesh.triangles)


def _bed_part(name: str, body_name: str, body: Sequence[Mesh], symbols: Sequence[Mesh]) -> BedPart:
    own = BedMesh(body_name, BODY, *_join_meshes(body))
    points, stuck = own.vertices, None
    if symbols:
        stuck = BedMesh(f"{name} symbols", SYMBOLS, *_join_meshes(symbols))
        points = np.vstack([points, stuck.vertices])
    low, high = points.min(axis=0), points.max(axis=0)
    return BedPart(name, own, stuck, low, (float(high[0] - low[0]), float(high[1] - low[1])))


def _join_meshes(meshes: Sequence[Mesh]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices and triangles of meshes as one, with the vertices that a triangle uses."""
    vertices, triangles = [], []
    first = 0
    for mesh in meshes:
        used = np.zeros(len(mesh.vertices), np.bool_)
        used[mesh.triangles] = True
        numbers = np.cumsum(used) - 1 + first
        vertices.append(mesh.vertices[used])
        triangles.append(numbers[mesh.triangles])
        first += len(vertices[-1])
    return np.concatenate(vertices), np.concatenate(triangles)
