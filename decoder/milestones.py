"""Code conversion the thesis's ways: parallel, serial, and serial-parallel with milestones.

Thesis 5.1, 5.4.3, figures 5.2 and 5.4. Parallel: one look into a table of all windows. Serial:
back shifts to the start of the sequence, counted; one milestone, at zero. Serial-parallel:
every t-th place of the sequence is a milestone; the register is shifted back until it holds
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

from decoder.element import Element, Keys, Shifts, elements_of
from decoder.errors import MethodError
from generator.array.sequence import Sequence

MOST_ENTRIES = 1 << 24  #: 64 MB


class Table:
    """The index of every window by the key of its element; `MethodError` beyond 2^24 terms."""

    def __init__(self, sequence: Sequence) -> None:
        if sequence.period > MOST_ENTRIES:
            raise MethodError(
                f"a table of {sequence.period} windows is too large: at most {MOST_ENTRIES}",
                fix="take method milestones or logarithm",
            )
        self.elements = elements_of(sequence.ring)
        self.index = np.zeros(sequence.period + 1, dtype=np.int32)  #: by key
        forward = Shifts(self.elements, sequence.ring.powers_of_x[1])
        block = min(sequence.period, 1 << 16)
        run = forward.run(self.elements.one[0], block)
        for start in range(0, sequence.period, block):
            keys = self.elements.keys(run)[: sequence.period - start]
            self.index[keys.astype(np.intp)] = np.arange(start, start + keys.size)
            if start + block < sequence.period:
                run = self.elements.apply(forward.map(16), run)

    def convert(self, states: Element) -> NDArray[np.uint64]:
        """Return the index of each element (none of them 0); (N,)."""
        places = self.elements.keys(states).astype(np.intp)
        return self.index.take(places).astype(np.uint64)


MOST_MILESTONES = 1 << 22  #: 50 MB
MOST_SHIFTS = 1 << 24  #: a single window then takes about 0.1 s
_BLOCK = 1 << 17  #: registers held at a time


def optimal_distance(period: int, k1: float = 1.0, k4: float = 1.0) -> int:
    """Return t_opt, the distance of milestones that costs least: k1 each, k4 a back shift.

    >>> optimal_distance(2**16 - 1, 1, 4), optimal_distance(2**16 - 1, 4, 1)
    (128, 512)
    """
    return max(1, round(sqrt(k1 / k4 * period)))


class Milestones:
    """Back shifts to the nearest milestone, `distance` steps apart; t_opt for k1 = k4 by default.

    Raises `MethodError` if it would take more than 2^22 milestones or 2^24 back shifts.
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

    def convert(self, states: Element) -> NDArray[np.uint64]:
        """Return the index of each element (none of them 0); (N,)."""
        result = np.zeros(len(states), dtype=np.uint64)
        open_ = np.arange(len(states))
        done = 0
        while open_.size:
            block = max(1, min(self.distance - done, _BLOCK // open_.size))
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


def serial(sequence: Sequence) -> Milestones:
    """Return the serial conversion of a sequence; `MethodError` beyond 2^24 terms."""
    if sequence.period > MOST_SHIFTS:
        raise MethodError(
            f"serial conversion of {sequence.period} terms would take up to as many back shifts; "
            f"at most {MOST_SHIFTS}",
            fix="take method milestones or logarithm",
        )
    return Milestones(sequence, sequence.period)
