"""Places on a cycle of up to 2^64 steps: integers of any size, exactly."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from generator.errors import ArrayError


def on_torus(indices: ArrayLike, steps: int) -> NDArray[np.uint64]:
    """Return integers modulo `steps` (1 to 2^64), same shape.

    Parameters
    ----------
    indices
        Integers of any shape; Python integers of any size, negative ones included.
    steps
        Length of the cycle.

    Raises
    ------
    ArrayError
        If an index is not an integer.
    """
    given: NDArray[Any] = np.asarray(indices)
    if given.size == 0:
        return np.zeros(given.shape, dtype=np.uint64)
    if given.dtype.kind == "f" and not isinstance(indices, np.ndarray):
        given = np.asarray(indices, dtype=object)  # mixed sizes of Python integers
    if given.dtype.kind == "i" and steps <= 2**63 - 1:
        return np.mod(given.astype(np.int64), steps).astype(np.uint64)
    if given.dtype.kind == "u" and steps <= 2**64 - 1:
        return np.mod(given.astype(np.uint64), np.uint64(steps))
    whole = given.ravel().tolist()
    if given.dtype.kind not in "iuO" or not all(
        isinstance(index, int | np.integer) and not isinstance(index, bool) for index in whole
    ):
        raise ArrayError(
            f"a place on the array is a pair of integers, not of {given.dtype}",
            fix="round rows and columns to integers",
        )
    exact = [int(index) % steps for index in whole]
    return np.array(exact, dtype=np.uint64).reshape(given.shape)
