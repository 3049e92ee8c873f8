"""Responses of the sensor to each symbol, through the overlay that is fitted.

Alphabet + style + sensor -> Template: the response of a tactel whose centre lies at an offset from
the centre of a symbol, 0 over the bare face, 1 over a wide plateau. Offsets in the symbol's axes (x
along the array's columns, y against its rows), mm.

A tab responds to the share of its tip that the plateau covers, and a little more, because a partly
covered tip bulges into the open side; a pad's responses are pressed once by the layer model; a
pixel of a gel sees the mean of the imprint, which membrane and optics blur. Responses are kept as
psi(y) = log(1 + 3 y) / log 4, in which gain errors and noise have about one size. Three things are
fitted with the rest, to first order: the excess of the strokes' width, cross-talk, and an exponent
for a force law that is not quite the assumed one. Thesis 4.2, 6.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.alphabet import Alphabet, SymbolStyle

Array = NDArray[np.float64]
Floats = NDArray[np.float32]

PSI = 3.0  #: of log(1 + 3 y) / log 4

# Chosen on simulated touches of the 40 objects of `docs/validation/forty.yaml` (typical noise and
# strong mismatch).
STEP_MM = 0.05  #: grid of the tables; positions are off by 0.025 mm at most
BULGE = 0.59  #: F(c)/F(1) = c (1 + BULGE (1 - c)) of a tip covered by the share c
PENETRATION_MM = 0.4  #: of the plateau into the overlay, for the part of a wall that presses
STROKE_UNIT_MM = 0.1  #: unit of the fitted stroke excess
CROSS_TALK = 0.12  #: of a reading that neighbours get; twice that at the far end
EXPONENTS = (0.7, 1.1)  #: between which the slope by the force law's exponent is taken
GEL_PEAK = 100.0  #: percentile of a gel's imprints that counts as 1
PAD_PEAK = 98.0  #: percentile of a pad's responses that counts as 1
PAD_FINE = 20  #: tactels to a pitch when a pad is pressed
PAD_CELLS = 2  #: pitches pressed: half a cell beyond the one that is kept, each side
PAD_NEIGHBOURHOODS = 3  #: arrangements of neighbours over which a symbol is averaged
PAD_PRESSURE = 0.05  #: mean pressure over Young's modulus: the pad is taken as linear
PAD_STIFFNESS = 1e9  #: N mm / rad: the plate stays level


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
def template_of(alphabet: Alphabet, style: SymbolStyle, sensor: SensorType) -> ResponseTemplate:
    """Return the template of an alphabet, as embossed and on a sensor."""
    step, (low, high) = STEP_MM, EXPONENTS
    pad = sensor.overlay.kind == "pad"
    responses = _RESPONSES[sensor.overlay.kind]
    half = style.pitch_mm / 2 if pad else _reach_mm(alphabet, style, sensor)
    steps = math.ceil(half / step) + (0 if pad else 1)
    axis = np.asarray((np.arange(2 * steps + 1) - steps) * step, np.float64)
    usual, wide = (
        responses(alphabet, replace(style, stroke_mm=style.stroke_mm + by), sensor, axis)
        for by in (0.0, STROKE_UNIT_MM)
    )
    rimmed = np.zeros((len(axis) + 2, len(axis) + 2, alphabet.order, 6), np.float32)
    values = rimmed[1:-1, 1:-1]
    neighbours = _annulus(math.sqrt(math.prod(sensor.step_mm)), step)

    for label in range(alphabet.order):
        middle = _with_cross_talk(usual[label], CROSS_TALK, neighbours)
        own = values[..., label, :]
        own[..., 0] = psi(middle)
        own[..., 1] = np.gradient(own[..., 0], step, axis=1)
        own[..., 2] = np.gradient(own[..., 0], step, axis=0)
        wider = _with_cross_talk(wide[label], CROSS_TALK, neighbours)
        own[..., 3] = psi(wider) - psi(middle)
        more = _with_cross_talk(usual[label], 2 * CROSS_TALK, neighbours)
        own[..., 4] = psi(more) - psi(usual[label])
        own[..., 5] = (psi(middle**high) - psi(middle**low)) / (high - low)
    ink = float(usual.sum() * step**2 / style.pitch_mm**2) / alphabet.order
    rimmed.setflags(write=False)
    return ResponseTemplate(style.pitch_mm, alphabet.order, steps * step, rimmed, ink, step)


def _tab_responses(
    alphabet: Alphabet, style: SymbolStyle, sensor: SensorType, axis: Array
) -> Array:
    """Return the responses (order, n, n) of tabs."""
    x, y = np.meshgrid(axis, axis)
    reach = alphabet.reach * style.pitch_mm
    tip = _disc(sensor.overlay.tab_diameter_mm / 2, STEP_MM)

    def response(strokes: Array) -> Array:
        presence = _presence(_distance(strokes * reach, x, y), style)
        cover = np.clip(_convolved(presence, tip), 0, 1)
        return np.asarray(cover * (1 + BULGE * (1 - cover)))

    return np.stack([response(np.array(glyph.strokes, float)) for glyph in alphabet.glyphs])


def _pad_responses(
    alphabet: Alphabet, style: SymbolStyle, sensor: SensorType, axis: Array
) -> Array:
    """Return the responses (order, n, n) of a pad, 1 where they are highest."""
    from scipy.ndimage import correlate1d

    step = STEP_MM
    tactel = _line(sensor.pitch_mm, step)
    cut = len(tactel) // 2
    beyond = axis[0] + np.arange(-cut, len(axis) + cut) * step
    base = _pressures(alphabet, style, sensor, beyond)
    across = correlate1d(base, tactel, axis=1, mode="nearest")
    tactels = correlate1d(across, tactel, axis=2, mode="nearest")
    tactels = tactels[:, cut : cut + len(axis), cut : cut + len(axis)]
    return np.asarray(tactels / np.percentile(tactels, PAD_PEAK))


def _pressures(alphabet: Alphabet, style: SymbolStyle, sensor: SensorType, axis_mm: Array) -> Array:
    """Return the pressure under a pad (order, n, n) over a cell, 1 where it is highest.

    A pad passes a load on farther than a cell and bridges symbols that stand close together: its
    response is no blur of the symbol alone. Each symbol is pressed among others by the layer model
    on tactels far finer than the real ones. `axis_mm` (n,) are offsets from the cell's centre, both
    ways; rows run upwards.
    """
    from scipy.ndimage import map_coordinates

    from probe.contact.contract import Touch, WristStiffness
    from probe.contact.layer import layer
    from probe.surface.face import endless_face
    from probe.surface.symbols import Relief

    pitch, fine = style.pitch_mm, style.pitch_mm / PAD_FINE
    across = PAD_CELLS * PAD_FINE
    probe = SensorType(across, across, fine, sensor.overlay)
    side = PAD_CELLS * pitch
    force = PAD_PRESSURE * sensor.overlay.young_mpa * side * side
    rng = np.random.default_rng(1)
    found = []
    for label in range(alphabet.order):
        total = np.zeros((across, across))
        for _ in range(PAD_NEIGHBOURHOODS):
            labels = rng.integers(alphabet.order, size=(4, 4))
            labels[1, 1] = label
            face = endless_face(
                labels,
                tuple(glyph.strokes for glyph in alphabet.glyphs),
                pitch_mm=pitch,
                unit_mm=alphabet.reach * pitch,
                relief=Relief(style.height_mm, style.stroke_mm, 0.0),  # only tops are pressed
            )
            at = Touch(
                1.5 * pitch,
                -1.5 * pitch,
                0.0,
                force,
                wrist=WristStiffness(PAD_STIFFNESS, PAD_STIFFNESS),
            )
            total += layer(face, probe, at, cells_per_tactel=2).forces_n
        found.append(total[::-1] / PAD_NEIGHBOURHOODS)  # rows upwards
    where = axis_mm / fine + (across - 1) / 2
    grid = np.stack(np.meshgrid(where, where, indexing="ij"))
    smooth = np.array([map_coordinates(one, grid, order=3, mode="nearest") for one in found])
    return np.asarray(np.maximum(smooth, 0.0) / max(float(smooth.max()), 1e-300))


def _gel_responses(
    alphabet: Alphabet, style: SymbolStyle, sensor: SensorType, axis: Array
) -> Array:
    """Return the responses (order, n, n) of the pixels of a gel."""
    from scipy.ndimage import correlate1d, gaussian_filter

    x, y = np.meshgrid(axis, axis)
    reach, step = alphabet.reach * style.pitch_mm, STEP_MM
    pixel = _line(sensor.pitch_mm, step)
    blur = math.hypot(sensor.overlay.blur_mm, sensor.overlay.membrane_mm) / step

    def seen(strokes: Array) -> Array:
        presence = _presence(_distance(strokes * reach, x, y), style)
        imprint = gaussian_filter(presence, blur, mode="constant")
        across = correlate1d(imprint, pixel, axis=0, mode="constant")
        return np.asarray(correlate1d(across, pixel, axis=1, mode="constant"))

    found = np.stack([seen(np.array(glyph.strokes, float)) for glyph in alphabet.glyphs])
    return np.asarray(np.minimum(found / np.percentile(found, GEL_PEAK), 1.0))


_RESPONSES = {"tab": _tab_responses, "pad": _pad_responses, "gel": _gel_responses}


def _with_cross_talk(response: Array, share: float, neighbours: Array) -> Array:
    """Return responses of tactels with a share of the readings of their neighbours.

    `neighbours` (k, k) are the weights of places one tactel away, all around.
    """
    around = _convolved(response, neighbours)
    return np.asarray(np.maximum((1 - share) * response + share * around, 0.0))


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


def _presence(distance: Array, style: SymbolStyle) -> Array:
    """Return the share of the plateau's pressure at a point: 1 on it, falling on a wall."""
    top = style.stroke_mm / 2 - style.chamfer_mm
    slope = math.tan(max(style.draft_rad, 0.02))
    wall = min(PENETRATION_MM, style.height_mm) * slope + style.chamfer_mm
    return np.clip(1 - (distance - top) / max(wall, STEP_MM), 0, 1)


def _reach_mm(alphabet: Alphabet, style: SymbolStyle, sensor: SensorType) -> float:
    """Return the distance from its centre at which a symbol does not press any more."""
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
