"""The knobs of the reader: one flat value.

Lengths in mm, forces in N, log-likelihoods in nats (10 nats are odds of 22,000). Every other number
that decides is a constant in the module that uses it, chosen, unless it says otherwise, on
simulated touches of the 40 objects of `docs/validation/forty.yaml` (typical noise, strong
mismatch).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

from encoded_objects.base.errors import UsageError
from encoded_objects.base.number import needed_number

#: Nats between a symbol and none where rounding decides: of a cell that is seen by its rim alone.
#: Scores of a cell are bounded, so that differences of 6, 8 and 14 nats are common: limits stand
#: this much below whole numbers.
TIE_NATS = 1e-4
ABOVE_ZERO = ("doubt", "scale_sd")  #: by these is divided


def _require(
    name: str, value: Any, *, whole: bool = False, least: int = 0, above: bool = False
) -> None:
    """Refuse what is no finite number, or no whole one, or less than the least."""
    if fix := needed_number(value, whole=whole, least=least, above=above):
        raise UsageError(f"{name} {value!r}", fix=fix)


@dataclass(frozen=True, slots=True)
class Effort:
    """The work of a search for lattices."""

    candidates: int = 2  #: lattices taken from the coarse search under each gain
    steps: int = 2  #: of damped least squares, of all of them
    finalists: int = 1  #: lattices that are refined to the end
    final_steps: int = 2
    again: int = 0  #: of the best lattices, under whose gains the image is searched again

    def __post_init__(self) -> None:
        for name in ("candidates", "finalists"):
            _require(name, getattr(self, name), whole=True, least=1)
        for name in ("steps", "final_steps", "again"):
            _require(name, getattr(self, name), whole=True)


@dataclass(frozen=True, slots=True)
class ReaderOptions:
    """How a touch is read, and when an answer is given.

    Raises UsageError: a value that is no number, not finite, or out of its range.
    """

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

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            kind = type(each.default)
            if kind is float:
                _require(each.name, value, above=each.name in ABOVE_ZERO)
            elif not isinstance(value, kind):
                raise UsageError(
                    f"{each.name} {value!r}",
                    fix=f"give {'True or False' if kind is bool else 'an Effort'}",
                )
        if self.scale_most >= 1:
            raise UsageError(f"scale_most {self.scale_most}", fix="give a share below 1")


DEFAULTS = ReaderOptions()
