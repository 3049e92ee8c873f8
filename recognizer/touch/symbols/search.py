"""Coarse search: every rotation and shift of the lattice at once.

The score of a symbol k at a place y of the sensor is sum_t w (2 f T_k - T_k^2) over tactels
t, two correlations of the image with what the symbol looks like there. What it looks like half a
turn further is the same, seen through the place: so tactels that lie opposite are taken together,
and the sums and differences of such pairs, multiplied with the even and the odd part of half the
turns, give all of them. All symbols, rotations and sub-tactel phases together are these two matrix
products; the score of a lattice is then the sum, over its cells, of the best symbol of each (or
none), by a table of look-ups.
Sensor frame, mm; psi values as in `template`.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.settings import DEFAULTS, SearchSettings
from recognizer.touch.symbols.kernels import compiled_kernels, kernels_in_use
from recognizer.touch.symbols.template import Floats, ResponseTemplate


@dataclass(frozen=True, slots=True, eq=False)
class Bank:
    """Everything about the search that does not depend on the image."""

    shape: tuple[int, int]  #: rows and columns of the image
    reach: int  #: kernels are (2 reach + 1) tactels wide
    rim: int  #: how many tactels around the matrix are places
    taps: NDArray[np.int32]  #: (2, m) places in (2, K, K), T and T^2, and those opposite to them
    even: Floats  #: (m, order * rotations / 2 * phases^2) of the first half turn, over both taps
    odd: Floats  #: the same, over their difference
    lookups: NDArray[np.int32]  #: (rotations, shifts^2, cells) into places, last one = none
    rotations_rad: NDArray[np.float64]  #: (rotations,)
    shifts_mm: NDArray[np.float64]  #: (shifts^2, 2) of the lattice


def bank_of(
    template: ResponseTemplate, sensor: SensorType, settings: SearchSettings = DEFAULTS.search
) -> Bank:
    """Return the tables of a search."""
    rotations, phases, shifts = settings.rotations, settings.phases, settings.shifts
    across, down = sensor.step_mm
    turns = np.arange(rotations) * 2 * np.pi / rotations  # an even number
    half = rotations // 2
    reach = math.ceil(template.half_mm * settings.reach / min(across, down))
    rim = math.ceil(settings.rim)
    offset = (np.arange(phases) + 0.5) / phases - 0.5  # of a place from its tactel, tactels
    k = np.arange(-reach, reach + 1)
    # tactel minus place, sensor frame: [ky, kx, py, px]
    dx = (k[None, :, None, None] - offset[None, None, None, :]) * across
    dy = (-k[:, None, None, None] + offset[None, None, :, None]) * down
    dx, dy = np.broadcast_arrays(dx, dy)
    kernels = np.empty((2, len(k) ** 2, template.order, half, phases * phases), np.float32)
    for i, turn in enumerate(turns[:half]):
        c, s = math.cos(turn), math.sin(turn)
        u = np.stack([c * dx - s * dy, s * dx + c * dy], axis=-1)
        value = template.at(u)[..., 0].reshape(len(k) ** 2, phases * phases, template.order)
        kernels[0, :, :, i] = value.swapaxes(1, 2)
        kernels[1, :, :, i] = kernels[0, :, :, i] ** 2
    lookups, shifts_mm = _lookups(template, sensor, turns, rim, phases, shifts)
    taps, even, odd = _opposite_pairs(kernels, settings.nothing)
    return Bank(
        (sensor.rows, sensor.columns),
        reach,
        rim,
        taps,
        even,
        odd,
        lookups,
        turns,
        shifts_mm,
    )


def _opposite_pairs(kernels: Floats, nothing: float) -> tuple[NDArray[np.int32], Floats, Floats]:
    """Return `taps`, `even` and `odd` of a bank from kernels (2, K^2, ...), symbols at each tap."""
    flat, opposite = (one.reshape(2 * kernels.shape[1], -1) for one in (kernels, kernels[:, ::-1]))
    number = np.arange(len(flat), dtype=np.int32)
    across = number.reshape(2, -1)[:, ::-1].ravel()
    felt = np.maximum(np.abs(flat), np.abs(opposite)).max(axis=1) > nothing  # not in the corners
    one = number[felt & (number <= across)]
    taps = np.stack([one, across[one]])
    even, odd = (
        np.float32(0.5) * part for part in (flat[one] + opposite[one], flat[one] - opposite[one])
    )
    even[taps[0] == taps[1]] /= 2  # the place itself, which is taken twice
    return taps, even, odd


def _lookups(
    template: ResponseTemplate,
    sensor: SensorType,
    turns: NDArray[np.float64],
    rim: int,
    phases: int,
    shifts: int,
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return which place each cell of each lattice falls on."""
    p, (across, down) = template.pitch_mm, sensor.step_mm
    step = (np.arange(shifts) + 0.5) / shifts * p
    shifts_mm = np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2)
    half_x, half_y = sensor.half_mm
    most = math.ceil((sensor.reach_mm + 2 * max(across, down)) / p) + 1
    cell = (np.arange(-most, most + 1) + 0.5) * p
    cells = np.stack(np.meshgrid(cell, cell), axis=-1).reshape(-1, 2)
    width, height = (sensor.columns + 2 * rim) * phases, (sensor.rows + 2 * rim) * phases
    none = width * height
    table = np.full((len(turns), len(shifts_mm), len(cells)), none, np.int32)
    for i, turn in enumerate(turns):
        c, s = math.cos(turn), math.sin(turn)
        u = cells[None] - shifts_mm[:, None]
        x, y = c * u[..., 0] + s * u[..., 1], -s * u[..., 0] + c * u[..., 1]
        ix = np.floor((x + half_x + rim * across) / across * phases).astype(np.int64)
        iy = np.floor((half_y + rim * down - y) / down * phases).astype(np.int64)
        inside = (ix >= 0) & (ix < width) & (iy >= 0) & (iy < height)
        table[i][inside] = (iy * width + ix)[inside]
    used = int((table < none).sum(axis=2).max())
    return np.ascontiguousarray(np.sort(table, axis=2)[:, :, :used]), shifts_mm


