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
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.outline import Tiers
from generator.layout.placement import FaceLayout

_FULL = 100  # cells a side up to which the whole array is drawn
_AROUND = 3  # cells around the faces in a cropped picture
_NAMED = 1.5  # cells: a narrower strip of a face bears no name
_CELL_PX, _WIDE_PX = 14, 1600  # a wider picture gets smaller cells
_FONT = 'font-family="Helvetica, Arial, sans-serif"'

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
    width, height = left + view.columns * cell + 30, view.rows * cell + 130
    frame = f'<rect width="{view.columns}" height="{view.rows}"'
    body = [
        _definitions(view, outlines, pitch_mm),
        f'{frame} fill="url(#grid)"/>',
        '<g clip-path="url(#view)">',
        *(
            _face(view, face, shape, _FACE_COLOURS[i % len(_FACE_COLOURS)])
            for i, (face, (shape, _)) in enumerate(zip(faces, placed, strict=True))
        ),
        "</g>",
        f'{frame} fill="none" stroke="#475569" stroke-width="0.08"/>',
    ]
    scale = f"translate({left},70) scale({cell:g})"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" {_FONT} width="{width:g}" '
        f'height="{height:g}" viewBox="0 0 {width:g} {height:g}">\n'
        '<rect width="100%" height="100%" fill="#FFFFFF"/>\n'
        f'<text x="{left}" y="30" font-size="19" font-weight="bold" fill="#0F172A">'
        f"{escape(title)}</text>"
    )
    rulers, legend = _rulers(view, cell, left), _legend(view, cell, left, faces)
    return "\n".join([head, rulers, f'<g transform="{scale}">', *body, "</g>", legend, "</svg>\n"])


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


def _definitions(view: _View, outlines: Sequence[Tiers], pitch_mm: float) -> str:
    glyphs = []
    for label, tiers in enumerate(outlines):
        path = "".join(_path(ring / pitch_mm * np.array([1.0, -1.0])) for ring in tiers.rings[-1])
        glyphs.append(f'<path id="s{label}" fill-rule="evenodd" d="{path}"/>')
    return (
        "<defs>\n"
        f'<clipPath id="view"><rect width="{view.columns}" height="{view.rows}"/></clipPath>\n'
        '<pattern id="grid" width="1" height="1" patternUnits="userSpaceOnUse">'
        '<rect width="1" height="1" fill="#F8FAFC"/>'
        '<path d="M0 0H1M0 0V1" stroke="#DCE3EB" stroke-width="0.06"/></pattern>\n'
        + "\n".join(glyphs)
        + "\n</defs>"
    )


def _face(view: _View, face: FaceOnArray, shape: list[NDArray[np.float64]], colour: str) -> str:
    """Return outline, name and symbols of a face, at every place of the view it reaches."""
    placement, (rows, columns) = face.layout.placement, view.period
    low, high = shape[0].min(axis=0), shape[0].max(axis=0)
    places = [
        np.array([x, y], np.float64)
        for x in _copies(placement.column - view.left, low[0], high[0], view.columns, columns)
        for y in _copies(placement.row - view.top, low[1], high[1], view.rows, rows)
    ]
    paint = (
        f'fill="{colour}" fill-opacity="0.10" fill-rule="evenodd" '
        f'stroke="{colour}" stroke-width="0.16" stroke-linejoin="round"'
    )
    outlines = [
        f'<path d="{"".join(_path(loop + place) for loop in shape)}" {paint}/>' for place in places
    ]
    column = _offsets(face.layout.columns, view.left, columns)
    row = _offsets(face.layout.rows, view.top, rows)
    seen = (column < view.columns) & (row < view.rows)
    cells = zip(
        row[seen].tolist(), column[seen].tolist(), face.layout.labels[seen].tolist(), strict=True
    )
    symbols = "".join(f'<use href="#s{label}" x="{c}.5" y="{r}.5"/>' for r, c, label in cells)
    names = [_name(face.name, colour, shape[0] + place, view) for place in places]
    return "\n".join([*outlines, f'<g fill="{colour}">{symbols}</g>', *names])


def _name(name: str, colour: str, loop: NDArray[np.float64], view: _View) -> str:
    """Return the name in the middle of a face, or of the part of it that is in the view."""
    edge = np.array([view.columns, view.rows])
    low, high = loop.min(axis=0).clip(0, edge), loop.max(axis=0).clip(0, edge)
    if min(high - low) < _NAMED:
        return ""
    whole = bool((loop >= 0).all() and (loop <= edge).all())
    x, y = (_centroid(loop) if whole else (low + high) / 2).tolist()
    size = min(1.05, 0.3 * float(min(high - low)))
    half = 0.33 * size * len(name) + 0.4 * size
    return (
        f'<rect x="{x - half:.2f}" y="{y - 0.75 * size:.2f}" width="{2 * half:.2f}" '
        f'height="{1.5 * size:.2f}" rx="{0.7 * size:.2f}" fill="#FFFFFF" fill-opacity="0.92" '
        f'stroke="{colour}" stroke-width="0.08"/>'
        f'<text x="{x:.2f}" y="{y + 0.36 * size:.2f}" font-size="{size:.2f}" font-weight="bold" '
        f'text-anchor="middle" fill="{colour}">{escape(name)}</text>'
    )


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


def _rulers(view: _View, cell: float, left: int) -> str:
    rows, columns = view.period
    step = 5 if cell >= 9 else 10
    texts = []
    for column in range(view.left + -view.left % step, view.left + view.columns, step):
        x = left + (column - view.left + 0.5) * cell
        texts.append(f'<text x="{x:g}" y="63" text-anchor="middle">{column % columns}</text>')
    for row in range(view.top + -view.top % step, view.top + view.rows, step):
        y = 74 + (row - view.top + 0.5) * cell
        texts.append(f'<text x="{left - 6}" y="{y:g}" text-anchor="end">{row % rows}</text>')
    return f'<g font-size="11" fill="#64748B">{"".join(texts)}</g>'


def _legend(view: _View, cell: float, left: int, faces: Sequence[FaceOnArray]) -> str:
    """Return the line under the picture that says what is what."""
    rows, columns = view.period
    y = 70 + view.rows * cell + 30
    used = sum(len(face.layout.labels) for face in faces)
    cropped = (view.columns, view.rows) != (columns, rows)
    items = {
        f"{len(faces)} faces, {used} symbols": 'fill="#0B6FB8" fill-opacity="0.2" stroke="#0B6FB8"',
        "cells for other objects": 'fill="#F8FAFC" stroke="#CBD5E1"',
    }
    texts = []
    x = float(left)
    for text, style in items.items():
        texts.append(f'<rect x="{x:g}" y="{y - 11:g}" width="14" height="14" {style}/>')
        texts.append(f'<text x="{x + 20:g}" y="{y:g}">{text}</text>')
        x += 48 + 7.2 * len(text)
    size = f"array of {rows} rows x {columns} columns, closed to a torus"
    if cropped:
        size += f"; rows from {view.top % rows}, columns from {view.left % columns} are shown"
    texts.append(f'<text x="{left}" y="{y + 22:g}" fill="#64748B">{size}</text>')
    return f'<g font-size="13" fill="#0F172A">{"".join(texts)}</g>'
