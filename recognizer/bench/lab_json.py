"""Registered objects, arrays and alphabets as JSON, for the page to draw.

An object is its faces (`face_mesh`) and its symbols (label, place on their face, pose on the
object); how a symbol of each label looks is sent once. An array is the cells that
objects hold, whatever its size: what nobody holds is not sent. mm, rad. Thesis 6.3.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any

import numpy as np
from sqlalchemy import Connection, select

from generator.database import tables
from generator.database.read import list_objects, read_object
from generator.database.registered import RegisteredObject
from probe.surface.body import symbol_triangles
from probe.surface.symbols import Relief, emboss
from recognizer.bench.face_mesh import DIGITS, drawn_faces, mesh_json, nested_lists, stands_json
from recognizer.touch.lab import EmbossedArray, Lab


def objects_json(connection: Connection) -> list[dict[str, Any]]:
    """Return the list of objects."""
    return [
        {
            "name": entry.name,
            "type": entry.object_type,
            "faces": entry.faces,
            "symbols": entry.symbols,
            "profile": entry.profile,
            "array": [entry.rows, entry.columns],
            "pitch_mm": entry.pitch_mm,
            "registered": entry.utc,
            "retired": bool(entry.retired_utc),
        }
        for entry in list_objects(connection)
    ]


def object_json(connection: Connection, name: str) -> dict[str, Any]:
    """Return an object as solid and symbols.

    Raises
    ------
    DatabaseError
        When no object has this name.
    """
    held = read_object(connection, name)
    return {
        "name": held.entry.name,
        "type": held.entry.object_type,
        "profile": held.entry.profile,
        "registered": held.entry.utc,
        "pitch_mm": held.style.pitch_mm,
        "height_mm": held.style.height_mm,
        "faces": [_face(held, number) for number in drawn_faces(held)],
        "glyphs": _glyphs(held),
        "parts": [
            {"number": i, "name": part.name, "format": part.format}
            for i, part in enumerate(held.parts)
        ],
    }


def _face(held: RegisteredObject, number: int) -> dict[str, Any]:
    face, cells = held.faces[number], held.layout.faces[number]
    loops = face.polygon_mm if face.round is None else (face.round.outline_mm,)
    return {
        "name": face.name,
        "loops": [nested_lists(loop) for loop in loops],
        "round": face.round is not None,
        "blank": face.placement is None,
        "labels": cells.labels.tolist(),
        "centres": nested_lists(cells.centres_mm),
        "stands": stands_json(face, cells.centres_mm),
        **mesh_json(held, face),
    }


def _glyphs(held: RegisteredObject) -> list[list[float]]:
    """Return the triangles of every label's symbol, corner after corner."""
    style = held.style
    relief = Relief(style.height_mm, style.stroke_mm, style.draft_rad, style.chamfer_mm)
    glyphs = held.alphabet["glyphs"]
    strokes = tuple(tuple((tuple(a), tuple(b)) for a, b in glyph["strokes"]) for glyph in glyphs)
    symbols = emboss(strokes, held.alphabet["reach"] * style.pitch_mm, relief)
    return [
        np.round(symbol_triangles(symbols, label), DIGITS).ravel().tolist()
        for label in range(len(strokes))
    ]


def arrays_json(lab: Lab) -> list[dict[str, Any]]:
    """Return the arrays with the strokes of their alphabets, mm in the symbol's axes."""
    return [
        {
            "rows": encoding.array.rows,
            "columns": encoding.array.columns,
            "alphabet": encoding.alphabet.name,
            "pitch_mm": encoding.style.pitch_mm,
            "stroke_mm": encoding.style.stroke_mm,
            "cells": len(encoding.keys),
            "objects": len(encoding.names),
            "strokes": [
                [[[float(v) * unit for v in node] for node in stroke] for stroke in glyph.strokes]
                for glyph in encoding.alphabet.glyphs
            ],
        }
        for encoding in lab.arrays
        for unit in (encoding.alphabet.reach * encoding.style.pitch_mm,)
    ]


def map_json(connection: Connection, encoding: EmbossedArray) -> dict[str, Any]:
    """Return the cells of an array that objects hold, face by face."""
    columns = np.uint64(encoding.array.columns)
    owners, labels = encoding.owners[:-1], encoding.labels[:-1]
    order = np.argsort(owners, kind="stable")
    bounds = np.searchsorted(owners[order], np.arange(len(encoding.faces) + 1))
    names = _face_names(connection)
    faces = []
    for number, (object_id, face_id) in enumerate(encoding.faces.tolist()):
        mine = order[bounds[number] : bounds[number + 1]]
        rows, columns_at = np.divmod(encoding.keys[mine], columns)
        faces.append(
            {
                "object": encoding.names[object_id],
                "face": names[object_id].get(face_id, ""),
                "rows": rows.tolist(),
                "columns": columns_at.tolist(),
                "labels": labels[mine].tolist(),
            }
        )
    return {
        "rows": encoding.array.rows,
        "columns": encoding.array.columns,
        "order": encoding.alphabet.order,
        "faces": faces,
    }


def _face_names(connection: Connection) -> dict[int, dict[int, str]]:
    found: dict[int, dict[int, str]] = defaultdict(dict)
    faces = tables.faces.c
    for object_id, face_id, name in connection.execute(
        select(faces.object_id, faces.face_id, faces.name)
    ):
        found[object_id][face_id] = name
    return found
