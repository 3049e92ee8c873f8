"""Whether the best place is an answer, and why not. Thesis 6.3.

Evidence (nats, counts of cells) and expected false matches -> a reason of `recognition`; "" accepts
the place. One touch (`recognise`) and a scan (`recognizer.scan`) are judged alike:

1. `reject_reason` where symbols of no registered place explain the touch as well, where cells
   contradict the place, or where another place comes near.
2. `reject_chance` where a surface of another lab would match a registered place as well (`chance`).

Limits are of likelihoods and of expected matches, none of numbers of symbols that agree: a letter
of a large alphabet says more than one of a small one. Cells that contradict a place are counted.

Log-likelihoods in nats; 10 nats are odds of 22,000.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from recognizer.touch.options import ReaderOptions
from recognizer.touch.recognition import AMBIGUOUS, BY_CHANCE, NOT_ENCODED, TOO_FEW

# With these and the margins of the reader's options, 100,000 touches of 40 objects, a fifth of them
# of surfaces of no database, gave 0 wrong answers, and an answer to 99.6 % of those that show
# enough symbols (`docs/validation/README.md`).

RATIO = 3.0  #: nats over symbols of no registered place, at least
SURE_RATIO = 7.0  #: nats below which `WELL_EXPLAINED` of the image must be explained
STROKE_EXCESS = 0.9  #: tenths of a mm by which strokes are hardly printed wider; the same holds
WELL_EXPLAINED = 0.8
EXPLAINED = 0.72  #: share of the image's variance
EXPLAINED_BY_MANY = 0.58  #: where agreeing symbols say `MANY_BITS`
MANY_BITS = 22.0  #: of eleven letters of four
CONTRADICTIONS = 1  #: cells that may contradict a place; none strongly
CONTRADICTION = 8.0  #: nats by which a cell shows another symbol
STRONG_CONTRADICTION = 10.0  #: noise alone: one cell in 20,000, one touch in 1,000
MOST_POSITION_SD_MM = 0.6  #: standard deviation of the place of several touches
WORN_WITH_BORDER = 1  #: symbols in view and not felt, with more of which borders do not count


Face = tuple[str | None, str | None]  #: names of an object and a face


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence for a place, and against it."""

    log_likelihood_ratio: float  #: nats over symbols of no registered place
    inliers: int  #: cells in view whose registered symbol is read, ...
    bits: float  #: ... and what these symbols say
    contradictions: int  #: cells in view that show another symbol, by `CONTRADICTION`
    strong_contradictions: int = 0  #: by `STRONG_CONTRADICTION`
    worn: int = 0  #: cells in view whose registered symbol is not felt
    explained: float = 1.0  #: share of the image's variance
    stroke_excess: float = 0.0  #: tenths of a mm by which strokes seem wider than designed
    best_ratio: float = math.inf  #: the ratio if every cell agreed fully
    touches: int = 1  #: of a scan, ...
    agreeing: int = 1  #: ... and those that agree with the place


def reject_reason(
    evidence: Evidence,
    margin: float,
    least_margin: float,
    *,
    least_ratio: float = RATIO,
    wrong_share: float = 0.0,
) -> str:
    """Return why a place is no answer; "" where nothing speaks against it.

    `margin` is nats over the best other place, `least_ratio` over symbols of no registered place;
    `wrong_share` of the agreeing cells may contradict the place where that is more than usual.
    """
    if evidence.best_ratio < least_ratio:
        return TOO_FEW
    if not is_encoded(evidence, max(CONTRADICTIONS, wrong_share * evidence.inliers)):
        return NOT_ENCODED
    if evidence.touches > 1 and 2 * evidence.agreeing <= evidence.touches:
        return TOO_FEW  # few of many touches agree on some place by chance
    if evidence.log_likelihood_ratio < least_ratio:
        return TOO_FEW
    return reject_margin(margin, least_margin)


def is_encoded(evidence: Evidence, contradictions: float = CONTRADICTIONS) -> bool:
    """Return whether the touch shows the symbols of a place rather than any surface."""
    doubtful = evidence.log_likelihood_ratio < SURE_RATIO or evidence.stroke_excess > STROKE_EXCESS
    return (
        evidence.log_likelihood_ratio >= RATIO
        and (evidence.explained >= WELL_EXPLAINED or not doubtful)
        and evidence.explained >= least_explained(evidence.bits)
        and evidence.contradictions <= contradictions
        and evidence.strong_contradictions == 0
    )


def least_explained(bits: float) -> float:
    """Return the share of the image's variance that symbols that say so much must explain."""
    return EXPLAINED if bits < MANY_BITS else EXPLAINED_BY_MANY


def least_margin(bits: float, options: ReaderOptions) -> float:
    """Return the nats by which symbols that say so much must leave other places behind.

    Bare cells weigh as much as few symbols, and a cell is bare beyond an edge, between two edges,
    or where its symbol is worn.
    """
    return options.margin_by_few if bits < MANY_BITS else options.margin


def reject_margin(margin: float, least: float) -> str:
    """Return `AMBIGUOUS` where another place comes nearer than so many nats."""
    return AMBIGUOUS if margin < least else ""


def reject_joined(
    named: Face, confirmed: Face | None, outliers: int, most_outliers: int, position_sd_mm: float
) -> str:
    """Return why the answer of several touches of one face is no answer; "" where it is.

    Two different answers about one face exclude each other: a `named` face that is not the
    `confirmed` one is ambiguous. A touch that disagrees with the others is answered by them, but
    only as one of few: `outliers` are such touches in a row. A vague place is refused.
    """
    if confirmed is not None and named != confirmed:
        return AMBIGUOUS
    if outliers > 0 and (confirmed is None or outliers > most_outliers):
        return NOT_ENCODED
    return TOO_FEW if position_sd_mm > MOST_POSITION_SD_MM else ""


def reject_chance(doubt: float, most: float) -> str:
    """Return `BY_CHANCE` where more than so many places would match a foreign surface as well.

    `TOO_FEW` where more than one would: the symbols name no place then.
    """
    if doubt > max(most, 1.0):
        return TOO_FEW
    return BY_CHANCE if doubt > most else ""


def may_count_border(evidence: Evidence, margin: float, options: ReaderOptions) -> bool:
    """Return whether a place lacks nothing but symbols, so that its border may count for it.

    Where symbols of it are worn or read as others, the face may be another one, whose border lies
    elsewhere.
    """
    return (
        evidence.worn <= WORN_WITH_BORDER
        and evidence.contradictions == 0
        and margin >= options.margin_by_few
    )
