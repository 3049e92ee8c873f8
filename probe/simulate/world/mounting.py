"""A sensor that is mounted or wired otherwise than drawn: its counts arrive in other places.

Counts (rows, columns) -> counts as they arrive. The sensor stands where it stands: the truth of
a touch does not turn with its image.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from probe.errors import CircuitError

Counts = NDArray[np.uint16]

MOUNTINGS: dict[str, Callable[[Counts], Counts]] = {
    "as drawn": lambda counts: counts,
    "quarter turn": np.rot90,
    "mirrored": np.fliplr,
    "transposed": np.transpose,
    "halves swapped": lambda counts: np.roll(counts, counts.shape[1] // 2, axis=1),
    "rolled": lambda counts: np.roll(counts, 1, axis=1),
}


def mount(counts: Counts, mounting: str) -> Counts:
    """Return counts as a mounting leaves them.

    Raises
    ------
    CircuitError
        The matrix is not square, and the mounting would give it another shape.
    """
    found = MOUNTINGS[mounting](counts)
    if found.shape != counts.shape:
        raise CircuitError(
            f"a matrix of {counts.shape[0]} x {counts.shape[1]} cannot be mounted '{mounting}'",
            fix="take a square sensor, or another level",
        )
    return np.ascontiguousarray(found)
