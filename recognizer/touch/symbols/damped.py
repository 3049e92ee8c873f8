"""Damped least squares (Levenberg, Marquardt) for many starts at once.

Each start keeps a damping of its own and the best point that it has reached. K. Levenberg,
Quart. Appl. Math. 2 (1944) 164; D. W. Marquardt, J. SIAM 11 (1963) 431.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST = 1e6  #: damping beyond which a step is nothing


class Point(Protocol):
    """Where b starts are: a dataclass whose fields are arrays (b, ...)."""

    @property
    def value(self) -> Array:
        """(b,) what is made as large as it gets."""

    @property
    def normal(self) -> Array:
        """(b, k, k) normal matrices."""

    @property
    def right(self) -> Array:
        """(b, k) right-hand sides."""


class Damping(Protocol):
    """How large steps may be."""

    @property
    def damping(self) -> float:
        """Of the first step, a share of the normal matrix's diagonal."""

    @property
    def easier(self) -> float:
        """What divides it after a step that helps."""

    @property
    def harder(self) -> float:
        """What multiplies it after one that does not."""


P = TypeVar("P", bound=Point)


def ascend(
    start: P, moved: Callable[[P, Array], P], steps: int, settings: Damping, settled: float = 0.0
) -> P:
    """Return the best points that are reached in `steps` steps.

    Parameters
    ----------
    moved
        (points, damping (b,)) -> the points a step further.
    settled
        End when no step changes a value by as much.
    """
    best, damping = start, np.full(len(start.value), settings.damping)
    for _ in range(steps):
        tried = moved(best, damping)
        better = tried.value > best.value
        done = bool((np.abs(tried.value - best.value) < settled).all())
        best = _select_points(better, tried, best)
        damping = np.where(
            better, damping / settings.easier, np.minimum(damping * settings.harder, MOST)
        )
        if done:
            break
    return best


def damped_step(at: Point, damping: Array, least: Array | float) -> Array:
    """Return the step (b, k) at points; `least` is added to the diagonals in any case."""
    diagonal = np.einsum("bii->bi", at.normal) * damping[:, None] + least
    system = at.normal + diagonal[:, :, None] * np.eye(diagonal.shape[1])
    return np.asarray(np.linalg.solve(system, at.right[..., None])[..., 0])


def _select_points(better: NDArray[np.bool_], one: Any, other: Any) -> Any:
    """Return the points of one where they are better, else those of the other."""
    picked = {}
    for item in fields(one):
        new, old = getattr(one, item.name), getattr(other, item.name)
        picked[item.name] = np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old)
    return type(one)(**picked)
