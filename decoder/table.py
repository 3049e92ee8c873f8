"""Parallel code conversion: one look into a table of all windows. Thesis 5.1, 5.4.3."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from decoder.element import Element, Shifts, elements_of
from decoder.errors import MethodError
from generator.array.sequence import Sequence

MOST_ENTRIES = 1 << 24  #: 64 MB


class Table:
    """The index of every window, by the key of its field element.

    Raises
    ------
    MethodError
        If the sequence has more than 2^24 terms.
    """

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

    @property
    def nbytes(self) -> int:
        """Memory of the table, bytes."""
        return self.index.nbytes

    def convert(self, states: Element) -> NDArray[np.uint64]:
        """Return the index of each element (none of them 0); (N,)."""
        places = self.elements.keys(states).astype(np.intp)
        return self.index.take(places).astype(np.uint64)
