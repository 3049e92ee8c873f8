"""Conductances -> what the ADC is offered, as a share of its full scale, and back where linear.

The ideal readouts are those of `network`. After them come two faults that are linear, hence
exactly undone: the multiplexer does not settle fully, so that each tactel keeps a share of
the one scanned before (rows from the top, in a row from the left, frame after frame), and the
tactels of a column couple. All functions take (..., rows, columns).
"""

from __future__ import annotations

import numpy as np

from probe.circuit.electronics import Electronics
from probe.circuit.fsr import Image
from probe.circuit.network import effective_resistances, transconductances


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
    """Add what the scan leaves from tactel to tactel, and what columns couple."""
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
