"""A piece: what is placed on the array as a whole, one face or several faces of a net.

Lattice (mm, per face) -> Piece: a small grid that says which face owns which cell, and the
transform of each face into the grid's plane. Grid cell (r, c) has its centre at
((c + 1/2) p, -(r + 1/2) p), p = pitch, mm, as cells of the array have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from generator.layout.lattice import Lattice
from generator.layout.places import Identifies, count_places


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


def piece_of(
    faces: Sequence[int],
    poses: Sequence[PiecePose],
    lattice: Lattice,
    pitch_mm: float,
    window: tuple[int, int],
    identifies: Identifies | None = None,
) -> Piece:
    """Return the piece that a lattice shows.

    Parameters
    ----------
    faces
        Numbers of the faces, one per region of the lattice.
    poses
        T_net_face, in the frame in which the lattice was chosen.
    lattice, pitch_mm
        The lattice and its pitch.
    window, identifies
        As for `choose_lattice`: they decide which quarter turns are allowed.
    """
    owner, low, high = _grid(lattice)
    lattice_poses = [
        _turn_pose(pose, lattice.rotation_rad, *_corner(lattice, low, high, pitch_mm))
        for pose in poses
    ]
    piece = Piece(tuple(faces), tuple(lattice_poses), owner, lattice.places, (0,))
    piece = turn_piece(piece, lattice.quarter, pitch_mm)
    return Piece(
        piece.faces, piece.poses, piece.owner, lattice.places, _turns(piece, window, identifies)
    )


def turn_piece(piece: Piece, quarter: int, pitch_mm: float) -> Piece:
    """Return the piece turned counter-clockwise by quarter turns, its grid at the origin again.

    `places` and `turns` are kept as they are: only turns in `turns` are allowed afterwards.
    """
    poses, owner = piece.poses, piece.owner
    for _ in range(quarter % 4):
        height = owner.shape[1] * pitch_mm  # of the turned grid
        poses = tuple(
            PiecePose(pose.rotation_rad + np.pi / 2, -pose.y_mm, pose.x_mm - height)
            for pose in poses
        )
        owner = np.ascontiguousarray(np.rot90(owner))
    return Piece(piece.faces, poses, owner, piece.places, piece.turns)


def _grid(lattice: Lattice) -> tuple[NDArray[np.int64], tuple[int, int], tuple[int, int]]:
    """Return the owner of every cell in the bounding box, and its least and greatest (j, i)."""
    cells = np.concatenate(lattice.cells)
    if len(cells) == 0:
        return np.empty((0, 0), dtype=np.int64), (0, 0), (0, 0)
    low, high = cells.min(axis=0), cells.max(axis=0)
    owner = np.full(high - low + 1, -1, dtype=np.int64)
    for k, own in enumerate(lattice.cells):
        owner[high[0] - own[:, 0], own[:, 1] - low[1]] = k
    return owner, (int(low[0]), int(low[1])), (int(high[0]), int(high[1]))


def _corner(
    lattice: Lattice, low: tuple[int, int], high: tuple[int, int], pitch: float
) -> tuple[float, float]:
    """Return the shift that brings the grid's upper left corner to the origin, mm."""
    return (
        -(lattice.x_mm + (low[1] - 0.5) * pitch),
        -(lattice.y_mm + (high[0] + 0.5) * pitch),
    )


def _turn_pose(pose: PiecePose, rotation: float, x: float, y: float) -> PiecePose:
    """Return the pose followed by a rotation about the origin and a shift."""
    c, s = float(np.cos(rotation)), float(np.sin(rotation))
    return PiecePose(
        pose.rotation_rad + rotation,
        c * pose.x_mm - s * pose.y_mm + x,
        s * pose.x_mm + c * pose.y_mm + y,
    )


def _turns(piece: Piece, window: tuple[int, int], identifies: Identifies | None) -> tuple[int, ...]:
    """Return the quarter turns under which no face loses a place."""
    allowed = [0]
    for quarter in (1, 2, 3):
        owner = np.rot90(piece.owner, quarter)
        if all(
            count_places(*_cells(owner == k), window, identifies) >= places
            for k, places in enumerate(piece.places)
        ):
            allowed.append(quarter)
    return tuple(allowed)


def _cells(mask: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    rows, columns = np.nonzero(mask)
    return rows.astype(np.int64), columns.astype(np.int64)
