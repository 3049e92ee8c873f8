"""Faces of registered objects, and their written parts, as surfaces. Thesis 6.3.

Database + object + face -> Scene in the face frame: the face with its symbols, and around it
the other faces that can be seen from above, with their symbols. Panels are taken as assembled,
without the gap along their edges. A part is the surface of its STL file; a round face, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection

from generator.database import DatabaseError
from generator.database.open import normal_url, open_database, part_file, part_path
from generator.database.read import find_object, list_objects, object_names, read_object, read_parts
from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
from generator.database.transaction import read_transaction
from probe.errors import SurfaceError
from probe.scan import surface_to_sensor
from probe.simulate.scene import Scene
from probe.simulate.written import part_mesh, round_part
from probe.surface.body import symbol_triangles, triangulate
from probe.surface.contract import HeightMap
from probe.surface.face import FaceSurface, LatticeSurface, list_lookup, template
from probe.surface.mesh import MeshSurface, mesh, transform_points
from probe.surface.polygon import polygon
from probe.surface.symbols import Relief, SymbolReliefs, emboss

Array = NDArray[np.float64]

DEEPEST_MM = 8.0  #: symbols of other faces that lie farther below a face are left out ...
BEYOND_MM = 40.0  #: ... and those farther outside its box
UP = 0.999  #: cosine from which a face of a panel lies up
FLAT = 1e-9  #: share of an object's size that is rounding


class DatabaseUnreadableError(SurfaceError):
    """A database that is not there, is no database, or is newer than this tool."""

    exit_code = 4


def registered_surface(database: str, object_name: str, face: str = "") -> Scene:
    """Return a face of a registered object; an empty name: the first one that bears symbols.

    Raises `SurfaceError` when the database (`lab.db`, `sqlite:///lab.db` or
    `postgresql://host/name`) cannot be read, or holds no such object or face; the message lists
    those that it holds.
    """
    return scene_of_face(database, registered_object(database, object_name), face)


def scene_of_face(database: str, held: RegisteredObject, face: str = "") -> Scene:
    """Return a face of an object that was read before; raises as `registered_surface`."""
    found = face_of(held, face)
    if found.round is None:
        return face_scene(held, found, _surface(held, found), f"{held.entry.name}/{found.name}")
    for part in held.parts:
        if part.format == "stl":
            return round_part(part_path(normal_url(database), part.file), held, part, found).scene()
    raise SurfaceError(
        f"{held.entry.name} has no STL file, and a round face is touched as it was written",
        fix="make it again with --format stl",
        place=database,
    )


def scene_of_part(path: Path, held: RegisteredObject, part: RegisteredPart, face: str) -> Scene:
    """Return the surface of a part (STL) of an object that was read before.

    An empty `face`: the face of a panel, or the first face of a whole body with symbols.
    """
    up = _face_up(held, part, face)
    if up.round is not None:
        return round_part(path, held, part, up).scene()
    T_face_part = np.linalg.inv(up.T_object_face) @ part.T_object_part
    return face_scene(held, up, part_mesh(path, T_face_part), f"{path.name}/{up.name}")


def face_scene(
    held: RegisteredObject, face: RegisteredFace, surface: HeightMap, name: str
) -> Scene:
    """Return the scene of a surface that is a face of an object, in the face frame."""
    region = polygon(face.polygon_mm)
    return Scene(surface, region, name, held.entry.name, face.name, face.T_object_face)


def registered_object(database: str, name: str) -> RegisteredObject:
    """Return a registered object; the only one if the name is empty."""
    with _connect(database) as connection:
        if name and find_object(connection, name) is not None:
            return read_object(connection, name)
        known = object_names(connection)
        if not name and len(known) == 1:
            return read_object(connection, known[0])
    shown = _first_names(known, 12)
    raise SurfaceError(
        f"no object is called '{name}'" if name else f"{len(known)} objects, none is named",
        fix=f"registered objects: {shown or 'none yet'}",
        place=database,
    )


def registered_objects(database: str) -> tuple[str, ...]:
    """Return the names of all registered objects, in order."""
    with _connect(database) as connection:
        return object_names(connection)


def registered_parts(database: str) -> list[tuple[str, RegisteredPart]]:
    """Return all parts with the names of their objects, in the order of these."""
    with _connect(database) as connection:
        return [
            (entry.name, part)
            for entry in list_objects(connection)
            for part in read_parts(connection, entry.object_id)
        ]


@contextmanager
def _connect(database: str) -> Iterator[Connection]:
    try:
        with read_transaction(open_database(database, writable=False)) as connection:
            yield connection
    except DatabaseError as error:
        place = error.place or database
        raise DatabaseUnreadableError(error.cause, fix=error.fix, place=place) from error


def face_of(held: RegisteredObject, name: str = "") -> RegisteredFace:
    """Return a face by its name; the first one that bears symbols if the name is empty."""
    for face in held.faces:
        if face.name == name or (not name and face.placement is not None):
            return face
    raise SurfaceError(
        f"no face is called '{name}'" if name else "no face bears symbols",
        fix=f"faces: {_first_names([face.name for face in held.faces], 12)}",
        place=held.entry.name,
    )


def registered_part(database: str, path: Path) -> tuple[RegisteredObject, RegisteredPart]:
    """Return the part that a file holds: of this path, or else of this file name."""
    stated = part_file(normal_url(database), str(path))
    known = [(name, part) for name, part in registered_parts(database) if part.format == "stl"]
    same_path = [held for held in known if held[1].file == stated]
    same_name = [held for held in known if Path(held[1].file).name == path.name]
    for name, part in same_path + same_name:
        return registered_object(database, name), part
    shown = _first_names([Path(part.file).name for _, part in known], 8)
    raise SurfaceError(
        f"{path.name} is not registered in {database}",
        fix=f"its STL parts: {shown or 'none'}",
        place=path,
    )


def _first_names(names: Sequence[str], most: int) -> str:
    return ", ".join(names[:most]) + (", ..." if len(names) > most else "")


def _face_up(held: RegisteredObject, part: RegisteredPart, name: str) -> RegisteredFace:
    """Return the named face, or the one whose plane holds the top of a panel."""
    if name or len(held.parts) == 0:
        return face_of(held, name)
    panels = sum(other.format == part.format for other in held.parts) == len(held.faces)
    for face in held.faces:
        T = np.linalg.inv(part.T_object_part) @ face.T_object_face
        if panels and part.name.endswith(f"-{face.name}") and T[2, 2] > UP:
            return face
    return face_of(held)


def _surface(held: RegisteredObject, face: RegisteredFace) -> FaceSurface:
    symbols = symbols_of(held)
    lattice = None
    cells = held.layout.faces[face.face_id]
    if face.placement is not None and len(cells.labels):
        place, pitch = face.placement, held.style.pitch_mm
        c, s = math.cos(place.rotation_rad), math.sin(place.rotation_rad)
        at = cells.centres_mm @ np.array([[c, s], [-s, c]]) + (place.x_mm, place.y_mm)
        columns, rows = np.rint(at / (pitch, -pitch) - 0.5).T
        look_up = list_lookup(rows, columns, cells.labels)
        at = place.rotation_rad, place.x_mm, place.y_mm
        lattice = LatticeSurface(template(symbols, pitch), look_up, *at)
    return FaceSurface(lattice, polygon(face.polygon_mm), _surrounding_mesh(held, face, symbols))


def symbols_of(held: RegisteredObject) -> SymbolReliefs:
    """Return the symbols of an object's alphabet in its relief."""
    style = held.style
    relief = Relief(style.height_mm, style.stroke_mm, style.draft_rad, style.chamfer_mm)
    definition: dict[str, Any] = held.alphabet
    glyphs = tuple(
        tuple((tuple(a), tuple(b)) for a, b in glyph["strokes"]) for glyph in definition["glyphs"]
    )
    return emboss(glyphs, definition["reach"] * style.pitch_mm, relief)


