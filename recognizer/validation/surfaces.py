"""Surfaces that no database knows, as `--kinds foreign` names them.

EmbossedArray + rng -> HeightMap in the style of the lab's symbols. What they are stands in
`probe.simulate.world.surfaces`; everything else than a registered face must be refused.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generator.alphabet import alphabet_named
from generator.array import FoldedArray, ProductArray, profile
from probe.simulate.world.surfaces import draw_dots, draw_ridges, draw_rough, draw_text
from probe.surface.contract import HeightMap
from probe.surface.face import endless_face
from probe.surface.indenters import FlatPlate
from probe.surface.symbols import Relief
from recognizer.touch.lab import EmbossedArray


def flat_face(_encoding: EmbossedArray, _rng: np.random.Generator) -> HeightMap:
    """Return a flat face."""
    return FlatPlate()


def ridges(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return straight ridges."""
    return draw_ridges(encoding.style.pitch_mm, encoding.style.stroke_mm, rng)


def dots(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return dots on a square grid."""
    return draw_dots(encoding.style.pitch_mm, rng)


def rough_face(_encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return a random surface."""
    return draw_rough(rng)


def random_symbols(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return symbols of the same alphabet at the same pitch, drawn at random."""
    return _embossed_surface(encoding, rng.integers(encoding.array.order, size=(64, 64)))


def other_lab(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return another array in the same alphabet, at the same pitch."""
    sizes = (encoding.array.rows, encoding.array.columns)
    names = ("one-touch", "large") if encoding.array.order == 4 else ("thesis",)
    others = [_array_of(name) for name in names]
    array = next((a for a in others if (a.rows, a.columns) != sizes), others[0])
    if (array.rows, array.columns) == sizes or array.order != encoding.array.order:
        return random_symbols(encoding, rng)
    row, column = (int(rng.integers(size)) for size in (array.rows, array.columns))
    rows, columns = np.indices((64, 64))
    return _embossed_surface(
        encoding, array.symbols((rows + row) % array.rows, (columns + column) % array.columns)
    )


def text(encoding: EmbossedArray, rng: np.random.Generator) -> HeightMap:
    """Return letters as high and as thick as the symbols."""
    letters = alphabet_named("letters-4")
    strokes = tuple(glyph.strokes for glyph in letters.glyphs)
    return draw_text(strokes, letters.reach, encoding.style.pitch_mm, _relief(encoding), rng)


#: Surfaces of no database.
FOREIGN: dict[str, Callable[[EmbossedArray, np.random.Generator], HeightMap]] = {
    "blank": flat_face,
    "ridges": ridges,
    "dots": dots,
    "rough": rough_face,
    "random symbols": random_symbols,
    "other lab": other_lab,
    "text": text,
}


@lru_cache(maxsize=4)
def _array_of(name: str) -> FoldedArray | ProductArray:
    return profile(name).array()


def _embossed_surface(encoding: EmbossedArray, labels: NDArray[np.int64]) -> HeightMap:
    style, alphabet = encoding.style, encoding.alphabet
    return endless_face(
        labels,
        tuple(glyph.strokes for glyph in alphabet.glyphs),
        pitch_mm=style.pitch_mm,
        unit_mm=alphabet.reach * style.pitch_mm,
        relief=_relief(encoding),
    )


def _relief(encoding: EmbossedArray) -> Relief:
    style = encoding.style
    return Relief(style.height_mm, style.stroke_mm, style.draft_rad, style.chamfer_mm)
