"""How a part of one piece stands on the printer's bed: polyhedron -> the face that is down.

A face can be down if the whole solid lies above its plane, and its centre of mass above the area
that touches the bed. The model's own way up is kept where it is stable and hangs over hardly more
than the best way does; of the others the best has the largest area on the bed, less what hangs
over. Lengths in mm, areas in mm^2, object frame.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.plane.polygon import plane_axes
from generator.polyhedron.frame import dihedral, face_normal, face_polygon, face_vectors
from generator.polyhedron.winged import Polyhedron

Floats = NDArray[np.float64]

DOWN = np.array([0.0, 0.0, -1.0])
FLAT = 0.999  #: cosine from which a face looks straight down
LEVEL = 1e-6  #: height above the bed, as a share of the size, at which a face still touches it
CANDIDATES = 64  #: so many of the largest faces are tried
MORE_OVERHANG = 0.05  #: of the surface, by which the model's own way up may hang over more
BRIDGE_MM = 10.0  #: width that filament spans from wall to wall, without supports
SLENDER = 5.0  #: times the root of its area on the bed that a part may be high as it was modelled


@dataclass(frozen=True, slots=True)
class Stance:
    """The solid with one side down."""

    face: int  #: the face that is down, the largest on the bed
    on_bed: tuple[int, ...]  #: all faces that touch the bed
    R_bed_object: Floats  #: (3, 3) z up; the identity where it stands as modelled
    overhang_mm2: float  #: of all faces off the bed that need supports
    contact_mm2: float
    height_mm: float
    stable: bool  #: whether it stays so by itself

    @property
    def as_modelled(self) -> bool:
        """Whether the object's z is up."""
        return bool((self.R_bed_object == np.eye(3)).all())


def stance_on(polyhedron: Polyhedron, face: int, steepest_sine: float) -> Stance | None:
    """Return how the solid stands on a face; None where it cannot: others reach below its plane.

    `steepest_sine`: of the steepest overhang, from the vertical, that prints without supports.
    """
    return _stance(polyhedron, face, steepest_sine, face_vectors(polyhedron))


def best_stance(
    polyhedron: Polyhedron, flat: Collection[int], steepest_sine: float
) -> Stance | None:
    """Return how the solid stands best on one of its `flat` faces; None where it stands on none."""
    vectors = face_vectors(polyhedron)
    areas = np.linalg.norm(vectors, axis=1)
    order = sorted(flat, key=lambda face: (-areas[face], face))
    lowest = polyhedron.vertices[:, 2].min() + LEVEL * np.ptp(polyhedron.vertices, axis=0).max()
    own = [  # the way up of the model counts, however small the face
        face
        for face in order
        if vectors[face] @ DOWN > FLAT * areas[face]
        and polyhedron.vertices[polyhedron.faces[face].loops[0][0], 2] <= lowest
    ]
    tried = [
        _stance(polyhedron, face, steepest_sine, vectors)
        for face in dict.fromkeys((*own[:1], *order[:CANDIDATES]))
    ]
    stances = [stance for stance in tried if stance is not None and stance.stable]
    if not stances:
        return None
    first = stances[0]
    if own and first.face == own[0] and first.height_mm < SLENDER * first.contact_mm2**0.5:
        least = min(stance.overhang_mm2 for stance in stances)
        if first.overhang_mm2 <= least + MORE_OVERHANG * areas.sum():
            return first
    return max(stances, key=lambda stance: round(stance.contact_mm2 - stance.overhang_mm2, 3))


def bridges(polyhedron: Polyhedron, down: Floats) -> frozenset[int]:
    """Return the level ceilings of narrow pockets: walls all around carry them as they print.

    `down` (3,): unit vector, object frame.
    """
    edges: dict[int, list[int]] = {
        number: []
        for number, face in enumerate(polyhedron.faces)
        if len(face.loops[0]) > 3
        and face_normal(polyhedron, number) @ down > FLAT
        and min(np.ptp(face_polygon(polyhedron, number)[0], axis=0)) <= BRIDGE_MM
    }
    for number, edge in enumerate(polyhedron.edges if edges else ()):
        for face in (edge.left, edge.right):
            if face in edges:
                edges[face].append(number)
    return frozenset(
        face
        for face, own in edges.items()
        if all(dihedral(polyhedron, edge) > np.pi + 1e-6 for edge in own)
    )


def _stance(
    polyhedron: Polyhedron, face: int, steepest_sine: float, vectors: Floats
) -> Stance | None:
    points = polyhedron.vertices
    areas = np.linalg.norm(vectors, axis=1)
    down = vectors[face] / areas[face]
    low = points @ down
    level = low.max() - LEVEL * np.ptp(points, axis=0).max()
    towards = vectors @ down
    on_bed = [
        number
        for number in np.flatnonzero(towards > FLAT * areas).tolist()
        if low[list(polyhedron.faces[number].loops[0])].min() >= level
    ]
    if face not in on_bed:
        return None
    over = towards > steepest_sine * areas + 1e-9
    over[on_bed] = False
    over[list(bridges(polyhedron, down))] = False
    R = np.eye(3)
    if not np.allclose(down, DOWN, rtol=0.0, atol=1e-9):
        loop = polyhedron.faces[face].loops[0]
        R = np.array(plane_axes(-down, points[loop[1]] - points[loop[0]]))
    corners = [v for number in on_bed for v in polyhedron.faces[number].loops[0]]
    arms = (points[corners] - _centre_of_mass(polyhedron)) @ R[:2].T
    around = np.sort(np.arctan2(arms[:, 1], arms[:, 0]))
    widest = np.diff([*around, around[0] + 2.0 * np.pi]).max()
    on_bed.sort(key=lambda number: (number != face, -areas[number]))
    return Stance(
        face, tuple(on_bed), R, float(areas[over].sum()), float(areas[on_bed].sum()),
        float(np.ptp(low)), bool(widest < np.pi - 1e-6),
    )  # fmt: skip


def _centre_of_mass(polyhedron: Polyhedron) -> Floats:
    """Return the centre (3,) of the solid, from the tetrahedra over fans of all loops."""
    middle = polyhedron.vertices.mean(axis=0)
    fans = []
    for face in polyhedron.faces:
        for loop in face.loops:
            ring = polyhedron.vertices[list(loop)] - middle
            first = np.broadcast_to(ring[0], (len(ring) - 2, 3))
            fans.append(np.stack([first, ring[1:-1], ring[2:]], axis=1))
    a, b, c = np.moveaxis(np.concatenate(fans), 1, 0)
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.asarray(middle + six @ (a + b + c) / 4.0 / six.sum())
