"""Name a surface in one word, as `sim:` ports and `probe-sensor simulate` do.

::

    part.stl                     a written part as it lies
    lab.db#Cube/F1               a face of a registered object
    sqlite:///lab.db#Cube        its first face that bears symbols
    part.stl@lab.db              a written part, in the frame of its face
    washer                       the washer that the thesis pressed

What follows the last '/' after '#' is a face if the object has one of that name. A written part
is touched as it was printed; one that no database registers stands as it lies on the printer's
bed (z up, centred on x and y), with its face up if it is a panel. Thesis 6.3.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from probe.errors import SurfaceError
from probe.simulate.scene import Scene
from probe.surface.indenters import Washer
from probe.surface.polygon import polygon

WASHER = "washer"


def surface_of(target: str) -> Scene:
    """Return the scene that a target names.

    Raises `SurfaceError` when nothing stands behind it; the message lists the objects or faces that
    are known.
    """
    if target == WASHER:
        return _washer()
    database, mark, rest = target.partition("#")
    if mark:
        from probe.simulate.registered import registered_objects, registered_surface

        name, _, face = rest.rpartition("/")
        if not name or rest in registered_objects(database):
            name, face = rest, ""
        return registered_surface(database, name, face)
    file, mark, database = target.rpartition("@")
    if mark and Path(file).suffix.lower() == ".stl":
        return part_surface(file, database=database)
    if Path(target).suffix.lower() == ".stl":
        return part_surface(target)
    raise SurfaceError(
        "this names no surface",
        fix="write part.stl, or database#object/face such as lab.db#Cube/F1",
        place=target,
    )


def part_surface(file: str | os.PathLike[str], *, database: str = "", face: str = "") -> Scene:
    """Return the surface of a written part (STL), in its face's frame or its own.

    Parameters
    ----------
    database
        Where it is registered; empty: the part as it lies, whoever it belongs to.
    face
        Which face lies up; empty: the face of a panel, or the first face of a whole body
        that bears symbols.

    Raises
    ------
    SurfaceError
        When the file is no STL, or the database does not know it.
    """
    path = Path(file)
    if database:
        from probe.simulate.registered import registered_part, scene_of_part  # loads the database

        return scene_of_part(path, *registered_part(database, path), face)
    from probe.simulate.written import part_mesh

    surface = part_mesh(path)
    low, high = surface.corners[:, :, :2].min((0, 1)), surface.corners[:, :, :2].max((0, 1))
    box = [low, (high[0], low[1]), high, (low[0], high[1])]
    return Scene(surface, polygon([np.array(box)]), path.name)


def _washer() -> Scene:
    half = Washer().outer_mm / 2
    square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    return Scene(Washer(), polygon([square]), WASHER)
