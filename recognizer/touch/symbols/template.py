"""What the sensor feels of each symbol, through the overlay that is fitted.

Alphabet + style + sensor -> Template: the response of a tactel whose centre lies at an
offset from the centre of a symbol, 0 over the bare face, 1 over a wide plateau. Offsets in
the symbol's axes (x along the array's columns, y against its rows), mm.

A tab feels the share of its tip that the plateau covers, and a little more than that share
because a partly covered tip bulges into the open side; what a pad feels is pressed once by
the layer model (`pad`). Responses are kept as
psi(y) = log(1 + 3 y) / log 4, in which gain errors and noise have about one size. Three
things are fitted with the rest, to first order: how much wider than asked the strokes are
printed, how far tactels hear their neighbours, and an exponent, for a force law that is not
quite the one that was taken off.
Thesis 4.2, 6.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from generator.alphabet import Alphabet, SymbolStyle
from probe.sensor import SensorType

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

STEP_MM = 0.05  #: grid of the tables
_BULGE = 0.59  #: F(c)/F(1) = c (1 + bulge (1 - c)) for a tip covered by the share c
_PENETRATION_MM = 0.4  #: of the plateau into the overlay, for the part of a wall that is felt
_PSI = 3.0
WIDER_MM = 0.1  #: unit of the width
CROSS_TALK = 0.12  #: of a reading that its neighbours get; twice that at the far end
PEAK = 98.0  #: percentile of a pad's responses that counts as 1
LOW, HIGH = 0.7, 1.1  #: exponents between which the slope is taken


def psi(response: NDArray[np.float64] | Floats) -> NDArray[np.float64]:
    """Return log(1 + 3 y) / log 4 of responses y >= 0 (negative ones count as 0)."""
    return np.log1p(_PSI * np.maximum(response, 0.0)) / math.log1p(_PSI)


@dataclass(frozen=True, slots=True)
class ResponseTemplate:
    """Responses of all symbols of an alphabet on a fine grid of offsets."""

    pitch_mm: float
    order: int  #: number of symbols
    half_mm: float  #: the grid covers offsets -half ... half in x and y
    rimmed: Floats  #: (n + 2, n + 2, order, 6) psi, slopes by x, y (mm), width, ...; 0 on the rim
    ink: float  #: mean response over a cell

    @property
    def size(self) -> int:
        """Number of grid points along one side."""
        return int(self.rimmed.shape[0]) - 2

    @property
    def values(self) -> Floats:
        """(n, n, order, 6) psi and its slopes by x, y (mm), width, cross-talk and exponent."""
        return self.rimmed[1:-1, 1:-1]

    def at(self, offsets_mm: NDArray[np.float64]) -> Floats:
        """Return psi and slopes (..., order, 6) at offsets (..., 2); 0 outside the grid."""
        index = np.rint((offsets_mm + self.half_mm) / STEP_MM)
        np.clip(index, -1, self.size, out=index)
        place = ((index[..., 1] + 1) * (self.size + 2) + index[..., 0] + 1).astype(np.intp)
        found = self.rimmed.reshape(-1, self.order * 6).take(place, axis=0)
        return found.reshape(*place.shape, self.order, 6)


@lru_cache(maxsize=16)
def template_of(alphabet: Alphabet, style: SymbolStyle, sensor: SensorType) -> ResponseTemplate:
    """Return the template of an alphabet, as embossed and as felt by a sensor."""
    pad = sensor.overlay.kind == "pad"
    felt = _pad_responses if pad else _tab_responses
    half = style.pitch_mm / 2 if pad else _reach_mm(alphabet, style, sensor)
    steps = math.ceil(half / STEP_MM) + (0 if pad else 1)
    axis = np.asarray((np.arange(2 * steps + 1) - steps) * STEP_MM, np.float64)
    usual, wide = (
        felt(alphabet, replace(style, stroke_mm=style.stroke_mm + by), sensor, axis)
        for by in (0.0, WIDER_MM)
    )
    rimmed = np.zeros((len(axis) + 2, len(axis) + 2, alphabet.order, 6), np.float32)
    values = rimmed[1:-1, 1:-1]
    for label in range(alphabet.order):
        middle = _with_cross_talk(usual[label], CROSS_TALK, sensor)
        values[..., label, 0] = psi(middle)
        values[..., label, 1] = np.gradient(values[..., label, 0], STEP_MM, axis=1)
        values[..., label, 2] = np.gradient(values[..., label, 0], STEP_MM, axis=0)
        values[..., label, 3] = psi(_with_cross_talk(wide[label], CROSS_TALK, sensor)) - psi(middle)
        values[..., label, 4] = psi(_with_cross_talk(usual[label], 2 * CROSS_TALK, sensor)) - psi(
            usual[label]
        )
        values[..., label, 5] = (psi(middle**HIGH) - psi(middle**LOW)) / (HIGH - LOW)
    ink = float(usual.sum() * STEP_MM**2 / style.pitch_mm**2) / alphabet.order
    rimmed.setflags(write=False)
    return ResponseTemplate(style.pitch_mm, alphabet.order, steps * STEP_MM, rimmed, ink)


def _tab_responses(
    alphabet: Alphabet, style: SymbolStyle, sensor: SensorType, axis: Array
) -> Array:
    """Return the responses (order, n, n) of tabs."""
    x, y = np.meshgrid(axis, axis)
    reach = alphabet.reach * style.pitch_mm
    return np.stack(
        [
            _tip_response(
                _presence(_distance(np.array(g.strokes, float) * reach, x, y), style), sensor
            )
            for g in alphabet.glyphs
        ]
    )


def _pad_responses(
    alphabet: Alphabet, style: SymbolStyle, sensor: SensorType, axis: Array
) -> Array:
    """Return the responses (order, n, n) of a pad, 1 where they are highest."""
    from scipy.ndimage import uniform_filter

    from recognizer.touch.symbols.pad import pad_responses

    wide = sensor.pitch_mm / 2
    beyond = np.arange(axis[0] - wide, axis[-1] + wide + STEP_MM / 2, STEP_MM)
    base = pad_responses(alphabet, style, sensor, beyond)
    size = round(sensor.pitch_mm / STEP_MM)
    tactels = np.array([uniform_filter(one, size, mode="nearest") for one in base])
    cut = (tactels.shape[1] - len(axis)) // 2
    tactels = tactels[:, cut : cut + len(axis), cut : cut + len(axis)]
    return np.asarray(tactels / np.percentile(tactels, PEAK))


def _with_cross_talk(
    felt: NDArray[np.float64], share: float, sensor: SensorType
) -> NDArray[np.float64]:
    """Return responses of tactels that hear a share of what stands one tactel away, all around."""
    from scipy.signal import fftconvolve

    around = fftconvolve(felt, _annulus(sensor.pitch_mm), mode="same")
    return np.asarray(np.maximum((1 - share) * felt + share * around, 0.0))


def _distance(
    strokes: NDArray[np.float64], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance to the nearest stroke's centre line, mm."""
    best = np.full(x.shape, np.inf)
    for (x0, y0), (x1, y1) in strokes:
        dx, dy = x1 - x0, y1 - y0
        length = max(dx * dx + dy * dy, 1e-12)
        t = np.clip(((x - x0) * dx + (y - y0) * dy) / length, 0, 1)
        best = np.minimum(best, np.hypot(x - x0 - t * dx, y - y0 - t * dy))
    return best


