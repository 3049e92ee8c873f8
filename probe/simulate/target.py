"""Name a surface in one word, as `sim:` ports and `probe-sensor simulate` do.

::

    part.stl                     a written part as it lies
    lab.db#Cube/F1               a face of a registered object
    sqlite:///lab.db#Cube        its first face that bears symbols
    part.stl@lab.db              a written part, in the frame of its face
    washer                       the washer that the thesis pressed

What follows the last '/' after '#' is a face if the object has one of that name.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from probe.errors import SurfaceError
from probe.simulate.scene import Scene
from probe.surface.indenters import Washer
from probe.surface.polygon import polygon

WASHER = "washer"


def surface_of(target: str) -> Scene:
    """Return the scene that a target names.

    Raises
    ------
    SurfaceError
        When nothing stands behind it; the message lists the objects or faces that are known.

    Examples
    --------
    >>> scene = surface_of("lab.db#Cube/F1")
    >>> scene.object_name, scene.face, scene.surface.top_mm
    ('Cube', 'F1', 1.0)
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
        from probe.simulate.part import part_surface

        return part_surface(file, database=database)
    if Path(target).suffix.lower() == ".stl":
        from probe.simulate.part import part_surface

        return part_surface(target)
    raise SurfaceError(
        "this names no surface",
        fix="write part.stl, or database#object/face such as lab.db#Cube/F1",
        place=target,
    )


def _washer() -> Scene:
    half = Washer().outer_mm / 2
    square = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])
    return Scene(Washer(), polygon([square]), WASHER)