def search(
    bank: Bank, values: Floats, weights: Floats, order: int, keep: int
) -> NDArray[np.float64]:
    """Return the best lattices.

    Parameters
    ----------
    values
        (rows, columns) psi of the normalised forces.
    weights
        (rows, columns) 0 ... 1; 0 where a tactel tells nothing.
    keep
        How many to return at most; no two of them are neighbours.

    Returns
    -------
    (n, 3) x, y (mm), theta: sensor point s lies at R(theta) s + (x, y) in the lattice frame.
    """
    seen = np.array([values, weights], np.float32)
    kernels = kernels_in_use()  # what a try was searched with serves the next one, and `diagnose`
    scores, around = _scores_of(bank, seen.tobytes(), order, kernels)
    return _peaks(bank, scores, around, keep)


@lru_cache(maxsize=4)
def _scores_of(bank: Bank, seen: bytes, order: int, _kernels: str) -> tuple[Floats, Floats]:
    """Return the scores of an image, (2, rows, columns), and `best_around` them."""
    values, weights = np.frombuffer(seen, np.float32).reshape(2, *bank.shape)
    scores = lattice_scores(bank, values, weights, order)
    return scores, best_around(scores)


def best_around(scores: Floats) -> Floats:
    """Return the best of each score (rotations, shifts^2) and those beside it; all go round."""
    turns, n = len(scores), math.isqrt(scores.shape[1])
    library = compiled_kernels()
    if library is not None:
        scores = np.ascontiguousarray(scores)  # named, so that it stays while it is looked at
        around = np.empty_like(scores)
        library.look_around(turns, n, *addresses(scores, around))
        return around
    most = scores.reshape(turns, n, n)
    for axis in range(3):  # all three go round
        one = most.swapaxes(0, axis)
        line = one.copy()
        np.maximum(line[1:], one[:-1], out=line[1:])
        np.maximum(line[:-1], one[1:], out=line[:-1])
        line[0], line[-1] = np.maximum(line[0], one[-1]), np.maximum(line[-1], one[0])
        most = line.swapaxes(0, axis)
    return most.reshape(scores.shape)


