"""Draw parts, plates and steps of gluing as SVG, to stand inside a page.

A panel is drawn as it is seen: its front with the symbols up, and its back as one looks at the
engraved side. mm, y down.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from generator.export.bed import BedPlace, Plate
from generator.export.colours import BODY_RGB, SYMBOL_RGB, hexadecimal
from generator.plane.polygon import face_vector
from generator.solid.part import Embossing, Part, in_frame, plane_frame

Points = NDArray[np.float64]

INK, GREY, MARK = "#0F172A", "#94A3B8", "#1D4ED8"
BODY, SYMBOL = hexadecimal(BODY_RGB), hexadecimal(SYMBOL_RGB)
_FRONT, _BACK = 0, 1  # facets of a panel
_MARGIN_MM = 6.0
_LETTER_MM = 4.5
_ACROSS_PX = 220  # a drawing's greatest width


def is_panel(part: Part) -> bool:
    """Whether a part is a plate of one face, its back on the bed."""
    return len(part.facets) > 1 and part.facets[_BACK].name.endswith(" back")


def draw_front(part: Part, edges: Sequence[tuple[str, Points]]) -> str:
    """Return a panel from the side of its symbols, the numbers of its edges near them.

    `edges`: number of each edge and its ends (2, 2), part frame, mm.
    """
    outline = [part.vertices[list(loop), :2] for loop in part.facets[_FRONT].loops]
    shapes = [_path(outline, f'fill="{BODY}" stroke="{INK}" stroke-width=".4"')]
    for number, embossing in enumerate(part.embossings):
        if embossing.facet == _FRONT:
            shapes += _symbols(embossing, f"{escape(part.name)}-{number}", SYMBOL)
    middle = (outline[0].min(axis=0) + outline[0].max(axis=0)) / 2
    for text, ends in edges:
        at = ends.mean(axis=0)
        away = at - middle
        at = at + away / max(float(np.hypot(*away)), 1e-9) * _LETTER_MM * 0.8
        shapes.append(_text(text, at, INK))
    return _svg(outline, shapes, margin=_MARGIN_MM + _LETTER_MM)


def draw_back(part: Part) -> str:
    """Return a panel from behind, with what is engraved."""
    corners = [part.vertices[list(loop)] for loop in part.facets[_BACK].loops]
    marks = [one for one in part.embossings if one.facet == _BACK]
    if marks:
        T = marks[0].T_part_facet
    else:
        T = plane_frame(corners[0][0], corners[0][1] - corners[0][0], face_vector(corners))
    outline = [in_frame(T, corner)[:, :2] for corner in corners]
    shapes = [_path(outline, f'fill="#fff" stroke="{INK}" stroke-width=".4"')]
    for number, embossing in enumerate(marks):
        shapes += _symbols(embossing, f"{escape(part.name)}-back-{number}", MARK, own=True)
    return _svg(outline, shapes)


def draw_plate(parts: Sequence[Part], plate: Plate, bed_mm: tuple[float, float]) -> str:
    """Return a plate from above: the parts as they lie, by name."""
    loops = []
    for part in parts:
        own = [_box(part)]
        if is_panel(part):
            own = [part.vertices[list(loop), :2] for loop in part.facets[_FRONT].loops]
        loops.append((part.name, own))
    return _draw_bed(loops, plate, bed_mm)


def draw_boxes(
    parts: Sequence[tuple[str, tuple[float, float]]], plate: Plate, bed_mm: tuple[float, float]
) -> str:
    """Return a plate from above: the boxes of parts by their names, sizes in mm."""
    loops = [
        (name, [np.array([[0, 0], [w, 0], [w, d], [0, d]], dtype=np.float64)])
        for name, (w, d) in parts
    ]
    return _draw_bed(loops, plate, bed_mm)


def _draw_bed(
    parts: Sequence[tuple[str, list[Points]]], plate: Plate, bed_mm: tuple[float, float]
) -> str:
    width, depth = bed_mm
    bed = np.array([[0, 0], [width, 0], [width, depth], [0, depth]], dtype=np.float64)
    shapes = [_path([bed], f'fill="#F1F5F9" stroke="{GREY}" stroke-width=".6"')]
    corners = [bed]
    for place in plate.places:
        name, loops = parts[place.part]
        outline = _lying(loops, place)
        shapes.append(_path(outline, f'fill="{BODY}" stroke="{INK}" stroke-width=".4"'))
        low, high = outline[0].min(axis=0), outline[0].max(axis=0)
        size = min(6.0, 1.5 * float(high[0] - low[0]) / max(len(name), 1))
        shapes.append(_text(name, (low + high) / 2, INK, size))
        corners.append(outline[0])
    return _svg(corners, shapes, across_px=3 * _ACROSS_PX)


def draw_step(polygons: Sequence[Sequence[Points]], kinds: Sequence[int], names: Sequence[str],
              R_eye_object: Points) -> str:  # fmt: skip
    """Return the object while it is put together.

    `polygons`: loops (k, 3) of each face, object frame; `kinds` of each face: 0 missing, 1 glued,
    2 to be glued now; `R_eye_object` (3, 3), eye frame: x right, y up, z towards the eye.
    """
    seen = [[loop @ R_eye_object.T for loop in loops] for loops in polygons]
    order = sorted(range(len(seen)), key=lambda k: round(float(seen[k][0][:, 2].mean()), 6))
    shapes = [
        _path([loop[:, :2] for loop in seen[k]],
              f'fill="none" stroke="{GREY}" stroke-width=".3" stroke-dasharray="2 2"')
        for k in order if kinds[k] == 0
    ]  # fmt: skip
    for k in (k for k in order if kinds[k]):
        fill = SYMBOL if kinds[k] == 2 else BODY
        style = f'fill="{fill}" fill-opacity=".75" stroke="{INK}" stroke-width=".5"'
        shapes.append(_path([loop[:, :2] for loop in seen[k]], style))
    size = float(np.ptp(np.concatenate([loop[:, :2] for loops in seen for loop in loops]), 0).max())
    for k in (k for k in order if kinds[k]):
        middle = (seen[k][0].min(axis=0) + seen[k][0].max(axis=0)) / 2
        shapes.append(_text(names[k], middle[:2], INK, size / 14))
    flat = [loop[:, :2] for loops in seen for loop in loops]
    return _svg(flat, shapes, across_px=200)


def _symbols(embossing: Embossing, name: str, colour: str, *, own: bool = False) -> list[str]:
    """Return the feet of symbols, each shape written once."""
    T = np.eye(4) if own else embossing.T_part_facet
    turn = float(np.degrees(embossing.rotation_rad))
    centres = embossing.centres_mm @ T[:2, :2].T + T[:2, 3]
    if not own:
        turn += float(np.degrees(np.arctan2(T[1, 0], T[0, 0])))
    defined = "".join(
        _path(list(embossing.tiers[label].rings[0]), f'id="{name}-{label}"')
        for label in sorted(set(embossing.labels.tolist()))
    )
    used = [
        f'<use href="#{name}-{label}" transform="translate({x:.2f} {-y:.2f}) rotate({-turn:.3f})"/>'
        for label, (x, y) in zip(embossing.labels.tolist(), centres.tolist(), strict=True)
    ]
    return [f"<defs>{defined}</defs>", f'<g fill="{colour}">', *used, "</g>"]


def _lying(loops: Sequence[Points], place: BedPlace) -> list[Points]:
    """Return the outline of a part where it lies on the plate."""
    turned = [np.stack([-p[:, 1], p[:, 0]], axis=1) if place.turned else p for p in loops]
    corner = turned[0].min(axis=0)
    return [p - corner + np.array([place.x_mm, place.y_mm]) for p in turned]


def _box(part: Part) -> Points:
    """Return the four corners of what a part covers, part frame."""
    (x0, y0), (x1, y1) = part.vertices[:, :2].min(axis=0), part.vertices[:, :2].max(axis=0)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def _path(loops: Sequence[Points], style: str) -> str:
    runs = (
        "M" + " ".join(f"{x:.2f} {y:.2f}" for x, y in (loop * [1, -1] + 0.0).tolist()) + "Z"
        for loop in loops
    )
    return f'<path {style} fill-rule="evenodd" d="{"".join(runs)}"/>'


def _text(text: str, at: Points, colour: str, size: float = _LETTER_MM) -> str:
    x, y = float(at[0]), -float(at[1])
    return (
        f'<text x="{x:.2f}" y="{y + 0.35 * size:.2f}" font-size="{size:.2f}" fill="{colour}" '
        f'text-anchor="middle">{escape(text)}</text>'
    )


def _svg(
    loops: Sequence[Points],
    shapes: Sequence[str],
    *,
    margin: float = 2.0,
    across_px: int = _ACROSS_PX,
) -> str:
    points = np.concatenate(loops)
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    width, height = (high - low).tolist()
    scale = min(across_px / width, across_px / height)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{low[0]:.2f} {-high[1]:.2f} '
        f'{width:.2f} {height:.2f}" width="{width * scale:.0f}" height="{height * scale:.0f}" '
        f'font-family="Helvetica, Arial, sans-serif">{"".join(shapes)}</svg>'
    )
