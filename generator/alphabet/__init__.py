"""Symbols: stroke graphs and the outlines that are embossed."""

from generator.alphabet.known import ALPHABETS, Alphabet, alphabet_from, alphabet_named
from generator.alphabet.outline import (
    SymbolStyle,
    Tiers,
    footprint_half_mm,
    outline,
    outlines,
)
from generator.alphabet.printable import check_printable
from generator.alphabet.strokes import Counts, Glyph, counts, key_points

__all__ = [
    "ALPHABETS",
    "Alphabet",
    "Counts",
    "Glyph",
    "SymbolStyle",
    "Tiers",
    "alphabet_from",
    "alphabet_named",
    "check_printable",
    "counts",
    "footprint_half_mm",
    "key_points",
    "outline",
    "outlines",
]
