"""Parts -> the object as one rigid body: what is seen, what is hit, mass, and frames of faces.

Seen: the bodies of all parts in one mesh, and the symbols. Hit: the plain shape as convex
pieces, and where asked for the symbols as convex pieces of their own, each piece one mesh that
stands wherever its symbol does. Mass, centre and inertia: of the parts as they are printed,
symbols and marks included, all solid; an object of panels is hollow. Object frame, m, kg.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.errors import SolidError
from generator.export.colours import BODY_RGB, RGB, SYMBOL_RGB
from generator.layout.placement import Layout
from generator.polyhedron import Polyhedron, face_frame
from generator.solid import Mesh, Part, body_mesh, emboss_whole, symbol_meshes
from generator.solid.convex import ConvexPieces, ConvexSettings, convex_pieces
from generator.solid.emboss import to_part, turn
from generator.solid.measure import inertia_of
from generator.solid.triangulate import closed_template

Floats = NDArray[np.float64]
M = 1e-3  #: metres in a millimetre


@dataclass(frozen=True, slots=True, eq=False)
class ModelMesh:
    """A mesh of a model."""

    name: str  #: of the mesh, and with .obj of its file
    vertices: Floats  #: (n, 3) m
    triangles: NDArray[np.int64]  #: (m, 3)
    colour: RGB = BODY_RGB


@dataclass(frozen=True, slots=True, eq=False)
class PlacedMesh:
    """A mesh and where it stands."""

    mesh: ModelMesh
    T_object_mesh: Floats  #: (4, 4) m


@dataclass(frozen=True, slots=True, eq=False)
class FaceFrame:
    """A face and its frame."""

    face: str  #: "F1"
    name: str  #: "Cube-F1", unique among objects
    T_object_face: Floats  #: (4, 4) m


@dataclass(frozen=True, slots=True, eq=False)
class RobotModel:
    """An object as one rigid body."""

    name: str
    mass_kg: float
    centre_m: Floats  #: (3,) of mass, object frame
    inertia_kg_m2: Floats  #: (3, 3) about the centre of mass, axes of the object
    visuals: tuple[ModelMesh, ...]
    collisions: tuple[PlacedMesh, ...]  #: convex each
    frames: tuple[FaceFrame, ...]
    warnings: tuple[str, ...] = ()

    @property
    def meshes(self) -> tuple[ModelMesh, ...]:
        """All meshes, each once."""
        return tuple(dict.fromkeys((*self.visuals, *(c.mesh for c in self.collisions))))


def robot_model(
    name: str,
    polyhedron: Polyhedron,
    parts: Sequence[Part],
    meshes: Sequence[Mesh],
    *,
    density_kg_m3: float,
    symbols_collide: bool = False,
) -> RobotModel:
    """Return the model of an object.

    Parameters
    ----------
    name
        Of the object.
    polyhedron
        Its shape.
    parts, meshes
        What is printed: panels or the whole body, and the mesh of each, part frame, mm.
    density_kg_m3
        Of the plastic.
    symbols_collide
        Whether other bodies feel the symbols.

    Raises
    ------
    SolidError
        Symbols on a round face are to collide.
    """
    corners = [
        _moved(part.T_object_part, mesh.vertices)[mesh.triangles]
        for part, mesh in zip(parts, meshes, strict=True)
    ]
    inertia = inertia_of(np.concatenate(corners))
    body, warnings = _body_pieces(name, polyhedron)
    placed = [PlacedMesh(mesh, np.eye(4)) for mesh in body]
    if symbols_collide:
        placed += _placed_symbols(name, parts)
    return RobotModel(
        name=name,
        mass_kg=density_kg_m3 * inertia.volume * M**3,
        centre_m=inertia.centre * M,
        inertia_kg_m2=density_kg_m3 * inertia.tensor * M**5,
        visuals=tuple(_visuals(name, parts)),
        collisions=tuple(placed),
        frames=tuple(_frames(name, polyhedron)),
        warnings=warnings,
    )


def _visuals(name: str, parts: Sequence[Part]) -> Iterator[ModelMesh]:
    """Yield the bodies of all parts in one mesh, and their symbols in another."""
    yield _mesh_of(
        f"{name}-visual-body",
        [(_moved(p.T_object_part, m.vertices), m.triangles) for p in parts for m in [body_mesh(p)]],
        BODY_RGB,
    )
    symbols = [
        (_moved(part.T_object_part, mesh.vertices), mesh.triangles)
        for part in parts
        for mesh in symbol_meshes(part)
    ]
    if symbols:
        yield _mesh_of(f"{name}-visual-symbols", symbols, SYMBOL_RGB)


def _body_pieces(name: str, polyhedron: Polyhedron) -> tuple[list[ModelMesh], tuple[str, ...]]:
    """Return the plain shape as convex meshes, and what they lack."""
    plain = emboss_whole(polyhedron, Layout("faces", 1.0, ()), (), name)
    mesh = body_mesh(plain)
    found = convex_pieces(_moved(plain.T_object_part, mesh.vertices), mesh.triangles)
    warnings: tuple[str, ...] = ()
    if found.depth_mm > ConvexSettings().depth_mm:
        warnings = (
            f"{len(found.pieces)} convex collision pieces stand out up to {found.depth_mm:.1f} mm",
        )
    return _piece_meshes(f"{name}-collision", found), warnings


def _placed_symbols(name: str, parts: Sequence[Part]) -> Iterator[PlacedMesh]:
    """Yield the convex pieces of every symbol where they stand."""
    pieces: dict[int, list[ModelMesh]] = {}
    for part in parts:
        if part.wrapped:
            raise SolidError(
                "symbols on a round face cannot collide: each is bent in its own way",
                fix="set robot: {collision: body}",
                place=part.name,
            )
        for embossing in part.embossings:
            if embossing.face is None:
                continue
            T_part_symbol = embossing.T_part_facet.copy()
            T_part_symbol[:3, :2] = T_part_symbol[:3, :2] @ turn(embossing.rotation_rad)
            centres = to_part(embossing, embossing.centres_mm, 0.0)
            for label, centre in zip(embossing.labels.tolist(), centres, strict=True):
                if label not in pieces:
                    solid = closed_template(embossing.tiers[label])
                    found = convex_pieces(solid.points, solid.own)
                    pieces[label] = _piece_meshes(f"{name}-symbol-{label}", found)
                T_part_symbol[:3, 3] = centre
                T = part.T_object_part @ T_part_symbol
                T[:3, 3] *= M
                yield from (PlacedMesh(mesh, T) for mesh in pieces[label])


def _piece_meshes(stem: str, found: ConvexPieces) -> list[ModelMesh]:
    return [
        ModelMesh(f"{stem}-{number}", M * vertices, triangles)
        for number, (vertices, triangles) in enumerate(found.pieces, 1)
    ]


def _frames(name: str, polyhedron: Polyhedron) -> Iterator[FaceFrame]:
    """Yield the frame of every face; a round face has that of its first facet."""
    done: set[str] = set()
    for number, facet in enumerate(polyhedron.faces):
        face = re.sub(r"\..*", "", facet.name)
        if face not in done:
            done.add(face)
            T = face_frame(polyhedron, number)
            T[:3, 3] *= M
            yield FaceFrame(face, f"{name}-{face}", T)


def _mesh_of(
    name: str, pieces: Sequence[tuple[Floats, NDArray[np.int64]]], colour: RGB
) -> ModelMesh:
    """Return one mesh, m, of pieces in mm; corners that no triangle needs are left out."""
    vertices, triangles, count = [], [], 0
    for points, index in pieces:
        used, numbers = np.unique(index, return_inverse=True)
        vertices.append(points[used])
        triangles.append(numbers.reshape(-1, 3) + count)
        count += len(used)
    return ModelMesh(name, M * np.concatenate(vertices), np.concatenate(triangles), colour)


def _moved(T: Floats, points: Floats) -> Floats:
    moved: Floats = points @ T[:3, :3].T + T[:3, 3]
    return moved
