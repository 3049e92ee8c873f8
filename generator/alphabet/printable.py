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
from generator.alphabet.outline import SymbolStyle, Tiers, footprint_half_mm, outlines
from generator.errors import AlphabetError
from generator.printers import Printer


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

    It names the number that is out of range, the printer's limit, and a stroke or pitch that works.
    """
    found = _fault(alphabet, style, printer)
    if found is not None:
        cause, fix = found
        raise AlphabetError(
            cause,
            fix=fix or _ways_out(alphabet, style, printer),
            place=f"alphabet {alphabet.name}",
        )


def is_printable(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> bool:
    """Return whether `check_printable` lets symbols pass."""
    try:
        return _fault(alphabet, style, printer) is None
    except AlphabetError:  # of the footprint
        return False


def _fault(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> tuple[str, str] | None:
    """Return what the printer would lose, and what to do: empty where that takes a search."""
    if style.stroke_mm < printer.stroke_min_mm:
        least = f"{printer.stroke_min_mm:g} mm"
        return (
            f"stroke {style.stroke_mm:g} mm, but {printer.name} prints no stroke under {least}",
            f"set stroke to {least} or more, or choose a finer printer",
        )
    if style.height_mm < printer.height_min_mm:
        least = f"{printer.height_min_mm:g} mm"
        cause = (
            f"height {style.height_mm:g} mm, but under {least} a symbol printed by {printer.name} "
            "cannot be felt"
        )
        return cause, f"set height to {least} or more"
    top = style.stroke_mm - 2 * style.chamfer_mm * (1 - math.tan(style.draft_rad))
    if top < printer.stroke_min_mm / 2:
        most = (style.stroke_mm - printer.stroke_min_mm / 2) / 2
        cause = (
            f"a chamfer of {style.chamfer_mm:g} mm leaves {max(top, 0.0):.2g} mm of the stroke's "
            f"top, but {printer.name} needs {printer.stroke_min_mm / 2:g} mm"
        )
        return cause, f"set chamfer to {math.floor(100 * most) / 100:g} mm or less"
    footprint_half_mm(alphabet, style)
    between = gap_between_mm(alphabet, style)
    if between < printer.gap_min_mm:
        cause = (
            f"{between:.2g} mm between the feet of neighbouring symbols, but {printer.name} keeps "
            f"no gap under {printer.gap_min_mm:g} mm open"
        )
        return cause, ""
    open_mm = printer.gap_inside_mm
    for glyph, tiers in zip(alphabet.glyphs, outlines(alphabet, style), strict=True):
        inside = gap_inside_mm(tiers)
        if inside < open_mm * (1 - 1e-9):
            cause = (
                f"{inside:.2g} mm between two strokes of symbol '{glyph.name}', but "
                f"{printer.name} keeps no gap under {open_mm:g} mm open inside a symbol"
            )
            return cause, ""
    return None


def _ways_out(alphabet: Alphabet, style: SymbolStyle, printer: Printer) -> str:
    """Return the nearest strokes and pitches that pass, as an instruction."""
    ways = []
    for name, direction in (("stroke", -1), ("stroke", 1), ("pitch", 1)):
        field = f"{name}_mm"
        given = getattr(style, field)
        for steps in range(1, 16):  # of 5 %
            value = round(given + direction * steps * 0.05 * given, 2)
            if value <= 0:
                break
            if is_printable(alphabet, replace(style, **{field: value}), printer):
                ways.append(f"{name} to {value:g} mm")
                break
    return "set " + ", or ".join(ways) if ways else "set draft or height to less, or pitch to more"
