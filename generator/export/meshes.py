"""Parts and their triangles -> STL and GLB.

STL is binary, mm, part frame. Coordinates are 32-bit floats: near the local origin they resolve
1e-5 mm at 100 mm. Vertices are shared by number: the file is as closed as the mesh.

GLB (glTF 2.0, binary container) has one node for each face of the object, and body and symbols as
two materials. The faces' nodes ("F1", ...) are in the object frame, mm, z up; the root node scales
to the metres and turns to the y-up axes of glTF. Normals are left out: viewers then shade flat.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import BODY_RGB, RGB, SYMBOL_RGB
from generator.export.formats import ExportedObject, Files
from generator.solid.part import Part, transform
from generator.solid.triangulate import Mesh

_HEADER = b"encoded-objects binary STL, mm".ljust(80, b" ")
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_BLOCK = 16_384  # triangles written at once: they stay in the cache
#: Column-major: (x, y, z) mm -> (x, z, -y) / 1000 m.
_ROOT = [0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1]
_FLOAT, _UNSIGNED = 5126, 5125  # component types
_VERTICES, _INDICES = 34962, 34963  # buffer targets


def named_facets(part: Part, *, alone: bool) -> list[tuple[str, int]]:
    """Return name and number of the facets that are faces of the object.

    Of the only part (`alone`) these are all its facets; a round face has the name and the number of
    its first facet. A panel carries one face: the facet with the symbols, or its first one.
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
    facets of a symbol (F2/r1c2/top) belong to its face.
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


def join_meshes(
    pieces: Iterable[tuple[NDArray[np.float64], NDArray[np.int64]]],
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices (n, 3) and triangles (m, 3) of pieces as one, without unused vertices."""
    vertices, triangles, first = [], [], 0
    for points, index in pieces:
        used = np.zeros(len(points), np.bool_)
        used[index] = True
        vertices.append(points[used])
        triangles.append((np.cumsum(used) - 1 + first)[index])
        first += len(vertices[-1])
    return np.concatenate(vertices), np.concatenate(triangles)


def write_stl(_part: Part, mesh: Mesh) -> Iterator[bytes | memoryview]:
    """Return the STL file of a part."""
    return stl_chunks(mesh)


def write_glb(exported: ExportedObject) -> Files:
    """Yield the GLB file of an object."""
    yield f"{exported.name}.glb", glb_bytes(exported.name, exported.parts, exported.meshes)


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


def glb_bytes(name: str, parts: Sequence[Part], meshes: Sequence[Mesh]) -> bytes:
    """Return the file of an object; meshes in part frames, mm.

    Each facet of a single part is a node; of several parts each part is, named as its face.
    """
    buffer = _Buffer()
    nodes: list[dict[str, Any]] = [{"name": name, "matrix": _ROOT, "children": []}]
    shapes: list[dict[str, Any]] = []
    for node_name, vertices, triangles, embossed in _faces(parts, meshes):
        positions = buffer.positions(vertices)
        primitives = [
            {
                "attributes": {"POSITION": positions},
                "indices": buffer.indices(triangles[embossed == material]),
                "material": material,
            }
            for material in (0, 1)
            if (embossed == material).any()
        ]
        nodes[0]["children"].append(len(nodes))
        nodes.append({"name": node_name, "mesh": len(shapes)})
        shapes.append({"name": node_name, "primitives": primitives})
    content = {
        "asset": {"version": "2.0", "generator": "encoded-objects"},
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0]}],
        "nodes": nodes,
        "meshes": shapes,
        "materials": [_material("body", BODY_RGB), _material("symbols", SYMBOL_RGB)],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.size}],
    }
    text = json.dumps(content, separators=(",", ":")).encode("ascii")
    text += b" " * (-len(text) % 4)
    data = b"".join(buffer.blocks)
    return b"".join(
        [
            struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data)),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(data), b"BIN\0"),
            data,
        ]
    )


def _faces(
    parts: Sequence[Part], meshes: Sequence[Mesh]
) -> Iterator[tuple[str, NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]]:
    """Yield name, vertices in the object frame, triangles, and 1 for those of a symbol."""
    for part, mesh in zip(parts, meshes, strict=True):
        vertices = transform(part.T_object_part, mesh.vertices)
        embossed = symbol_triangles(part, mesh).astype(np.int64)
        if len(parts) > 1:
            [(name, _)] = named_facets(part, alone=False)
            groups = [(name, np.arange(len(mesh.triangles)))]
        else:
            faces = object_faces(part)[mesh.facets]
            groups = [
                (name, np.flatnonzero(faces == number))
                for name, number in named_facets(part, alone=True)
            ]
        for name, chosen in groups:
            yield name, *join_meshes([(vertices, mesh.triangles[chosen])]), embossed[chosen]


class _Buffer:
    def __init__(self) -> None:
        self.blocks: list[bytes] = []
        self.size = 0
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def positions(self, points: NDArray[np.float64]) -> int:
        """Append (n, 3) points; return their accessor."""
        values = points.astype("<f4")
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        kind = {"componentType": _FLOAT, "count": len(values), "type": "VEC3"}
        return self._append(values.tobytes(), _VERTICES, kind | bounds)

    def indices(self, triangles: NDArray[np.int64]) -> int:
        """Append (m, 3) vertex numbers; return their accessor."""
        values = triangles.astype("<u4")
        kind = {"componentType": _UNSIGNED, "count": values.size, "type": "SCALAR"}
        return self._append(values.tobytes(), _INDICES, kind)

    def _append(self, block: bytes, target: int, kind: dict[str, Any]) -> int:
        self.accessors.append({"bufferView": len(self.views)} | kind)
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": len(block)}
        self.views.append(view | {"target": target})
        self.blocks.append(block)
        self.size += len(block)
        return len(self.accessors) - 1


def _material(name: str, colour: RGB) -> dict[str, Any]:
    linear = [round(_linear(value / 255), 6) for value in colour]
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear, 1],
            "metallicFactor": 0,
            "roughnessFactor": 0.8,
        },
    }


def _linear(value: float) -> float:
    """Return the linear light of an sRGB value (IEC 61966-2-1)."""
    return value / 12.92 if value <= 0.04045 else float(((value + 0.055) / 1.055) ** 2.4)
