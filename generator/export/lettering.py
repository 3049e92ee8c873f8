"""Letters of the preview: title, captions, the scale, and the name of each face where it is seen.

Pictures are in pixels, x right, y down. Pillow draws the letters: its import takes 0.01 s of CPU,
that of matplotlib 0.34 s.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from generator.export.colours import answered_rgb

Floats = NDArray[np.float64]
Font = ImageFont.ImageFont | ImageFont.FreeTypeFont

MARGIN = 30  #: px around what is drawn and written
FONT_SIZES = (30, 16, 15)  #: title, names, all else
CAPTIONS = ("from the front, right, above", "from behind, left, below")
LEGEND = (132, 11)  #: px wide, and steps of colour
INK, GREY = (15, 23, 42), (100, 116, 139)
HALF_HEIGHT = 13.0  #: of a name, px
GAP = 3.0  #: between two names, px
LEAST = 8  #: places of the map at which a face must be seen to get its name
FAR = 0.7  #: what a name loses by standing as far from the middle as the face is large


@dataclass(frozen=True, slots=True)
class Label:
    """The name of a face and where its middle is."""

    face: int  #: as the map of `place_labels` calls it
    text: str
    x: float  #: px, the centre
    y: float
    half_width: float  #: px


def transliterate(text: str) -> str:
    """Return `text` in the letters of the built-in font: ASCII, accents left out."""
    letters = unicodedata.normalize("NFKD", text)
    kept = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return kept.encode("ascii", "replace").decode("ascii")


def place_labels(
    seen: NDArray[np.int64], step: float, wanted: Sequence[Label]
) -> list[Label | None]:
    """Return each label where most of it lies on its own face, near the middle, and over no other.

    `seen`: (rows, columns) the face at ((column + 1/2) step, (row + 1/2) step) px, -1 for none.
    None for a face that is hidden, or seen at too few places.
    """
    rows, columns = np.nonzero(seen >= 0)
    faces = seen[rows, columns]
    order = np.argsort(faces, kind="stable")
    faces = faces[order]
    x: Floats = (columns[order].astype(np.float64) + 0.5) * step
    y: Floats = (rows[order].astype(np.float64) + 0.5) * step
    spans = [np.searchsorted(faces, [one.face, one.face + 1]).tolist() for one in wanted]
    found: list[Label | None] = [None] * len(wanted)
    taken: list[Label] = []
    # Small faces first: large ones have other places left.
    for number in sorted(range(len(wanted)), key=lambda k: spans[k][1] - spans[k][0]):
        one, (first, end) = wanted[number], spans[number]
        if end - first < LEAST:
            continue
        at_x, at_y = x[first:end], y[first:end]
        free = np.abs(at_x - seen.shape[1] * step / 2) <= seen.shape[1] * step / 2 - one.half_width
        for other in taken:
            free &= (np.abs(at_x - other.x) >= one.half_width + other.half_width + GAP) | (
                np.abs(at_y - other.y) >= 2 * HALF_HEIGHT + GAP
            )
        if not free.any():
            continue
        size = max(float(np.ptp(at_x)), float(np.ptp(at_y)), step)
        away = np.hypot(at_x - one.x, at_y - one.y) / size
        score = _own_share(seen == one.face, at_x, at_y, step, one.half_width) - FAR * away
        best = int(np.argmax(np.where(free, score, -np.inf)))
        found[number] = label = replace(one, x=float(at_x[best]), y=float(at_y[best]))
        taken.append(label)
    return found


def write_lettering(
    image: Image.Image,
    subtitle: str,
    name: str,
    labels: list[Label],
    scale: float,
    fonts: list[Font],
    *,
    apart: bool,
) -> None:
    """Write title, captions, names of faces and the scale (px for a mm) into the picture.

    `fonts` of the title, of names and of all else; `apart`: the second view has panels apart.
    """
    draw = ImageDraw.Draw(image)
    width, height = image.size
    large, medium, small = fonts
    draw.text((MARGIN, 20), transliterate(name), INK, large)
    draw.text((MARGIN, 58), subtitle, GREY, small)
    for i, caption in enumerate(CAPTIONS):
        text = caption + (", panels moved apart" if i and apart else "")
        draw.text(((2 * i + 1) * width // 4, height - 24), text, GREY, small, anchor="mm")
    for label in labels:
        x, y, half = label.x, label.y, label.half_width
        outline = (x - half, y - HALF_HEIGHT, x + half, y + HALF_HEIGHT)
        draw.rounded_rectangle(outline, HALF_HEIGHT, (255, 255, 255), INK)
        draw.text((x, y), label.text, INK, medium, anchor="mm")
    length = next(
        digit * 10.0**power
        for power in range(-3, 9)
        for digit in (1, 2, 5)
        if digit * 10.0**power * scale > 60
    )
    right, y = width - MARGIN, 44
    left = right - length * scale
    draw.line((left, y, right, y), GREY, 2)
    for x in (left, right):
        draw.line((x, y - 5, x, y + 5), GREY, 2)
    draw.text(((left + right) / 2, y - 8), f"{length:g} mm", GREY, small, anchor="mb")


def write_legend(image: Image.Image, font: Font, *, within_three: bool) -> None:
    """Say at the top what the colours of faces mean, and the second number of a label."""
    draw = ImageDraw.Draw(image)
    left, y, step = image.size[0] // 2, 58, LEGEND[0] // LEGEND[1]
    draw.text((left - 8, y + 8), "touches answered at once: 0 %", GREY, font, anchor="rm")
    for k in range(LEGEND[1]):
        x = left + k * step
        draw.rectangle((x, y, x + step - 1, y + 15), answered_rgb(k / (LEGEND[1] - 1)))
    over = "100 %  (at once / within three)" if within_three else "100 %"
    draw.text((left + LEGEND[1] * step + 8, y + 8), over, GREY, font, anchor="lm")


def _own_share(
    own: NDArray[np.bool_], x: Floats, y: Floats, step: float, half_width: float
) -> Floats:
    """Return which share of a label at each place lies on its own face, by summed areas."""
    sums = np.zeros((own.shape[0] + 1, own.shape[1] + 1))
    sums[1:, 1:] = own.cumsum(axis=0).cumsum(axis=1)
    top = np.rint((y - HALF_HEIGHT) / step).astype(np.int64).clip(0, own.shape[0])
    bottom = np.rint((y + HALF_HEIGHT) / step).astype(np.int64).clip(0, own.shape[0])
    left = np.rint((x - half_width) / step).astype(np.int64).clip(0, own.shape[1])
    right = np.rint((x + half_width) / step).astype(np.int64).clip(0, own.shape[1])
    inside = sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]
    return np.asarray(inside * step**2 / (4 * half_width * HALF_HEIGHT))
