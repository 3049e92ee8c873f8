"""Parts -> PNG: the object from two opposite corners, with the names of its faces.

Where it is known, faces bear the share of touches that they answer, as a number and a colour.
The left view looks from the front, right and above; the right one from the opposite corner,
with panels moved apart, so that every face of a convex object is seen. Orthographic, flat
shading, two by two samples for each pixel. Object frame in mm, z up. Why by hand: `raster`.

::

    scene.py  all parts in the object frame
    view.py   a camera's view of them: triangles, edges, places of names
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFont

from generator.export.lettering import FONT_SIZES, MARGIN, write_legend, write_lettering
from generator.export.preview.scene import both_scenes
from generator.export.preview.view import (
    NOTHING_KNOWN,
    Shares,
    best_eye,
    draw_view,
    pack_colours,
    scale_to_fit,
    view_of,
)
from generator.export.settings import PREVIEW
from generator.solid.part import Part
from generator.solid.triangulate import Mesh


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
    picture = np.repeat(pack_colours(fade)[:, None], width * samples, axis=1)
    apart = len(parts) > 1
    closed, moved = both_scenes(parts, meshes)
    eye = best_eye(closed.normals)
    views = (view_of(closed, eye), view_of(moved, -eye))
    room = (width // 2 - 2 * MARGIN, bottom - top - MARGIN)
    scale = min(scale_to_fit(view, room) for view in views)
    memory = np.empty(((bottom - top) * samples, width // 2 * samples), np.int64)
    fonts = [ImageFont.load_default(size) for size in FONT_SIZES]
    labels = []
    for i, view in enumerate(views):
        box = (i * width // 2, top, (i + 1) * width // 2, bottom)
        labels += draw_view(picture, view, scale, box, memory, fonts[1], answered)
    image = Image.frombuffer("RGBX", picture.shape[::-1], picture, "raw", "RGBX", 0, 1)
    image = image.reduce(samples).convert("RGB")
    write_lettering(image, _subtitle(size_mm, parts), name, labels, scale, fonts, apart=apart)
    if answered:
        later = any(within is not None for _, within in answered.values())
        write_legend(image, fonts[2], within_three=later)
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


def _subtitle(size_mm: Sequence[float], parts: Sequence[Part]) -> str:
    symbols = sum(part.symbols for part in parts)
    extent = " x ".join(f"{value:.4g}" for value in size_mm)
    made = f"{len(parts)} panels" if len(parts) > 1 else "one part"
    return f"{extent} mm, {symbols} symbols, {made}"
