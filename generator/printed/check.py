"""Parts -> the fate of every symbol on one printer: slice, print, compare, and draw as a PNG.

The whole of `encode-object SPEC --printed-check`. Each part is sliced by PrusaSlicer from the
mesh of its STL; faces that look down on the bed or lean are named, not judged.

The picture has one row for each kind of symbol: that of median overlap, and the worst. Each shows
design, deposit (shaded, light from the upper left) and their footprints at half height. A
symbol's y axis runs up the picture.
"""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from generator.export.colours import BODY_RGB, SYMBOL_RGB
from generator.export.meshes import stl_chunks
from generator.printed.deposit import deposit
from generator.printed.faults import PrintFaults
from generator.printed.slicer import PrintProfile, find_slicer, slice_part, slicer_version
from generator.printed.survey import SymbolTile, survey_face
from generator.printed.view import face_surface, is_seen
from generator.solid.part import Part
from generator.solid.triangulate import triangles

Floats = NDArray[np.float64]
Pixels = NDArray[np.uint8]

TILE = 150  #: pixels a side
LOST_RGB = (190, 24, 40)
WIDENED_RGB = (37, 99, 205)
BOTH_RGB = (246, 205, 170)
_PAPER = (250, 251, 253)
_INK = (51, 65, 85)
_GAP, _MARGIN, _NAME, _HEAD, _FOOT = 8, 24, 190, 104, 64
_LIGHT = np.array([-0.45, 0.45, 0.77])
_STEP_MM = 0.05  # of the tiles' lattice

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, eq=False)
class PrintedCheck:
    """Every symbol of some parts as one printer makes it."""

    profile: str
    tiles: tuple[SymbolTile, ...]
    unseen: tuple[str, ...]  #: faces with symbols that are not judged: "F6 of Cube"
    plain: tuple[str, ...]  #: parts without symbols


def check_parts(
    parts: Sequence[Part],
    profile: PrintProfile,
    *,
    faults: PrintFaults | None = None,
    progress: Progress = lambda _text, _share: None,
) -> PrintedCheck:
    """Print all parts in simulation and compare every symbol with its design.

    Raises `PrintError` if PrusaSlicer is missing or refuses a part.
    """
    find_slicer()
    slicer_version()
    marked = [part for part in parts if _faces(part)]
    done = 0

    def one(job: tuple[int, Part]) -> tuple[list[SymbolTile], list[str]]:
        nonlocal done
        number, part = job
        found = _check_part(part, profile, faults, np.random.default_rng([0, number]))
        done += 1
        progress(f"printing {part.name}", done / len(marked))
        return found

    with ThreadPoolExecutor(min(len(marked) or 1, os.cpu_count() or 1)) as pool:
        results = list(pool.map(one, enumerate(marked)))
    return PrintedCheck(
        profile.name,
        tuple(tile for tiles, _ in results for tile in tiles),
        tuple(face for _, faces in results for face in faces),
        tuple(part.name for part in parts if not _faces(part)),
    )


