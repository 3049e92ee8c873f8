"""Image -> symbols with their places and axes, the thesis's way. Thesis 6.1, 6.2.

Ink is where a reading exceeds a share of the highest one nearby: tactels do not press equally all
over an image (a tilted sensor, touches of different force in a mosaic). Ink is thinned; every
component that lies wholly in the image has its end-points and vertices counted, and the counts name
the symbol, or no symbol. Then the points of that symbol are fitted to those of the component. The
fit gives the directions of its axes, and its residual rejects other shapes with equal counts. The
symbol's place is the middle of its ink; ends, which blur and thinning shorten, would displace it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from generator.alphabet import Alphabet, Glyph, SymbolStyle
from recognizer.thesis.filters import magnify_image
from recognizer.thesis.skeleton import KeyPoints, points_of_glyph, points_of_skeleton
from recognizer.touch.tactile_image import TactileImage

Array = NDArray[np.float64]

CUT, COUNTS, SHAPE = "cut", "counts", "shape"

FAINT = 0.15  #: of the highest reading; below it nothing is pressed
INK_SHARE = 0.58  #: of the highest reading nearby, from which a sample is ink
LEAST_AREA = 0.3  #: of a symbol's stroke area; smaller specks are no symbols
MOST_RESIDUAL = 0.35  #: rms distance of the points, lattice units
THICK = 6  #: samples that a stroke is magnified to before it is thinned
RIM = THICK // 2  #: samples around a component that belong to its blur
FINE = 101  #: points along a symbol's box, by which the middle of a glyph is found


@dataclass(frozen=True, slots=True, eq=False)
class Symbol:
    """A component of ink."""

    label: int  #: -1 where it is rejected
    x_mm: float  #: centre of the symbol, or of the ink where it is rejected; image frame
    y_mm: float
    theta_rad: float  #: of the symbol's x axis; NaN where it is rejected
    middle_mm: tuple[float, float]  #: of its ink
    off_mm: float  #: rms residual of the points; NaN if not named
    rejected: str  #: "", "cut", "counts" or "shape"


def symbols(image: TactileImage, alphabet: Alphabet, style: SymbolStyle) -> list[Symbol]:
    """Return the components of ink in an image over its bias, named or rejected.

    The image is magnified until strokes are `THICK` samples wide.
    """
    require("skimage", extra="thesis", purpose="the thesis's reading")
    from scipy.ndimage import find_objects, label
    from skimage.morphology import skeletonize

    thin = THICK * image.step_mm / style.stroke_mm
    image = magnify_image(image, max(0, math.ceil(math.log2(thin))))
    unit_mm = alphabet.reach * style.pitch_mm
    shown = ink(image, style.pitch_mm)
    numbers, _ = label(shown, structure=np.ones((3, 3)))
    beyond = np.pad(~image.defined, RIM, constant_values=True)
    values = np.pad(image.values, RIM)
    least = LEAST_AREA * 2 * unit_mm * style.stroke_mm / image.step_mm**2
    found = []
    for number, (rows, columns) in enumerate(find_objects(numbers), 1):
        part = np.pad(numbers[rows, columns] == number, RIM)
        if part.sum() < least:
            continue
        box = np.s_[rows.start : rows.stop + 2 * RIM, columns.start : columns.stop + 2 * RIM]
        whole = _dilate(part, RIM)
        cut = bool((_dilate(part, 1) & beyond[box]).any())
        points = points_of_skeleton(skeletonize(part), unit_mm / image.step_mm)
        weights = np.where(whole, values[box], 0.0)
        middle = [
            weights.sum(axis=1) @ np.arange(len(weights)),
            weights.sum(axis=0) @ np.arange(weights.shape[1]),
        ] / weights.sum()
        corner = (rows.start - RIM, columns.start - RIM)
        placed = KeyPoints(
            image.xy_mm(*(points.ends + corner).T),
            image.xy_mm(*(points.vertices + corner).T),
            points.loops,
        )
        at = image.xy_mm(*(middle + corner))
        found.append(_identify_symbol(placed, at, cut, alphabet, style))
    return found


def ink(image: TactileImage, reach_mm: float) -> NDArray[np.bool_]:
    """Return where (h, w) readings are high among those within `reach_mm`: strokes."""
    from scipy.ndimage import maximum_filter, uniform_filter

    if not image.defined.any():
        return np.zeros(image.values.shape, np.bool_)
    size = 2 * round(reach_mm / 2 / image.step_mm) + 1
    nearby = uniform_filter(maximum_filter(image.values, size), size, mode="nearest")
    least = FAINT * np.quantile(image.values[image.defined], 0.99)
    return np.asarray((image.values > INK_SHARE * nearby) & (nearby > least) & image.defined)


def fit_glyph(glyph: KeyPoints, found: KeyPoints, unit_mm: float) -> tuple[float, float]:
    """Return residual (rms, mm) and turn (rad) of a glyph fitted to points of equal counts.

    Ends are paired with ends and vertices with vertices in the way that fits best.
    """
    first, total = len(glyph.ends), len(glyph.ends) + len(glyph.vertices)
    ways = itertools.product(
        itertools.permutations(range(first)), itertools.permutations(range(first, total))
    )
    order = np.array([[*ends, *vertices] for ends, vertices in ways], int)
    model = np.concatenate([glyph.ends, glyph.vertices]) @ np.array([1, 1j]) * unit_mm
    seen = np.concatenate([found.ends, found.vertices]) @ np.array([1, 1j])
    paired = model[order]
    middle, centre = paired.mean(axis=1, keepdims=True), seen.mean()
    turn = ((paired - middle).conj() * (seen - centre)).sum(axis=1)
    turn = np.where(abs(turn) > 0, turn, 1)
    turn = turn / abs(turn)
    away = seen - centre - turn[:, None] * (paired - middle)
    off = np.sqrt((abs(away) ** 2).mean(axis=1))
    best = int(off.argmin())
    return float(off[best]), float(np.angle(turn[best]))


def _identify_symbol(
    points: KeyPoints, middle: Array, cut: bool, alphabet: Alphabet, style: SymbolStyle
) -> Symbol:
    unit_mm = alphabet.reach * style.pitch_mm
    x, y = middle.tolist()
    if cut:
        return Symbol(-1, x, y, math.nan, (x, y), math.nan, CUT)
    fits = [
        (*fit_glyph(points_of_glyph(glyph), points, unit_mm), label)
        for label, glyph in enumerate(alphabet.glyphs)
        if points_of_glyph(glyph).counts == points.counts
    ]
    if not fits:
        return Symbol(-1, x, y, math.nan, (x, y), math.nan, COUNTS)
    off, theta, label = min(fits)
    if off > MOST_RESIDUAL * unit_mm:
        return Symbol(-1, x, y, math.nan, (x, y), off, SHAPE)
    own = _middle(alphabet.glyphs[label], unit_mm, style.stroke_mm)
    at = complex(x, y) - own * complex(math.cos(theta), math.sin(theta))
    return Symbol(label, at.real, at.imag, theta, (x, y), off, "")


@lru_cache(maxsize=256)
def _middle(glyph: Glyph, unit_mm: float, stroke_mm: float) -> complex:
    """Return the middle of a glyph's area, mm, in its own axes."""
    half = unit_mm + stroke_mm
    x, y = np.meshgrid(np.linspace(-half, half, FINE), np.linspace(-half, half, FINE))
    at = x + 1j * y
    covered = np.zeros(at.shape, np.bool_)
    for a, b in glyph.strokes:
        start, along = complex(*a) * unit_mm, (complex(*b) - complex(*a)) * unit_mm
        share = np.clip(((at - start) * along.conjugate()).real / abs(along) ** 2, 0, 1)
        covered |= abs(at - start - share * along) <= stroke_mm / 2
    return complex(at[covered].mean())


def _dilate(part: NDArray[np.bool_], steps: int) -> NDArray[np.bool_]:
    from scipy.ndimage import binary_dilation

    return np.asarray(binary_dilation(part, np.ones((3, 3)), iterations=steps))
