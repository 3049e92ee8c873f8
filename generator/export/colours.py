"""The colours of every file: body, symbols, and faces by the share of touches they answer."""

from __future__ import annotations

RGB = tuple[int, int, int]

BODY_RGB: RGB = (198, 205, 214)  #: a light, cool grey
SYMBOL_RGB: RGB = (232, 119, 34)  #: orange: distinct from the body for every kind of eye
#: of faces of which no touch, half of them and all are answered: lightness rises with the share,
#: so that it shows without colours too
ANSWERED_RGB: tuple[RGB, RGB, RGB] = ((205, 124, 150), (226, 205, 150), (196, 226, 232))


def answered_rgb(share: float) -> RGB:
    """Return the colour of a face that answers a share of touches, 0 to 1."""
    low = 0 if share < 0.5 else 1
    part = 2 * min(max(share, 0.0), 1.0) - low
    ends = zip(ANSWERED_RGB[low], ANSWERED_RGB[low + 1], strict=True)
    red, green, blue = (round(a + part * (b - a)) for a, b in ends)
    return red, green, blue


def hexadecimal(colour: RGB) -> str:
    """Return `#RRGGBB`."""
    return "#{:02X}{:02X}{:02X}".format(*colour)
