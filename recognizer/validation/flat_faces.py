"""Faces drawn flat, with every touch as a dot: right, refused or wrong.

Faces + rows -> one SVG for each face. All faces of a run have the same scale; x of a face
points to the right, y up. Dots are strokes of no length with round ends, so that a hundred
thousand of them stay a small file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recognizer.touch.lab import Lab
from recognizer.validation.dataset import faces_by_name
from recognizer.validation.pictures import COLOURS, DOTS, WORDS
from recognizer.validation.trial import REJECTED, RIGHT, WRONG

Array = NDArray[np.float64]
FACE, BAD, SYMBOL = "#f3f4f6", "#fdf0ee", "#c9ced6"

# Sizes on the page, px.
MOST = 230.0  #: the longer side of the largest face
DOT = 5.0
RIGHT_DOTS = 150  #: of a face, at most; refused and wrong touches are all drawn


def flat_objects(
    lab: Lab, rows: Mapping[str, Any], faces: Sequence[Mapping[str, Any]]
) -> list[dict[str, Any]]:
    """Return, for each object that was touched, its name, whether a face is bad, and its faces.

    `rows` are columns of `trial.COLUMNS`; `faces` the lines `objects.faces` of `results.json`. A
    face has its name, whether it is bad, its touches in words, and its picture.
    """
    known = faces_by_name(lab)
    shapes = [known[f"{line['object']}/{line['face']}"] for line in faces]
    sides = (np.ptp(np.concatenate(shape.polygon_mm), axis=0).max() for shape in shapes)
    scale = MOST / max(map(float, sides), default=1.0)
    touched = {name: rows["object"] == name for name in {line["object"] for line in faces}}
    held: dict[str, list[dict[str, Any]]] = {}
    for line, shape in zip(faces, shapes, strict=True):
        here = np.flatnonzero(touched[line["object"]])
        here = here[rows["face"][here] == line["face"]]
        at = np.column_stack([rows["x_mm"][here], rows["y_mm"][here]])
        by = {v: at[rows["verdict"][here] == v] for v in (RIGHT, REJECTED, WRONG)}
        words = ", ".join(f"{len(at)} {WORDS[v]}" for v, at in by.items() if len(at))
        svg = draw_flat(shape.polygon_mm, shape.centres_mm, by, scale, bad=line["bad"])
        face = {"name": line["face"], "bad": line["bad"], "words": words or "not touched"}
        held.setdefault(line["object"], []).append(face | {"svg": svg})
    return [
        {"object": name, "bad": any(face["bad"] for face in each), "faces": each}
        for name, each in held.items()
    ]


def draw_flat(
    loops_mm: Sequence[Array], symbols_mm: Array, touches_mm: Mapping[str, Array], scale: float,
    *, bad: bool = False,
) -> str:  # fmt: skip
    """Return the SVG of a face by its loops (k, 2), `scale` px a mm.

    `symbols_mm` (n, 2) are centres, `touches_mm` places (m, 2) by verdict, all in the face frame.
    """
    corners = np.concatenate(loops_mm)
    left, top = corners[:, 0].min(), corners[:, 1].max()

    def on_page(points: Array) -> Array:
        return np.asarray((points - (left, top)) * (scale, -scale) + 0.0)

    loops = (on_page(loop) for loop in loops_mm)
    outline = "".join(f"M{'L'.join(f'{x:.1f} {y:.1f}' for x, y in loop)}Z" for loop in loops)
    fill, edge = (BAD, COLOURS[WRONG]) if bad else (FACE, "#9aa1ab")
    dots = [_dots(on_page(symbols_mm), SYMBOL, max(1.0, DOT * 0.6))]
    for verdict, at in touches_mm.items():
        if verdict == RIGHT and len(at) > RIGHT_DOTS:
            at = at[np.linspace(0, len(at) - 1, RIGHT_DOTS).astype(int)]
        dots.append(_dots(on_page(at), DOTS[verdict], DOT))
    wide, tall = (f"{side:.0f}" for side in scale * np.ptp(corners, axis=0) + 2 * DOT)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="-{DOT:g} -{DOT:g} {wide} {tall}" '
        f'width="{wide}" height="{tall}"><path d="{outline}" fill="{fill}" '
        f'fill-rule="evenodd" stroke="{edge}"/>{"".join(dots)}</svg>'
    )


def _dots(at: Array, colour: str, size: float) -> str:
    """Return dots; round by style, since matplotlib's pictures give the page a rule for ends."""
    if len(at) == 0:
        return ""
    path = "".join(f"M{x:.1f} {y:.1f}h.01" for x, y in at)
    return (
        f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{size:.1f}" '
        f'style="stroke-linecap:round"/>'
    )
