"""Plans: what a layout would show, before it has cells on the array.

LayoutTask (object, regions, symbols) -> LayoutPlan: pieces with their lattices. `faces` gives
every face a lattice of its own, `net` lets one run through each piece of the unfolded object.
Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from generator.array.contract import SymbolArray
from generator.layout.blank import Request
from generator.layout.footprint import ROUNDING, Region, move_region
from generator.layout.lattice import Lattice, choose_lattice
from generator.layout.piece import Piece, PiecePose, piece_of
from generator.layout.unfold import Net
from generator.polyhedron.winged import Polyhedron


@dataclass(frozen=True, slots=True)
class LayoutPlan:
    """One way to lay out the object, before it has cells."""

    kind: str
    pieces: tuple[Piece, ...]
    net: Net | None

    @property
    def worth(self) -> tuple[int, int, int]:
        """Faces that are identified, then places, then few cells."""
        places = [n for piece in self.pieces for n in piece.places]
        return sum(n > 0 for n in places), sum(places), -sum(p.cells for p in self.pieces)


@dataclass(frozen=True, slots=True)
class LayoutTask:
    """What is to be laid out."""

    polyhedron: Polyhedron
    array: SymbolArray
    request: Request
    regions: tuple[Region, ...]  #: per face, face frame
    blank: frozenset[int]  #: faces that shall carry no symbols


def faces_plan(task: LayoutTask) -> LayoutPlan:
    """Give every face a lattice of its own; faces with equal polygons share the work."""
    known: dict[bytes, Piece] = {}
    pieces = []
    for face, region in enumerate(task.regions):
        if face in task.blank:
            continue
        step = ROUNDING * task.request.pitch_mm
        edges = np.column_stack([region.start, region.end, region.clearance])
        key = (np.round(edges / step) + 0.0).tobytes()
        if key not in known:
            known[key] = _piece(task, (face,), (PiecePose(0.0, 0.0, 0.0),), search=True)
        pieces.append(replace(known[key], faces=(face,)))
    return LayoutPlan("faces", tuple(pieces), None)


def net_plan(task: LayoutTask, net: Net) -> LayoutPlan:
    """Let one lattice run through each piece of the net."""
    pieces = tuple(net_piece(task, net, faces) for faces in net.pieces)
    return LayoutPlan("net", pieces, net)


def net_piece(task: LayoutTask, net: Net, faces: Sequence[int]) -> Piece:
    """Return some faces of a net, on one lattice."""
    shown = tuple(face for face in faces if face not in task.blank)
    poses = tuple(
        PiecePose(math.atan2(T[1, 0], T[0, 0]), float(T[0, 2]), float(T[1, 2]))
        for T in net.T_net_face[list(shown)]
    )
    return _piece(task, shown, poses, search=False)


def _piece(
    task: LayoutTask, faces: tuple[int, ...], poses: tuple[PiecePose, ...], *, search: bool
) -> Piece:
    """Choose the lattice of some faces and drop the cells of those that it does not identify."""
    request = task.request
    if not faces:
        return Piece((), (), np.empty((0, 0), dtype=np.int64), (), (0,))
    regions = [
        move_region(task.regions[face], pose.rotation_rad, pose.x_mm, pose.y_mm)
        for face, pose in zip(faces, poses, strict=True)
    ]
    lattice = choose_lattice(
        regions,
        request.half_mm,
        request.pitch_mm,
        request.window,
        request.identifies,
        search=search,
    )
    cells = tuple(
        own if places else own[:0]
        for own, places in zip(lattice.cells, lattice.places, strict=True)
    )
    lattice = replace(lattice, cells=cells)
    return piece_of(faces, poses, lattice, request.pitch_mm, request.window, request.identifies)


def face_lattice(task: LayoutTask, face: int) -> Lattice:
    """Return the best lattice of one face by itself."""
    request = task.request
    return choose_lattice(
        [task.regions[face]],
        request.half_mm,
        request.pitch_mm,
        request.window,
        request.identifies,
    )
