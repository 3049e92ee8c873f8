"""The likeliest places of each window, and how much the others weigh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Ranked:
    """N windows, their K best places, best first."""

    rows: NDArray[np.uint64]  #: (N, K)
    columns: NDArray[np.uint64]  #: (N, K)
    values: NDArray[np.float64]  #: (N, K) log-likelihood, nats; -inf where there is none
    rest: NDArray[np.float64]  #: (N,) likelihood of all but the best, relative to it


def best_of(
    values: NDArray[np.float32], number: int
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64]]:
    """Return places, values (N, K) and rest (N,) of the K best of (N, P); spoils `values`."""
    lines = np.arange(len(values))
    if number <= 2:
        first = values.argmax(axis=1)
        high = values[lines, first].astype(np.float64)
        values[lines, first] = -np.inf
        second = values.argmax(axis=1)
        places = np.stack([first, second], axis=1)
        chosen = np.stack([high, values[lines, second].astype(np.float64)], axis=1)
        values -= high[:, None].astype(np.float32)
        np.exp(values, out=values)
        return places, chosen, values.sum(axis=1, dtype=np.float64)
    places = _highest(values, number)
    order = np.argsort(-np.take_along_axis(values, places, axis=1), axis=1, kind="stable")
    places = np.take_along_axis(places, order, axis=1)
    chosen = np.take_along_axis(values, places, axis=1).astype(np.float64)
    values[lines, places[:, 0]] = -np.inf
    values -= chosen[:, :1].astype(np.float32)
    np.exp(values, out=values)
    return places, chosen, values.sum(axis=1, dtype=np.float64)


def _highest(values: NDArray[np.float32], number: int) -> NDArray[np.intp]:
    """Return the places of the K highest of (N, P), K < P or all; unordered.

    They lie in the K blocks with the highest maxima.
    """
    windows, places = values.shape
    if number >= places:
        return np.tile(np.arange(places), (windows, 1))
    if places < 1 << 10:
        return np.argpartition(-values, number - 1, axis=1)[:, :number]
    size = 1 << (places.bit_length() // 2)
    starts = np.arange(0, places, size)
    high = np.maximum.reduceat(values, starts, axis=1)
    blocks = starts[_highest(high, number)]
    inside = (blocks[..., None] + np.arange(size)).reshape(windows, -1)
    found = np.take_along_axis(values, inside.clip(max=places - 1), axis=1)
    found[inside >= places] = -np.inf
    kept = np.argpartition(-found, number - 1, axis=1)[:, :number]
    return np.take_along_axis(inside, kept, axis=1)


def best_of_all(parts: list[Ranked], number: int) -> tuple[Ranked, NDArray[np.uint8]]:
    """Return the K best of several hypotheses (rotations), and which each came from, (N, K)."""
    rows = np.concatenate([part.rows for part in parts], axis=1)
    columns = np.concatenate([part.columns for part in parts], axis=1)
    values = np.concatenate([part.values for part in parts], axis=1)
    source = np.repeat(np.arange(len(parts)), [part.rows.shape[1] for part in parts])
    order = np.argsort(-values, axis=1, kind="stable")[:, :number]
    best = values.max(axis=1)
    with np.errstate(invalid="ignore"):
        rest = sum(np.exp(part.values[:, 0] - best) * (1 + part.rest) for part in parts) - 1
    best_places = Ranked(
        np.take_along_axis(rows, order, axis=1),
        np.take_along_axis(columns, order, axis=1),
        np.take_along_axis(values, order, axis=1),
        np.maximum(rest, 0.0),
    )
    return best_places, source[order].astype(np.uint8)
