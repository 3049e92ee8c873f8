"""Coarse search: every rotation and shift of the lattice at once.

The score of a symbol k at a place y of the sensor is sum_t w (2 f T_k - T_k^2) over tactels t, two
correlations of the image with the symbol's response there. The response half a turn further is the
one seen through the place: so tactels that lie opposite are taken together, and the sums and
differences of such pairs, multiplied with the even and the odd part of half the turns, give all of
them. All symbols, rotations and sub-tactel phases together are these two matrix products; the score
of a lattice is then the sum, over its cells, of the best symbol of each (or none), by a table of
look-ups. Sensor frame, mm; psi values as in `template`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.compiled import addresses
from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.symbols.kernels import kernels
from recognizer.touch.symbols.template import Floats, ResponseTemplate

# Work grows with ROTATIONS (PHASES^2 + SHIFTS^2).
ROTATIONS = 72  #: over the full turn, an even number
PHASES = 2  #: places per tactel along each axis
SHIFTS = 10  #: of the lattice along each axis
RIM = 1  #: tactels beyond the matrix at which a symbol's centre may lie
REACH = 1.1  #: of a template's half width that kernels cover
NOTHING = 1e-9  #: response below which it is the rounding error of none


@dataclass(frozen=True, eq=False)
class Bank:
    """The part of the search that does not depend on the image."""

    shape: tuple[int, int]  #: rows and columns of the image
    reach: int  #: kernels are (2 reach + 1) tactels wide
    rim: int  #: how many tactels around the matrix are places
    taps: NDArray[np.int32]  #: (2, m) places in (2, K, K), T and T^2, and those opposite to them
    even: Floats  #: (m, order * rotations / 2 * phases^2) of the first half turn, over both taps
    odd: Floats  #: the same, over their difference
    lookups: NDArray[np.int32]  #: (rotations, shifts^2, cells) into places, last one = none
    rotations_rad: NDArray[np.float64]  #: (rotations,)
    shifts_mm: NDArray[np.float64]  #: (shifts^2, 2) of the lattice

    @cached_property
    def tactels(self) -> NDArray[np.intp]:
        """(2, places, m) which tactels of a padded image lie at each tap about each place."""
        side, around = 2 * self.reach + 1, 2 * (self.reach + self.rim)
        shape = (2, self.shape[0] + around, self.shape[1] + around)
        layer, down, along = np.unravel_index(self.taps[:, None], (2, side, side))
        height, width = shape[1] - 2 * self.reach, shape[2] - 2 * self.reach
        y, x = (part.reshape(-1, 1) for part in np.indices((height, width)))
        return np.ravel_multi_index((layer + 0 * y, y + down, x + along), shape)


def bank_of(template: ResponseTemplate, sensor: SensorType) -> Bank:
    """Return the tables of a search."""
    phases, rim = PHASES, RIM
    across, down = sensor.step_mm
    turns = np.arange(ROTATIONS) * 2 * np.pi / ROTATIONS
    half = ROTATIONS // 2
    taps_away = math.ceil(template.half_mm * REACH / min(across, down))
    offset = (np.arange(phases) + 0.5) / phases - 0.5  # of a place from its tactel, tactels
    k = np.arange(-taps_away, taps_away + 1)
    # tactel minus place, sensor frame: [ky, kx, py, px]
    dx = (k[None, :, None, None] - offset[None, None, None, :]) * across
    dy = (-k[:, None, None, None] + offset[None, None, :, None]) * down
    dx, dy = np.broadcast_arrays(dx, dy)
    responses = np.empty((2, len(k) ** 2, template.order, half, phases * phases), np.float32)
    for i, turn in enumerate(turns[:half]):
        c, s = math.cos(turn), math.sin(turn)
        u = np.stack([c * dx - s * dy, s * dx + c * dy], axis=-1)
        value = template.at(u)[..., 0].reshape(len(k) ** 2, phases * phases, template.order)
        responses[0, :, :, i] = value.swapaxes(1, 2)
        responses[1, :, :, i] = responses[0, :, :, i] ** 2
    lookups, shifts_mm = _lookups(template, sensor, turns)
    taps, even, odd = _opposite_pairs(responses)
    shape = (sensor.rows, sensor.columns)
    return Bank(shape, taps_away, rim, taps, even, odd, lookups, turns, shifts_mm)


def _opposite_pairs(responses: Floats) -> tuple[NDArray[np.int32], Floats, Floats]:
    """Return `taps`, `even` and `odd` of a bank from responses (2, K^2, ...) at each tap."""
    flat, opposite = (
        one.reshape(2 * responses.shape[1], -1) for one in (responses, responses[:, ::-1])
    )
    number = np.arange(len(flat), dtype=np.int32)
    across = number.reshape(2, -1)[:, ::-1].ravel()
    held = np.maximum(np.abs(flat), np.abs(opposite)).max(axis=1) > NOTHING  # not in the corners
    one = number[held & (number <= across)]
    taps = np.stack([one, across[one]])
    even, odd = (
        np.float32(0.5) * part for part in (flat[one] + opposite[one], flat[one] - opposite[one])
    )
    even[taps[0] == taps[1]] /= 2  # the place itself, which is taken twice
    return taps, even, odd


def _lookups(
    template: ResponseTemplate, sensor: SensorType, turns: NDArray[np.float64]
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the place of each cell of each lattice."""
    phases, rim, shifts = PHASES, RIM, SHIFTS
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


