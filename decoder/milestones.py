"""Serial-parallel code conversion, and what it costs. Thesis 5.1, 5.4.3, figures 5.2 and 5.4.

Every t-th place of the sequence is a milestone; the register is shifted back until it holds
one. Position = milestone position + number of back shifts. All shifts of a block are made
at once, for all windows.

The thesis prints t_opt = int[(k1/k4 2^n - 1)^(1/2)]; a bracket was lost. The cost
k1 (2^n - 1)/t + k2 + k3 + k4 t is least at t_opt = [(k1/k4) (2^n - 1)]^(1/2), which is what
table 5.2 is made from.
"""

from __future__ import annotations

from math import isqrt, sqrt

import numpy as np
from numpy.typing import NDArray

from decoder.element import Element, Shifts, elements_of
from decoder.errors import MethodError
from decoder.keys import Keys
from generator.array.sequence import Sequence

MOST_MILESTONES = 1 << 22  #: 50 MB
MOST_SHIFTS = 1 << 24  #: a single window then takes about 0.1 s
_BLOCK = 1 << 17  #: registers held at a time


def optimal_distance(period: int, k1: float = 1.0, k4: float = 1.0) -> int:
    """Return t_opt, the distance of milestones that costs least.

    Parameters
    ----------
    period
        Length of the sequence, 2^n - 1.
    k1, k4
        Cost of one milestone, and of one back shift.

    Examples
    --------
    >>> optimal_distance(2**16 - 1, 1, 4), optimal_distance(2**16 - 1, 4, 1)
    (128, 512)
    """
    return max(1, round(sqrt(k1 / k4 * period)))


def conversion_cost(
    period: int, distance: float, k1: float = 1.0, k2: float = 0.0, k3: float = 0.0, k4: float = 1.0
) -> float:
    """Return the total cost of figure 5.4: equipment k1 N/t + k2, and time k3 + k4 t."""
    return k1 * period / distance + k2 + k3 + k4 * distance


def requested_milestones(period: int, k1: float = 1.0, k4: float = 1.0) -> int:
    """Return the number of milestones at t_opt: an entry of table 5.2."""
    return round(period / sqrt(k1 / k4 * period))


class Milestones:
    """Back shifts to the nearest milestone.

    Parameters
    ----------
    sequence
        The m-sequence.
    distance
        t, steps between milestones; t_opt for k1 = k4 by default.

    Raises
    ------
    MethodError
        If it would take more than 2^22 milestones or 2^24 back shifts.
    """

    def __init__(self, sequence: Sequence, distance: int | None = None) -> None:
        period = sequence.period
        self.distance = min(period, optimal_distance(period) if distance is None else distance)
        if self.distance < 1:
            raise MethodError(
                f"milestones every {distance} steps: the distance is 1 or more",
                fix="leave the distance out for t_opt",
            )
        number = -(-period // self.distance)
        if number > MOST_MILESTONES or self.distance > MOST_SHIFTS:
            raise MethodError(
                f"{number} milestones and up to {self.distance} back shifts for a sequence of "
                f"{period} terms are too many: at most {MOST_MILESTONES} and {MOST_SHIFTS}",
                fix="take method logarithm"
                + (", or milestones" if self.distance > isqrt(period) + 1 else ""),
            )
        self.elements = elements_of(sequence.ring)
        stride = Shifts(self.elements, sequence.ring.power_of_x(self.distance))
        self._keys = Keys(self.elements.keys(stride.run(self.elements.one[0], number)))
        self._back = Shifts(self.elements, sequence.ring.power_of_x(period - 1))

    @property
    def nbytes(self) -> int:
        """Memory of the milestones, bytes."""
        return self._keys.nbytes

    def convert(self, states: Element) -> NDArray[np.uint64]:
        """Return the index of each element (none of them 0); (N,)."""
        result = np.zeros(len(states), dtype=np.uint64)
        open_ = np.arange(len(states))
        done = 0
        while open_.size:
            block = _block(open_.size, self.distance - done)
            run = self._back.run(states, block)
            found = self._keys.find(self.elements.keys(run))
            hit = found >= 0
            reached = hit.any(axis=0)
            shifts = hit.argmax(axis=0)
            milestone = np.take_along_axis(found, shifts[None], axis=0)[0]
            index = milestone * self.distance + shifts + done
            result[open_[reached]] = index[reached].astype(np.uint64)
            done += block
            open_, states = open_[~reached], run[-1][~reached]
            states = self.elements.apply(self._back.map(0), states)
        return result


def _block(windows: int, shifts: int) -> int:
    return max(1, min(shifts, _BLOCK // windows))
