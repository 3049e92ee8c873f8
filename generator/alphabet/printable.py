"""Whether a printer can make the symbols of an alphabet as a style asks.

Limits, from `Printer`: stroke and height; between neighbouring symbols the gap at the foot,
because symbols that grow together change what is read; inside a symbol the gap between the
tops of two strokes, which may be narrower, because one that half closes costs contrast only
(strokes 0.2 mm too wide are still read without error).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from generator.alphabet.known import Alphabet
from generator.alphabet.outline import (
    TIGHT_FIX,
    SymbolStyle,
    Tiers,
    check_numbers,
    footprint_half_mm,
    outlines,
)
from generator.errors import AlphabetError
from generator.printers import Printer

# Numbers of a style that may mend it, and which way they go.
WAYS = (("stroke", -1), ("stroke", 1), ("pitch", 1), ("draft", -1), ("chamfer", -1))


def gap_inside_mm(tiers: Tiers) -> float:
    """Return the narrowest gap between two facing sides of one symbol at its top, mm.

    Sides face each other when their normals are opposed within 25 degrees; `inf` if none do.
    A chamfer is counted as open: the gap is that below it.
    """
    tier = tiers.rings[-2] if len(tiers.rings) > 2 else tiers.rings[-1]
    a = np.concatenate(tier)
    b = np.concatenate([np.roll(ring, -1, axis=0) for ring in tier])
    length = np.hypot(*(b - a).T)
    along = (b - a) / length[:, None]
    normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
    middle = (a + b) / 2
    i, j = np.triu_indices(len(a), 1)
    facing = (normal[i] * normal[j]).sum(axis=1) < -math.cos(math.radians(25))
    i, j = i[facing], j[facing]
    between = middle[j] - middle[i]
    gap = (between * normal[i]).sum(axis=1)
    apart = np.abs((between * along[i]).sum(axis=1)) - (length[i] + length[j]) / 2
    gap, apart = gap[gap > 0], np.maximum(apart[gap > 0], 0.0)
    return float(np.hypot(gap, apart).min(initial=np.inf))


def gap_between_mm(alphabet: Alphabet, style: SymbolStyle) -> float:
    """Return the least gap between the feet of two neighbouring symbols, mm."""
    feet = np.concatenate([ring for tiers in outlines(alphabet, style) for ring in tiers.rings[0]])
    return style.pitch_mm - float((feet.max(axis=0) - feet.min(axis=0)).max())


def check_printable(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> None:
    """Refuse symbols that the printer would lose, by `AlphabetError`.

    It names the number that is out of range, the limit, and for every number of the style that
    mends it alone the nearest value; where none does, the limit to keep.
    """
    place = f"alphabet {alphabet.name}"
    check_numbers(style, place)
    fault = printing_fault(alphabet, style, printer)
    if fault is not None:
        ways = _ways_out(alphabet, style, printer)
        raise AlphabetError(fault.cause, fix=ways or fault.fix, place=place)


def is_printable(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> bool:
    """Return whether `check_printable` lets symbols pass."""
    return printing_fault(alphabet, style, printer) is None


def printing_fault(
    alphabet: Alphabet, style: SymbolStyle, printer: Printer
) -> AlphabetError | None:
    """Return what `check_printable` would refuse, without its search for what mends it."""
    try:
        check_numbers(style, f"alphabet {alphabet.name}")
        _check(alphabet, style, printer)
    except AlphabetError as fault:
        return fault
    return None


def _check(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> None:
    """Refuse what the printer would lose; the fix is the limit that was broken."""
    least = f"{printer.stroke_min_mm:g} mm"
    if style.stroke_mm < printer.stroke_min_mm:
        raise AlphabetError(
            f"stroke {style.stroke_mm:g} mm, but {printer.name} prints no stroke under {least}",
            fix=f"set stroke to {least} or more, or choose a finer printer",
        )
    least = f"{printer.height_min_mm:g} mm"
    if style.height_mm < printer.height_min_mm:
        raise AlphabetError(
            f"height {style.height_mm:g} mm, but under {least} a symbol printed by {printer.name} "
            "cannot be felt",
            fix=f"set height to {least} or more",
        )
    least_mm = printer.stroke_min_mm / 2
    top_mm = style.stroke_mm - 2 * style.chamfer_mm * (1 - math.tan(style.draft_rad))
    if top_mm < least_mm:
        most_mm = math.floor(50 * (style.stroke_mm - least_mm)) / 100
        raise AlphabetError(
            f"a chamfer of {style.chamfer_mm:g} mm leaves {max(top_mm, 0.0):.2g} mm of the "
            f"stroke's top, but {printer.name} needs {least_mm:g} mm",
            fix=f"set chamfer to {most_mm:g} mm or less",
        )
    footprint_half_mm(alphabet, style)
    between = gap_between_mm(alphabet, style)
    if between < printer.gap_min_mm:
        raise AlphabetError(
            f"{between:.2g} mm between the feet of neighbouring symbols, but {printer.name} keeps "
            f"no gap under {printer.gap_min_mm:g} mm open",
            fix=TIGHT_FIX,
        )
    open_mm = printer.gap_inside_mm
    for glyph, tiers in zip(alphabet.glyphs, outlines(alphabet, style), strict=True):
        inside = gap_inside_mm(tiers)
        if inside < open_mm * (1 - 1e-9):
            raise AlphabetError(
                f"{inside:.2g} mm between two strokes of symbol '{glyph.name}', but "
                f"{printer.name} keeps no gap under {open_mm:g} mm open inside a symbol",
                fix=TIGHT_FIX,
            )


def _ways_out(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> str:
    """Return the nearest values that pass, one number changed, as an instruction; empty if none."""
    ways = []
    for name, direction in WAYS:
        unit, scale = ("degrees", math.degrees(1.0)) if name == "draft" else ("mm", 1.0)
        field = "draft_rad" if name == "draft" else f"{name}_mm"
        given = scale * getattr(style, field)
        most = 40 if direction > 0 else 20  # up to three times as much, or down to nothing
        for steps in range(1, most + 1) if given else ():  # of 5 %
            value = round(given + direction * steps * 0.05 * given, 2)
            if is_printable(alphabet, replace(style, **{field: value / scale}), printer):
                ways.append(f"{name} to {value:g} {unit}")
                break
    return "set " + ", or ".join(ways) if ways else ""
