"""Letters of the preview: title, captions, names of faces, the scale. Pixels.

Pillow draws them; its import takes 0.01 s of CPU, that of matplotlib 0.34 s.
"""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

from PIL import Image, ImageDraw, ImageFont

from generator.export.colours import answered_rgb
from generator.export.settings import PREVIEW

Font = ImageFont.ImageFont | ImageFont.FreeTypeFont

MARGIN = 30  #: px beside what is drawn and written
FONT_SIZES = (30, 16, 15)  #: title, names, all else
CAPTIONS = ("from the front, right, above", "from behind, left, below")
LEGEND = (132, 11)  #: px wide, and steps of colour
INK, GREY = (15, 23, 42), (100, 116, 139)


@dataclass(frozen=True, slots=True)
class Label:
    """The name of a face and its place in the picture."""

    text: str
    x: float  #: px, the centre
    y: float
    half_width: float  #: px


def transliterate(text: str) -> str:
    """Return `text` in the letters of the built-in font: ASCII, accents left out."""
    letters = unicodedata.normalize("NFKD", text)
    kept = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return kept.encode("ascii", "replace").decode("ascii")


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
    """Write title, captions, names of faces and the scale.

    Parameters
    ----------
    image
        The picture, changed in place.
    labels
        Names of faces, where they belong.
    scale
        Pixels for a mm.
    fonts
        Of the title, of names and of all else.
    apart
        Whether panels are moved apart in the second view.
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
        outline = (x - half, y - PREVIEW.label_half_height, x + half, y + PREVIEW.label_half_height)
        draw.rounded_rectangle(outline, PREVIEW.label_half_height, (255, 255, 255), INK)
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
