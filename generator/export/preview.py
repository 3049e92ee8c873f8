"""Parts -> PNG: the object from two opposite corners, with the names of its faces.

Where it is known, faces bear the share of touches that they answer, as a number and a colour.
The left view looks from the front, right and above; the right one from the opposite corner,
with panels moved apart, so that every face of a convex object is seen. Orthographic, flat
shading, two by two samples for each pixel. Object frame in mm, z up. Why by hand: `raster`.
"""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFont

from generator.export.colours import BODY_RGB, SYMBOL_RGB, answered_rgb
from generator.export.faces import (
    centre_and_normal,
    named_facets,
    object_faces,
    symbol_triangles,
)
from generator.export.labels import LabelRequest, label_places
from generator.export.lettering import (
    FONT_SIZES,
    MARGIN,
    Font,
    Label,
    transliterate,
    write_legend,
    write_lettering,
)
from generator.export.raster import DepthBuffer, rasterise
from generator.export.settings import PREVIEW
from generator.solid.part import Facet, Part
from generator.solid.triangulate import Mesh

Points = NDArray[np.float64]
Colours = NDArray[np.uint32]  # 0xXXBBGGRR

Shares = tuple[float, float]  #: of touches answered at once, and within three

NOTHING_KNOWN: Mapping[str, Shares] = MappingProxyType({})

# Directions towards the eye, the best first; the second view looks from the opposite side.
_EYES = tuple(np.array([x, -1.0, z]) for z in (0.62, 0.45, 0.8) for x in (0.62, 0.45, 0.8, 0.3))


@dataclass(frozen=True, slots=True)
class _Scene:
    """All parts in the object frame."""

    vertices: Points  #: (N, 3) mm
    triangles: NDArray[np.int64]  #: (T, 3)
    symbols: NDArray[np.bool_]  #: (T,) whether a triangle belongs to a symbol
    faces: NDArray[np.int64]  #: (T,) named face that a triangle belongs to, -1 for none
    edges: Points  #: (E, 2, 3) mm, of the bodies
    names: list[str]
    centres: Points  #: (F, 3) mm, of the named faces
    normals: Points  #: (F, 3)


