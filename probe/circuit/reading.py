"""Conductances -> voltages -> counts, as a board with its noise gives them. Thesis 4.2.

The ideal readouts are those of `network`. After them come two faults that are linear, hence
exactly undone: the multiplexer does not settle fully, so that each tactel keeps a share of
the one scanned before (rows from the top, in a row from the left, frame after frame), and the
tactels of a column couple. Shares are voltages over the ADC's full scale, (..., rows, columns).

Randomness is drawn from the generator that is passed in; with `QUIET` electronics nothing is
drawn. The multiplexer's ring of samples takes the scene as steady over two frames.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.circuit.electronics import Electronics
from probe.circuit.fsr import FilmState, Fsr, Image, conductances
from probe.circuit.network import effective_resistances, transconductances

Counts = NDArray[np.uint16]


def read_counts(
    forces_n: ArrayLike,
    electronics: Electronics,
    fsr: Fsr,
    state: FilmState | None,
    rng: np.random.Generator,
) -> tuple[Counts, FilmState]:
    """Read a frame; returns counts (u16, of the forces' shape) and the new state.

    Forces (N) are (rows, columns), or (N, rows, columns) for independent touches. `state` is of the
    frame before; None for a sensor that was not loaded yet. `rng` is the source of the noise.
    Raises CircuitError: a force is negative or no number, or a shape is wrong.

    Examples
    --------
    >>> from probe.circuit import Electronics, fsr_of
    >>> forces = np.zeros((16, 16))
    >>> forces[3, 4] = 1.0
    >>> counts, state = read_counts(forces, Electronics(), fsr_of(), None, np.random.default_rng(1))
    >>> np.unravel_index(counts.argmax(), counts.shape) == (3, 4)
    True
    """
    conductance, now = conductances(fsr, forces_n, state, electronics.frame_s)
    flutter = _contact_noise(now.flutter, electronics, state is None, rng)
    offered = scan_shares(shares(conductance, electronics), electronics) * electronics.full
    counts = _sample_adc(offered, flutter, electronics, rng)
    return counts, FilmState(now.effective_n, now.age_s, flutter)


def _contact_noise(
    before: Image, electronics: Electronics, fresh: bool, rng: np.random.Generator
) -> Image:
    """Return the contact's noise of this frame: unit variance, exponential correlation."""
    noise = electronics.noise
    if noise.contact_lsb == 0:
        return before
    kept = (
        0.0 if fresh or noise.contact_s == 0 else math.exp(-electronics.frame_s / noise.contact_s)
    )
    return kept * before + math.sqrt(1.0 - kept * kept) * rng.standard_normal(before.shape)


def _sample_adc(
    offered: Image, flutter: Image, electronics: Electronics, rng: np.random.Generator
) -> Counts:
    """Return the ADC's counts of offered voltages, in counts."""
    noise, lsb = electronics.noise, electronics.lsb
    value = offered + electronics.bias_lsb * lsb
    if noise.contact_lsb > 0:
        value += flutter * np.sqrt(noise.contact_lsb * lsb * np.maximum(offered, 0.0))
    if noise.idle_lsb > 0:
        value += noise.idle_lsb * lsb * rng.standard_normal(value.shape)
    if noise.spike_rate > 0:
        hit = np.flatnonzero(rng.random(value.shape) < noise.spike_rate)
        height = noise.spike_lsb * (1.0 + rng.exponential(size=hit.size))
        value.flat[hit] += rng.choice((-1.0, 1.0), hit.size) * height * lsb
    return np.clip(np.rint(value), 0, electronics.full).astype(np.uint16)


def shares(conductance_s: Image, electronics: Electronics) -> Image:
    """Return every tactel's settled voltage over the ADC's reference, without coupling."""
    e = electronics
    if e.readout == "floating":
        series = e.row_ohm + e.column_ohm + effective_resistances(conductance_s)
        return e.volts_ratio * e.load_ohm / (e.load_ohm + series)
    if e.readout == "grounded":
        return e.volts_ratio * e.load_ohm * transconductances(conductance_s, e.row_ohm, e.load_ohm)
    return (
        e.volts_ratio * e.feedback_ohm * transconductances(conductance_s, e.row_ohm, e.column_ohm)
    )


def scan_shares(share: Image, electronics: Electronics) -> Image:
    """Add the residue of the tactel scanned before, and the coupling of columns."""
    k = electronics.coupling
    settled = _cyclic(share, electronics.residue, inverse=False)
    coupled: Image = settled + k * (settled.sum(axis=-2, keepdims=True) - settled)
    return coupled


def unscan_shares(share: Image, electronics: Electronics) -> Image:
    """Undo `scan_shares`."""
    k, rows = electronics.coupling, share.shape[-2]
    total = share.sum(axis=-2, keepdims=True) / (1.0 + k * (rows - 1))
    settled = (share - k * total) / (1.0 - k)
    return _cyclic(settled, electronics.residue, inverse=True)


def _cyclic(share: Image, residue: float, *, inverse: bool) -> Image:
    """Leave `residue` of the sample before in each sample, or take it out; the scan is a ring."""
    if residue == 0:
        return share
    flat = share.reshape(*share.shape[:-2], -1)
    if inverse:
        before = np.roll(flat, 1, axis=-1)
        return ((flat - residue * before) / (1.0 - residue)).reshape(share.shape)
    size = flat.shape[-1]
    turn = np.exp(-2j * np.pi * np.arange(size // 2 + 1) / size)
    response = (1.0 - residue) / (1.0 - residue * turn)
    return np.fft.irfft(np.fft.rfft(flat) * response, size).reshape(share.shape)
