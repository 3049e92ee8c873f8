"""Glyph outlines: stroke graphs widened by an octagonal nib, with draft and chamfer.

Glyph + style -> Tiers: outlines at rising heights, mm, in the symbol's own axes. The top
of a stroke keeps its width; draft widens the foot, a chamfer of 45 degrees narrows the
top. From tier to tier every edge moves along its own normal and every corner with it, so
each side of a symbol is one exactly planar quadrilateral. Thesis 6.1, 6.2.

An outline is rings of lines (nx, ny, c): the material lies at n . x <= c near that edge, and
moving the outline by d is c + d. The union's own coordinates are rounded to 1e-8; its edges only
name the lines, and vertices are their intersections.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from generator.alphabet.known import Alphabet
from generator.alphabet.strokes import Glyph
from generator.errors import AlphabetError
from generator.plane.polygon import edges_cross, keeps_edges, signed_area

TIGHT_FIX = "set stroke, draft or height to less, or pitch to more"  #: where strokes have no room
SHORTEST_EDGE = 0.01  #: of the stroke: an edge shorter than this is refused as collapsed
LEAST_CHAMFER_MM = 0.01  #: a smaller one cannot be seen, and its sides would be slivers
FOOT_MARGIN = 0.005  #: of the pitch: free around the footprint, for triangulation

Lines = NDArray[np.float64]  # (k, 3): unit normal out of the material, and offset in mm

_ROOT = np.sqrt(0.5)
#: Flats of the nib; the diagonal ones to the last bit alike.
_FLATS = np.array(
    [[1, 0], [_ROOT, _ROOT], [0, 1], [-_ROOT, _ROOT], [-1, 0], [-_ROOT, -_ROOT], [0, -1],
     [_ROOT, -_ROOT]]
)  # fmt: skip
_NIB = _FLATS + np.tan(np.pi / 8) * np.stack([-_FLATS[:, 1], _FLATS[:, 0]], axis=1)


def nib_outline(strokes: NDArray[np.float64], width_mm: float) -> list[Lines]:
    """Return the outline of strokes (s, 2, 2) mm, drawn by an octagonal nib as wide between flats.

    (k, 3) each: outer rings counter-clockwise and holes clockwise, in no order; no two neighbouring
    edges are parallel.
    """
    from manifold3d import CrossSection, OpType

    radius = width_mm / 2
    hulls, lines = [], []
    for a, b in strokes:
        corners = np.concatenate([a + radius * _NIB, b + radius * _NIB])
        along = (b - a) / np.hypot(*(b - a))
        side = np.array([along[1], -along[0]])
        normals = np.concatenate([_FLATS, [side, -side]])
        # On the flats, the support is that of the end point; elsewhere that of a nib corner.
        support = np.maximum(_FLATS @ a, _FLATS @ b) + radius
        sideways = (corners @ np.stack([side, -side], axis=1)).max(axis=0)
        hulls.append(CrossSection.hull_points(corners))
        lines.append(np.c_[normals, np.concatenate([support, sideways])])
    known = np.concatenate(lines)
    union = CrossSection.batch_boolean(hulls, OpType.Add)
    scale = float(np.abs(strokes).max()) + width_mm
    return [_support_lines(ring, known, scale) for ring in union.to_polygons()]


def offset_ring(ring: Lines, distance_mm: float) -> NDArray[np.float64]:
    """Return the corners (k, 2) of a ring whose edges move out; corner i starts edge i."""
    n, c = ring[:, :2], ring[:, 2] + distance_mm
    m, d = np.roll(n, 1, axis=0), np.roll(c, 1)
    turn = m[:, 0] * n[:, 1] - m[:, 1] * n[:, 0]
    x = (d * n[:, 1] - c * m[:, 1]) / turn
    y = (c * m[:, 0] - d * n[:, 0]) / turn
    return np.stack([x, y], axis=1)


def _support_lines(ring: NDArray[np.float64], known: Lines, scale: float) -> Lines:
    """Replace the rounded edges of a union by the support lines they lie on."""
    edge = np.roll(ring, -1, axis=0) - ring
    length = np.hypot(edge[:, 0], edge[:, 1])
    found: list[NDArray[np.float64]] = []
    for start, step, size in zip(ring, edge, length, strict=True):
        if size < 1e-6 * scale:
            continue
        normal = np.array([step[1], -step[0]]) / size
        off = np.abs(known[:, :2] @ (start + step / 2) - known[:, 2]) / scale
        miss = off + np.hypot(*(known[:, :2] - normal).T) * size / scale
        best = known[int(np.argmin(miss))]
        if not found or np.abs(best - found[-1]).max() > 1e-9 * max(1.0, scale):
            found.append(best)
    while len(found) > 1 and np.abs(found[0] - found[-1]).max() <= 1e-9 * max(1.0, scale):
        found.pop()
    return np.array(found)


Ring = NDArray[
    np.float64
]  #: (k, 2) mm in the symbol's axes, outer counter-clockwise, holes clockwise


@dataclass(frozen=True, slots=True)
class SymbolStyle:
    """How symbols are embossed."""

    pitch_mm: float = 7.0
    height_mm: float = 1.0
    stroke_mm: float = 1.4  #: width of the stroke at the top, before the chamfer
    draft_rad: float = 0.17453292519943295  #: slope of the sides from the vertical
    chamfer_mm: float = 0.0  #: of the top edge, at 45 degrees; 0 for none

    @property
    def draft_mm(self) -> float:
        """How far the foot reaches beyond the top, before the chamfer, on every side."""
        return self.height_mm * math.tan(self.draft_rad)


@dataclass(frozen=True, slots=True, eq=False)
class Tiers:
    """A symbol as outlines at rising (emboss) or falling (engrave) heights.

    All parts of an object hold the same ones: what follows from one is kept by its identity.

    Every tier has the same number of rings, and ring k the same number of corners on every
    tier; edge i of ring k (corner i to i + 1) has one direction on all tiers, so
    neighbouring tiers join by planar quadrilaterals. With a, b the corners on one tier and
    c, d those after it, the loop (a_i, a_i+1, b_i+1, b_i) has its normal out of the
    material in both cases: next to an embossed stroke, or into the void of an engraved one.
    The facet in z = 0 is cut by the first tier's rings reversed; inside each hole ring of
    the first tier it goes on (an island of the facet). The last tier's rings, as they are,
    bound the top (or the floor), whose normal is +z in both cases.
    """

    z_mm: tuple[float, ...]  #: first 0.0 in the face; strictly rising or strictly falling
    rings: tuple[tuple[Ring, ...], ...]  #: [tier][ring]; ring 0 outer, others holes


@lru_cache(maxsize=64)
def outlines(alphabet: Alphabet, style: SymbolStyle) -> tuple[Tiers, ...]:
    """Return the tiers of all symbols of an alphabet by label; raises as `outline` does."""
    return tuple(
        outline(glyph, alphabet.reach * style.pitch_mm, style, place=f"alphabet {alphabet.name}")
        for glyph in alphabet.glyphs
    )


def outline(glyph: Glyph, unit_mm: float, style: SymbolStyle, *, place: str = "") -> Tiers:
    """Return the tiers of one embossed glyph: two, or three with a chamfer.

    `unit_mm` is the distance of neighbouring nodes; the style's pitch is not used; errors name
    `place`. Raises `AlphabetError` if a number is out of range, an edge collapses, or strokes meet
    at the foot that stand apart at the top.
    """
    check_numbers(style, place)
    lines = _stroke_lines(glyph, unit_mm, style.stroke_mm, place)
    steps = _steps(style)
    if _regular(lines, [d for _, d in steps], style.stroke_mm):
        return _tiers(lines, steps)
    raise AlphabetError(
        f"stroke {style.stroke_mm:g} mm makes an edge or a gap of symbol '{glyph.name}' collapse "
        f"at pitch {style.pitch_mm:g} mm, height {style.height_mm:g} mm, "
        f"draft {math.degrees(style.draft_rad):.3g} degrees, chamfer {style.chamfer_mm:g} mm",
        fix=TIGHT_FIX,
        place=place,
    )


@lru_cache(maxsize=256)
def engrave(glyph: Glyph, unit_mm: float, stroke_mm: float, depth_mm: float) -> Tiers:
    """Return the tiers of a glyph cut into a facet as a groove with 45 degree walls.

    The stroke has its width at the surface and loses twice the depth at the floor: the groove
    prints without support where it faces the bed. Raises `AlphabetError` if the floor collapses.
    """
    lines = _stroke_lines(glyph, unit_mm, stroke_mm, "edge number")
    if not _regular(lines, [0.0, -depth_mm], stroke_mm):
        raise AlphabetError(
            f"'{glyph.name}' collapses: stroke {stroke_mm:g} mm, depth {depth_mm:g} mm",
            fix=f"engrave less than {0.45 * stroke_mm:.2g} mm deep, or use larger figures",
        )
    return _tiers(lines, [(0.0, 0.0), (-depth_mm, -depth_mm)])


def _tiers(lines: list[Lines], steps: Sequence[tuple[float, float]]) -> Tiers:
    """Return the read-only rings at heights, each so far (mm) outside the lines."""
    rings = tuple(tuple(offset_ring(ring, out) for ring in lines) for _, out in steps)
    for ring in chain.from_iterable(rings):
        ring.setflags(write=False)
    return Tiers(tuple(z for z, _ in steps), rings)


def foot_half_mm(tiers: Tiers) -> float:
    """Half side of the smallest square about the symbol's centre that holds its foot, mm."""
    return max(float(np.abs(ring).max()) for ring in tiers.rings[0])


