"""What lies about each tactel: images, squares of tactels -> one value for each square.

The square of 2 `reach` + 1 tactels is gone through line by line, first along columns and then along
rows; beyond the rim of the matrix nothing counts.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Kind = TypeVar("Kind", np.bool_, np.float64)


def combine_around(image: NDArray[Kind], reach: int, combine: np.ufunc) -> NDArray[Kind]:
    """Return the maximum (`np.maximum`), any or all of the values about each tactel.

    Parameters
    ----------
    image
        (rows, columns).
    combine
        Of two values; of which it does not matter in what order they come, nor how often.

    Examples
    --------
    >>> combine_around(np.array([[0.0, 3.0, 1.0, 1.0]]), 1, np.maximum)
    array([[3., 3., 3., 1.]])
    """
    found: Any = image
    for axis in (0, 1):
        line = found.swapaxes(0, axis)
        found = line.copy()
        for away in range(1, min(reach, len(line) - 1) + 1):
            combine(found[away:], line[:-away], out=found[away:])
            combine(found[:-away], line[away:], out=found[:-away])
        found = found.swapaxes(0, axis)
    return np.asarray(found)


def quantile(ordered: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the quantile of values that rise along the last axis, as `numpy.quantile` has it.

    Examples
    --------
    >>> float(quantile(np.array([0.0, 1.0, 5.0]), 0.75))
    3.0
    """
    at = (ordered.shape[-1] - 1) * share
    low = min(int(at), ordered.shape[-1] - 1)
    one, other = ordered[..., low], ordered[..., min(low + 1, ordered.shape[-1] - 1)]
    part = at - low
    between = other - one
    return np.asarray(one + between * part if part < 0.5 else other - between * (1 - part))


def mean_of_strongest(forces: NDArray[np.float64], count: int) -> float:
    """Return the mean of so many of the highest readings."""
    return float(np.sort(forces, axis=None)[-count:].mean())