def preview_png(
    name: str,
    size_mm: Sequence[float],
    parts: Sequence[Part],
    meshes: Sequence[Mesh],
    answered: Mapping[str, Shares] = NOTHING_KNOWN,
) -> bytes:
    """Return the picture.

    Parameters
    ----------
    name
        Of the object, the title.
    size_mm
        Its extent in x, y and z, mm, for the subtitle.
    parts, meshes
        The parts and the mesh of each, part frame, mm.
    answered
        Shares of touches that are answered at once, and within three, by the name of a face: its
        label, and by the first its colour.
    """
    samples, width, top = PREVIEW.samples, PREVIEW.width, PREVIEW.top
    bottom = PREVIEW.height - PREVIEW.bottom
    rows = np.linspace(0.0, 1.0, PREVIEW.height * samples)[:, None]
    above, below = np.array(PREVIEW.paper_rgb)
    fade = np.rint((1 - rows) * above + rows * below)
    picture = np.repeat(_pack_colours(fade)[:, None], width * samples, axis=1)
    apart = len(parts) > 1
    closed = _scene(parts, meshes, 0.0)
    scenes = (closed, _scene(parts, meshes, PREVIEW.apart) if apart else closed)
    eye = _best_eye(scenes[0].normals)
    cameras = (_axes(eye), _axes(-eye))
    room = (width // 2 - 2 * MARGIN, bottom - top - MARGIN)
    scale = min(
        _scale_to_fit(scene, axes, room) for scene, axes in zip(scenes, cameras, strict=True)
    )
    memory = np.empty(((bottom - top) * samples, width // 2 * samples), np.int64)
    fonts = [ImageFont.load_default(size) for size in FONT_SIZES]
    labels = []
    for i, (scene, axes) in enumerate(zip(scenes, cameras, strict=True)):
        box = (i * width // 2, top, (i + 1) * width // 2, bottom)
        labels += _draw_view(picture, scene, axes, scale, box, memory, fonts[1], answered)
    image = Image.frombuffer("RGBX", picture.shape[::-1], picture, "raw", "RGBX", 0, 1)
    image = image.reduce(samples).convert("RGB")
    write_lettering(image, _subtitle(size_mm, parts), name, labels, scale, fonts, apart=apart)
    if answered:
        write_legend(image, fonts[2])
    return _png(np.asarray(image))


def _png(rgb: NDArray[np.uint8]) -> bytes:
    """Return (height, width, 3) pixels as a PNG file, each row as differences to the left.

    Pillow would load the readers and writers of all formats for this.
    """
    height, width = rgb.shape[:2]
    rows = np.ones((height, 1 + 3 * width), np.uint8)  # filter type 1
    rows[:, 1:4] = rgb[:, 0]
    rows[:, 4:] = (rgb[:, 1:] - rgb[:, :-1]).reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 2)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )


def _scene(parts: Sequence[Part], meshes: Sequence[Mesh], apart: float) -> _Scene:
    """Gather all parts in the object frame; panels move out by a share of the size.

    Closed panels hide their backs, so these are left out unless the panels move apart.
    """
    placed = [part.T_object_part for part in parts]
    bodies = [part.vertices @ T[:3, :3].T + T[:3, 3] for part, T in zip(parts, placed, strict=True)]
    distance = apart * float(np.ptp(np.concatenate(bodies), axis=0).max())
    vertices, triangles, symbols, owners, edges = [], [], [], [], []
    names: list[str] = []
    centres, normals = [], []
    first = 0
    for part, mesh, body, T in zip(parts, meshes, bodies, placed, strict=True):
        faces = named_facets(part, alone=len(parts) == 1)
        shapes = [centre_and_normal(body, part.facets[number]) for _, number in faces]
        shift = distance * shapes[0][1]
        numbers = np.arange(len(part.facets))
        if len(parts) > 1 and not apart:
            towards = [centre_and_normal(body, facet)[1] @ shapes[0][1] for facet in part.facets]
            numbers = np.flatnonzero(np.array(towards) > PREVIEW.back)
        belongs = object_faces(part) if len(parts) == 1 else np.arange(len(part.facets))
        shown = np.isin(mesh.facets, numbers)
        vertices.append(mesh.vertices @ T[:3, :3].T + (T[:3, 3] + shift))
        triangles.append(mesh.triangles[shown] + first)
        first += len(mesh.vertices)
        symbols.append(symbol_triangles(part, mesh)[shown])
        owner = np.full(len(part.facets), -1)
        owner[[number for _, number in faces]] = np.arange(len(faces)) + len(names)
        owners.append(owner[belongs[mesh.facets[shown]]])
        edges.append(body[_edges([(part.facets[k], int(belongs[k])) for k in numbers])] + shift)
        names += [name for name, _ in faces]
        centres += [centre + shift for centre, _ in shapes]
        normals += [normal for _, normal in shapes]
    return _Scene(
        np.concatenate(vertices),
        np.concatenate(triangles),
        np.concatenate(symbols),
        np.concatenate(owners),
        np.concatenate(edges),
        names,
        np.array(centres),
        np.array(normals),
    )


def _edges(facets: Sequence[tuple[Facet, int]]) -> NDArray[np.int64]:
    """Return (E, 2) vertices of the edges of facets, without those inside of one face."""
    faces: dict[tuple[int, int], set[int]] = {}
    alone: set[tuple[int, int]] = set()
    for facet, face in facets:
        for loop in facet.loops:
            for a, b in zip(loop, (*loop[1:], loop[0]), strict=True):
                pair = (min(a, b), max(a, b))
                alone ^= {pair}
                faces.setdefault(pair, set()).add(face)
    kept = [pair for pair, both in faces.items() if len(both) > 1 or pair in alone]
    return np.array(sorted(kept), np.int64)


def _best_eye(normals: Points) -> Points:
    """Return the first direction from which, or from behind which, no face is seen edge-on."""
    least = [float(np.abs(normals @ (eye / np.linalg.norm(eye))).min()) for eye in _EYES]
    good = [eye for eye, cosine in zip(_EYES, least, strict=True) if cosine >= PREVIEW.open]
    return good[0] if good else _EYES[int(np.argmax(least))]


def _axes(eye: Points) -> Points:
    """Return the rows right, up and eye of a camera that looks against `eye`."""
    towards: Points = eye / np.linalg.norm(eye)
    right: Points = np.cross([0.0, 0.0, 1.0], towards)
    right = right / np.linalg.norm(right)
    axes: Points = np.stack([right, np.cross(towards, right), towards])
    return axes


def _scale_to_fit(scene: _Scene, axes: Points, room: tuple[int, int]) -> float:
    """Return the pixels for a mm at which the scene fills the room."""
    width, height = np.ptp(scene.vertices @ axes[:2].T, axis=0).tolist()
    return float(min(room[0] / width, room[1] / height))


def _draw_view(
    picture: Colours,
    scene: _Scene,
    axes: Points,
    scale: float,
    box: tuple[int, int, int, int],
    memory: NDArray[np.int64],
    font: Font,
    answered: Mapping[str, Shares],
) -> list[Label]:
    """Draw one view into its box (pixels); return the names of the faces seen."""
    left, top, right, bottom = (PREVIEW.samples * value for value in box)
    fine = scale * PREVIEW.samples
    flat: Points = scene.vertices @ axes.T
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    offset = np.array([(right - left) / 2, (bottom - top) / 2, 0.0])

    def screen(points: Points) -> Points:
        moved: Points = (points - middle) * np.array([fine, -fine, fine]) + offset
        return moved

    seen = rasterise(screen(flat), scene.triangles, memory)
    view = picture[top:bottom, left:right]
    seen.paint(view, _shade(scene, flat, answered))
    _draw_edges(view, screen(scene.edges @ axes.T), seen, 0.6 * fine)
    texts = [
        transliterate(name) + (_percents(answered[name]) if name in answered else "")
        for name in scene.names
    ]
    halves = [font.getlength(text) / 2 + 9 for text in texts]
    middles = screen(scene.centres @ axes.T)[:, :2] / PREVIEW.samples
    facing = np.flatnonzero(scene.normals @ axes[2] > PREVIEW.facing).tolist()
    wanted = [
        LabelRequest(face, float(middles[face, 0]), float(middles[face, 1]), halves[face])
        for face in facing
    ]
    step = PREVIEW.label_step
    places = label_places(seen.coarse(scene.faces, step * PREVIEW.samples), step, wanted)
    return [
        Label(texts[one.face], box[0] + place[0], box[1] + place[1], one.half_width)
        for one, place in zip(wanted, places, strict=True)
        if place is not None
    ]


def _percents(shares: Shares) -> str:
    """Return what a label says of a face: at once / within three, per cent."""
    return f" {100 * shares[0]:.0f}/{100 * shares[1]:.0f}%"


def _shade(scene: _Scene, flat: Points, answered: Mapping[str, Shares]) -> Colours:
    """Return the colour of each triangle under the light; `flat` in screen axes."""
    light = np.array(PREVIEW.light) / np.linalg.norm(PREVIEW.light)
    faces = [
        answered_rgb(answered[name][0]) if name in answered else BODY_RGB for name in scene.names
    ]
    tints = np.array([*faces, BODY_RGB, SYMBOL_RGB], np.float64)  # the face -1 is the body
    tint_of = np.where(scene.symbols, len(faces) + 1, scene.faces % (len(faces) + 1))
    colours = np.empty(len(scene.triangles), np.uint32)
    for start in range(0, len(colours), PREVIEW.block):
        some = slice(start, start + PREVIEW.block)
        a, b, c = (flat[scene.triangles[some, i]].T for i in range(3))
        (ux, uy, uz), (vx, vy, vz) = b - a, c - a
        normals = np.array([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
        lengths = np.sqrt((normals * normals).sum(axis=0))
        cosine = light @ normals / np.where(lengths > 0, lengths, 1.0)
        # Half of the way round the object still gets some light, so that no face is black.
        shade = PREVIEW.ambient + (1.0 - PREVIEW.ambient) * (0.5 + 0.5 * cosine)
        tint = tints[tint_of[some]]
        colours[some] = _pack_colours(np.minimum(np.rint(1.06 * tint * shade[:, None]), 255.0))
    return colours


def _pack_colours(rgb: Points) -> Colours:
    """Return colours (n, 3) as one little-endian word each."""
    red, green, blue = rgb.astype(np.uint32).T
    words: Colours = red | green << 8 | blue << 16
    return words if sys.byteorder == "little" else words.byteswap()


def _draw_edges(view: Colours, edges: Points, seen: DepthBuffer, slack: float) -> None:
    """Draw the edges of the bodies where nothing lies in front of them."""
    height, width = view.shape
    line = _pack_colours(np.array([PREVIEW.line_rgb]))
    for start, end in edges:
        steps = int(np.abs(end - start)[:2].max()) + 2
        points = start + np.linspace(0.0, 1.0, steps)[:, None] * (end - start)
        columns = points[:, 0].astype(np.int64).clip(0, width - 2)
        rows = points[:, 1].astype(np.int64).clip(0, height - 2)
        shown = points[:, 2] > seen.depths(rows, columns) - slack
        for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
            view[rows[shown] + down, columns[shown] + across] = line


def _subtitle(size_mm: Sequence[float], parts: Sequence[Part]) -> str:
    symbols = sum(part.symbols for part in parts)
    extent = " x ".join(f"{value:.4g}" for value in size_mm)
    made = f"{len(parts)} panels" if len(parts) > 1 else "one part"
    return f"{extent} mm, {symbols} symbols, {made}"
