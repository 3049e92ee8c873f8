"""Lay the faces of an object onto the array: which cell stands where on which face.

Polyhedron (mm) + Array + pitch + taken cells -> Layout. Two ways, of which `auto` takes the one
that shows more places: `faces` gives every face a lattice of its own, `net` unfolds the object
and lets one lattice run through each piece of the net (symbols that an edge would cut are left
out). Either way a face ends with one rigid transform to the array. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.array.contract import SymbolArray
from generator.errors import LayoutError
from generator.layout.blank import describe_blank, remedies
from generator.layout.footprint import Region, region_of
from generator.layout.lattice import LatticeRequest
from generator.layout.occupancy import Occupancy
from generator.layout.piece import (
    LayoutPlan,
    LayoutTask,
    Piece,
    PiecePose,
    faces_plan,
    net_piece,
    net_plan,
    piece_of,
    turn_piece,
)
from generator.layout.placement import FaceLayout, Layout, Placement
from generator.layout.places import rank_test
from generator.layout.torus import TorusPosition, place_pieces
from generator.layout.unfold import split, unfold
from generator.polyhedron.frame import face_polygon
from generator.polyhedron.winged import Polyhedron

Clearances = Sequence[Sequence[NDArray[np.float64]]]  #: [face][loop] -> (edges,) mm
Outlines = Mapping[int, Sequence[NDArray[np.float64]]]  #: face -> loops (k, 2) mm, face frame

NONE: Outlines = MappingProxyType({})


def lay_out(
    polyhedron: Polyhedron,
    array: SymbolArray,
    pitch_mm: float,
    footprint_half_mm: float,
    clearances_mm: Clearances,
    occupied: Occupancy | tuple[ArrayLike, ArrayLike],
    kind: str = "auto",
    *,
    blank_faces: Collection[int] = (),
    allow_blank_faces: bool = False,
    developed: Outlines = NONE,
    prints: Callable[[float], bool] = lambda _: True,
) -> Layout:
    """Choose the cells of every face, none of them used before.

    Parameters
    ----------
    polyhedron, array, pitch_mm
        The object, mm; the array that all objects share; distance of neighbouring symbols.
    footprint_half_mm
        Half side of the square, turned with the lattice, that a symbol needs.
    clearances_mm
        Per face and loop (k,): least distance from a footprint to each edge; entry e belongs to
        the edge from vertex e to vertex e + 1 of the loop.
    occupied
        What is taken of the array, or rows and columns (n,) of the taken cells.
    kind
        `auto`, `faces` or `net`.
    blank_faces, allow_blank_faces
        Faces that shall carry no symbols; leave others without an identifiable place blank and
        warn, instead of refusing.
    developed
        Outlines in place of a face's own: of a round face, unrolled, for the facet that stands for
        it; of a face less what others cover. Such an object has no net.
    prints
        Whether symbols of a pitch (mm) can be made, for what a refusal proposes.

    Raises
    ------
    LayoutError
        A face shows no place, or the array is full.
    """
    outlines = [
        developed.get(face) or face_polygon(polyhedron, face)
        for face in range(len(polyhedron.faces))
    ]
    round_faces = bool(developed or polyhedron.surfaces or polyhedron.blank)
    if round_faces and kind == "net":
        raise LayoutError(
            "an object with round or covered faces has no net",
            fix="set layout to faces, or leave it out",
        )
    regions = tuple(
        region_of(outline, clearances)
        for outline, clearances in zip(outlines, clearances_mm, strict=True)
    )
    request = LatticeRequest(footprint_half_mm, pitch_mm, array.window, rank_test(array))
    task = LayoutTask(polyhedron, array, request, regions, frozenset(blank_faces))

    plans = []
    if kind != "net":
        plans.append(faces_plan(task))
    if kind != "faces" and not round_faces:
        plans.append(net_plan(task, unfold(polyhedron)))
    plans.sort(key=lambda plan: plan.worth, reverse=True)  # stable: faces first among equals

    warning = _without_place(task, plans[0], allow_blank_faces, prints)
    if not isinstance(occupied, Occupancy):
        occupied = Occupancy.from_cells(*occupied, array)
    for plan in plans:
        if plan.worth[0] < plans[0].worth[0]:
            continue  # a full array is no reason to lose a face
        placed = _place_plan(task, plan, occupied)
        if placed is not None:
            if placed[0] is not plans[0]:  # other pieces may show other faces
                warning = _without_place(task, placed[0], allow_blank_faces, prints)
            return _layout(task, *placed, warning)
    raise _full_array_error(plans[0], occupied)


def lay_out_face(
    region: Region, array: SymbolArray, pitch_mm: float, footprint_half_mm: float
) -> FaceLayout:
    """Return how one face (mm) would be laid out by itself at the array's first cell."""
    request = LatticeRequest(footprint_half_mm, pitch_mm, array.window, rank_test(array))
    lattice = request.choose([region], search=False)
    piece = piece_of((0,), (PiecePose(0.0, 0.0, 0.0),), lattice, request)
    return _face_layout(array, pitch_mm, piece, 0, TorusPosition(0, 0, 0))


