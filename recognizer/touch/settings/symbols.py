"""Numbers of the symbols in an image: responses, gain, noise, search, refinement, spread.

Units as in `recognizer.touch.settings`.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Between a symbol and none where rounding decides: of a cell that is seen by its rim alone.
TIE_NATS = 1e-4


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
    whole: float = 0.95  #: share of the sensor that lies on something, from which no edge is near
    deep: float = 0.65  #: heights that strong readings are deep near an edge, as `usual` amid faces
    strong_percent: float = 90.0  #: percentile of the highest readings that counts as strong
    bare: float = 0.05  #: share of the highest that the lowest reach where the bare face is pressed


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
    grazed: float = 1e-6  #: psi up to which nothing is felt: what rounding leaves of none
    tie: float = TIE_NATS  #: by which a symbol is likelier than none, at least


@dataclass(frozen=True, slots=True)
class SearchSettings:
    """The coarse search; work grows with rotations (phases^2 + shifts^2)."""

    rotations: int = 72  #: over the full turn, an even number
    phases: int = 2  #: places per tactel along each axis
    shifts: int = 10  #: of the lattice along each axis
    rim: float = 1.0  #: tactels beyond the matrix at which a symbol's centre may lie
    reach: float = 1.1  #: of a template's half width that kernels cover
    nothing: float = 1e-9  #: response below which it is what rounding leaves of none
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
