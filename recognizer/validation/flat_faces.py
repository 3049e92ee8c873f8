"""Faces drawn flat, with every touch as a dot: right, refused or wrong.

Faces + rows -> one SVG for each object. All faces of a run have the same scale; x of a face
points to the right, y up. Dots are strokes of no length with round ends, so that a hundred
thousand of them stay a small file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import Lab
from recognizer.validation.dataset import faces_by_name
from recognizer.validation.pictures import COLOURS, DOTS, WORDS
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

Array = NDArray[np.float64]
FACE, BAD, SYMBOL, INK = "#f3f4f6", "#fdf0ee", "#c9ced6", "#1d2126"

# Sizes on the page, px.
WIDE = 1080.0  #: a row of faces
MOST = 230.0  #: the longer side of the largest face
GAP = 18.0
TITLE = 30.0  #: two lines of letters over a face
LEAST = 96.0  #: width of a panel: its title must fit
DOT = 5.0
RIGHT_DOTS = 150  #: of a face, at most; refused and wrong touches are all drawn


@dataclass(frozen=True, slots=True, eq=False)
class FlatFace:
    """A face and its touches by verdict."""

    name: str
    loops_mm: tuple[Array, ...]  #: (k, 2) each, face frame
    symbols_mm: Array  #: (n, 2) centres
    touches_mm: Mapping[str, Array]  #: verdict -> (m, 2)
    bad: bool

    @property
    def box_mm(self) -> tuple[Array, Array]:
        """Lowest and highest corner."""
        corners = np.concatenate(self.loops_mm)
        return corners.min(axis=0), corners.max(axis=0)


def flat_objects(
    lab: Lab, rows: Mapping[str, Any], faces: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Return, for each object that was touched, its name, whether a face is bad, and its picture.

    `rows` are columns of `trial.COLUMNS`; `faces` the lines `objects.faces` of `results.json`.
    """
    shapes = faces_by_name(lab)
    touched = {name: rows["object"] == name for name in {line["object"] for line in faces}}
    held: dict[str, list[FlatFace]] = {}
    for line in faces:
        shape = shapes[f"{line['object']}/{line['face']}"]
        here = np.flatnonzero(touched[line["object"]])
        here = here[rows["face"][here] == line["face"]]
        at = np.column_stack([rows["x_mm"][here], rows["y_mm"][here]])
        by = {v: at[rows["verdict"][here] == v] for v in (RIGHT, REJECTED, WRONG)}
        flat = FlatFace(line["face"], shape.polygon_mm, shape.centres_mm, by, line["bad"])
        held.setdefault(line["object"], []).append(flat)
    boxes = (flat.box_mm for each in held.values() for flat in each)
    scale = MOST / max((float((far - low).max()) for low, far in boxes), default=1.0)
    return [
        {"object": name, "bad": any(flat.bad for flat in each), "svg": draw_flat(each, scale)}
        for name, each in held.items()
    ]


def draw_flat(faces: Sequence[FlatFace], scale: float) -> str:
    """Return the SVG of an object's faces, `scale` px a mm."""
    parts, left, top, high, right = [], 0.0, 0.0, 0.0, 0.0
    for face in faces:
        low, far = face.box_mm
        across, down = scale * (far - low)
        panel = max(float(across), LEAST)
        if left and left + panel > WIDE:
            left, top, high = 0.0, top + high + GAP, 0.0
        parts.append(_panel(face, left, top + TITLE, scale))
        left += panel + GAP
        right, high = max(right, left - GAP), max(high, TITLE + float(down))
    wide, tall = f"{right + 6:.0f}", f"{top + high + DOT:.0f}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-3 0 {wide} {tall}" width="{wide}" '
        f'height="{tall}" font-family="DejaVu Sans, Arial, sans-serif" font-size="11">'
        f"{''.join(parts)}</svg>"
    )


def _panel(face: FlatFace, left: float, top: float, scale: float) -> str:
    """Return a face with its title over it."""
    low, far = face.box_mm

    def on_page(points: Array) -> Array:
        at: Array = (points - (low[0], far[1])) * (scale, -scale) + (left, top)
        return at

    outline = "".join(
        f"M{'L'.join(f'{x:.1f} {y:.1f}' for x, y in on_page(loop))}Z" for loop in face.loops_mm
    )
    count = {verdict: len(at) for verdict, at in face.touches_mm.items()}
    words = ", ".join(f"{n} {WORDS[v]}" for v, n in count.items() if n) or "not touched"
    ink, fill, edge = (COLOURS[WRONG], BAD, COLOURS[WRONG]) if face.bad else (INK, FACE, "#9aa1ab")
    svg = (
        f'<text x="{left:.0f}" y="{top - 18:.0f}" fill="{ink}" font-weight="bold">'
        f"{escape(face.name)}</text>"
        f'<text x="{left:.0f}" y="{top - 5:.0f}" fill="{ink}" font-size="9">{words}</text>'
        f'<path d="{outline}" fill="{fill}" fill-rule="evenodd" stroke="{edge}"/>'
    )
    svg += _dots(on_page(face.symbols_mm), SYMBOL, max(1.0, DOT * 0.6))
    for verdict in (RIGHT, REJECTED, WRONG):
        at = face.touches_mm.get(verdict, np.zeros((0, 2)))
        if verdict == RIGHT and len(at) > RIGHT_DOTS:
            at = at[np.linspace(0, len(at) - 1, RIGHT_DOTS).astype(int)]
        svg += _dots(on_page(at), DOTS[verdict], DOT)
    return svg


def _dots(at: Array, colour: str, size: float) -> str:
    """Return dots; round by style, since matplotlib's pictures give the page a rule for ends."""
    if len(at) == 0:
        return ""
    path = "".join(f"M{x:.1f} {y:.1f}h.01" for x, y in at)
    return (
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{size:.1f}" '
        f'style="stroke-linecap:round"/>'
    )
