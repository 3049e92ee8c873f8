"""Draw parts, plates and steps of gluing as SVG, to stand inside a page.

A panel is drawn as it is seen: its front with the symbols up, and its back as one looks at the
engraved side. mm, y down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.export.bed import BedPlace, Plate
from generator.export.colours import BODY_RGB, SYMBOL_RGB, hexadecimal
from generator.export.raster import rasterise
from generator.plane.polygon import face_vector, plane_axes
from generator.solid.part import Embossing, Part, in_frame, plane_frame
from generator.solid.triangulate import triangulate_rings

Points = NDArray[np.float64]

INK, GREY, MARK = "#0F172A", "#94A3B8", "#1D4ED8"
BODY, SYMBOL = hexadecimal(BODY_RGB), hexadecimal(SYMBOL_RGB)
_FRONT, _BACK = 0, 1  # facets of a panel
_MARGIN_MM = 6.0
_LETTER_MM = 4.5
_ACROSS_PX = 220  # a drawing's greatest width
_ABOVE = 0.75  # height of the eye over the table, of its distance to the side
_SIDES = 8  # from which an assembly is looked at
_SCREEN = 72  # pixels a side by which it is found what hides what
_LEAST_SEEN = 0.012  # share of the screen from which a face has room for its name
_BACK_FILLS = ("#F1F5F9", "#FBD9BF")  # of a panel's back, and of that of the new one


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


def outline_of(part: Part) -> list[Points]:
    """Return what a part covers of its plate, part frame, mm: a panel's front, or a box."""
    if is_panel(part):
        return [part.vertices[list(loop), :2] for loop in part.facets[_FRONT].loops]
    return [rectangle(part.vertices[:, :2].min(axis=0), part.vertices[:, :2].max(axis=0))]


def rectangle(low: ArrayLike, high: ArrayLike) -> Points:
    """Return the corners (4, 2) of a rectangle between two of them, counter-clockwise."""
    (x0, y0), (x1, y1) = np.asarray(low), np.asarray(high)
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=np.float64)


def draw_plate(
    parts: Sequence[tuple[str, list[Points]]], plate: Plate, bed_mm: tuple[float, float]
) -> str:
    """Return a plate from above: the parts as they lie, by name; loops in part frames, mm."""
    bed = rectangle((0, 0), bed_mm)
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


@dataclass(frozen=True, slots=True)
class Assembly:
    """The faces of an object, and the order in which they are glued together."""

    names: Sequence[str]
    polygons: Sequence[Sequence[Points]]  #: loops (k, 3) of each face, object frame, mm
    order: Sequence[int]  #: faces as they are glued; the first one lies on the table
    edges: Sequence[Sequence[tuple[str, Points]]]  #: of each step: numbers and ends (2, 3)


def draw_steps(assembly: Assembly) -> list[str]:
    """Return a drawing of each step, all from the side from which new panels are seen best.

    The new panel is orange, backs are light; what is hidden has no name; what is missing is dashed.
    """
    triangles: list[NDArray[np.int64]] = []
    first = 0
    for name, loops in zip(assembly.names, assembly.polygons, strict=True):
        T = plane_frame(loops[0][0], loops[0][1] - loops[0][0], face_vector(loops))
        numbers = np.arange(sum(map(len, loops))) + first
        triangles.append(
            triangulate_rings([in_frame(T, loop)[:, :2] for loop in loops], numbers, name)
        )
        first += len(numbers)
    up = -face_vector(assembly.polygons[assembly.order[0]])
    up /= np.linalg.norm(up)
    ahead, aside = plane_axes(up, np.eye(3)[int(np.argmin(np.abs(up)))])[:2]
    views = [
        _FixedView(assembly, triangles, np.cos(t) * ahead + np.sin(t) * aside + _ABOVE * up, up)
        for t in np.linspace(0.35, 0.35 + 2 * np.pi, _SIDES, endpoint=False)
    ]
    best = max(views, key=lambda view: round(view.shown(), 3))
    return [best.draw(step) for step in range(len(assembly.order))]


