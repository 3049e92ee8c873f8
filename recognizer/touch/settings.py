"""Every number that decides how a touch is read: one frozen value, a part for each stage.

Lengths in mm, angles in rad, forces in N, log-likelihoods in nats; "tactels" are pitches of the
sensor, "heights" those of the overlay. Where nothing else is said a value was chosen with the
others on simulated touches of the 40 objects of `docs/validation/forty.yaml` (typical noise and
strong mismatch; `tests/bench/recognizer_times.py` shows error against time), not measured alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class SignalSettings:
    """What of a frame is contact, background, or a dead line."""

    contact_counts: float = 8.0  #: over the background by which the strongest tactels rise
    quiet_sigmas: float = 6.0  #: and standard deviations of the type's noise, where that is more
    contact_n: float = 0.05  #: the same where readings are newtons
    contact_sigmas: float = 7.0  #: the same where they are on another scale: deviations of noise
    strongest: int = 6  #: tactels that must; a spike is one
    background: float = 0.05  #: share of the tactels below the reading that a contact rises over
    lowest: float = 0.6  #: share of the tactels among which the background is sought ...
    densest: float = 0.4  #: ... where so many of them read most alike, and ...
    fifth: float = 0.2  #: ... no higher over the reading that `background` names ...
    above: float = 1.4  #: ... than so many times as this share of the tactels is
    strong: float = 0.95  #: share of the tactels below the reading that stands for strokes ...
    tail: float = 1.6  #: ... that rise over the middle so many times as this does over the
    #: lowest, unless a bare plate is felt: .9-1.6 at 20-120 N; symbols 1.6-3 from 4 N on
    dead: float = 0.02  #: of the median row (column): one below it is dead ...
    beside: float = 0.3  #: ... if both its neighbours are above this share


@dataclass(frozen=True, slots=True)
class ContactSettings:
    """When frames are one touch, and when it is read."""

    alike: float = 0.6  #: correlation of images of one touch; of two places it is below 0.3
    steady: float = 0.05  #: share by which sums may be off that of the first frame averaged
    still: float = 0.9  #: correlation with it
    few: int = 5  #: frames that make a touch steady
    enough: int = 22  #: frames that are averaged, 0.1 s at 220 frames a second
    fragments: int = 64  #: unlike images without a steady one from which each is a touch


@dataclass(frozen=True, slots=True)
class LabSettings:
    """How the registered cells are kept, and which radii of round faces are told apart."""

    dense: int = 1 << 22  #: arrays of at most so many cells are looked up in a table (16 MB)
    least_mm: float = 15.0  #: smallest radius that is looked for
    most_mm: float = 400.0  #: largest: it falls 0.2 mm away at the sensor's rim
    finer: float = 1.35  #: from one radius to the next


@dataclass(frozen=True, slots=True)
class TemplateSettings:
    """What a tactel feels of a symbol."""

    step_mm: float = 0.05  #: grid of the tables; positions are off by 0.025 mm at most
    bulge: float = 0.59  #: F(c)/F(1) = c (1 + bulge (1 - c)) of a tip covered by the share c
    penetration_mm: float = 0.4  #: of the plateau into the overlay, for the felt part of a wall
    wider_mm: float = 0.1  #: unit of the fitted stroke width
    cross_talk: float = 0.12  #: of a reading that neighbours get; twice that at the far end
    low: float = 0.7  #: exponents between which the slope by the force law's is taken
    high: float = 1.1
    gel_peak: float = 100.0  #: percentile of a gel's imprints that counts as 1
    pad_peak: float = 98.0  #: percentile of a pad's responses that counts as 1
    pad_fine: int = 20  #: tactels to a pitch when a pad is pressed
    pad_cells: int = 2  #: pitches pressed: half a cell beyond the one that is kept, each side
    pad_among: int = 3  #: arrangements of neighbours over which a symbol is averaged
    pad_light: float = 0.05  #: mean pressure over Young's modulus: the pad is taken as linear


@dataclass(frozen=True, slots=True)
class GainSettings:
    """Of the plane of depths under the force scale."""

    deepest: float = 0.8  #: heights beyond which the overlay's law goes on straight
    steepest: float = 1.7  #: slope over depth; over 1 a part of the sensor hangs in the air
    steepest_first: float = 0.9  #: the same of the first guess
    usual: float = 0.25  #: heights a usual touch is deep, where the scale is not known
    least_press: float = 0.2  #: of a tactel where the plane presses little or not at all
    full_press: float = 0.5  #: of the depth at the centre, from which a tactel counts whole
    least_gain: float = 0.12  #: of the largest: below it a tactel tells nothing of symbols
    around: int = 5  #: tactels, side of a neighbourhood as wide as a symbol
    low_percent: float = 20.0  #: percentiles of it that stand for its lowest ...
    high_percent: float = 80.0  #: ... and highest readings
    even: float = 0.3  #: share of the highest that the lowest reach on the bare face
    high: float = 0.06  #: and share of the highest of all
    top: float = 0.8  #: share of the highest around it from which a tactel is on a plateau
    few: int = 10  #: tactels of both kinds, at least


@dataclass(frozen=True, slots=True)
class LoadedAreaSettings:
    """Which tactels lie on something.

    Chosen on touches near corners (own engine, `typical`, seed 105, of boxes, wedges and polyhedra
    with symbols of 5 mm) and on light ones (seed 107): the true place explains 80 % of nine tenths
    of the former, and of as many of the latter as before.
    """

    around: int = 5  #: tactels, side of the square that closes gaps between strokes
    faint: float = 0.04  #: share of the highest around it from which a tactel is pressed ...
    sigmas: float = 5.0  #: ... and deviations of the noise, ...
    quiet: float = 0.03  #: ... which is no more than so much of the strongest readings ...
    strongest: int = 12  #: ... of so many tactels


@dataclass(frozen=True, slots=True)
class NoiseSettings:
    """How far readings lie from what they should be; psi of `symbols.template`."""

    first: float = 0.15  #: deviation of psi on a covered tactel, until it is known better
    least: float = 0.05  #: below it a fit is not believed
    quiet: float = 0.8  #: deviation where nothing is felt, against a covered tactel
    displaced_mm: float = 1.0  #: slopes count by this much, in the same measure
    most: float = 8.0  #: nats that one tactel can cost: a dead one or a spike
    loud: float = 0.03  #: noise of readings over the force on a plateau, from which it counts
    hidden: float = 0.5  #: most of an image's variance that is taken for that noise
    above: float = 0.5  #: share of it that is seen where nothing is felt: no force is negative
    far: float = 4.0  #: deviations beyond which a tactel neither pulls nor counts as noise


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """The coarse search; work grows with rotations (phases^2 + shifts^2)."""

    rotations: int = 72  #: over the full turn
    phases: int = 2  #: places per tactel along each axis
    shifts: int = 10  #: of the lattice along each axis
    rim: float = 1.0  #: tactels beyond the matrix at which a symbol's centre may lie
    reach: float = 1.1  #: of a template's half width that kernels cover
    least_rest: float = 0.1  #: of a tactel's force that is left beside the bare face's
    same_shift: float = 0.08  #: pitches by which two lattices that are one may differ
    same_turn: float = 0.02  #: and half turns


@dataclass(frozen=True, slots=True)
class RefineSettings:
    """Damped least squares over (x, y, theta, width, cross-talk, exponent, scale; gain (4,))."""

    damping: float = 0.01  #: of the first step
    easier: float = 3.0  #: divides it after a step that helps
    harder: float = 8.0  #: multiplies it after one that does not
    settled: float = 0.5  #: nats by which a step may change what is taken as found
    #: largest changes in one step
    step: tuple[float, ...] = (1.0, 1.0, 0.08, 0.5, 0.5, 0.15, 0.01, 0.3, 0.1, 0.1, 0.1)
    #: added to the diagonal of the normal matrix
    least: tuple[float, ...] = (1.0, 1.0, 100.0, 0.1, 0.1, 0.1, 10.0, 1.0, 10.0, 10.0, 10.0)
    #: standard deviations known beforehand; 0: nothing is
    prior: tuple[float, ...] = (0.0, 0.0, 0.0, 0.6, 0.4, 0.2, 0.01)
    scale_known: float = 0.3  #: of the log of the force scale, where forces are in newtons
    #: of width (tenths of a mm), cross-talk, exponent - 1, scale - 1
    limits: tuple[float, ...] = (1.2, 0.7, 0.4, 0.03)
    shallower: float = 0.3  #: least share of the depth that a step leaves
    deepest: float = 0.9  #: heights, the largest depth


@dataclass(frozen=True, slots=True)
class StretchSettings:
    """How the stretch of one touch is fitted, where it is asked for: scale both ways and skew."""

    steps: int = 8  #: of damped least squares, at most
    settled: float = 0.01  #: nats by which a step may change what is taken as found
    largest: float = 0.15  #: of scale - 1 and of both unknowns of the shear
    widest: float = 2.5  #: tenths of a mm, of the stroke's excess
    step: tuple[float, float] = (0.01, 0.01)  #: largest change in one step
    least: tuple[float, float] = (10.0, 10.0)  #: added to the diagonal of the normal matrix


@dataclass(frozen=True, slots=True)
class CovarianceSettings:
    """By how much the fit's own covariance is too small.

    Measured against simulated touches of all contact levels: on faces 95-97 % of the errors lie
    within the 95 % ellipse (`docs/recognizer.md`, "How sure it is").
    """

    pad: float = 1.18  #: times the variance under a pad, neighbours that err alike counted
    tab: float = 0.6  #: times the variance under tabs ...
    strange: float = 0.025  #: ... and with the fourth power of the form's distance from known
    unseen: float = 1e-8  #: least eigenvalue of a normal matrix of unit diagonal
    size: float = 1.1  #: times the variance of an answer's pose (`symbols.posterior`) ...
    blurred: float = 2.5  #: ... and more by this, for what readings hold of their neighbours ...
    usual_blur: float = 0.12  #: ... beyond this share
    #: times the variance more, for each unit by which the squared distance of the form (width,
    #: cross-talk, exponent) from what was known beforehand, in deviations, exceeds the usual ...
    form: float = 0.25
    usual_form: float = 5.0  #: ... 4.7 in own simulation, 8.8 in MuJoCo (medians)


@dataclass(frozen=True, slots=True)
class SpreadSettings:
    """How far readings of a sensor scatter, until a touch tells it (`symbols.spread`)."""

    felt: float = 0.08  #: deviation of psi on a covered tactel
    aside_mm: float = 0.08  #: of a tip's place, each way
    touches: float = 4.0  #: tactels that these two weigh as much as
    freedom: float = 8.0  #: of Student's distribution of errors
    rounds: int = 6  #: of expectation and maximisation, at each step
    unseen: float = 1e-8  #: as that of `CovarianceSettings`


@dataclass(frozen=True, slots=True)
class PosteriorSettings:
    """The last fit of an answer: a lattice, and what a sensor adds to its image."""

    steps: int = 2  #: of damped least squares
    offset: float = 0.05  #: of the largest reading: deviation of what all readings have too much
    blur: float = 0.05  #: deviation of the share of each neighbour in a reading
    #: largest changes of offset (of the largest reading) and of the blur both ways in one step
    step: tuple[float, float, float] = (0.1, 0.05, 0.05)
    #: added to the diagonal of the normal matrix for these
    least: tuple[float, float, float] = (0.01, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class FitSettings:
    """How much work the fit spends."""

    candidates: int = 2  #: lattices taken from the coarse search
    steps: int = 2  #: Gauss-Newton steps of all of them
    finalists: int = 1  #: lattices that are refined to the end
    final_steps: int = 2
    crossed: int = 0  #: gains that are tried on all lattices, and these turned by quarters


@dataclass(frozen=True, slots=True)
class HypothesisSettings:
    """Which registered places are looked at, and what a cell may cost one of them."""

    kept: int = 8  #: verified at most, two at least
    near: float = 14.0  #: nats below the best within which they are
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

    margin: float = 10.0  #: nats over the best other place
    margin_by_few: float = 14.0  #: the same where fewer than `many_inliers` cells speak ...
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
    whole: float = 6.0  #: tactels that look at a cell which counts as seen
    #: tactels to a symbol below which numbers of tactels shrink with the square of the share: 8x8
    #: at 3 mm, 7 mm symbols, 40 typical touches mid-face, 0 wrong: 38 answered, 0 without it
    coarse: float = 8.0
    rim_mm: float = 2.0  #: how far the sensor's centre may lie beyond the face
    #: registered places that foreign symbols may match as well by chance: of 395 right answers
    #: among 20,880 places of 5 mm it refuses 5, all at edges (`tests/campaigns/other_labs.py`)
    doubt: float = 1e-4
    grain: float = 0.25  #: nats to which scores are rounded where that is counted


@dataclass(frozen=True, slots=True)
class BendSettings:
    """How line and radius of a round face are told from forces alone."""

    directions: int = 18  #: of lines, over half a turn
    steps: int = 6  #: of damped least squares
    damping: float = 0.01  #: of the first one
    easier: float = 3.0  #: divides it after a step that helps
    harder: float = 6.0  #: multiplies it after one that does not
    around: int = 5  #: tactels, side of the square over which forces are averaged
    apart: float = 0.35  #: rad by which two bends of one radius differ
    first: float = 0.45  #: depth, heights of the overlay: to begin with,
    least: float = 0.08  #: at least,
    most: float = 0.8  #: and at most
    step: float = 0.2  #: largest change of a step
    faint: float = 0.03  #: root of a response below which its slope is not trusted


@dataclass(frozen=True, slots=True)
class RoundSettings:
    """How places on round faces are verified (`tests/bench/round_faces.py`)."""

    bends: int = 2  #: that an image is read under
    thorough_bends: int = 5  #: the same at the second try
    #: of each bend at the second try: several bends see to what several gains do on a flat face
    each_bend: FitSettings = FitSettings(candidates=8, steps=3, finalists=3, final_steps=4)
    #: factors by which a face is taken to fall away less: a force law that rises less than the
    #: one that is taken makes a strip look so
    shares: tuple[float, ...] = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
    first_shares: tuple[float, ...] = (0.65, 0.8, 1.0)  #: of the first round of verifying
    turned_rad: float = 0.5  #: by which lines at a place may differ from those the image shows
    radii: float = 2.5  #: factor by which radii may
    same_rad: float = 0.05  #: within which two bends are taken as one
    same_radii: float = 1.1


@dataclass(frozen=True, slots=True)
class FirstLookSettings:
    """Which touches are refused before a search, or before a wide one.

    Chosen with pitches of 5 mm (seed 902) and 5.5 mm (720 touches of faulty sensors): of 1,008
    touches of registered faces none had fewer gaps than .30, of 112 of a blank plate nine in ten
    fewer than .275; of 583 that the first try did not answer, six were answered by the wide search,
    all of them with 94 tactels pressed or more and 2 nats over symbols of no registered place.
    """

    strongest: int = 12  #: tactels that say how hard is pressed
    pressed: float = 0.15  #: share of that from which a tactel is pressed
    around: int = 5  #: tactels, side of a square in which strokes and gaps lie
    high: float = 0.85  #: quantile of its readings that stands for strokes
    weak: float = 0.35  #: share of that below which a tactel lies over a gap
    gaps: float = 0.285  #: share of such tactels below which nothing is embossed
    finest: float = 3.1  #: tactels, pitches between which gaps were measured
    coarsest: float = 5.0
    ink: float = 0.44  #: share of a cell's tactels that its symbol presses, and some beside it
    foreign: float = -4.0  #: nats over symbols of no registered place


@dataclass(frozen=True, slots=True)
class NextSettings:
    """Which steps are weighed, and what they are worth (`tests/campaigns/next_touch.py`)."""

    lengths_mm: tuple[float, ...] = (4.0, 7.0, 10.0, 14.0)  #: of steps
    directions: int = 16  #: of steps
    turns_rad: tuple[float, ...] = (0.0, math.pi / 4)  #: a row of symbols fits along a diagonal
    force_n: float = 80.0  #: at which touches are read best
    strongest: int = 12  #: tactels that say how hard is pressed
    faint: float = 0.08  #: share of that from which a tactel lies on something ...
    least_counts: float = 16.0  #: ... and readings over the background: less is noise
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
    margin: float = 14.0  #: nats below which an answer had better be confirmed
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


@dataclass(frozen=True, slots=True)
class ReaderSettings:
    """All numbers that decide in `recognizer.touch`.

    Examples
    --------
    >>> ReaderSettings().belief.margin
    10.0
    >>> ReaderSettings(belief=BeliefSettings(margin=20.0)).belief.surprise
    3.0
    """

    lab: LabSettings = field(default_factory=LabSettings)
    signal: SignalSettings = field(default_factory=SignalSettings)
    contacts: ContactSettings = field(default_factory=ContactSettings)
    template: TemplateSettings = field(default_factory=TemplateSettings)
    gain: GainSettings = field(default_factory=GainSettings)
    loaded: LoadedAreaSettings = field(default_factory=LoadedAreaSettings)
    noise: NoiseSettings = field(default_factory=NoiseSettings)
    search: SearchSettings = field(default_factory=SearchSettings)
    refine: RefineSettings = field(default_factory=RefineSettings)
    stretch: StretchSettings = field(default_factory=StretchSettings)
    covariance: CovarianceSettings = field(default_factory=CovarianceSettings)
    spread: SpreadSettings = field(default_factory=SpreadSettings)
    posterior: PosteriorSettings = field(default_factory=PosteriorSettings)
    first: FitSettings = field(default_factory=FitSettings)  #: the first try
    #: the second, of touches that the first does not answer or that few cells speak for: seven
    #: times the work (`docs/recognizer.md`)
    thorough: FitSettings = FitSettings(12, 4, 6, 6, crossed=3)
    hypotheses: HypothesisSettings = field(default_factory=HypothesisSettings)
    belief: BeliefSettings = field(default_factory=BeliefSettings)
    bends: BendSettings = field(default_factory=BendSettings)
    round: RoundSettings = field(default_factory=RoundSettings)
    printed: PrintedSettings = field(default_factory=PrintedSettings)
    first_look: FirstLookSettings = field(default_factory=FirstLookSettings)
    next: NextSettings = field(default_factory=NextSettings)


#: As the reader is, if nothing else is asked for.
DEFAULTS = ReaderSettings()
