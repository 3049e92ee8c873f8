"""What the sensor feels of each symbol, through the overlay that is fitted.

Alphabet + style + sensor -> Template: the response of a tactel whose centre lies at an
offset from the centre of a symbol, 0 over the bare face, 1 over a wide plateau. Offsets in
the symbol's axes (x along the array's columns, y against its rows), mm.

A tab feels the share of its tip that the plateau covers, and a little more than that share
because a partly covered tip bulges into the open side; what a pad feels is pressed once by
the layer model (`pad`); a pixel of a gel sees the mean of the imprint, which membrane and optics
blur. Responses are kept as
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

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import Alphabet, SymbolStyle
from recognizer.touch.settings import DEFAULTS, TemplateSettings

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

PSI = 3.0  #: of log(1 + 3 y) / log 4


def psi(response: NDArray[np.float64] | Floats) -> NDArray[np.float64]:
    """Return log(1 + 3 y) / log 4 of responses y >= 0 (negative ones count as 0)."""
    return np.log1p(PSI * np.maximum(response, 0.0)) / math.log1p(PSI)


@dataclass(frozen=True, slots=True, eq=False)
class ResponseTemplate:
    """Responses of all symbols of an alphabet on a fine grid of offsets."""

    pitch_mm: float
    order: int  #: number of symbols
    half_mm: float  #: the grid covers offsets -half ... half in x and y
    rimmed: Floats  #: (n + 2, n + 2, order, 6) psi, slopes by x, y (mm), width, ...; 0 on the rim
    ink: float  #: mean response over a cell
    step_mm: float  #: of the grid

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
        place = self._places(offsets_mm)
        found = self.rimmed.reshape(-1, self.order * 6).take(place, axis=0)
        return found.reshape(*place.shape, self.order, 6)

    def of(self, offsets_mm: NDArray[np.float64], labels: NDArray[np.int64]) -> Floats:
        """Return those (..., 1, 6) of one symbol each alone, labels (...)."""
        place = self._places(offsets_mm) * self.order + labels
        return self.rimmed.reshape(-1, 6).take(place[..., None], axis=0)

    def _places(self, offsets_mm: NDArray[np.float64]) -> NDArray[np.intp]:
        index = np.rint((offsets_mm + self.half_mm) / self.step_mm)
        np.minimum(np.maximum(index, -1, out=index), self.size, out=index)
        return ((index[..., 1] + 1) * (self.size + 2) + index[..., 0] + 1).astype(np.intp)


@lru_cache(maxsize=16)
def template_of(
    alphabet: Alphabet,
    style: SymbolStyle,
    sensor: SensorType,
    settings: TemplateSettings = DEFAULTS.template,
) -> ResponseTemplate:
    """Return the template of an alphabet, as embossed and as felt by a sensor."""
    step, cross_talk, low, high = (
        settings.step_mm, settings.cross_talk, settings.low, settings.high
    )  # fmt: skip
    pad = sensor.overlay.kind == "pad"
    felt = _RESPONSES[sensor.overlay.kind]
    half = style.pitch_mm / 2 if pad else _reach_mm(alphabet, style, sensor)
    steps = math.ceil(half / step) + (0 if pad else 1)
    axis = np.asarray((np.arange(2 * steps + 1) - steps) * step, np.float64)
    usual, wide = (
        felt(alphabet, replace(style, stroke_mm=style.stroke_mm + by), sensor, axis, settings)
        for by in (0.0, settings.wider_mm)
    )
    rimmed = np.zeros((len(axis) + 2, len(axis) + 2, alphabet.order, 6), np.float32)
    values = rimmed[1:-1, 1:-1]
    for label in range(alphabet.order):
        middle = _with_cross_talk(usual[label], cross_talk, sensor, step)
        values[..., label, 0] = psi(middle)
        values[..., label, 1] = np.gradient(values[..., label, 0], step, axis=1)
        values[..., label, 2] = np.gradient(values[..., label, 0], step, axis=0)
        values[..., label, 3] = psi(_with_cross_talk(wide[label], cross_talk, sensor, step)) - psi(
            middle
        )
        values[..., label, 4] = psi(
            _with_cross_talk(usual[label], 2 * cross_talk, sensor, step)
        ) - psi(usual[label])
        values[..., label, 5] = (psi(middle**high) - psi(middle**low)) / (high - low)
    ink = float(usual.sum() * step**2 / style.pitch_mm**2) / alphabet.order
    rimmed.setflags(write=False)
    return ResponseTemplate(style.pitch_mm, alphabet.order, steps * step, rimmed, ink, step)


def _tab_responses(
    alphabet: Alphabet,
    style: SymbolStyle,
    sensor: SensorType,
    axis: Array,
    settings: TemplateSettings,
) -> Array:
    """Return the responses (order, n, n) of tabs."""
    x, y = np.meshgrid(axis, axis)
    reach = alphabet.reach * style.pitch_mm
    tip = _disc(sensor.overlay.tab_diameter_mm / 2, settings.step_mm)

    def felt(strokes: Array) -> Array:
        presence = _presence(_distance(strokes * reach, x, y), style, settings)
        cover = np.clip(_convolved(presence, tip), 0, 1)
        return np.asarray(cover * (1 + settings.bulge * (1 - cover)))

    return np.stack([felt(np.array(glyph.strokes, float)) for glyph in alphabet.glyphs])


def _pad_responses(
    alphabet: Alphabet,
    style: SymbolStyle,
    sensor: SensorType,
    axis: Array,
    settings: TemplateSettings,
) -> Array:
    """Return the responses (order, n, n) of a pad, 1 where they are highest."""
    from scipy.ndimage import correlate1d

    from recognizer.touch.symbols.pad import pad_responses

    step = settings.step_mm
    tactel = _line(sensor.pitch_mm, step)
    cut = len(tactel) // 2
    beyond = axis[0] + np.arange(-cut, len(axis) + cut) * step
    base = pad_responses(alphabet, style, sensor, beyond, settings)
    across = correlate1d(base, tactel, axis=1, mode="nearest")
    tactels = correlate1d(across, tactel, axis=2, mode="nearest")
    tactels = tactels[:, cut : cut + len(axis), cut : cut + len(axis)]
    return np.asarray(tactels / np.percentile(tactels, settings.pad_peak))


def _gel_responses(
    alphabet: Alphabet,
    style: SymbolStyle,
    sensor: SensorType,
    axis: Array,
    settings: TemplateSettings,
) -> Array:
    """Return the responses (order, n, n) of the pixels of a gel."""
    from scipy.ndimage import correlate1d, gaussian_filter

    x, y = np.meshgrid(axis, axis)
    reach, step = alphabet.reach * style.pitch_mm, settings.step_mm
    pixel = _line(sensor.pitch_mm, step)
    blur = math.hypot(sensor.overlay.blur_mm, sensor.overlay.membrane_mm) / step

    def seen(strokes: Array) -> Array:
        presence = _presence(_distance(strokes * reach, x, y), style, settings)
        imprint = gaussian_filter(presence, blur, mode="constant")
        across = correlate1d(imprint, pixel, axis=0, mode="constant")
        return np.asarray(correlate1d(across, pixel, axis=1, mode="constant"))

    found = np.stack([seen(np.array(glyph.strokes, float)) for glyph in alphabet.glyphs])
    return np.asarray(np.minimum(found / np.percentile(found, settings.gel_peak), 1.0))


_RESPONSES = {"tab": _tab_responses, "pad": _pad_responses, "gel": _gel_responses}


def _with_cross_talk(felt: Array, share: float, sensor: SensorType, step: float) -> Array:
    """Return responses of tactels that hear a share of what stands one tactel away, all around."""
    around = _convolved(felt, _annulus(math.sqrt(math.prod(sensor.step_mm)), step))
    return np.asarray(np.maximum((1 - share) * felt + share * around, 0.0))


def _convolved(values: Array, weights: Array) -> Array:
    """Return values (n, n) convolved with weights (k, k), as large as the values; 0 beyond them.

    As `scipy.signal.fftconvolve(..., mode="same")`, whose import takes longer than many touches.
    """
    from scipy.fft import irfft2, next_fast_len, rfft2

    whole = [a + b - 1 for a, b in zip(values.shape, weights.shape, strict=True)]
    fast = [next_fast_len(n, real=True) for n in whole]
    product = irfft2(rfft2(values, fast) * rfft2(weights, fast), fast)
    row, column = ((n - a) // 2 for n, a in zip(whole, values.shape, strict=True))
    found = product[row : row + values.shape[0], column : column + values.shape[1]]
    return np.asarray(found)


def _distance(strokes: Array, x: Array, y: Array) -> Array:
    """Return the distance to the nearest stroke's centre line, mm."""
    best = np.full(x.shape, np.inf)
    for (x0, y0), (x1, y1) in strokes:
        dx, dy = x1 - x0, y1 - y0
        length = max(dx * dx + dy * dy, 1e-12)
        t = np.clip(((x - x0) * dx + (y - y0) * dy) / length, 0, 1)
        best = np.minimum(best, np.hypot(x - x0 - t * dx, y - y0 - t * dy))
    return best