def _surrounding_mesh(
    held: RegisteredObject, face: RegisteredFace, symbols: SymbolReliefs
) -> MeshSurface | None:
    """Return all other faces that are seen from above, with symbols near this face."""
    T_face_object = np.linalg.inv(face.T_object_face)
    eps = FLAT * float(np.ptp(held.polyhedron.vertices, axis=0).max())
    low, high = polygon(face.polygon_mm).box_mm
    found: list[Array] = []
    for other in held.faces:
        if other.face_id == face.face_id:
            continue
        T = T_face_object @ other.T_object_face
        if T[2, 2] > FLAT:
            # Corners come from the object, so that neighbours share them to the last bit.
            loops = held.polyhedron.faces[other.face_id].loops
            corners = transform_points(held.polyhedron.vertices, T_face_object)
            numbers = np.concatenate([np.array(loop) for loop in loops])
            found.append(corners[numbers[triangulate(other.polygon_mm)]])
        if other.placement is None or T[2, 2] < -0.5:
            continue
        cells = held.layout.faces[other.face_id]
        at = transform_points(np.c_[cells.centres_mm, np.zeros(len(cells.labels))], T)
        reach = math.hypot(symbols.foot_half_mm * math.sqrt(2), symbols.relief.height_mm)
        near = (at[:, 2] + reach > -DEEPEST_MM) & (
            (at[:, :2] > low - BEYOND_MM) & (at[:, :2] < high + BEYOND_MM)
        ).all(axis=1)
        turn, turned = surface_to_sensor(0.0, 0.0, -other.placement.rotation_rad), np.eye(4)
        turned[:3, :3] = T[:3, :3] @ turn[:3, :3]
        for label in np.unique(cells.labels[near]):
            solid = transform_points(symbol_triangles(symbols, int(label)), turned)
            here = at[near & (cells.labels == label)]
            found.append((here[:, None, None] + solid).reshape(-1, 3, 3))
    if not found:
        return None
    corners = np.concatenate(found)
    corners[..., 2][np.abs(corners[..., 2]) < eps] = 0.0
    flat = corners[:, :, :2]
    ab, ac = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    seen = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0] > 0
    return mesh(corners[seen], place=held.entry.name) if seen.any() else None
