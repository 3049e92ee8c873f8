"""The two colours of every file: body and symbols, far apart in lightness and hue."""

from __future__ import annotations

RGB = tuple[int, int, int]

BODY_RGB: RGB = (198, 205, 214)  #: a light, cool grey
SYMBOL_RGB: RGB = (232, 119, 34)  #: orange: told apart from the body by every kind of eye


def hexadecimal(colour: RGB) -> str:
    """Return `#RRGGBB`."""
    return "#{:02X}{:02X}{:02X}".format(*colour)