def _check_part(
    part: Part, profile: PrintProfile, faults: PrintFaults | None, rng: np.random.Generator
) -> tuple[list[SymbolTile], list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{part.name}.stl"
        file.write_bytes(b"".join(stl_chunks(triangles(part))))
        whole = len(_faces(part)) + len(part.wrapped) > 1
        sliced = slice_part(file, profile, supports=whole)
    printed = deposit(sliced, faults, rng)
    tiles: list[SymbolTile] = []
    unseen = [part.facets[w.facets[0]].name for w in part.wrapped if w.facets]
    for number in _faces(part):
        embossing = part.embossings[number]
        facet = part.facets[embossing.facet]
        if not is_seen(embossing.T_part_facet):
            unseen.append(facet.name)
            continue
        T = embossing.T_part_facet
        corners = part.vertices[[corner for loop in facet.loops for corner in loop]]
        outline = ((corners - T[:3, 3]) @ T[:3, :3])[:, :2]
        surface = face_surface(printed, T, outline_mm=outline)
        tiles += survey_face(surface, embossing, part=part.name, face=facet.name)
    return tiles, [f"{face} of {part.name}" for face in unseen]


def _faces(part: Part) -> list[int]:
    """Return the numbers of the embossings that carry symbols of faces."""
    return [k for k, e in enumerate(part.embossings) if e.face is not None and len(e.labels)]


def check_png(title: str, tiles: Sequence[SymbolTile], names: Sequence[str] = ()) -> bytes:
    """Return the picture: its first line, all symbols, and their names in the alphabet by label."""
    labels = sorted({tile.check.label for tile in tiles})
    worst_first = sorted(tiles, key=lambda tile: tile.check.overlap)
    alike = [[tile for tile in worst_first if tile.check.label == label] for label in labels]
    width = _MARGIN * 2 + _NAME + 6 * TILE + 6 * _GAP + 2 * _MARGIN
    height = _HEAD + len(labels) * (TILE + _GAP) + _FOOT
    image = Image.new("RGB", (width, height), _PAPER)
    draw = ImageDraw.Draw(image)
    large, small = ImageFont.load_default(24), ImageFont.load_default(14)
    draw.text((_MARGIN, 20), title, _INK, large)
    left = [_MARGIN + _NAME + side * (3 * TILE + 3 * _GAP + _MARGIN) for side in (0, 1)]
    for x, what in zip(left, ("median", "worst"), strict=True):
        words = (f"{what}: designed", "deposited", "difference")
        for k, word in enumerate(words):
            draw.text((x + k * (TILE + _GAP), _HEAD - 24), word, _INK, small)
    for row, (label, own) in enumerate(zip(labels, alike, strict=True)):
        y = _HEAD + row * (TILE + _GAP)
        pair = own[len(own) // 2], own[0]
        check = own[0].check
        name = names[label] if label < len(names) else str(label)
        lines = (f"symbol {name}, {len(own)} of them", f"overlap {pair[0].check.overlap:.3f}",
                 f"worst {check.overlap:.3f}: {check.verdict}", f"{check.face} {check.name}",
                 f"height {check.height_mm:.2f} of {check.designed_mm:.2f} mm")  # fmt: skip
        for k, line in enumerate(lines):
            draw.text((_MARGIN, y + 8 + 20 * k), line, _INK, small)
        for x, tile in zip(left, pair, strict=True):
            for k, pixels in enumerate(_three_views(tile)):
                picture = Image.fromarray(pixels[::-1]).resize((TILE, TILE), Image.Resampling.BOX)
                image.paste(picture, (x + k * (TILE + _GAP), y))
    x, y = _MARGIN, height - _FOOT + 22
    for colour, what in ((BOTH_RGB, "as designed"), (LOST_RGB, "lost"), (WIDENED_RGB, "widened")):
        draw.rectangle((x, y, x + 18, y + 14), colour)
        draw.text((x + 26, y - 2), what, _INK, small)
        x += 140
    stored = io.BytesIO()
    image.save(stored, "PNG", optimize=True)
    return stored.getvalue()


def _three_views(tile: SymbolTile) -> tuple[Pixels, Pixels, Pixels]:
    high = tile.check.designed_mm
    designed, printed = (heights > high / 2 for heights in (tile.designed, tile.deposited))
    both = np.empty((*designed.shape, 3), np.uint8)
    both[:] = BODY_RGB
    both[designed & printed] = BOTH_RGB
    both[designed & ~printed] = LOST_RGB
    both[printed & ~designed] = WIDENED_RGB
    return _shade(tile.designed, high), _shade(tile.deposited, high), both


def _shade(heights: Floats, high: float) -> Pixels:
    """Return heights as a lit relief, coloured from body to symbol."""
    z = np.where(np.isfinite(heights), heights, -high).clip(-high, 2 * high)
    slope_y, slope_x = np.gradient(z, _STEP_MM)
    light = (-slope_x * _LIGHT[0] - slope_y * _LIGHT[1] + _LIGHT[2]) / np.sqrt(
        1 + slope_x**2 + slope_y**2
    )
    share = (z / high).clip(0, 1)[..., None]
    colour = (1 - share) * np.array(BODY_RGB) + share * np.array(SYMBOL_RGB)
    shade = (0.35 + 0.85 * light.clip(0) / _LIGHT[2]).clip(0, 1.15)[..., None]
    pixels: Pixels = (colour * shade).clip(0, 255).astype(np.uint8)
    return pixels
