"""Registered objects, arrays and alphabets for the page: JSON to draw them, a small picture.

An object is its faces (triangles on the object, places on the face), its symbols (label, place
on their face, pose on the object), and once per label the triangles of a symbol. A round face is
drawn as its facets; a place on them is one of the unrolled plane, and each of its symbols stands in
the plane that is tangent there. An array is the cells that objects hold. mm, rad. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, select

from generator.database import tables
from generator.database.read import list_objects, read_object
from generator.database.registered import RegisteredFace, RegisteredObject
from generator.database.transaction import of_rows
from probe.simulate.registered import symbols_of
from probe.surface.body import symbol_triangles, triangulate
from recognizer.touch.lab import EmbossedArray, Lab

Array = NDArray[np.float64]

DIGITS = 4  #: after the point, of mm: a tenth of a micrometre
VIEW = np.array([0.55, -1.0, 0.6])  #: from where the picture is seen, object frame, as on the page
SUN = np.array([0.25, -0.65, 1.0])
DARK, LIGHT = 52.0, 84.0  #: lightness (%) of faces in the shade and in the sun
DOT = 0.42  #: of a pitch, diameter of a symbol's dot


def objects_json(connection: Connection) -> list[dict[str, Any]]:
    """Return the list of objects."""
    return [
        {
            "name": entry.name, "type": entry.object_type, "faces": entry.faces,
            "symbols": entry.symbols, "profile": entry.profile,
            "array": [entry.rows, entry.columns], "pitch_mm": entry.pitch_mm,
            "registered": entry.utc, "retired": bool(entry.retired_utc),
        }
        for entry in list_objects(connection)
    ]  # fmt: skip


def object_json(connection: Connection, name: str) -> dict[str, Any]:
    """Return an object as solid and symbols.

    Raises DatabaseError: no object has this name.
    """
    held = read_object(connection, name)
    return {
        "name": held.entry.name, "type": held.entry.object_type, "profile": held.entry.profile,
        "registered": held.entry.utc,
        "pitch_mm": held.style.pitch_mm, "height_mm": held.style.height_mm,
        "faces": [_face(held, number) for number in drawn_faces(held)],
        "glyphs": _glyphs(held),
        "parts": [
            {"number": i, "name": part.name, "format": part.format}
            for i, part in enumerate(held.parts)
        ],
    }  # fmt: skip


def arrays_json(lab: Lab) -> list[dict[str, Any]]:
    """Return the arrays with the strokes of their alphabets, mm in the symbol's axes."""
    return [
        {
            "rows": encoding.array.rows, "columns": encoding.array.columns,
            "alphabet": encoding.alphabet.name, "pitch_mm": encoding.style.pitch_mm,
            "stroke_mm": encoding.style.stroke_mm, "cells": len(encoding.keys),
            "objects": len(encoding.names),
            "strokes": [
                (np.array(glyph.strokes, float) * unit).tolist()
                for glyph in encoding.alphabet.glyphs
            ],
        }
        for encoding in lab.arrays
        for unit in (encoding.alphabet.reach * encoding.style.pitch_mm,)
    ]  # fmt: skip


@of_rows
def map_json(connection: Connection, encoding: EmbossedArray) -> dict[str, Any]:
    """Return the cells of an array that objects hold, face by face."""
    owners, labels = encoding.owners[:-1], encoding.labels[:-1]
    order = np.argsort(owners, kind="stable")
    bounds = np.searchsorted(owners[order], np.arange(len(encoding.faces) + 1))
    faces = tables.faces.c
    found = connection.execute(select(faces.object_id, faces.face_id, faces.name))
    names = {(object_id, face_id): name for object_id, face_id, name in found}
    held = []
    for number, (object_id, face_id) in enumerate(encoding.faces.tolist()):
        mine = order[bounds[number] : bounds[number + 1]]
        rows, columns = np.divmod(encoding.keys[mine], np.uint64(encoding.array.columns))
        held.append(
            {
                "object": encoding.names[object_id], "face": names.get((object_id, face_id), ""),
                "rows": rows.tolist(), "columns": columns.tolist(),
                "labels": labels[mine].tolist(),
            }
        )  # fmt: skip
    return {
        "rows": encoding.array.rows, "columns": encoding.array.columns,
        "order": encoding.alphabet.order, "faces": held,
    }  # fmt: skip


def object_svg(held: RegisteredObject) -> str:
    """Return a small picture of an object as SVG: faces by their distance, symbols as dots."""
    look = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0.0, 0.0, 1.0], look)
    right /= np.linalg.norm(right)
    axes = np.stack([right, -np.cross(look, right), look], axis=1)  # x right, y down, z near
    seen = [
        drawing
        for number in drawn_faces(held)
        for drawing in _drawings(held, held.faces[number], number, axes)
    ]
    corners = np.concatenate([points for _, _, points in seen])
    x, y = corners.min(axis=0) - 1.0
    w, h = np.ptp(corners, axis=0) + 2.0
    body = "".join(text for _, text, _ in sorted(seen, key=lambda one: one[0]))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{x:.1f} {y:.1f} {w:.1f} {h:.1f}" '
        f'stroke-linejoin="round" stroke-linecap="round">{body}</svg>'
    )


def drawn_faces(held: RegisteredObject) -> list[int]:
    """Return the faces that are drawn, by number: of a round face's facets the carrier alone."""
    facets = {facet for face in held.faces if face.round is not None
              for facet in face.round.surface.facets}  # fmt: skip
    return [n for n, face in enumerate(held.faces) if n not in facets or face.round is not None]


