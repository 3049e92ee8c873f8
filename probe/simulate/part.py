"""Written parts as surfaces: what was printed is what is touched.

STL file -> Scene. With the database in which the part is registered, the surface stands in
the frame of a face; a file alone stands as it lies on the printer's bed (z up, centred on x
and y), with its face up if it is a panel. Thesis 6.3.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from probe.simulate.scene import Scene
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
    from probe.simulate.registered_part import registered_part_surface  # loads the database

    return registered_part_surface(path, database, object_name, face)
