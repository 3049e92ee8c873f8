"""The array as an SVG picture, with the faces of one object laid on it.

Cells, a small glyph in every cell that the object uses, the outline of each face in its
colour with its name, and the cells of other objects in grey. Faces that cross the border of
the torus appear on both sides. An array of more than `_FULL` cells a side is cropped to
the neighbourhood of the faces.

Drawing frame: one unit is one cell, x along columns, y along rows downwards, origin at the
upper left corner of the first cell drawn; a point of the array plane at (u, v) mm from the
anchor cell lies at (column + u/p, row - v/p) before that origin is taken off. Thesis 6.3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.pages import page_environment
from generator.alphabet.outline import Tiers
from generator.layout.placement import FaceLayout

_FULL = 100  # cells a side up to which the whole array is drawn
_AROUND = 3  # cells around the faces in a cropped picture
_NAMED = 1.5  # cells: a narrower strip of a face bears no name
_CELL_PX, _WIDE_PX = 14, 1600  # a wider picture gets smaller cells
_OTHERS = 'fill="#F8FAFC" stroke="#CBD5E1"'

#: Colours of the faces, one after another; dark enough for text on white.
_FACE_COLOURS = (
    "#0B6FB8", "#C2410C", "#15803D", "#7E22CE", "#B91C1C", "#0F766E",
    "#A16207", "#BE185D", "#4338CA", "#4D7C0F", "#0369A1", "#9A3412",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class FaceOnArray:
    """A face as the picture needs it."""

    name: str
    layout: FaceLayout
    loops: tuple[NDArray[np.float64], ...]  #: (k, 2) mm, face frame: outer loop, then holes


@dataclass(frozen=True, slots=True)
class _View:
    """The cells that are drawn: `columns` x `rows` from (left, top), unwrapped."""

    left: int
    top: int
    columns: int
    rows: int
    period: tuple[int, int]  #: rows and columns of the array


def array_svg(
    title: str,
    rows: int,
    columns: int,
    pitch_mm: float,
    faces: Sequence[FaceOnArray],
    outlines: Sequence[Tiers],
) -> str:
    """Return the picture of one object on an array of any size as SVG text.

    `outlines`: the symbols by label; the last tier is drawn, mm.
    """
    placed = [_unwrap(face, pitch_mm) for face in faces]
    view = _view(rows, columns, [box for _, box in placed])
    cell = min(_CELL_PX, max(4.0, _WIDE_PX / view.columns))
    left = max(60, 24 + 7 * len(str(rows)))
    step = 5 if cell >= 9 else 10
    down = np.array([1.0, -1.0])
    template = page_environment(Path(__file__).parent).get_template("array.svg.j2")
    return template.render(
        title=title,
        width=f"{left + view.columns * cell + 30:g}",
        height=f"{view.rows * cell + 130:g}",
        left=left,
        below=70 + view.rows * cell + 30,
        cell=cell,
        view=view,
        columns=[
            (left + (k - view.left + 0.5) * cell, k % columns)
            for k in range(view.left + -view.left % step, view.left + view.columns, step)
        ],
        rows=[
            (74 + (k - view.top + 0.5) * cell, k % rows)
            for k in range(view.top + -view.top % step, view.top + view.rows, step)
        ],
        glyphs=[
            "".join(_path(ring / pitch_mm * down) for ring in tiers.rings[-1]) for tiers in outlines
        ],
        faces=[
            _face(view, face, shape, _FACE_COLOURS[i % len(_FACE_COLOURS)])
            for i, (face, (shape, _)) in enumerate(zip(faces, placed, strict=True))
        ],
        legend=_legend(left, faces),
        size=_size_text(view),
    )


Box = tuple[int, int, int, int]  # left, top, right, bottom


def _unwrap(face: FaceOnArray, pitch_mm: float) -> tuple[list[NDArray[np.float64]], Box]:
    """Return the loops in cells from the anchor cell, and the box of their cells."""
    placement = face.layout.placement
    c, s = np.cos(placement.rotation_rad), np.sin(placement.rotation_rad)
    shift = np.array([placement.x_mm, placement.y_mm])
    loops = [
        (loop @ np.array([[c, s], [-s, c]]) + shift) / pitch_mm * np.array([1.0, -1.0])
        for loop in face.loops
    ]
    (left, top), (right, bottom) = loops[0].min(axis=0), loops[0].max(axis=0)
    # Whole cells, added to the anchor as integers, which may be far beyond 2^53.
    box = (
        placement.column + math.floor(left),
        placement.row + math.floor(top),
        placement.column + math.ceil(right),
        placement.row + math.ceil(bottom),
    )
    return loops, box


def _view(rows: int, columns: int, boxes: list[Box]) -> _View:
    if not boxes or max(rows, columns) <= _FULL:
        return _View(0, 0, columns, rows, (rows, columns))
    left, width = _shortest_arc(columns, [(box[0], box[2]) for box in boxes])
    top, height = _shortest_arc(rows, [(box[1], box[3]) for box in boxes])
    return _View(left, top, width, height, (rows, columns))


def _shortest_arc(period: int, intervals: list[tuple[int, int]]) -> tuple[int, int]:
    """Return start and length of the shortest arc of a circle that holds all intervals."""
    cells = [(a - _AROUND, b + _AROUND) for a, b in intervals]
    if period <= _FULL:
        return 0, period
    best = (0, period)
    for start, _ in cells:
        length = max((a - start) % period + (b - a) for a, b in cells)
        if length < best[1]:
            best = (start % period, length)
    return best


def _face(
    view: _View, face: FaceOnArray, shape: list[NDArray[np.float64]], colour: str
) -> dict[str, Any]:
    """Return outlines, names and symbols of a face, at every place of the view it reaches."""
    placement, (rows, columns) = face.layout.placement, view.period
    low, high = shape[0].min(axis=0), shape[0].max(axis=0)
    places = [
        np.array([x, y], np.float64)
        for x in _copies(placement.column - view.left, low[0], high[0], view.columns, columns)
        for y in _copies(placement.row - view.top, low[1], high[1], view.rows, rows)
    ]
    column = _offsets(face.layout.columns, view.left, columns)
    row = _offsets(face.layout.rows, view.top, rows)
    seen = (column < view.columns) & (row < view.rows)
    return {
        "name": face.name,
        "colour": colour,
        "outlines": ["".join(_path(loop + place) for loop in shape) for place in places],
        "cells": np.stack([row, column, face.layout.labels], axis=1)[seen].tolist(),
        "names": [_name(face.name, shape[0] + place, view) for place in places],
    }


def _name(name: str, loop: NDArray[np.float64], view: _View) -> dict[str, float]:
    """Return where a name stands: in the middle of a face, or of what of it is in the view."""
    edge = np.array([view.columns, view.rows])
    low, high = loop.min(axis=0).clip(0, edge), loop.max(axis=0).clip(0, edge)
    if min(high - low) < _NAMED:
        return {}
    whole = bool((loop >= 0).all() and (loop <= edge).all())
    x, y = (_centroid(loop) if whole else (low + high) / 2).tolist()
    size = min(1.05, 0.3 * float(min(high - low)))
    return {"x": x, "y": y, "size": size, "half": 0.33 * size * len(name) + 0.4 * size}


def _offsets(values: NDArray[np.int64], start: int, period: int) -> NDArray[np.int64]:
    """Return how far each value lies behind `start` on the circle, for any period."""
    if period < 1 << 62:
        return (np.asarray(values, np.int64) - start) % period
    exact = ((int(value) - start) % period for value in np.asarray(values).tolist())
    return np.array([min(offset, 1 << 62) for offset in exact], np.int64)


def _copies(anchor: int, low: float, high: float, length: int, period: int) -> list[int]:
    """Return the places of the anchor at which [low, high] reaches into [0, length]."""
    places = range(anchor % period - period, length + period, period)
    return [place for place in places if place + high > 0 and place + low < length]


def _centroid(loop: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centroid of a polygon; of one that is not convex it may lie outside."""
    arms = loop - loop[0]
    following = np.roll(arms, -1, axis=0)
    cross = arms[:, 0] * following[:, 1] - following[:, 0] * arms[:, 1]
    centroid: NDArray[np.float64] = loop[0] + cross @ (arms + following) / (3.0 * cross.sum())
    return centroid


def _path(loop: NDArray[np.float64]) -> str:
    points = " ".join(f"{x:.4g} {y:.4g}" for x, y in (loop + 0.0).tolist())
    return f"M{points}z"


def _legend(left: int, faces: Sequence[FaceOnArray]) -> list[tuple[float, str, str]]:
    """Return what is what under the picture: place, text, and style of its square."""
    used = sum(len(face.layout.labels) for face in faces)
    cells = f"{len(faces)} faces, {used} symbols"
    return [
        (left, cells, 'fill="#0B6FB8" fill-opacity="0.2" stroke="#0B6FB8"'),
        (left + 48 + 7.2 * len(cells), "cells for other objects", _OTHERS),
    ]


def _size_text(view: _View) -> str:
    rows, columns = view.period
    size = f"array of {rows} rows x {columns} columns, closed to a torus"
    if (view.columns, view.rows) != (columns, rows):
        size += f"; rows from {view.top % rows}, columns from {view.left % columns} are shown"
    return size
