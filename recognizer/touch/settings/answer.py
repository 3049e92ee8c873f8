"""Numbers of the answer: what is weighed against what, refused, asked for next.

Units as in `recognizer.touch.settings`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from recognizer.touch.settings.symbols import TIE_NATS


@dataclass(frozen=True, slots=True)
class HypothesisSettings:
    """Which registered places are looked at, and what a cell may cost one of them."""

    kept: int = 8  #: verified at most, two at least
    near: float = 14.0 - TIE_NATS  #: nats below the best within which they are
    steps: int = 4  #: of their verification
    cap: float = 8.0  #: nats that one cell can cost at most
    corner: float = 8.0  #: tactels on a cell below which it can cost less than that
    worn: float = 4.0  #: nats that a symbol costs that is registered but not felt at all
    anchors: int = 3  #: cells tried as the one surely registered, where no window is whole
    anchors_again: int = 2  #: the same, when the best place is known
    windows: int = 4  #: whole windows that are looked up, the surest ones
    sure: float = 6.0  #: nats by which each of their cells shows its symbol, not any other
    many: int = 1024  #: candidates, from which on those count that two windows agree on
    large: int = 1 << 18  #: registered cells, from which on a whole window must be seen
    first: int = 6  #: cells after which only ...
    followed: int = 512  #: ... so many candidates go on (`tests/bench/recognizer_scale.py`)
    heavy: float = 12.0  #: tactels from which a cell counts whole in the order of the cells


@dataclass(frozen=True, slots=True)
class BeliefSettings:
    """When an answer is given.

    With these, 100,000 touches of 40 objects, a fifth of them of surfaces of no database, gave 0
    wrong answers, and an answer to 99.6 % of those that show enough symbols
    (`docs/validation/README.md`).
    """

    #: nats over the best other place; what cells can cost is bounded (`HypothesisSettings`), so
    #: that differences of 6, 8 and 14 nats are common, and rounding is not to decide
    margin: float = 10.0 - TIE_NATS
    margin_by_few: float = 14.0 - TIE_NATS  #: where fewer than `many_inliers` cells speak ...
    #: ... and registered places, whatever their borders, that random symbols match as well: with
    #: more of them what is felt, partly seen symbols counted by what they show, names no place
    named: float = 1.0
    surprise: float = 3.0  #: nats over symbols of no registered place
    sure: float = 7.0  #: nats below which a share of `well` must be explained
    wide: float = 0.9  #: tenths of a mm by which strokes are hardly printed wider; the same holds
    well: float = 0.8
    explained: float = 0.72  #: share of the image's variance
    explained_by_many: float = 0.58  #: the same where `many_inliers` agree
    many_inliers: int = 11
    least_inliers: int = 4  #: cells that hold a symbol, are seen, and agree
    contradicted: int = 1  #: cells that speak `clearly` for another symbol; `plainly`: none
    clearly: float = 8.0  #: nats
    plainly: float = 16.0
    tie: float = TIE_NATS  #: by which none is likelier than a symbol that is worn, at least
    whole: float = 6.0  #: tactels that look at a cell which counts as seen
    #: tactels to a symbol below which numbers of tactels shrink with the square of the share: 8x8
    #: at 3 mm, 7 mm symbols, 40 typical touches mid-face, 0 wrong: 38 answered, 0 without it
    coarse: float = 8.0
    rim_mm: float = 2.0  #: how far the sensor's centre may lie beyond the face
    #: registered places that foreign symbols may match as well by chance: of 395 right answers
    #: among 20,880 places of 5 mm it refuses 5, all at edges (`tests/campaigns/other_labs.py`)
    doubt: float = 1e-4
    #: doubt above which a wide search looks at an answer again, where the image does not speak for
    #: the place with `first_look.plain` nats: it is to be best once more, with a doubt of at most
    #: `doubt_again`. A wrong soft one of 20,000 touches had 8e-5 and 7 nats at first and .006 then;
    #: of 1,074 right soft ones (seed 1301) 72 are looked at, all below 6e-4 then
    looked_at_again: float = 1e-5
    doubt_again: float = 1e-3
    grain: float = 0.25  #: nats to which scores are rounded where that is counted


@dataclass(frozen=True, slots=True)
class BorderSettings:
    """How the border of a face is weighed, and where (`recognizer.touch.border`).

    Tuned on touches near edges and corners of the forty objects: own engine, seeds 501 and 502,
    MuJoCo, seeds 900 and 902.
    """

    worn: int = 1  #: symbols seen and not felt, with more of which borders are not asked
    strongest: int = 12  #: tactels that say how hard is pressed
    sigmas: float = 5.0  #: deviations of the noise of readings ...
    pressed: float = 0.08  #: ... and share of the strongest from which the bare face is pressed
    symbol: float = 0.15  #: the same of a symbol, for a bare cell to be one
    bare: float = 0.1  #: psi of a symbol from which a tactel feels it
    reach_mm: float = 3.2  #: from a line within which tactels are asked
    ends_mm: float = 1.0  #: at the ends of a line that are left out
    apart_mm: float = 1.5  #: from any other line
    few: int = 3  #: tactels, at least
    step_mm: float = 0.1  #: of shifts
    gains: int = 5  #: factors that the force on the bare face may be off by, evenly spread ...
    gain: float = 0.5  #: ... over 1.5 of this deviation of their logarithm, both ways
    noise: float = 0.12  #: least deviation of psi on a covered tactel ...
    quiet: float = 0.8  #: ... and that where nothing is felt, against it
    most: float = 4.0  #: nats that one tactel can cost
    slack: float = 0.25  #: nats by which a shift may be less likely that fits as well
    least: float = 0.25  #: share that a line leaves at least
    alike_rad: float = 0.2  #: by which lines differ that tell the same


@dataclass(frozen=True, slots=True)
class ExchangedSettings:
    """Which answers are read again with the halves of the sensor exchanged (`touch.exchanged`).

    Of 286 answers at edges and in corners (own engine, seeds 1701, 1702) no pressed tactel lies
    so far beyond the face, of those beside another part (1703) a third have more than .15; of 545
    at edges and amid faces (1902, 1903) none is explained so poorly, of worn ones a third.
    """

    strongest: int = 12  #: tactels that say how hard is pressed
    pressed: float = 0.2  #: share of that from which a tactel is pressed
    beyond_mm: float = 1.5  #: beyond the outline of the face, from which it lies beside
    beside: float = 0.15  #: share of the pressed tactels that do
    surprise: float = 25.0  #: nats over symbols of no registered place, and ...
    explained: float = 0.86  #: ... share of the image, below which symbols explain it poorly
    soft: float = 30.0  #: times the noise up to which the strongest are weak, and that is why


@dataclass(frozen=True, slots=True)
class FirstLookSettings:
    """Which touches are not searched for widely.

    Gaps: of 30,777 touches of a blank plate nine in ten show fewer than .27 (seed 22), of 682 amid
    a face, along its rows, at 160 N six fewer than .285 (seeds 11 and 12).

    When a wide search is asked for: chosen on 2,326 touches of forty and of forty small objects,
    most of them at edges and corners, worn or soft (own engine, seeds 1001 and 1002, MuJoCo, 1003).
    Of 274 answers by few symbols that chance allows none was wrong, and a wide search would refuse
    15 of them. It is asked 303 times of 921 where no such answer is, and makes 42 touches right of
    the 50 that it can.
    """

    strongest: int = 12  #: tactels that say how hard is pressed
    pressed: float = 0.15  #: share of that from which a tactel is pressed
    around: int = 5  #: tactels, side of a square in which strokes and gaps lie
    high: float = 0.85  #: quantile of its readings that stands for strokes
    weak: float = 0.35  #: share of that below which a tactel lies over a gap
    gaps: float = 0.285  #: share of such tactels below which no strokes show
    finest: float = 3.1  #: tactels, pitches between which gaps were measured
    coarsest: float = 5.0
    ink: float = 0.44  #: share of a cell's tactels that its symbol presses, and some beside it
    #: symbols that agree with a place, with fewer of which a wide search finds none: of 49 touches
    #: that it made right (own engine, MuJoCo, forty and small objects; seeds 1401-1408) none
    agreed: int = 3
    foreign: float = 3.0  #: nats over symbols of no registered place
    plain: float = 20.0  #: the same from which a place's symbols are plainly there, and then ...
    explained: float = 0.6  #: ... the share of the image that they explain
    doubt: float = 1e-3  #: of an answer by few symbols that a better fit may bring below the limit
    margin: float = 12.0 - TIE_NATS  #: nats that it leaves other places behind, likewise


@dataclass(frozen=True, slots=True)
class NextSettings:
    """Which steps are weighed, and what they are worth (`tests/campaigns/next_touch.py`).

    Lengths, forces and counts are those of `fsr-16`; `next_limits` makes another type's of them.
    """

    lengths_mm: tuple[float, ...] = (4.0, 7.0, 10.0, 14.0)  #: of steps
    directions: int = 16  #: of steps
    turns_rad: tuple[float, ...] = (0.0, math.pi / 4)  #: a row of symbols fits along a diagonal
    force_n: float = 80.0  #: at which touches are read best
    strongest: int = 12  #: tactels that say how hard is pressed
    faint: float = 0.08  #: share of that from which a tactel lies on something ...
    least_counts: float = 16.0  #: ... and readings over the background: less is noise, ...
    quiet_sigmas: float = 4.0  #: ... and deviations of the type's noise, where that is more
    least_n: float = 0.1  #: the same where readings are newtons
    gap: int = 5  #: tactels, side of the square that closes gaps between strokes
    clear_mm: float = 2.5  #: from where the face may end to the centre: nearer, the plate tips
    points: int = 8  #: along each side of the sensor at which a view is asked
    whole: float = 0.36  #: pitches within the rim at which a symbol's centre is seen whole
    beyond_mm: float = 30.0  #: beyond the sensor's rim at which trust in a face falls to 1/e
    novelty: float = 0.2  #: more that a symbol is worth which was not seen yet ...
    novelty_inside: float = 0.5  #: ... where no edge is near: there another look tells as little
    faces: int = 6  #: hypotheses that are asked, and ...
    soft: float = 3.0  #: ... nats by which their weights fall to 1/e
    by_face: float = 0.5  #: weight of what faces say against what the image says
    agreed: float = 0.9  #: of the hypotheses' weight that must know a face under the centre
    cost: float = 0.01  #: symbols that a mm of the way costs
    turning: float = 1.5  #: symbols that a turn costs
    whole_share: float = 0.85  #: of the sensor that lies on something; with less, an edge is near
    soft_counts: float = 40.0  #: below which the strongest readings are weak
    soft_n: float = 0.25  #: the same where readings are newtons
    margin: float = 14.0 - TIE_NATS  #: nats below which an answer had better be confirmed
    doubt: float = 1e-5  #: places by chance above which it had


@dataclass(frozen=True, slots=True)
class PrintedSettings:
    """How prints come out that nobody has measured, and how poses on prints are corrected.

    Standard deviations: printers are off by .3 % as a rule and .6 % at worst, and backlash and
    shifted layers move symbols by up to .03 mm (`docs/printed.md`).
    """

    scale: float = 0.004  #: of what both axes have in common
    apart: float = 0.002  #: of the difference between the two
    skew_rad: float = 0.001
    aside_mm: float = 0.02  #: each way, of the place of symbols, beyond scale and skew
    step: float = 1e-6  #: of scales and skew, of the differences that stand for derivatives