@dataclass(frozen=True, slots=True, eq=False)
class LatticeScores:
    """How well every rotation and shift of the lattice explains an image."""

    scores: Floats  #: (rotations, shifts^2)
    around: Floats  #: the best of each score and its neighbours; rotations and shifts are cyclic

    def best(self, bank: Bank, keep: int) -> NDArray[np.float64]:
        """Return the `keep` best lattices (n, 3) in x, y (mm), theta, no two of them neighbours."""
        shifts, flat = self.scores.shape[1], self.scores.ravel()
        peaks = np.flatnonzero(flat >= self.around.ravel())
        order = peaks[np.argsort(-flat[peaks], kind="stable")][:keep]
        turn, shift = np.divmod(order, shifts)
        return np.concatenate([bank.shifts_mm[shift], bank.rotations_rad[turn, None]], axis=1)


def score_lattices(bank: Bank, values: Floats, weights: Floats, order: int) -> LatticeScores:
    """Return the scores of all lattices.

    `values` (rows, columns) are psi of the normalised forces, `weights` 0 ... 1, 0 where a tactel
    is not used; `order` is the number of symbols.
    """
    pad = bank.reach + bank.rim
    rows, columns = bank.shape
    height, width = rows + 2 * bank.rim, columns + 2 * bank.rim
    padded = np.zeros((2, rows + 2 * pad, columns + 2 * pad), np.float32)
    padded[:, pad : pad + rows, pad : pad + columns] = 2 * weights * values, -weights
    one, other = padded.ravel().take(bank.tactels)
    even = np.ascontiguousarray((one + other) @ bank.even, np.float32)
    odd = np.ascontiguousarray((one - other) @ bank.odd, np.float32)
    turns, lattices, cells = bank.lookups.shape
    phases = math.isqrt(even.shape[1] // (order * turns // 2))
    lookups = np.ascontiguousarray(bank.lookups, np.int32)
    scores = np.empty((turns, lattices), np.float32)
    kernels().sum_lattices(
        height, width, order, turns, phases, lattices, cells,
        *addresses(even, odd, lookups, scores),
    )  # fmt: skip
    return LatticeScores(scores, best_around(scores))


def best_around(scores: Floats) -> Floats:
    """Return the best of each score (rotations, shifts^2) and its neighbours, cyclic all ways."""
    scores = np.ascontiguousarray(scores)
    around = np.empty_like(scores)
    kernels().look_around(len(scores), math.isqrt(scores.shape[1]), *addresses(scores, around))
    return around