def _presence(distance: NDArray[np.float64], style: SymbolStyle) -> NDArray[np.float64]:
    """Return how much of the plateau's pressure is felt at a point: 1 on it, falling on a wall."""
    top = style.stroke_mm / 2 - style.chamfer_mm
    slope = math.tan(max(style.draft_rad, 0.02))
    wall = min(_PENETRATION_MM, style.height_mm) * slope + style.chamfer_mm
    return np.clip(1 - (distance - top) / max(wall, STEP_MM), 0, 1)


def _reach_mm(alphabet: Alphabet, style: SymbolStyle, sensor: SensorType) -> float:
    """Return how far from its centre a symbol is felt."""
    strokes = alphabet.reach * style.pitch_mm + style.stroke_mm / 2 + style.draft_mm
    return strokes + sensor.overlay.tab_diameter_mm / 2 + sensor.pitch_mm


def _tip_response(presence: NDArray[np.float64], sensor: SensorType) -> NDArray[np.float64]:
    from scipy.signal import fftconvolve

    cover = fftconvolve(presence, _disc(sensor.overlay.tab_diameter_mm / 2), mode="same")
    cover = np.clip(cover, 0, 1)
    return np.asarray(cover * (1 + _BULGE * (1 - cover)))


def _disc(radius: float) -> NDArray[np.float64]:
    steps = math.ceil(radius / STEP_MM)
    axis = np.arange(-steps, steps + 1) * STEP_MM
    x, y = np.meshgrid(axis, axis)
    disc = np.clip((radius - np.hypot(x, y)) / STEP_MM + 0.5, 0, 1)
    return np.asarray(disc / disc.sum())


def _annulus(radius: float) -> NDArray[np.float64]:
    steps = math.ceil(radius / STEP_MM) + 1
    axis = np.arange(-steps, steps + 1) * STEP_MM
    x, y = np.meshgrid(axis, axis)
    ring = np.clip(1 - np.abs(np.hypot(x, y) - radius) / STEP_MM, 0, 1)
    return np.asarray(ring / ring.sum())