def _presence(distance: Array, style: SymbolStyle, settings: TemplateSettings) -> Array:
    """Return how much of the plateau's pressure is felt at a point: 1 on it, falling on a wall."""
    top = style.stroke_mm / 2 - style.chamfer_mm
    slope = math.tan(max(style.draft_rad, 0.02))
    wall = min(settings.penetration_mm, style.height_mm) * slope + style.chamfer_mm
    return np.clip(1 - (distance - top) / max(wall, settings.step_mm), 0, 1)


def _reach_mm(alphabet: Alphabet, style: SymbolStyle, sensor: SensorType) -> float:
    """Return how far from its centre a symbol is felt."""
    strokes = alphabet.reach * style.pitch_mm + style.stroke_mm / 2 + style.draft_mm
    overlay = sensor.overlay
    if overlay.kind == "gel":
        blur = math.hypot(overlay.blur_mm, overlay.membrane_mm)
        return strokes + sensor.pitch_mm / 2 + 2.5 * blur
    return strokes + overlay.tab_diameter_mm / 2 + max(sensor.step_mm)


def _disc(radius: float, step: float) -> Array:
    """Return the weights of a disc on the grid; their sum is 1."""
    disc = np.clip((radius - _from_centre(math.ceil(radius / step), step)) / step + 0.5, 0, 1)
    return np.asarray(disc / disc.sum())


def _line(length: float, step: float) -> Array:
    """Return the weights of a line about the middle grid point, an odd number; their sum is 1."""
    away = np.abs(np.arange(-math.ceil(length / step), math.ceil(length / step) + 1) * step)
    line = np.clip((length / 2 - away) / step + 0.5, 0, 1)
    return np.asarray(line / line.sum())


def _annulus(radius: float, step: float) -> Array:
    """Return the weights of a ring, a step wide to both sides; their sum is 1."""
    away = _from_centre(math.ceil(radius / step) + 1, step)
    ring = np.clip(1 - np.abs(away - radius) / step, 0, 1)
    return np.asarray(ring / ring.sum())


def _from_centre(steps: int, step: float) -> Array:
    """Return the distances of grid points from their centre, (2 steps + 1) each way."""
    axis = np.arange(-steps, steps + 1) * step
    return np.asarray(np.hypot(*np.meshgrid(axis, axis)))
