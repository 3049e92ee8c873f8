"""Parts -> PNG: the object from two opposite corners, with the names of its faces.

Where it is known, faces bear the share of touches that they answer, as a number and a colour.
The left view looks from the front, right and above; the right one from the opposite corner,
with panels moved apart, so that every face of a convex object is seen. Orthographic, flat
shading, two by two samples for each pixel. Object frame in mm, z up. Coordinates stand in three
rows, (3, N): extents and depths run along them.
"""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFont

from generator.export.colours import BODY_RGB, SYMBOL_RGB, answered_rgb
from generator.export.lettering import (
    FONT_SIZES,
    MARGIN,
    Font,
    Label,
    place_labels,
    transliterate,
    write_legend,
    write_lettering,
)
from generator.export.meshes import named_facets, object_faces, symbol_triangles
from generator.export.raster import DepthBuffer, rasterise
from generator.solid.part import Facet, Part
from generator.solid.triangulate import Mesh

Points = NDArray[np.float64]
Colours = NDArray[np.uint32]  # 0xXXBBGGRR
Shares = tuple[float, float | None]  #: of touches answered at once, and within three, if known

WIDTH, HEIGHT = 1200, 700  #: of the picture, px
TOP, BOTTOM = 84, 46  #: px above the views (title, captions) and below them (the scale)
SAMPLES = 2  #: a side for each pixel: smooth edges at four times the work
LABEL_STEP = 4  #: px between the places where a name may stand
LIGHT = (-0.48, 0.56, 0.67)  #: towards the light; screen axes: right, up, eye
AMBIENT = 0.42  #: share of the light that comes from everywhere
APART = 0.10  #: of the object's size: how far panels are moved apart
FACING = 0.12  #: least cosine to the eye at which a face gets its name
BACK = -0.999  #: greatest cosine to the face at which a facet is the back of its panel
OPEN = 0.2  #: least cosine that a good view has on every face
LINE_RGB = (51, 65, 85)  #: of edges
PAPER_RGB = ((250, 251, 253), (224, 230, 238))  #: top and bottom of the background
BLOCK = 16_384  #: triangles shaded at once: bounds the memory
NOTHING_KNOWN: Mapping[str, Shares] = MappingProxyType({})

# Directions towards the eye, the best first; the second view looks from the opposite side.
_EYES = tuple(np.array([x, -1.0, z]) for z in (0.62, 0.45, 0.8) for x in (0.62, 0.45, 0.8, 0.3))


@dataclass(frozen=True, slots=True)
class PartsShown:
    """All parts in the object frame."""

    vertices: Points  #: (3, N) mm
    triangles: NDArray[np.int64]  #: (T, 3)
    symbols: NDArray[np.bool_]  #: (T,) whether a triangle belongs to a symbol
    faces: NDArray[np.int64]  #: (T,) named face that a triangle belongs to, -1 for none
    edges: Points  #: (E, 2, 3) mm, of the bodies
    names: list[str]
    centres: Points  #: (F, 3) mm, of the named faces
    normals: Points  #: (F, 3)


@dataclass(frozen=True, slots=True)
class View:
    """A scene as a camera sees it."""

    scene: PartsShown
    axes: Points  #: (3, 3) rows right, up and eye, object frame
    flat: Points  #: (3, N) mm, vertices along these axes
    low: Points  #: (3,) mm, least of them
    high: Points  #: (3,) mm, greatest


