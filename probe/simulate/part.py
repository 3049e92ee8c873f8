"""Written parts as surfaces: what was printed is what is touched.

STL file -> Scene. With the database in which the part is registered, the surface stands in
the frame of a face; a file alone stands as it lies on the printer's bed (z up, centred on x
and y), with its face up if it is a panel. Thesis 6.3.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
from generator.database.url import normal_url, part_file
from probe.errors import SurfaceError
from probe.simulate.registered import face_of, registered_object, registered_objects
from probe.simulate.round import round_part
from probe.simulate.scene import Scene
from probe.simulate.settings import FACE_AROUND
from probe.simulate.written import part_mesh
from probe.surface.polygon import polygon


def part_surface(
    file: str | os.PathLike[str], *, database: str = "", object_name: str = "", face: str = ""
) -> Scene:
    """Return the surface of a written part.

    Parameters
    ----------
    file
        STL.
    database
        Where it is registered; empty: the part as it lies, whoever it belongs to.
    object_name
        Whose part it is; empty: found by the file's name.
    face
        Which face lies up; empty: the face of a panel, or the first face of a whole body
        that bears symbols.

    Returns
    -------
    Scene
        In the face frame, or in the part's frame without a database.

    Raises
    ------
    SurfaceError
        When the file is no STL, or the database does not know it.
    """
    path = Path(file)
    if not database:
        surface = part_mesh(path)
        low, high = surface.corners[:, :, :2].min((0, 1)), surface.corners[:, :, :2].max((0, 1))
        box = [low, (high[0], low[1]), high, (low[0], high[1])]
        return Scene(surface, polygon([np.array(box)]), path.name)
    held, part = _registered_part(database, path, object_name)
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
    names = [object_name] if object_name else registered_objects(database)
    stated = part_file(normal_url(database), str(path))
    known = [
        (held, part)
        for held in (registered_object(database, name) for name in names)
        for part in held.parts
        if part.format == "stl"
    ]
    for held, part in known:
        if part.file == stated:
            return held, part
    for held, part in known:
        if Path(part.file).name == path.name:
            return held, part
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
