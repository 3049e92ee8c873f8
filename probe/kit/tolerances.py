"""What it costs in reading when a dimension of the probe is off: measured, one defect at a time.

`tests/bench/kit_tolerances.py` measures it: touches of `fsr-16` amid faces, a typical sensor with
one defect more, read as if it had none.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Tolerance:
    """A dimension, what it may be off by, and what was measured there."""

    what: str
    keep: str  #: the tolerance
    costs: str  #: what was measured


_SOUND = "60 of 60 right, .040 mm"

TOLERANCES: tuple[Tolerance, ...] = (
    Tolerance(
        "place of each tab, by itself",
        "0.15 mm (standard deviation)",
        f"nothing off: {_SOUND}; .15 mm: 60 of 60, .055 mm; .25 mm: 48 of 60, .080 mm; "
        ".4 mm: 12 of 60",
    ),
    Tolerance(
        "height of each tab, by itself",
        "0.15 mm (standard deviation)",
        ".1 mm: 60 of 60, .046 mm; .15 mm: 60 of 60, .052 mm; .2 mm: 57 of 60, .061 mm; "
        ".3 mm: 17 of 60",
    ),
    Tolerance(
        "overlay over film, as a whole",
        "0.1 mm, or measured",
        "every place is off by as much: .1 mm: .107 mm; .25 mm: .250 mm; .5 mm: .493 mm, all 60 of "
        "60 right; a touch at a known place tells it",
    ),
)
