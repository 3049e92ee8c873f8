"""Runs of whole numbers, one after the other: how a grid's rows are spread out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]


def expand_runs(first: Index, count: Index) -> tuple[Index, Index]:
    """Return owner and number of first, first + 1, ... of each run of `count` numbers.

    >>> [each.tolist() for each in expand_runs(np.array([5, 1]), np.array([2, 1]))]
    [[0, 0, 1], [5, 6, 1]]
    """
    count = count.clip(0)
    owner = np.repeat(np.arange(len(count)), count)
    before = np.cumsum(count) - count
    return owner, np.arange(len(owner)) + (first - before)[owner]


def blocks(count: Index, size: int) -> list[Index]:
    """Return the runs' numbers in blocks of about `size` numbers together."""
    total = np.cumsum(count)
    ends = np.arange(size, int(total[-1]) if len(total) else 0, size)
    return np.split(np.arange(len(count)), np.searchsorted(total, ends) + 1)
