"""Every number that decides how a print is estimated from touches, and what is said of it.

Scales and strains are shares, angles rad, lengths mm. What was measured:
`tests/campaigns/as_built.py`, tables in `docs/recognizer.md`.
"""

from __future__ import annotations

from dataclasses import dataclass

from recognizer.touch.options import ReaderOptions


@dataclass(frozen=True, slots=True)
class EstimateSettings:
    """How touches are put together. Four numbers are of scale x, scale y, skew and stroke."""

    least: int = 10  #: touches without which nothing is told
    enough: int = 25  #: touches that are asked for
    freedom: float = 4.0  #: of the t distribution of errors: one bad touch in ten moves little
    median: float = 3.357  #: of the chi-square distribution of the four numbers of a touch
    rounds: int = 50  #: of reweighing, at most
    settled: float = 1e-9  #: change of a strain that ends them
    unseen: float = 1e-6  #: of the largest eigenvalue: below it a direction was not touched
    #: standard deviations that no number of touches takes away: templates differ from what is felt
    always: tuple[float, float, float, float] = (0.0006, 0.0006, 0.0005, 0.1)
    #: standard deviations between the parts of one printer and material, until parts tell more
    between: tuple[float, float, float, float] = (0.0015, 0.0015, 0.001, 0.1)


@dataclass(frozen=True, slots=True)
class VerdictSettings:
    """What is worth a word."""

    unsure: float = 1.0  #: standard deviations within which nothing is said
    alike: float = 0.001  #: scale - 1 that counts as designed: .03 mm at 30 mm
    corrected: float = 0.025  #: beyond it panels no longer meet: 1.5 mm of 60, though they are read
    square_rad: float = 0.001  #: skew that counts as square
    askew_rad: float = 0.015  #: likewise: .9 mm over 60
    together: float = 0.003  #: by which the two scales differ at most that have one cause
    stroke_mm: float = 0.1  #: by which strokes may be wider or narrower without a word


#: Of a reader of prints that are further off than usual.
WIDE_SCALE = ReaderOptions(scale_sd=0.04, scale_most=0.12)

ESTIMATE, VERDICT = EstimateSettings(), VerdictSettings()