def footprint_half_mm(alphabet: Alphabet, style: SymbolStyle) -> float:
    """Half side of a square about the symbol's centre that holds every foot, mm.

    In the symbol's axes, with a margin of 0.005 pitch; less than half the pitch. Raises
    `AlphabetError` if neighbouring symbols would touch, or as `outline` does.
    """
    half = max(foot_half_mm(tiers) for tiers in outlines(alphabet, style))
    half += FOOT_MARGIN * style.pitch_mm
    if half < style.pitch_mm / 2:
        return half
    raise AlphabetError(
        f"symbols with a foot of {2 * half:.3g} mm touch at a pitch of {style.pitch_mm:g} mm",
        fix=TIGHT_FIX,
        place=f"alphabet {alphabet.name}",
    )


def _steps(style: SymbolStyle) -> list[tuple[float, float]]:
    """Return the height of every tier and how far it lies outside the stroke, mm."""
    slope = math.tan(style.draft_rad)
    h, c = style.height_mm, style.chamfer_mm
    if c > 0:
        return [(0.0, h * slope), (h - c, c * slope), (h, c * slope - c)]
    return [(0.0, h * slope), (h, 0.0)]


def check_numbers(style: SymbolStyle, place: str) -> None:
    """Refuse sizes that are no symbol at all; errors name `place`."""
    for name, value in (
        ("pitch", style.pitch_mm),
        ("height", style.height_mm),
        ("stroke", style.stroke_mm),
    ):
        if not (math.isfinite(value) and value > 0):
            raise AlphabetError(
                f"{name} {value:g} mm", fix=f"set {name} to more than 0 mm", place=place
            )
    if not 0 <= style.draft_rad <= math.radians(60):
        raise AlphabetError(
            f"draft {math.degrees(style.draft_rad):g} degrees",
            fix="set draft between 0 and 60 degrees, 10 prints well",
            place=place,
        )
    most = 0.9 * style.height_mm
    if style.chamfer_mm and not LEAST_CHAMFER_MM <= style.chamfer_mm <= most:
        raise AlphabetError(
            f"chamfer {style.chamfer_mm:g} mm on symbols {style.height_mm:g} mm high",
            fix=f"set chamfer to 0, or between {LEAST_CHAMFER_MM:g} and {most:.2g} mm",
            place=place,
        )