def symbol_poses(face: RegisteredFace, centres_mm: Array) -> Array:
    """Return T_object_symbol of every symbol of a face, (S, 4, 4); none where it is blank."""
    if face.placement is None:
        return np.zeros((0, 4, 4))
    c, s = math.cos(-face.placement.rotation_rad), math.sin(-face.placement.rotation_rad)
    T_plane_symbol = np.tile(np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]),
                             (len(centres_mm), 1, 1))  # fmt: skip
    T_plane_symbol[:, :2, 3] = centres_mm
    if face.round is None:
        return np.asarray(face.T_object_face @ T_plane_symbol)
    tangents = np.array([face.round.tangent(x, y) for x, y in centres_mm.tolist()])
    return np.asarray(tangents.reshape(-1, 4, 4) @ T_plane_symbol)


def face_sheets(face: RegisteredFace) -> Iterator[list[Array]]:
    """Yield the flat sheets of a face as loops (k, 3), object frame: of a round face its facets."""
    if face.round is None:
        yield [_seated(face.T_object_face, loop) for loop in face.polygon_mm]
        return
    d = face.round.development
    quads = np.stack([d.low[:-1], d.low[1:], d.high[1:], d.high[:-1]], axis=1)
    for T, quad in zip(d.T_object_flat, quads, strict=True):
        yield [_seated(T, quad)]


def _face(held: RegisteredObject, number: int) -> dict[str, Any]:
    face, cells = held.faces[number], held.layout.faces[number]
    loops = face.polygon_mm if face.round is None else (face.round.outline_mm,)
    return {
        "name": face.name,
        "loops": [_rounded(loop) for loop in loops],
        "round": face.round is not None,
        "blank": face.placement is None,
        "labels": cells.labels.tolist(),
        "centres": _rounded(cells.centres_mm),
        "stands": [_rounded(pose[:3].ravel(), 6) for pose in symbol_poses(face, cells.centres_mm)],
        **_mesh_json(held, face),
    }


def _mesh_json(held: RegisteredObject, face: RegisteredFace) -> dict[str, Any]:
    """Return a face's triangles and outlines.

    `corners`: 9 numbers a triangle, object frame; `places`: 6 numbers a triangle, face frame or
    unrolled plane; `outlines`: lines of points, object frame, closed on a flat face.
    """
    if face.round is None:
        points = np.concatenate(face.polygon_mm)
        places = points[triangulate(face.polygon_mm)]
        corners = _seated(face.T_object_face, places)
        outlines = [_seated(face.T_object_face, loop) for loop in face.polygon_mm]
    else:
        d = face.round.development
        quads = np.stack([d.low[:-1], d.low[1:], d.high[1:], d.high[:-1]], axis=1)
        places = quads[:, [[0, 1, 2], [0, 2, 3]]]
        seats = zip(d.T_object_flat, places, strict=True)
        corners = np.stack([_seated(T, triangles) for T, triangles in seats])
        outlines = [held.polyhedron.vertices[ends] for ends in d.vertices.T]
    return {
        "corners": _rounded(corners.ravel()),
        "places": _rounded(places.ravel()),
        "outlines": [_rounded(loop) for loop in outlines],
    }


def _glyphs(held: RegisteredObject) -> list[list[float]]:
    """Return the triangles of every label's symbol, corner after corner."""
    symbols = symbols_of(held)
    labels = range(len(symbols.rings))
    return [_rounded(symbol_triangles(symbols, label).ravel()) for label in labels]


def _drawings(
    held: RegisteredObject, face: RegisteredFace, number: int, axes: Array
) -> Iterator[tuple[float, str, Array]]:
    """Yield depth, drawing and corners of the sheets of a face that are seen, then its symbols."""
    nearest = -np.inf
    for sheet in face_sheets(face):
        normal = face.T_object_face[:3, 2]
        if face.round is not None:
            normal = np.cross(sheet[0][1] - sheet[0][0], sheet[0][2] - sheet[0][1])
            normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
        if normal @ axes[:, 2] < 1e-6:
            continue
        shade = DARK + (LIGHT - DARK) * max(0.0, float(normal @ SUN / np.linalg.norm(SUN)))
        loops = [loop @ axes for loop in sheet]
        path = "".join(f"M{_path(loop[:, :2])}z" for loop in loops)
        fill = f"hsl(210 16% {shade:.0f}%)"
        edge = fill if face.round is not None else "hsl(210 14% 38%)"
        depth = float(loops[0][:, 2].mean())
        nearest = max(nearest, depth)
        drawing = f'<path d="{path}" fill="{fill}" stroke="{edge}" stroke-width=".5"/>'
        yield depth, drawing, loops[0][:, :2]
    poses = symbol_poses(face, held.layout.faces[number].centres_mm)
    if not len(poses) or nearest == -np.inf:
        return
    towards = poses[:, :3, 2] @ axes[:, 2] > 0.05
    dots = (poses[towards, :3, 3] @ axes)[:, :2]
    if len(dots):
        path = "".join(f"M{u:.1f} {v:.1f}h0" for u, v in dots.tolist())
        size = DOT * held.style.pitch_mm
        drawing = f'<path d="{path}" stroke="hsl(210 22% 40%)" stroke-width="{size:.1f}"/>'
        yield nearest + 1e-3, drawing, dots


def _path(points: Array) -> str:
    return "L".join(f"{u:.1f} {v:.1f}" for u, v in points.tolist())


def _rounded(values: Array, digits: int = DIGITS) -> Any:
    """Return numbers as nested lists."""
    return np.round(values, digits).tolist()


def _seated(T: Array, places: Array) -> Array:
    return np.asarray(places @ T[:3, :2].T + T[:3, 3])
