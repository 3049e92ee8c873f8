"""Polygons of a mesh -> the solid that they enclose. Lengths in mm.

Where a mesh makes no solid as it stands, points a little farther apart are welded: programs
that round what they cut leave walls of a thousandth of a millimetre, which touch themselves.
"""

from __future__ import annotations

from dataclasses import replace

from generator.errors import ShapeError
from generator.polyhedron.read.merge import merge_triangles
from generator.polyhedron.read.regions import mesh_polyhedron
from generator.polyhedron.read.soup import Soup, weld_coarsely
from generator.polyhedron.winged import Polyhedron


def solid_of_soup(soup: Soup, kind: str, scale: float = 1.0) -> Polyhedron:
    """Return the solid of closed polygons, its curved regions `blank`.

    Parameters
    ----------
    soup
        Polygons of one body.
    kind
        Of the polyhedron.
    scale
        How many times larger it is made about the origin.

    Raises
    ------
    ShapeError
        As `merge_triangles` and `polyhedron` say of the mesh as it stands.
    """
    try:
        return _solid(soup, kind, scale)
    except ShapeError as error:
        coarse = weld_coarsely(soup)
        if len(coarse.points) == len(soup.points):
            raise
        try:
            solid = _solid(coarse, kind, scale)
        except ShapeError:
            raise error from None
    note = f"points nearer than {2.0 * scale * coarse.noise:.2g} mm were joined"
    return replace(solid, notes=(note, *solid.notes))


def _solid(soup: Soup, kind: str, scale: float) -> Polyhedron:
    vertices, faces = merge_triangles(soup)
    return mesh_polyhedron(kind, scale * vertices, faces)