def _stroke_lines(glyph: Glyph, unit_mm: float, stroke_mm: float, place: str) -> list[Lines]:
    """Return the outline's lines, outer ring first, starting at its lowest left corner."""
    rings = nib_outline(np.array(glyph.strokes, dtype=np.float64) * unit_mm, stroke_mm)
    begun = []
    for ring in rings:
        corners = offset_ring(ring, 0.0)
        order = np.lexsort(np.round(corners / stroke_mm, 6).T[::-1])
        first = int(order[0])
        area = signed_area(corners)
        key = (area < 0, *np.round(corners[first] / stroke_mm, 6))
        begun.append((key, np.roll(ring, -first, axis=0)))
    begun.sort(key=lambda pair: pair[0])
    if sum(not key[0] for key, _ in begun) != 1:
        raise AlphabetError(
            f"symbol '{glyph.name}' falls into pieces", fix="join its strokes", place=place
        )
    return [ring for _, ring in begun]


def _regular(lines: list[Lines], distances: list[float], stroke_mm: float) -> bool:
    """Whether all edges survive at every distance and no two of them meet."""
    normal = [offset_ring(ring, 0.0) for ring in lines]
    for distance in distances:
        rings = [offset_ring(ring, distance) for ring in lines]
        short = SHORTEST_EDGE * stroke_mm
        if not all(keeps_edges(a, b, short) for a, b in zip(normal, rings, strict=True)):
            return False
        if edges_cross(rings):
            return False
    return True
