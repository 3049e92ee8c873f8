"""The knobs of the reader: one flat value.

Lengths in mm, forces in N, log-likelihoods in nats (10 nats are odds of 22,000). Every other number
that decides is a constant in the module that uses it, chosen, unless it says otherwise, on
simulated touches of the 40 objects of `docs/validation/forty.yaml` (typical noise, strong
mismatch).
"""

from __future__ import annotations

from dataclasses import dataclass

#: Nats between a symbol and none where rounding decides: of a cell that is seen by its rim alone.
#: Scores of a cell are bounded, so that differences of 6, 8 and 14 nats are common: limits stand
#: this much below whole numbers.
TIE_NATS = 1e-4


@dataclass(frozen=True, slots=True)
class Effort:
    """The work of a search for lattices."""

    candidates: int = 2  #: lattices taken from the coarse search under each gain
    steps: int = 2  #: of damped least squares, of all of them
    finalists: int = 1  #: lattices that are refined to the end
    final_steps: int = 2
    again: int = 0  #: of the best lattices, under whose gains the image is searched again


@dataclass(frozen=True, slots=True)
class ReaderOptions:
    """How a touch is read, and when an answer is given."""

    margin: float = 10.0 - TIE_NATS  #: nats over the best other place
    margin_by_few: float = 14.0 - TIE_NATS  #: where agreeing symbols say less than 22 bits
    #: registered places that a foreign surface may match as well by chance: of 395 right answers
    #: among 20,880 places of 5 mm it refuses 5, all at edges (docs/validation)
    doubt: float = 1e-4
    rim_mm: float = 2.0  #: how far the sensor's centre may lie beyond the face
    contact_counts: float = 8.0  #: over the background by which the strongest tactels rise
    contact_n: float = 0.05  #: where readings are newtons
    scale_sd: float = 0.01  #: standard deviation of a print's scale
    scale_most: float = 0.03  #: largest deviation of a print's scale that is read
    as_designed: bool = False  #: parts are as their files (simulated): no print to allow for
    first: Effort = Effort()  #: of the first search
    #: of the second, of touches that the first does not answer or of which few cells agree: five
    #: times the work (`docs/recognizer.md`)
    thorough: Effort = Effort(12, 4, 6, 6, again=2)


DEFAULTS = ReaderOptions()
