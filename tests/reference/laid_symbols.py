"""Symbols laid on faces without an array, and what a closed mesh holds."""

import numpy as np

from generator.layout.placement import FaceLayout, Layout, Placement
from generator.plane.polygon import boxes_inside
from generator.polyhedron.frame import face_polygon
from generator.solid.closed import edges_once
from generator.solid.part import turn


def filled(solid, pitch, free, *, turned=0.0, order=4, chance=None, share=1.0):
    """Return a layout with a symbol wherever a square of half side `free` fits into a face.

    The lattice is in the middle of a face's box; with a share below 1 it stands anywhere, and so
    many of its cells are shown.
    """
    chance = chance or np.random.default_rng(0)
    R = turn(-turned)
    faces = []
    for face in range(len(solid.faces)):
        rings = [ring @ R for ring in face_polygon(solid, face)]
        low, high = rings[0].min(axis=0), rings[0].max(axis=0)
        count = np.ceil((high - low) / pitch).astype(int) + 1
        down, right = np.meshgrid(np.arange(count[1]), np.arange(count[0]), indexing="ij")
        cells = np.stack([right.ravel(), down.ravel()], axis=1)
        first = low + ((high - low) % pitch + pitch) / 2
        if share < 1.0:
            first = low + chance.random(2) * pitch
        centres = first + cells * pitch
        keep = boxes_inside(centres, free, rings) & (chance.random(len(cells)) < share)
        labels = chance.integers(0, order, int(keep.sum()))
        place = Placement(0, 0, turned, 0.0, 0.0)
        rows, columns = -cells[keep, 1] % 63, cells[keep, 0]
        faces.append(FaceLayout(face, place, rows, columns, labels, centres[keep] @ R.T, 1))
    return Layout("faces", pitch, tuple(faces))


def layout_on_round_face(solid, centres, labels, rotation=0.0, pitch=7.0):
    """Return a layout of symbols at places (mm) in the development of a solid's round side."""
    none = np.empty(0, np.int64)
    place = Placement(0, 0, 0.0, 0.0, 0.0)
    count = len(solid.faces)
    faces = [FaceLayout(k, place, none, none, none, np.empty((0, 2)), 0) for k in range(count)]
    carrier = solid.surfaces[0].carrier
    numbers = np.arange(len(labels))
    faces[carrier] = FaceLayout(
        carrier, Placement(0, 0, rotation, 0.0, 0.0), numbers, numbers,
        np.array(labels, np.int64), np.array(centres, float).reshape(-1, 2), 1,
    )  # fmt: skip
    return Layout("faces", pitch, tuple(faces))


def mesh_volume(mesh):
    """Return the volume that triangles enclose."""
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def is_closed(mesh):
    """Whether every edge of the triangles is run through once in each direction."""
    return edges_once(mesh.triangles.ravel(), np.roll(mesh.triangles, -1, axis=1).ravel())
