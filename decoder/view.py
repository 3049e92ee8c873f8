"""What a view can do: rank and minimum distance of any set of visible cells.

A view is a set of cells relative to the place, in any shape. With minimum distance d, up to
d - 1 symbols that are missing, or (d - 1)/2 that are wrong, never lead to another place;
e wrong and s missing ones together if 2 e + s < d.

`draw` shows a window on its array as a PNG: cells in shades of their symbols, the window outlined,
or its candidates if it is not decoded. Arrays of up to 2^16 cells are drawn whole, of others the
neighbourhood; a window that wraps around the torus is outlined on every side that it touches.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from generator.array.contract import Labels, SymbolArray
from generator.array.fold import FoldedArray
from generator.array.product import ProductArray

if TYPE_CHECKING:
    from decoder.decoded import Decoded


@dataclass(frozen=True, slots=True)
class Strength:
    """Exact answers about one set of visible cells."""

    cells: int  #: symbols seen
    rank: int  #: names the place if it is `full_rank`
    full_rank: int
    distance: int  #: least number of cells in which two places differ; 0: look alike

    @property
    def identifies(self) -> bool:
        """Whether the cells together name their place."""
        return self.rank == self.full_rank

    @property
    def errors(self) -> int:
        """Wrong symbols that are always corrected."""
        return max(0, (self.distance - 1) // 2)

    @property
    def erasures(self) -> int:
        """Missing symbols that are always made up for."""
        return max(0, self.distance - 1)


def strength(array: FoldedArray | ProductArray, rows: ArrayLike, columns: ArrayLike) -> Strength:
    """Return what the cells (rows, columns), relative to the place, can do.

    Raises `ArrayError` if the minimum distance is out of reach: beyond 2^20 places and 2^16 dual
    words.

    >>> from generator.array import profile
    >>> strength(profile("thesis").array(), *np.indices((6, 6))).errors
    2
    """
    r, c = np.broadcast_arrays(rows, columns)
    rank = array.rank(r, c)
    distance = array.minimum_distance(r, c) if rank == array.full_rank else 0
    return Strength(r.size, rank, array.full_rank, distance)


def strength_of_window(array: FoldedArray | ProductArray, rows: int, columns: int) -> Strength:
    """Return what a window of rows x columns cells can do, all of them seen."""
    return strength(array, *np.indices((rows, columns)))


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
