"""Scene and camera -> pixels of one view, and the names of the faces seen in it.

Screen axes: right, up and towards the eye; orthographic, flat shading.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from generator.export.colours import BODY_RGB, SYMBOL_RGB, answered_rgb
from generator.export.labels import LabelRequest, label_places
from generator.export.lettering import Font, Label, transliterate
from generator.export.preview.scene import Points, PreviewScene
from generator.export.raster import DepthBuffer, rasterise
from generator.export.settings import PREVIEW

Colours = NDArray[np.uint32]  # 0xXXBBGGRR

Shares = tuple[float, float | None]  #: of touches answered at once, and within three, if known

NOTHING_KNOWN: Mapping[str, Shares] = MappingProxyType({})

# Directions towards the eye, the best first; the second view looks from the opposite side.
_EYES = tuple(np.array([x, -1.0, z]) for z in (0.62, 0.45, 0.8) for x in (0.62, 0.45, 0.8, 0.3))


@dataclass(frozen=True, slots=True)
class View:
    """A scene as a camera sees it."""

    scene: PreviewScene
    axes: Points  #: (3, 3) rows right, up and eye, object frame
    flat: Points  #: (3, N) mm, vertices along these axes
    low: Points  #: (3,) mm, least of them
    high: Points  #: (3,) mm, greatest


def view_of(scene: PreviewScene, eye: Points) -> View:
    """Return what a camera sees that looks against `eye`, (3,)."""
    towards: Points = eye / np.linalg.norm(eye)
    right: Points = np.cross([0.0, 0.0, 1.0], towards)
    right = right / np.linalg.norm(right)
    axes: Points = np.stack([right, np.cross(towards, right), towards])
    flat = axes @ scene.vertices
    return View(scene, axes, flat, flat.min(axis=1), flat.max(axis=1))


def best_eye(normals: Points) -> Points:
    """Return the first direction from which, or from behind which, no face is seen edge-on."""
    least = [float(np.abs(normals @ (eye / np.linalg.norm(eye))).min()) for eye in _EYES]
    good = [eye for eye, cosine in zip(_EYES, least, strict=True) if cosine >= PREVIEW.open]
    return good[0] if good else _EYES[int(np.argmax(least))]


def scale_to_fit(view: View, room: tuple[int, int]) -> float:
    """Return the pixels for a mm at which a view fills the room."""
    width, height = (view.high - view.low)[:2].tolist()
    return float(min(room[0] / width, room[1] / height))


def draw_view(
    picture: Colours,
    view: View,
    scale: float,
    box: tuple[int, int, int, int],
    memory: NDArray[np.int64],
    font: Font,
    answered: Mapping[str, Shares],
) -> list[Label]:
    """Draw one view into its box (pixels); return the names of the faces seen."""
    scene, axes = view.scene, view.axes
    left, top, right, bottom = (PREVIEW.samples * value for value in box)
    fine = scale * PREVIEW.samples
    factors = np.array([fine, -fine, fine])[:, None]
    middle = ((view.low + view.high) / 2)[:, None]
    offset = np.array([(right - left) / 2, (bottom - top) / 2, 0.0])[:, None]

    def screen(points: Points) -> Points:
        """Return points (3, n) along the axes in pixels and depth."""
        moved = points - middle
        moved *= factors
        moved += offset
        return moved

    seen = rasterise(screen(view.flat), scene.triangles, memory)
    part = picture[top:bottom, left:right]
    seen.paint(part, _shade(view, seen.triangles_seen(len(scene.triangles)), answered))
    _draw_edges(part, screen(axes @ scene.edges.reshape(-1, 3).T), seen, 0.6 * fine)
    texts = [
        transliterate(name) + (_percents(answered[name]) if name in answered else "")
        for name in scene.names
    ]
    halves = [font.getlength(text) / 2 + 9 for text in texts]
    middles = screen(axes @ scene.centres.T)[:2] / PREVIEW.samples
    facing = np.flatnonzero(scene.normals @ axes[2] > PREVIEW.facing).tolist()
    wanted = [
        LabelRequest(face, float(middles[0, face]), float(middles[1, face]), halves[face])
        for face in facing
    ]
    step = PREVIEW.label_step
    places = label_places(seen.coarse(scene.faces, step * PREVIEW.samples), step, wanted)
    return [
        Label(texts[one.face], box[0] + place[0], box[1] + place[1], one.half_width)
        for one, place in zip(wanted, places, strict=True)
        if place is not None
    ]


def pack_colours(rgb: Points) -> Colours:
    """Return colours (n, 3) as one little-endian word each."""
    red, green, blue = rgb.astype(np.uint32).T
    words: Colours = red | green << 8 | blue << 16
    return words if sys.byteorder == "little" else words.byteswap()


def _percents(shares: Shares) -> str:
    """Return what a label says of a face: at once / within three, per cent."""
    once, within = shares
    return f" {100 * once:.0f}" + ("%" if within is None else f"/{100 * within:.0f}%")


def _shade(view: View, seen: NDArray[np.int64], answered: Mapping[str, Shares]) -> Colours:
    """Return the colour of each triangle under the light; of those not `seen`, nothing."""
    scene, flat = view.scene, view.flat
    light = np.array(PREVIEW.light) / np.linalg.norm(PREVIEW.light)
    faces = [
        answered_rgb(answered[name][0]) if name in answered else BODY_RGB for name in scene.names
    ]
    tints = np.array([*faces, BODY_RGB, SYMBOL_RGB], np.float64)  # the face -1 is the body
    colours = np.zeros(len(scene.triangles), np.uint32)
    for start in range(0, len(seen), PREVIEW.block):
        some = seen[start : start + PREVIEW.block]
        tint_of = np.where(
            scene.symbols[some], len(faces) + 1, scene.faces[some] % (len(faces) + 1)
        )
        a, b, c = (flat[:, corner] for corner in scene.triangles[some].T)
        (ux, uy, uz), (vx, vy, vz) = b - a, c - a
        normals = np.array([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
        lengths = np.sqrt((normals * normals).sum(axis=0))
        cosine = light @ normals / np.where(lengths > 0, lengths, 1.0)
        # Half of the way round the object still gets some light, so that no face is black.
        shade = PREVIEW.ambient + (1.0 - PREVIEW.ambient) * (0.5 + 0.5 * cosine)
        lit = 1.06 * tints[tint_of] * shade[:, None]
        colours[some] = pack_colours(np.minimum(np.rint(lit), 255.0))
    return colours


def _draw_edges(view: Colours, ends: Points, seen: DepthBuffer, slack: float) -> None:
    """Draw the edges of the bodies where nothing lies in front of them.

    `ends`: (3, 2 E) pixels and depth, start and end of each edge in turn.
    """
    height, width = view.shape
    start, end = ends[:, ::2], ends[:, 1::2]
    steps = np.abs(end - start)[:2].max(axis=0).astype(np.int64) + 2
    edge = np.repeat(np.arange(len(steps)), steps)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(steps) - steps, steps)
    last = number == steps[edge] - 1
    share = np.where(last, 1.0, number * (1.0 / (steps - 1))[edge])
    points = start[:, edge] + share * (end - start)[:, edge]
    columns = points[0].astype(np.int64).clip(0, width - 2)
    rows = points[1].astype(np.int64).clip(0, height - 2)
    shown = points[2] > seen.depths(rows, columns) - slack
    line = pack_colours(np.array([PREVIEW.line_rgb]))
    for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
        view[rows[shown] + down, columns[shown] + across] = line
