"""Film sensors whose tactels differ, drawn at random.

The default spread is at least as bad as the public 16x16 sensor of the measurements (159,120
frames): 147 of 256 tactels never responded, 5 were preloaded for more than half of the trials; its
law had to be calibrated tactel by tactel. `DATASHEET` is the spread of single parts as their maker
states it, all of them sound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from probe.circuit import Electronics, FilmState, read_counts
from probe.circuit.fsr import BREAK_N, GAIN_S, LEAK_S, SERIES_OHM, Fsr


@dataclass(frozen=True, slots=True)
class Spread:
    """Standard deviations of the law's numbers, and shares (of 1) of tactels that are unsound."""

    gain_spread: float = 0.30  #: of its logarithm
    exponent_spread: float = 0.08
    break_spread: float = 0.5  #: of its logarithm
    series_spread: float = 0.3  #: of its logarithm
    dead: float = 147 / 256  #: share that never responds
    stuck: float = 1 / 256  #: share that shows one conductance whatever the force
    preloaded: float = 5 / 256  #: share that is pressed by the assembly
    preload_n: float = 0.3  #: N, mean force on those (exponential)


MEASURED = Spread()

DATASHEET = Spread(
    gain_spread=0.06, exponent_spread=0.02, break_spread=0.2, series_spread=0.1,
    dead=0.0, stuck=0.0, preloaded=0.0,
)  # fmt: skip


def draw_fsr(rng: Generator, spread: Spread = MEASURED) -> Fsr:
    """Draw a sensor of 16 x 16; exactly the stated shares of its tactels (rounded up) are unsound.

    It reads 10 % more on the way back than on the way up, and drifts 5 % per decade of time.
    """
    shape, size = (16, 16), 256

    def lognormal(median: float, deviation: float) -> np.ndarray:
        return median * np.exp(deviation * rng.standard_normal(shape))

    gain = lognormal(GAIN_S, spread.gain_spread)
    exponent = 1.0 + spread.exponent_spread * rng.standard_normal(shape)
    broken = lognormal(BREAK_N, spread.break_spread)
    series = lognormal(SERIES_OHM, spread.series_spread)
    order = rng.permutation(size)
    counts = [int(np.ceil(s * size - 1e-9)) for s in (spread.dead, spread.stuck, spread.preloaded)]
    ends = np.minimum(np.cumsum(counts), size)
    dead, stuck, preload = np.zeros(size, bool), np.zeros(size), np.zeros(size)
    dead[order[: ends[0]]] = True
    held = order[ends[0] : ends[1]]
    stuck[held] = GAIN_S * np.exp(rng.uniform(-3.0, 3.0, held.size))
    pressed = order[ends[1] : ends[2]]
    preload[pressed] = BREAK_N + rng.exponential(spread.preload_n, pressed.size)
    return Fsr(
        gain, np.maximum(exponent, 0.2), broken, preload.reshape(shape), series,
        stuck.reshape(shape), dead.reshape(shape), leak_s=LEAK_S, hysteresis=0.10, drift=0.05,
    )  # fmt: skip


def read_sequence(
    forces_n: ArrayLike, board: Electronics, fsr: Fsr, state: FilmState | None, rng: Generator
) -> tuple[np.ndarray, FilmState | None]:
    """Read frames of forces (N, rows, columns) that follow at the board's frame time."""
    frames = []
    for force in np.asarray(forces_n):
        counts, state = read_counts(force, board, fsr, state, rng)
        frames.append(counts)
    return np.stack(frames), state
