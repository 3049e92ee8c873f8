"""A registered part as a surface: in the frame of one of its faces, as its database knows them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from generator.database.open import normal_url, part_file
from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
from probe.errors import SurfaceError
from probe.simulate.registered import face_of, registered_object, registered_parts
from probe.simulate.round import round_part
from probe.simulate.scene import Scene
from probe.simulate.settings import FACE_AROUND
from probe.simulate.written import part_mesh
from probe.surface.polygon import polygon


def registered_part_surface(path: Path, database: str, object_name: str, face: str) -> Scene:
    """Return the surface of a registered part; see `part_surface`."""
    held, part = _registered_part(database, path, object_name)
    return scene_of_part(path, held, part, face)


def scene_of_part(path: Path, held: RegisteredObject, part: RegisteredPart, face: str) -> Scene:
    """Return the surface of a part of an object that was read before; see `part_surface`.

    Parameters
    ----------
    path
        Of the part's file.
    held, part
        What the database knows of it.
    face
        Which face lies up; empty: as in `part_surface`.
    """
    up = _face_up(held, part, face)
    if up.round is not None:
        return round_part(path, held, part, up).scene()
    T_face_part = np.linalg.inv(up.T_object_face) @ part.T_object_part
    return Scene(
        surface=part_mesh(path, T_face_part),
        region=polygon(up.polygon_mm),
        name=f"{path.name}/{up.name}",
        object_name=held.entry.name,
        face=up.name,
        T_object_surface=up.T_object_face,
    )


def _registered_part(
    database: str, path: Path, object_name: str
) -> tuple[RegisteredObject, RegisteredPart]:
    """Return the part that a file holds: of this path, or else of this file name."""
    stated = part_file(normal_url(database), str(path))
    named = registered_object(database, object_name) if object_name else None
    parts = (
        [(named.entry.name, part) for part in named.parts] if named else registered_parts(database)
    )
    known = [(name, part) for name, part in parts if part.format == "stl"]
    same = [held for held in known if held[1].file == stated]
    alike = [held for held in known if Path(held[1].file).name == path.name]
    for name, part in same + alike:
        return named or registered_object(database, name), part
    shown = ", ".join(Path(part.file).name for _, part in known[:8])
    raise SurfaceError(
        f"{path.name} is not registered in {database}",
        fix=f"its STL parts: {shown or 'none'}{', ...' if len(known) > 8 else ''}",
        place=str(path),
    )


def _face_up(held: RegisteredObject, part: RegisteredPart, name: str) -> RegisteredFace:
    """Return the face asked for; of a panel, the one whose plane its top lies in."""
    if name or len(held.parts) == 0:
        return face_of(held, name)
    panels = sum(other.format == part.format for other in held.parts) == len(held.faces)
    for face in held.faces:
        T = np.linalg.inv(part.T_object_part) @ face.T_object_face
        if panels and part.name.endswith(f"-{face.name}") and T[2, 2] > FACE_AROUND.up:
            return face
    return face_of(held)
