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
from generator.plane.polygon import face_vector
from generator.polyhedron.read.merge import merge_triangles
from generator.polyhedron.read.soup import Soup, cluster_labels, weld_coarsely
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
    vertices, faces = merge_triangles(soup)
    return _mesh_polyhedron(kind, scale * vertices, faces)


def _mesh_polyhedron(kind: str, vertices: Floats, faces: list[Loops]) -> Polyhedron:
    """Return the solid of a mesh; of more than `MOST_FACES`, curved regions stay blank.

    Planar faces are called F1, F2, ... in the order of the file, then each round wall and each
    curved region is one face of many facets: F9, F9.2, F9.3, ...
    """
    solid = polyhedron(kind, vertices, faces)
    vertices, loops = solid.vertices, [face.loops for face in solid.faces]
    normals, areas = _normals(vertices, loops)
    walls = round_walls(solid, normals)
    round_facets = {facet for wall, _ in walls for facet in wall.facets}
    regions = []
    if len(faces) > MOST_FACES:
        regions = _curved_regions(vertices, loops, normals, areas)
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
        notes=(*solid.notes, *_notes(vertices, loops, regions, first + len(walls))),
    )


def _curved_regions(
    vertices: Floats, faces: list[Loops], normals: Floats, areas: Floats
) -> list[list[int]]:
    """Return the faces of each curved surface, in order."""
    owner: dict[tuple[int, int], int] = {}
    pairs: list[tuple[int, int]] = []
    lengths: list[float] = []
    for number, loops in enumerate(faces):
        for loop in loops:
            for a, b in zip(loop, (*loop[1:], loop[0]), strict=True):
                if (b, a) in owner:
                    pairs.append((owner.pop((b, a)), number))
                    lengths.append(float(np.linalg.norm(vertices[a] - vertices[b])))
                else:
                    owner[a, b] = number
    one, other = np.array(pairs, np.intp).T
    length = np.array(lengths)
    cross = np.linalg.norm(np.cross(normals[one], normals[other]), axis=1)
    turn = np.arctan2(cross, np.einsum("ij,ij->i", normals[one], normals[other]))
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    joined = turn <= SMOOTH_RAD
    for face in (one, other):
        width = areas[face] / np.maximum(length, 1e-9)
        strip = (turn <= FAINT_RAD) & (width < STRIP * size)
        joined &= strip | (width < BEND * size * turn)
    label = cluster_labels(np.arange(len(faces)), one[joined], other[joined])
    curved = np.zeros(len(faces), bool)
    curved[one[joined]] = curved[other[joined]] = True
    found: dict[int, list[int]] = {}
    for face in np.flatnonzero(curved).tolist():
        found.setdefault(int(label[face]), []).append(face)
    return [found[key] for key in sorted(found)]


def _normals(vertices: Floats, faces: list[Loops]) -> tuple[Floats, Floats]:
    """Return unit normals (n, 3) and areas (n,)."""
    vectors = np.array([face_vector([vertices[list(loop)] for loop in f]) for f in faces])
    lengths = np.linalg.norm(vectors, axis=1)
    return vectors / np.maximum(lengths, 1e-300)[:, None], lengths / 2


def _notes(
    vertices: Floats, faces: list[Loops], regions: list[list[int]], first: int
) -> tuple[str, ...]:
    if not regions:
        return ()
    facets = sum(map(len, regions))
    places = []
    for number, region in enumerate(regions[:LISTED], first):
        points = vertices[[v for f in region for loop in faces[f] for v in loop]]
        x, y, z = ((points.min(axis=0) + points.max(axis=0)) / 2).tolist()
        places.append(f"F{number} about ({x:.4g}, {y:.4g}, {z:.4g})")
    more = f" and {len(regions) - LISTED} more" if len(regions) > LISTED else ""
    what = "region stays" if len(regions) == 1 else "regions stay"
    note = (
        f"{len(regions)} curved {what} blank, {facets} of {len(faces)} facets: "
        f"{', '.join(places)}{more}; export the model as STEP: there "
        "cylinders and cones carry symbols"
    )
    return (note,)