def _without_place(
    task: LayoutTask, plan: LayoutPlan, allowed: bool, prints: Callable[[float], bool]
) -> tuple[str, ...]:
    """Return the warning about faces without a place; raise it unless they are allowed."""
    shown = {
        face: places
        for piece in plan.pieces
        for face, places in zip(piece.faces, piece.places, strict=True)
    }
    faces = sorted(face for face, places in shown.items() if places == 0)
    if not faces:
        return ()
    lattices = [task.request.choose([task.regions[face]], search=True) for face in faces]
    names = {task.polyhedron.faces[face].name: task.regions[face] for face in faces}
    cause = describe_blank(names, [len(lattice.cells[0]) for lattice in lattices], task.request)
    if allowed:
        return (f"{cause}; left blank",)
    if plan.kind == "net" and all(any(lattice.places) for lattice in lattices):
        raise LayoutError(
            f"{cause} in the net's lattice", fix="set layout to faces, which turns each lattice"
        )
    raise LayoutError(cause, fix=remedies(list(names.values()), task.request, prints))


def _place_plan(
    task: LayoutTask, plan: LayoutPlan, occupancy: Occupancy
) -> tuple[LayoutPlan, tuple[TorusPosition | None, ...]] | None:
    """Place a plan; pieces of a net that find no place are cut in two until they do."""
    while True:
        positions = place_pieces(occupancy, [(p.owner >= 0, p.turns) for p in plan.pieces])
        lost = [k for k, p in enumerate(plan.pieces) if p.cells and positions[k] is None]
        if not lost:
            return plan, tuple(positions)
        if plan.net is None or any(len(plan.net.pieces[k]) < 2 for k in lost):
            return None
        net = plan.net
        for k in reversed(lost):
            net = split(net, k)
        known = dict(zip(plan.net.pieces, plan.pieces, strict=True))
        plan = LayoutPlan(
            plan.kind,
            tuple(known.get(faces) or net_piece(task, net, faces) for faces in net.pieces),
            net,
        )


def _layout(
    task: LayoutTask,
    plan: LayoutPlan,
    positions: tuple[TorusPosition | None, ...],
    warnings: tuple[str, ...],
) -> Layout:
    none = np.empty(0, dtype=np.int64)
    count = len(task.polyhedron.faces)
    faces = [
        FaceLayout(face, Placement(0, 0, 0.0, 0.0, 0.0), none, none, none, np.empty((0, 2)), 0)
        for face in range(count)
    ]
    for piece, at in zip(plan.pieces, positions, strict=True):
        if at is not None:
            lying = turn_piece(piece, at.quarter, task.request.pitch_mm)
            for k, face in enumerate(piece.faces):
                if piece.places[k]:
                    pitch = task.request.pitch_mm
                    faces[face] = _face_layout(task.array, pitch, lying, k, at)
    blank = tuple(face.face for face in faces if len(face.rows) == 0)
    return Layout(plan.kind, task.request.pitch_mm, tuple(faces), blank, warnings)


def _face_layout(
    array: SymbolArray, pitch: float, piece: Piece, k: int, at: TorusPosition
) -> FaceLayout:
    """Return one face of a piece that has been turned and has its position."""
    pose = piece.poses[k]
    r, c = (index.astype(np.int64) for index in np.nonzero(piece.owner == k))
    rotation = math.remainder(pose.rotation_rad, 2 * math.pi)
    cosine, sine = math.cos(rotation), math.sin(rotation)
    u, v = (c + 0.5) * pitch - pose.x_mm, -(r + 0.5) * pitch - pose.y_mm
    rows, columns = (r + at.row) % array.rows, (c + at.column) % array.columns
    return FaceLayout(
        piece.faces[k],
        Placement(at.row, at.column, rotation, pose.x_mm, pose.y_mm),
        rows,
        columns,
        array.symbols(rows, columns),
        np.column_stack([cosine * u + sine * v, cosine * v - sine * u]),
        piece.places[k],
    )


def _full_array_error(plan: LayoutPlan, occupancy: Occupancy) -> LayoutError:
    needed = -plan.worth[2]
    cause = (
        f"the array {occupancy.rows}x{occupancy.columns} is full: the object needs {needed} "
        f"cells, {occupancy.free} of {occupancy.rows * occupancy.columns} are free"
    )
    if needed <= occupancy.free:
        cause += ", but not in blocks that hold its faces"
    fix = "set profile: auto, which takes an array that is large enough"
    return LayoutError(cause, fix=f"{fix}, or start a new database" if occupancy.used else fix)
