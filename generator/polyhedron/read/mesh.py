"""Polygons of a mesh -> the solid that they enclose: round walls, other curved regions `blank`.

Where a mesh makes no solid as it stands, points a little farther apart are welded: programs
that round what they cut leave walls of a thousandth of a millimetre, which touch themselves.

In a mesh of many faces, two that meet at a small angle belong to one curved surface where they
are narrow for that angle: a strip of width w that turns by a has the radius w / a, which for a
fillet or a bore is small against the solid, and for a plane that a fillet meets is not. Lengths
in mm, angles in rad; shares are of the size.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from generator.errors import ShapeError
from generator.polyhedron.frame import face_vectors, size
from generator.polyhedron.read.merge import merge_triangles
from generator.polyhedron.read.soup import Soup, cluster_labels, middle_text, weld_coarsely
from generator.polyhedron.read.walls import BEND, SMOOTH_RAD, round_walls
from generator.polyhedron.winged import Face, Polyhedron, polyhedron, winged_edges

Floats = NDArray[np.float64]
Loops = tuple[tuple[int, ...], ...]
MOST_FACES = 100  #: of more, those that bend belong to curved surfaces, and stay blank
FAINT_RAD = 0.02  #: strips that meet at less belong to one curved surface of any radius
STRIP = 0.05  #: width of such a strip, as a share of the size
LISTED = 6  # regions that a note names with their places


def solid_of_soup(soup: Soup, kind: str, scale: float = 1.0) -> Polyhedron:
    """Return the solid of closed polygons, `scale` times larger.

    Raises `ShapeError` as `merge_triangles` and `polyhedron` do of the mesh as it stands.
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
    """Return the solid of a mesh; of more than `MOST_FACES`, curved regions stay blank.

    Planar faces are called F1, F2, ... in the order of the file, then each round wall and each
    curved region is one face of many facets: F9, F9.2, F9.3, ...
    """
    vertices, faces = merge_triangles(soup)
    solid = polyhedron(kind, scale * vertices, faces)
    vectors, loops = face_vectors(solid), [face.loops for face in solid.faces]
    lengths = np.linalg.norm(vectors, axis=1)
    normals = vectors / np.maximum(lengths, 1e-300)[:, None]
    walls = round_walls(solid, normals)
    round_facets = {facet for wall, _ in walls for facet in wall.facets}
    regions = []
    if len(faces) > MOST_FACES:
        regions = _curved_regions(solid, normals, lengths / 2)
        regions = [[f for f in region if f not in round_facets] for region in regions]
        regions = [region for region in regions if region]
    if not walls and not regions:
        return solid
    for wall, facets in walls:
        for facet, loop in zip(wall.facets, facets, strict=True):
            loops[facet] = (loop,)
    blank = {face for region in regions for face in region}
    planar = (f for f in range(len(loops)) if f not in blank and f not in round_facets)
    names = {face: f"F{number}" for number, face in enumerate(planar, 1)}
    first = len(names) + 1
    runs = [list(wall.facets) for wall, _ in walls] + regions
    for number, run in enumerate(runs, first):
        names |= {f: f"F{number}.{k}" if k > 1 else f"F{number}" for k, f in enumerate(run, 1)}
    return replace(
        solid,
        faces=tuple(Face(names[k], own) for k, own in enumerate(loops)),
        edges=winged_edges(loops),
        surfaces=tuple(wall for wall, _ in walls),
        blank=tuple(sorted(blank)),
        notes=(*solid.notes, *_notes(solid.vertices, loops, regions, first + len(walls))),
    )


def _curved_regions(solid: Polyhedron, normals: Floats, areas: Floats) -> list[list[int]]:
    """Return the faces of each curved surface, in order; of all: normals (F, 3), areas (F,)."""
    one, other = np.array([(edge.left, edge.right) for edge in solid.edges], np.intp).T
    ends = solid.vertices[[(edge.start, edge.end) for edge in solid.edges]]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    cross = np.linalg.norm(np.cross(normals[one], normals[other]), axis=1)
    turn = np.arctan2(cross, np.einsum("ij,ij->i", normals[one], normals[other]))
    joined = turn <= SMOOTH_RAD
    for face in (one, other):
        width = areas[face] / np.maximum(length, 1e-9)
        strip = (turn <= FAINT_RAD) & (width < STRIP * size(solid))
        joined &= strip | (width < BEND * size(solid) * turn)
    label = cluster_labels(np.arange(len(solid.faces)), one[joined], other[joined])
    curved = np.zeros(len(solid.faces), bool)
    curved[one[joined]] = curved[other[joined]] = True
    found: dict[int, list[int]] = {}
    for face in np.flatnonzero(curved).tolist():
        found.setdefault(int(label[face]), []).append(face)
    return [found[key] for key in sorted(found)]


def _notes(
    vertices: Floats, faces: list[Loops], regions: list[list[int]], first: int
) -> tuple[str, ...]:
    if not regions:
        return ()
    facets = sum(map(len, regions))
    places = []
    for number, region in enumerate(regions[:LISTED], first):
        points = vertices[[v for f in region for loop in faces[f] for v in loop]]
        places.append(f"F{number} about {middle_text(points)}")
    more = f" and {len(regions) - LISTED} more" if len(regions) > LISTED else ""
    what = "region stays" if len(regions) == 1 else "regions stay"
    note = (
        f"{len(regions)} curved {what} blank, {facets} of {len(faces)} facets: "
        f"{', '.join(places)}{more}; export the model as STEP: there "
        "cylinders and cones carry symbols"
    )
    return (note,)
