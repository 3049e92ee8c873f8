"""Pieces of a layout, and plans made of them, before they have cells on the array.

A piece is what is placed on the array as a whole: one face, or several faces of a net. It is a
small grid that says which face owns which cell, and the transform of each face into the grid's
plane; grid cell (r, c) has its centre at ((c + 1/2) p, -(r + 1/2) p), p = pitch, mm, as cells
of the array have. Plan `faces` gives every face a lattice of its own, plan `net` lets one run
through each piece of the unfolded object. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from generator.array.contract import SymbolArray
from generator.layout.footprint import ROUNDING, Region, move_region
from generator.layout.lattice import Lattice, LatticeRequest
from generator.layout.places import count_places
from generator.layout.unfold import Net
from generator.polyhedron.winged import Polyhedron


@dataclass(frozen=True, slots=True)
class PiecePose:
    """Rigid transform of a face into the plane of a piece: u = R x + (x_mm, y_mm)."""

    rotation_rad: float
    x_mm: float
    y_mm: float


@dataclass(frozen=True, slots=True)
class Piece:
    """Cells that keep their arrangement on the array."""

    faces: tuple[int, ...]  #: numbers of the faces in their polyhedron
    poses: tuple[PiecePose, ...]  #: T_piece_face, one per face
    owner: NDArray[np.int64]  #: (rows, columns): position in `faces`, -1 where no symbol stands
    places: tuple[int, ...]  #: identifiable places per face
    turns: tuple[int, ...]  #: quarter turns that show as many places; 0 comes first

    @property
    def cells(self) -> int:
        """Number of array cells that the piece takes."""
        return int(np.count_nonzero(self.owner >= 0))


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
    request: LatticeRequest
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
    if not faces:
        return Piece((), (), np.empty((0, 0), dtype=np.int64), (), (0,))
    regions = [
        move_region(task.regions[face], pose.rotation_rad, pose.x_mm, pose.y_mm)
        for face, pose in zip(faces, poses, strict=True)
    ]
    lattice = task.request.choose(regions, search=search)
    shown = zip(lattice.cells, lattice.places, strict=True)
    lattice = replace(lattice, cells=tuple(own if places else own[:0] for own, places in shown))
    return piece_of(faces, poses, lattice, task.request)


def piece_of(
    faces: tuple[int, ...], poses: Sequence[PiecePose], lattice: Lattice, request: LatticeRequest
) -> Piece:
    """Return the piece that a lattice shows of faces, whose poses T_net_face lie in its plane."""
    pitch, cells = request.pitch_mm, np.concatenate(lattice.cells)
    low, high = np.zeros(2, np.int64), np.full(2, -1)
    if len(cells):
        low, high = cells.min(axis=0), cells.max(axis=0)
    owner = np.full(high - low + 1, -1, dtype=np.int64)
    for k, own in enumerate(lattice.cells):
        owner[high[0] - own[:, 0], own[:, 1] - low[1]] = k
    # The grid's upper left corner comes to the origin.
    x = -(lattice.x_mm + (int(low[1]) - 0.5) * pitch)
    y = -(lattice.y_mm + (int(high[0]) + 0.5) * pitch)
    c, s = float(np.cos(lattice.rotation_rad)), float(np.sin(lattice.rotation_rad))
    turned = tuple(
        PiecePose(
            pose.rotation_rad + lattice.rotation_rad,
            c * pose.x_mm - s * pose.y_mm + x,
            s * pose.x_mm + c * pose.y_mm + y,
        )
        for pose in poses
    )
    piece = Piece(faces, turned, owner, lattice.places, (0,))
    piece = turn_piece(piece, lattice.quarter, pitch)
    return replace(piece, turns=_turns(piece, request))


def turn_piece(piece: Piece, quarter: int, pitch_mm: float) -> Piece:
    """Return the piece turned counter-clockwise by quarter turns, its grid at the origin again.

    Only turns in `turns` are allowed afterwards, which is kept as it is.
    """
    poses, owner = piece.poses, piece.owner
    for _ in range(quarter % 4):
        height = owner.shape[1] * pitch_mm  # of the turned grid
        poses = tuple(
            PiecePose(pose.rotation_rad + np.pi / 2, -pose.y_mm, pose.x_mm - height)
            for pose in poses
        )
        owner = np.ascontiguousarray(np.rot90(owner))
    return replace(piece, poses=poses, owner=owner)


def _turns(piece: Piece, request: LatticeRequest) -> tuple[int, ...]:
    """Return the quarter turns under which no face loses a place."""
    allowed = [0]
    for quarter in (1, 2, 3):
        owner = np.rot90(piece.owner, quarter)
        cells = (np.argwhere(owner == k).astype(np.int64) for k in range(len(piece.places)))
        counts = [
            count_places(own[:, 0], own[:, 1], request.window, request.identifies) for own in cells
        ]
        if all(count >= least for count, least in zip(counts, piece.places, strict=True)):
            allowed.append(quarter)
    return tuple(allowed)