def lattice_scores(bank: Bank, values: Floats, weights: Floats, order: int) -> Floats:
    """Return the score of every rotation and shift, (rotations, shifts^2)."""
    pad = bank.reach + bank.rim
    rows, columns = bank.shape
    height, width = rows + 2 * bank.rim, columns + 2 * bank.rim
    padded = np.zeros((2, rows + 2 * pad, columns + 2 * pad), np.float32)
    padded[:, pad : pad + rows, pad : pad + columns] = 2 * weights * values, -weights
    one, other = padded.ravel().take(_tactels_of(bank))
    turns = len(bank.rotations_rad)
    even, odd = (one + other) @ bank.even, (one - other) @ bank.odd
    library = compiled_kernels()
    if library is not None:
        return _sum_lattices(library, bank, even, odd, (height, width, order))
    even, odd = (part.reshape(height, width, order, turns // 2, -1) for part in (even, odd))
    best = np.concatenate([even + odd, (even - odd)[..., ::-1]], axis=3).max(axis=2)
    np.maximum(best, 0, out=best)
    phases = round(math.sqrt(best.shape[-1]))
    grid = best.reshape(height, width, turns, phases, phases).transpose(2, 0, 3, 1, 4)
    places = np.zeros((turns, height * width * phases * phases + 1), np.float32)
    places[:, :-1] = grid.reshape(turns, -1)
    base = (np.arange(turns) * places.shape[1])[:, None, None]
    return np.asarray(np.take(places.ravel(), bank.lookups + base).sum(axis=2))


@lru_cache(maxsize=16)
def _tactels_of(bank: Bank) -> NDArray[np.intp]:
    """Return (2, places, m) which tactels of a padded image lie at each tap about each place."""
    side, around = 2 * bank.reach + 1, 2 * (bank.reach + bank.rim)
    shape = (2, bank.shape[0] + around, bank.shape[1] + around)
    layer, down, along = np.unravel_index(bank.taps[:, None], (2, side, side))
    height, width = shape[1] - 2 * bank.reach, shape[2] - 2 * bank.reach
    y, x = (part.reshape(-1, 1) for part in np.indices((height, width)))
    return np.ravel_multi_index((layer + 0 * y, y + down, x + along), shape)


def _sum_lattices(
    library: ctypes.CDLL, bank: Bank, even: Floats, odd: Floats, sides: tuple[int, int, int]
) -> Floats:
    """Return the scores of lattices from those of symbols at places, compiled."""
    turns, lattices, cells = bank.lookups.shape
    height, width, order = sides
    phases = math.isqrt(even.shape[1] // (order * turns // 2))
    lookups = np.ascontiguousarray(bank.lookups, np.int32)
    even, odd = (np.ascontiguousarray(part, np.float32) for part in (even, odd))
    scores = np.empty((turns, lattices), np.float32)
    library.sum_lattices(
        height, width, order, turns, phases, lattices, cells,
        *addresses(even, odd, lookups, scores),
    )  # fmt: skip
    return scores


def _peaks(bank: Bank, scores: Floats, around: Floats, keep: int) -> NDArray[np.float64]:
    """Return the best lattices of which no two are neighbours."""
    shifts, flat = scores.shape[1], scores.ravel()
    peaks = np.flatnonzero(flat >= around.ravel())
    order = peaks[np.argsort(-flat[peaks], kind="stable")][:keep]
    turn, shift = np.divmod(order, shifts)
    return np.concatenate([bank.shifts_mm[shift], bank.rotations_rad[turn, None]], axis=1)
