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
    Tolerance(
        "size of the overlay (shrinkage of the silicone)",
        "0.3 %",
        ".3 %: .077 mm; .6 %: .132 mm; 1 %: .212 mm; 2 %: .424 mm; all 60 of 60 right, from .6 % "
        "on beyond the stated error: print the mould larger by what your silicone shrinks",
    ),
    Tolerance(
        "diameter of the tips",
        "30 %",
        "30 % smaller: 60 of 60, .042 mm; 30 % larger: 60 of 60, .051 mm",
    ),
    Tolerance(
        "Young's modulus of the silicone",
        "half to double",
        "half or double: 60 of 60, .043 mm; four times: 60 of 60, .054 mm",
    ),
    Tolerance("roundness of the tips", "0.5 mm", "domes of .2 to .5 mm: 60 of 60, .040 mm"),
    Tolerance(
        "housing against the face",
        "3 degrees",
        "wrist tilts up to 3 degrees: 60 of 60, .041 mm",
    ),
)