def preview_png(
    name: str,
    size_mm: Sequence[float],
    parts: Sequence[Part],
    meshes: Sequence[Mesh],
    answered: Mapping[str, Shares] = NOTHING_KNOWN,
) -> bytes:
    """Return the picture of an object of extent `size_mm`, (3,); meshes in part frames, mm.

    `answered`: shares of touches answered at once, and within three, by the name of a face: its
    label, and by the first its colour.
    """
    samples, width, top, bottom = SAMPLES, WIDTH, TOP, HEIGHT - BOTTOM
    rows = np.linspace(0.0, 1.0, HEIGHT * samples)[:, None]
    above, below = np.array(PAPER_RGB)
    fade = np.rint((1 - rows) * above + rows * below)
    picture = np.repeat(_pack_colours(fade)[:, None], width * samples, axis=1)
    apart = len(parts) > 1
    turned = [part.T_object_part[:3, :3] @ mesh.vertices.T
              for part, mesh in zip(parts, meshes, strict=True)]  # fmt: skip
    closed = _scene(parts, meshes, turned, 0.0)
    moved = _scene(parts, meshes, turned, APART) if apart else closed
    eye = _best_eye(closed.normals)
    views = (_view_of(closed, eye), _view_of(moved, -eye))
    room = np.array([width // 2 - 2 * MARGIN, bottom - top - MARGIN])
    scale = min(float(min(room / (view.high - view.low)[:2])) for view in views)
    memory = np.empty(((bottom - top) * samples, width // 2 * samples), np.int64)
    fonts = [ImageFont.load_default(size) for size in FONT_SIZES]
    labels = []
    for i, view in enumerate(views):
        box = (i * width // 2, top, (i + 1) * width // 2, bottom)
        labels += _draw_view(picture, view, scale, box, memory, fonts[1], answered)
    image = Image.frombuffer("RGBX", picture.shape[::-1], picture, "raw", "RGBX", 0, 1)
    image = image.reduce(samples).convert("RGB")
    write_lettering(image, _subtitle(size_mm, parts), name, labels, scale, fonts, apart=apart)
    if answered:
        later = any(within is not None for _, within in answered.values())
        write_legend(image, fonts[2], within_three=later)
    return _png(np.asarray(image))


def _scene(
    parts: Sequence[Part], meshes: Sequence[Mesh], turned: Sequence[Points], apart: float
) -> PartsShown:
    """Gather all parts in the object frame; panels move out by a share of the size.

    Backs, which closed panels hide, are left out unless the panels move apart. `turned`: (3, n)
    vertices of each mesh, mm, along the object's axes and from the part's origin.
    """
    placed = [part.T_object_part for part in parts]
    bodies = [part.seated for part in parts]
    distance = apart * float(np.ptp(np.concatenate(bodies), axis=0).max())
    vertices, triangles, symbols, owners, edges = [], [], [], [], []
    names: list[str] = []
    centres, normals = [], []
    first = 0
    for part, mesh, body, points, T in zip(parts, meshes, bodies, turned, placed, strict=True):
        faces = named_facets(part, alone=len(parts) == 1)
        shapes = [_centre_and_normal(body, part.facets[number]) for _, number in faces]
        shift = distance * shapes[0][1]
        numbers = np.arange(len(part.facets))
        if len(parts) > 1 and not apart:
            towards = [_centre_and_normal(body, facet)[1] @ shapes[0][1] for facet in part.facets]
            numbers = np.flatnonzero(np.array(towards) > BACK)
        belongs = object_faces(part) if len(parts) == 1 else np.arange(len(part.facets))
        vertices.append(points + (T[:3, 3] + shift)[:, None])
        of_symbols, owner = symbol_triangles(part, mesh), np.full(len(part.facets), -1)
        owner[[number for _, number in faces]] = np.arange(len(faces)) + len(names)
        owner = owner[belongs]
        kept = np.flatnonzero(np.isin(mesh.facets, numbers))
        triangles.append(mesh.triangles[kept] + first)
        first += len(mesh.vertices)
        symbols.append(of_symbols[kept])
        owners.append(owner[mesh.facets[kept]])
        edges.append(body[_edges([(part.facets[k], int(belongs[k])) for k in numbers])] + shift)
        names += [name for name, _ in faces]
        centres += [centre + shift for centre, _ in shapes]
        normals += [normal for _, normal in shapes]
    return PartsShown(
        np.concatenate(vertices, axis=1),
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


def _centre_and_normal(vertices: Points, facet: Facet) -> tuple[Points, Points]:
    """Return centroid, (3,), and outward unit normal, (3,), of a facet's outer loop."""
    loop = vertices[list(facet.loops[0])]
    arms = loop - loop[0]
    following = np.roll(arms, -1, axis=0)
    areas = np.cross(arms, following)
    total = areas.sum(axis=0)
    length = np.linalg.norm(total)
    normal: Points = total / length
    moment = (areas @ normal) @ (arms + following)
    centre: Points = loop[0] + moment / (3.0 * length)
    return centre, normal


def _view_of(scene: PartsShown, eye: Points) -> View:
    """Return what a camera sees that looks against `eye`, (3,)."""
    towards: Points = eye / np.linalg.norm(eye)
    right: Points = np.cross([0.0, 0.0, 1.0], towards)
    right = right / np.linalg.norm(right)
    axes: Points = np.stack([right, np.cross(towards, right), towards])
    flat = axes @ scene.vertices
    return View(scene, axes, flat, flat.min(axis=1), flat.max(axis=1))


def _best_eye(normals: Points) -> Points:
    """Return the first direction from which, or from behind which, no face is seen edge-on."""
    least = [float(np.abs(normals @ (eye / np.linalg.norm(eye))).min()) for eye in _EYES]
    good = [eye for eye, cosine in zip(_EYES, least, strict=True) if cosine >= OPEN]
    return good[0] if good else _EYES[int(np.argmax(least))]


def _draw_view(
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
    left, top, right, bottom = (SAMPLES * value for value in box)
    fine = scale * SAMPLES
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
    middles = (screen(axes @ scene.centres.T)[:2] / SAMPLES).T.tolist()
    facing = np.flatnonzero(scene.normals @ axes[2] > FACING).tolist()
    wanted = [
        Label(face, texts[face], middles[face][0], middles[face][1], halves[face])
        for face in facing
    ]
    labels = place_labels(seen.coarse(scene.faces, LABEL_STEP * SAMPLES), LABEL_STEP, wanted)
    return [
        replace(label, x=box[0] + label.x, y=box[1] + label.y)
        for label in labels
        if label is not None
    ]


def _pack_colours(rgb: Points) -> Colours:
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
    light = np.array(LIGHT) / np.linalg.norm(LIGHT)
    faces = [
        answered_rgb(answered[name][0]) if name in answered else BODY_RGB for name in scene.names
    ]
    tints = np.array([*faces, BODY_RGB, SYMBOL_RGB], np.float64)  # the face -1 is the body
    colours = np.zeros(len(scene.triangles), np.uint32)
    for start in range(0, len(seen), BLOCK):
        some = seen[start : start + BLOCK]
        tint_of = np.where(
            scene.symbols[some], len(faces) + 1, scene.faces[some] % (len(faces) + 1)
        )
        a, b, c = (flat[:, corner] for corner in scene.triangles[some].T)
        (ux, uy, uz), (vx, vy, vz) = b - a, c - a
        normals = np.array([uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx])
        lengths = np.sqrt((normals * normals).sum(axis=0))
        cosine = light @ normals / np.where(lengths > 0, lengths, 1.0)
        # Half of the way round the object still gets some light, so that no face is black.
        shade = AMBIENT + (1.0 - AMBIENT) * (0.5 + 0.5 * cosine)
        lit = 1.06 * tints[tint_of] * shade[:, None]
        colours[some] = _pack_colours(np.minimum(np.rint(lit), 255.0))
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
    line = _pack_colours(np.array([LINE_RGB]))
    for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
        view[rows[shown] + down, columns[shown] + across] = line


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


def _subtitle(size_mm: Sequence[float], parts: Sequence[Part]) -> str:
    symbols = sum(part.symbols for part in parts)
    extent = " x ".join(f"{value:.4g}" for value in size_mm)
    made = f"{len(parts)} panels" if len(parts) > 1 else "one part"
    return f"{extent} mm, {symbols} symbols, {made}"