class _FixedView:
    """An assembly as it is seen from one side; eye frame: x right, y up, z towards the eye, mm."""

    def __init__(
        self, assembly: Assembly, triangles: Sequence[NDArray[np.int64]], eye: Points, up: Points
    ) -> None:
        eye = eye / np.linalg.norm(eye)
        right = np.cross(up, eye)
        right /= np.linalg.norm(right)
        self.R_eye_object = np.stack([right, np.cross(eye, right), eye])
        self.assembly, self.step_of = assembly, np.argsort(assembly.order)
        self.loops = [[p @ self.R_eye_object.T for p in loops] for loops in assembly.polygons]
        self.flat = [loop[:, :2] for loops in self.loops for loop in loops]
        points = np.concatenate([loop for loops in self.loops for loop in loops])
        self.low = points[:, :2].min(axis=0)
        self.size = float(np.ptp(points[:, :2], axis=0).max())
        self.screen = np.column_stack([self._pixels(points[:, :2]), points[:, 2]]).T.copy()
        both = [np.concatenate([one, one[:, ::-1]]) for one in triangles]  # seen from both sides
        self.triangles = np.concatenate(both)
        self.owners = np.repeat(np.arange(len(both)), [len(one) for one in both])

    def _pixels(self, points: Points) -> Points:
        """Return points (n, 2) of the eye frame in pixels, y down."""
        across: Points = (points - self.low) * (_SCREEN / self.size)
        return across * [1, -1] + [0, _SCREEN]

    def seen(self, step: int) -> NDArray[np.int64]:
        """Return which face is seen at each pixel after a step, -1 for none."""
        there = np.flatnonzero(self.step_of[self.owners] <= step)
        memory = np.empty((_SCREEN, _SCREEN), np.int64)
        return rasterise(self.screen, self.triangles[there], memory).coarse(self.owners[there], 1)

    def shown(self) -> float:
        """Return how well all new panels are seen: the sum of the roots of their shares."""
        order = enumerate(self.assembly.order)
        return float(sum(np.sqrt((self.seen(k) == face).mean()) for k, face in order))

    def draw(self, step: int) -> str:
        """Return the drawing of a step."""
        now, seen = self.assembly.order[step], self.seen(step)
        shapes = []
        depths = [round(float(loops[0][:, 2].mean()), 6) for loops in self.loops]
        behind = [face_vector(loops)[2] < 0 for loops in self.loops]
        missing = self.step_of > step
        for face in sorted(range(len(depths)), key=lambda k: (not missing[k], depths[k])):
            fill = (_BACK_FILLS if behind[face] else (BODY, SYMBOL))[face == now]
            style = f'fill="{fill}" stroke="{INK}" stroke-width=".5"'
            if missing[face]:
                style = f'fill="none" stroke="{GREY}" stroke-width=".3" stroke-dasharray="2 2"'
            shapes.append(_path([loop[:, :2] for loop in self.loops[face]], style))
        labels: list[Points] = []
        for face in np.unique(seen[seen >= 0]).tolist():
            rows, columns = np.nonzero(seen == face)
            if len(rows) >= _LEAST_SEEN * seen.size:
                away = (rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2
                best = int(np.argmin(away))  # seen itself, where the middle is hidden
                at = np.array([columns[best] + 0.5, _SCREEN - rows[best] - 0.5])
                at = self.low + at * (self.size / _SCREEN)
                shapes.append(_text(self.assembly.names[face], at, INK, self.size / 13))
                labels.append(at)
        middle = self.loops[now][0][:, :2].mean(axis=0)
        for number, ends in self.assembly.edges[step]:
            at = (ends @ self.R_eye_object.T).mean(axis=0)[:2]
            away = middle - at
            at = at + away * (0.06 * self.size / max(float(np.hypot(*away)), 1e-9))
            column, row = self._pixels(at[None])[0].astype(int).clip(0, _SCREEN - 1).tolist()
            apart = min((float(np.hypot(*(at - label))) for label in labels), default=self.size)
            if seen[row, column] == now and apart > self.size / 10:
                shapes.append(_text(number, at, INK, self.size / 18))
        return _svg(self.flat, shapes, across_px=200)


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
    turned = [np.stack([-p[:, 1], p[:, 0]], axis=1) if place.turned else p for p in loops]
    corner = turned[0].min(axis=0)
    return [p - corner + np.array([place.x_mm, place.y_mm]) for p in turned]


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
