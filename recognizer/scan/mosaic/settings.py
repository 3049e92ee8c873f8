"""Numbers that decide how touches are compared, placed and laid. Thesis 4.3.

One frozen value a stage. How touches are tied to each other is `mosaic.MosaicSettings`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PlanarSettings:
    """Which poses lie in the plane."""

    steepest_cos: float = 0.5
    """A sensor turned further than 60 degrees from the plane does not face it."""


@dataclass(frozen=True, slots=True)
class PatchSettings:
    """How an image becomes a function."""

    smoothing: float = 0.4  #: tactels; none to .4 register equally well, .5 and more worse
    texture: float = 0.8  #: tactels; smooths over the gaps between tabs (`texture`)
    least_trust: float = 0.5  #: below, a tactel counts as bad


@dataclass(frozen=True, slots=True)
class TextureSettings:
    """Which motions of an image are seen."""

    least: float = 0.05  #: of the image's variance, for one tactel; ridges <= .02, symbols >= .12
    askew_rad: float = 0.1  #: of the motions' directions; measured: .07
    stiff: float = 1e6  #: 1/tactel^2
    least_change: float = 1e-9  #: variance of an image, in a patch's unit, that shows any motion


@dataclass(frozen=True, slots=True)
class CanvasSettings:
    """Cells, and what a touch says on them."""

    magnified: int = 4  #: cells to a tactel, the thesis's 64 by 64
    tile: int = 64  #: cells, as wide as a touch of 16 tactels
    floor: float = 0.03  #: least standard deviation of a reading, share of the upper level


@dataclass(frozen=True, slots=True)
class CorrelationSettings:
    """Where a correlation is defined."""

    flat: float = 1e-10  #: of the sum of squares: rounding


@dataclass(frozen=True, slots=True)
class ImageSearchSettings:
    """When a place is told from the images."""

    sigmas: float = 3.0  #: half width of the window, standard deviations of the belief
    contrast: float = 0.15  #: least spread of a patch, planes taken out, in its upper levels
    overlap: float = 0.2  #: least share of the matrix
    significance: float = 8.0  #: nats over what the best of as many shifts of noise gives
    margin: float = 3.0  #: nats over the next place, in a window within half a period
    margin_beyond: float = 8.0  #: the same in a wider window
    best: float = 0.94  #: correlation that true places have; more of it is chance, not evidence
    independent: float = 0.4  #: readings to a tactel: smoothing constraints neighbours together
    enough: float = 96.0  #: tactels of overlap, beyond which more do not count
    candidates: int = 6  #: maxima that are looked at
    near_tactels: float = 0.4  #: windows no wider than this need no search


@dataclass(frozen=True, slots=True)
class LucasKanadeSettings:
    """Least squares of two images."""

    steps: int = 12  #: at most
    reach: float = 1.0  #: tactels from the start; what is found further away is something else
    least: int = 40  #: tactels of each image over the other
    floor: float = 0.02  #: least standard deviation of a reading, share of the upper level
    inflation: float = 2.6
    """Of the variance: what aliases is not independent; measured on encoded faces."""
    cut: float = 6.0  #: standard deviations from which a reading counts ever less
    farthest: float = 0.4  #: tactels in one step
    widest_rad: float = 0.1  #: in one step
    done: float = 2e-3  #: tactels, a step under which is the last one
    slope: float = 0.5  #: standard deviation of the gain's slope, over the half width


@dataclass(frozen=True, slots=True)
class GraphSettings:
    """Least squares of all constraints."""

    free: float = 16.0  #: chi^2 of three numbers from which a constraint is doubted
    outlier: float = 0.5  #: s^2 under which it is reported
    least: float = 1e-4  #: s^2 of a constraint that is let go; keeps everything somewhere
    steps: int = 30  #: at most
    done_mm: float = 1e-4  #: of x and y: a step under both is the last one
    done_rad: float = 1e-6  #: of turns
    at_once: int = 64  #: poses whose covariances are solved for together


@dataclass(frozen=True, slots=True)
class GrowSettings:
    """When touches are tried or laid again, and how gains are evened out."""

    relaid: float = 0.2  #: tactels, under one cell, by which a touch moves before it is laid anew
    rounds: int = 3  #: in which touches are tried again
    spread_log: float = 0.5  #: of gains, standard deviation from touch to touch
    sure_log: float = 0.05  #: of gains, standard deviation by a pair


PLANAR, PATCH, TEXTURE = PlanarSettings(), PatchSettings(), TextureSettings()
CANVAS = CanvasSettings()
CORRELATION, LUCAS_KANADE = CorrelationSettings(), LucasKanadeSettings()
GRAPH, GROW = GraphSettings(), GrowSettings()
