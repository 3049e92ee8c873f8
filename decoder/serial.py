"""Serial code conversion: back shifts to the zero position, counted. Thesis 5.1, 5.4.3.

The reverse feedback of table 5.1 divides the register's field element by x; the number of
back shifts until it is the start of the sequence is the index. It is the serial-parallel
method with one milestone, at zero.
"""

from __future__ import annotations

from decoder.errors import MethodError
from decoder.milestones import MOST_SHIFTS, Milestones
from generator.array.sequence import Sequence


def serial(sequence: Sequence) -> Milestones:
    """Return the serial conversion of a sequence.

    Raises
    ------
    MethodError
        If the sequence has more than 2^24 terms.
    """
    if sequence.period > MOST_SHIFTS:
        raise MethodError(
            f"serial conversion of {sequence.period} terms would take up to as many back shifts; "
            f"at most {MOST_SHIFTS}",
            fix="take method milestones or logarithm",
        )
    return Milestones(sequence, sequence.period)
