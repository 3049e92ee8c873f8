"""The window on the array, as a PNG: cells in shades of their symbols, the window outlined.

Arrays of up to 2^16 cells are drawn whole, of others the neighbourhood; a window that wraps
around the torus is outlined on every side that it touches. A window that is not decoded has
its candidates outlined.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from generator.array.contract import Labels, SymbolArray

if TYPE_CHECKING:
    from decoder.decoded import Decoded

WHOLE = 1 << 16  #: cells
_AROUND = 24  #: cells drawn around a window of a larger array
_INK = (196, 60, 20)
_MAYBE = (60, 90, 200)


def draw(array: SymbolArray, window: Labels, found: Decoded, path: Path) -> None:
    """Write the picture; raises `OSError` if it cannot be written."""
    from PIL import Image, ImageDraw

    places = [(candidate.row, candidate.column) for candidate in found.candidates]
    if found.row is not None and found.column is not None:
        places = [(found.row, found.column)]
    shape = window.shape if found.rotation % 2 == 0 else window.shape[::-1]
    first, size = (0, 0), (array.rows, array.columns)
    if array.rows * array.columns > WHOLE:
        row, column = places[0] if places else (0, 0)
        reach = [min(cells, a + 2 * _AROUND) for cells, a in zip(size, shape, strict=True)]
        first, size = (row - _AROUND, column - _AROUND), (reach[0], reach[1])
    pixels = max(2, min(16, 1200 // max(size)))
    rows = [(first[0] + r) % array.rows for r in range(size[0])]
    columns = [(first[1] + c) % array.columns for c in range(size[1])]
    grid = array.symbols(np.array(rows, dtype=np.uint64)[:, None], np.array(columns, np.uint64))
    shades = (245 - 150 * grid / max(1, array.order - 1)).astype(np.uint8)
    whole = np.kron(shades, np.ones((pixels, pixels), dtype=np.uint8))
    picture = Image.fromarray(whole).convert("RGB")
    pen = ImageDraw.Draw(picture)
    for row, column in places:
        colour = _INK if found.row is not None else _MAYBE
        for down in (0, -array.rows):  # the parts that wrap around
            for right in (0, -array.columns):
                top = ((row - first[0]) % array.rows + down) * pixels
                left = ((column - first[1]) % array.columns + right) * pixels
                box = (left, top, left + shape[1] * pixels - 1, top + shape[0] * pixels - 1)
                if box[2] >= 0 and box[3] >= 0 and left < whole.shape[1] and top < whole.shape[0]:
                    pen.rectangle(box, outline=colour, width=max(1, pixels // 4))
    picture.save(path, format="PNG")
