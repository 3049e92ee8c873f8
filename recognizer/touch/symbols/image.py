"""The image that is fitted, and its gain: the force on a plateau, all over the sensor.

Signal -> Image. The plate stands at a depth u(x, y) = u0 + ux x + uy y below the tops of the
symbols, a plane over the sensor, in heights of the overlay. A tactel on a symbol gets the force
scale F(u), one over the bare face scale F(u - h), h the height of the symbols; the shape F is the
overlay's: a neo-Hookean tab's (1 - u)^-2 - (1 - u), or a pad's, which stays linear. A gain (4,) is
(logarithm of the scale, depth at the centre, its slopes per half width). It is guessed from the
forces alone, as if symbols stood all over, or as if a part of the sensor came down on the bare
face. A round face falls away under the plane by its curvature. Sensor frame, mm. Thesis 3.3, 4.2,
6.2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.options import ReaderOptions
from recognizer.touch.sensor_state import ASIDE_SD_MM
from recognizer.touch.signal import Signal, combine_around, mean_of_strongest, sorted_around
from recognizer.touch.symbols.kernels import (
    DEEPEST,
    FORM_MOST,
    FULL_PRESS,
    LEAST_GAIN,
    LEAST_PRESS,
    STEEPEST,
    TouchData,
)
from recognizer.touch.symbols.template import PSI, ResponseTemplate, psi

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

STEEPEST_FIRST = 0.9  #: slope over depth of the first guess; `STEEPEST` of all others
USUAL = 0.25  #: heights a usual touch is deep, where the force scale is not known
AROUND = 5  #: tactels, side of a neighbourhood as wide as a symbol
LOW, HIGH = 20.0, 80.0  #: percentiles of it that stand for its lowest and its highest readings
EVEN = 0.3  #: share of the highest that the lowest reach on the bare face
HIGH_ENOUGH = 0.06  #: and share of the highest of all
TOP = 0.8  #: share of the highest around it from which a tactel is on a plateau
FEW = 10  #: tactels of both kinds, at least
WHOLE = 0.95  #: share of the sensor that lies on something, from which no edge is near
#: Heights that strong readings are deep near an edge, as `USUAL` amid faces: of 200 corners a wide
#: search finds 140, under .85 122 (`tactel-8`, own engine, seed 4101).
DEEP = 0.75
#: Gain of a plate that balances over the edge of a face: logarithm of the scale over that of
#: `deep_gain`, depth at the centre, slopes over those of an even bed. Medians at the true places of
#: 300 corners (scale, depth) and 450 edges, 150 of them in MuJoCo (slopes: .20 to .25, spread .08;
#: seeds 4101, 4105).
BALANCED_SCALE, BALANCED_DEPTH, BALANCED_SLOPE = 1.06, 0.78, 0.22
STRONG = 90.0  #: percentile of the highest readings that counts as strong
BARE = 0.05  #: share of the highest that the lowest reach where the bare face is pressed

# Which tactels lie on something. Chosen on touches near corners (own engine, `typical`, seed 105,
# of boxes, wedges and polyhedra with symbols of 5 mm) and on light ones (seed 107): the true place
# explains 80 % of nine tenths of the former, and of as many of the latter as before.
FAINT = 0.04  #: share of the highest around it from which a tactel is pressed ...
SIGMAS = 5.0  #: ... and deviations of the noise, ...
NOISE_MOST = 0.03  #: ... which is no more than so much of the strongest readings


@dataclass(frozen=True, slots=True)
class Pressing:
    """The law of an overlay over symbols of one height."""

    hardens: bool  #: a tab does, a pad is taken as linear
    symbol: float  #: height of the symbols over that of the overlay
    deepest: float  #: heights of the overlay; beyond it F goes on straight
    scale: float  #: N, of a tactel on a plateau, where readings are newtons

    def force(self, depth: Array) -> Array:
        """Return F (0 without contact) at depths in heights of the overlay."""
        above = np.maximum(depth, 0.0)
        if not self.hardens:
            return np.asarray(3.0 * above)
        rest = 1 - np.minimum(above, self.deepest)
        beyond = np.maximum(depth - self.deepest, 0.0) * _stiffness(self.deepest)
        return np.asarray(rest**-2 - rest + beyond)

    def slope(self, depth: Array) -> Array:
        """Return dF/du, 0 without contact."""
        if not self.hardens:
            return np.where(depth > 0, 3.0, 0.0)
        return np.where(depth > 0, _stiffness(np.clip(depth, 0.0, self.deepest)), 0.0)

    def depth(self, force: Array) -> Array:
        """Return the depths of forces F, at most `deepest`."""
        if not self.hardens:
            return np.asarray(force / 3.0)
        return np.asarray(np.interp(force, *_forces_by_depth(self)))


def pressing_of(sensor: SensorType, height_mm: float) -> Pressing:
    """Return how a sensor's overlay presses symbols of a height."""
    overlay = sensor.overlay
    if overlay.kind == "tab":
        area = math.pi * overlay.tab_diameter_mm**2 / 4
    else:
        area = sensor.pitch_mm**2
    return Pressing(
        hardens=overlay.kind == "tab",
        symbol=height_mm / overlay.height_mm,
        deepest=DEEPEST,
        scale=overlay.young_mpa / 3.0 * area,
    )


@lru_cache(maxsize=16)
def _forces_by_depth(pressing: Pressing) -> tuple[Array, Array]:
    """Return rising forces and their depths."""
    table = np.linspace(0.0, pressing.deepest, 257)
    return pressing.force(table), table


def _stiffness(depth: Array | float) -> Array:
    return np.asarray(2.0 * (1.0 - depth) ** -3 + 1.0)


@dataclass(frozen=True, eq=False)
class Image:
    """One touch as it is fitted to the symbols of one array."""

    points_mm: Array  #: (n, 2) sensor frame; of a round face, as it is unrolled
    forces: Array  #: (n,) newtons, or anything proportional
    trust: Array  #: (n,) 0 ... 1, 0 for bad tactels
    shape: tuple[int, int]  #: rows and columns
    pressing: Pressing
    newtons: bool  #: whether the scale of the pressing is that of the forces
    plane: Array  #: (n, 3) basis of planes: 1, x and y over the half widths
    template: ResponseTemplate
    loaded: NDArray[np.bool_]  #: (n,) where the sensor lies on something
    noise: float = 0.0  #: standard deviation of forces where nothing is felt; 0: it is not one
    aside: Array | float = 1.0  #: (n,) variance of tips' places over that of an unlearned tip
    falls: Array | None = None  #: (1 or b, n) of a round face under b planes, overlay heights
    options: ReaderOptions = field(default_factory=ReaderOptions)
    #: by which numbers of tactels on a cell count less, on a sensor with few tactels to a symbol
    cell_share: float = 1.0

    @cached_property
    def data(self) -> TouchData:
        """The image as the compiled loops take it, without lattices."""
        arrays = {
            "points": (self.points_mm, np.float64), "forces": (self.forces, np.float64),
            "trust": (self.trust, np.float64), "plane": (self.plane, np.float64),
            "loaded": (self.loaded, np.bool_), "drop": (self.falls, np.float64),
            "rimmed": (self.template.rimmed, np.float32),
        }  # fmt: skip
        template, pressing = self.template, self.pressing
        return TouchData.of_image(
            arrays, n=len(self.forces), q=template.order, size=template.size,
            hardens=int(pressing.hardens), falls=0 if self.falls is None else len(self.falls),
            symbol=pressing.symbol, deepest=pressing.deepest, pitch=template.pitch_mm,
            half=template.half_mm, step=template.step_mm, noise=self.noise, limits=self.limits,
            usual_scale=math.log(pressing.scale) if self.newtons else 0.0,
        )  # fmt: skip

    @cached_property
    def reach_mm(self) -> float:
        """Distance from the centre of the tactel that lies farthest out."""
        return float(np.sqrt((self.points_mm**2).sum(axis=1).max()))

    @property
    def limits(self) -> tuple[float, ...]:
        """Largest stroke excess, cross-talk, exponent - 1, scale - 1."""
        return (*FORM_MOST, self.options.scale_most)


def image_of_signal(
    sensor: SensorType,
    signal: Signal,
    template: ResponseTemplate,
    height_mm: float,
    options: ReaderOptions | None = None,
    cell_share: float = 1.0,
) -> Image:
    """Return the image of a touch of symbols of a height.

    The face is taken as flat; `bend_image` gives the same image of a round one.
    """
    points, aside = sensor.centres_mm().reshape(-1, 2), np.ones(signal.forces.size)
    if signal.state is not None:
        points = points + signal.state.aside_mm.reshape(-1, 2)
        learned = signal.state.aside_deviation_mm.reshape(-1, 2) / ASIDE_SD_MM
        aside = (learned**2).mean(axis=1)
    return Image(
        points_mm=points,
        forces=signal.forces.reshape(-1).astype(np.float64),
        trust=signal.trust.reshape(-1).astype(np.float64),
        shape=signal.forces.shape,
        pressing=pressing_of(sensor, height_mm),
        newtons=signal.newtons,
        noise=signal.noise if signal.newtons or sensor.exponent == 1.0 else 0.0,
        plane=np.column_stack([np.ones(len(points)), points / np.array(sensor.half_mm)]),
        template=template,
        options=options or ReaderOptions(),
        cell_share=cell_share,
        aside=aside,
        loaded=find_loaded_area(sensor, signal).reshape(-1),
    )


def bend_image(
    image: Image, sensor: SensorType, bend: Bend, shares: tuple[float, ...] = (1.0,)
) -> Image:
    """Return an image of a flat face as one of a face with a bend, in the axes of the sensor.

    `shares` scale how far the face falls away, for each of the gains under which the image is seen;
    one for all of them.
    """
    height, points = sensor.overlay.height_mm, image.points_mm
    symbol = image.pressing.symbol * height
    return replace(
        image,
        points_mm=bend.unrolled_mm(points, symbol),
        loaded=np.ones_like(image.loaded),  # the curvature says where it falls away
        falls=np.multiply.outer(np.array(shares), bend.raised(symbol).falls_mm(points) / height),
    )


def first_gain(image: Image) -> Array | None:
    """Return the gain (4,) with symbols all over the loaded area; None where nothing presses."""
    basis = image.plane
    root = np.sqrt(image.trust * image.loaded)
    plane = np.linalg.lstsq(
        basis * (root * image.template.ink)[:, None], image.forces * root, rcond=None
    )[0]
    if not (np.isfinite(plane).all() and plane[0] > 0):
        return None
    pressing, usual = image.pressing, np.array(USUAL)
    scale = pressing.scale if image.newtons else plane[0] / float(pressing.force(usual))
    depth = pressing.depth(np.array(plane[0] / scale))
    slopes = plane[1:] / (scale * float(pressing.slope(depth)))
    gain = np.array([math.log(scale), depth, *slopes])
    return np.asarray(bounded_gain(gain[None], STEEPEST_FIRST)[0])


def tilted_gain(image: Image) -> Array | None:
    """Return the gain (4,) of an image in which a part of the bare face is pressed; None if not.

    A plate that tilts over blank ground comes down on the face itself, far deeper than on symbols;
    even the lowest readings of a neighbourhood as wide as a symbol are high there.
    """
    low, high = _percentiles_around(image.forces.reshape(image.shape), AROUND, (LOW, HIGH))
    known = image.trust > 0
    flat = known & (low > EVEN * high) & (low > HIGH_ENOUGH * np.max(high))
    top = known & (low < EVEN / 2 * high) & (image.forces > TOP * high)
    if flat.sum() < FEW or top.sum() < FEW:
        return None
    pressing = image.pressing
    scale = pressing.scale
    if not image.newtons:
        scale = float(np.median(image.forces[top])) / float(pressing.force(np.array(USUAL)))
    depth = pressing.depth(image.forces / scale) + np.where(flat, pressing.symbol, 0.0)
    basis, sure = image.plane, np.sqrt(image.trust * (flat | top))
    plane = np.linalg.lstsq(basis * sure[:, None], depth * sure, rcond=None)[0]
    if not (np.isfinite(plane).all() and plane[0] > 0):
        return None
    return np.asarray(bounded_gain(np.array([[math.log(scale), *plane]]))[0])


def _percentiles_around(forces: Array, around: int, shares: tuple[float, ...]) -> list[Array]:
    """Return percentiles (n,) of the `around` x `around` forces about each tactel, for every share.

    As `scipy.ndimage.percentile_filter(..., mode="nearest")`, whose import takes longer than
    reading a touch.
    """
    ordered = sorted_around(forces, around, mode="edge").reshape(forces.size, -1)
    return [ordered[:, int(around**2 * share / 100.0)] for share in shares]


def bounded_gain(gain: Array, steepest: float = STEEPEST) -> Array:
    """Return gains (b, 4) whose slopes are at most `steepest` times the depth at the centre."""
    slope = np.abs(gain[:, 2:]).sum(axis=1)
    limit = steepest * gain[:, 1]
    factor = np.where(slope > limit, limit / np.maximum(slope, 1e-300), 1.0)
    return np.concatenate([gain[:, :2], gain[:, 2:] * factor[:, None]], axis=1)


def deep_gain(image: Image) -> Array | None:
    """Return the gain (4,) of an image in which symbols and the bare face are pressed.

    A plate over the edge of a face lies on little and tips: it stands two or three times deeper
    than one amid a face and comes down on the bare face around most symbols. About each loaded
    tactel the highest readings are then symbols and the lowest ones the bare face, deeper by the
    height of the symbols: one plane goes through both. `first_gain`, which takes the bare face as
    not touched, ends in another basin.

    None where all of the sensor is loaded, where nothing presses, and where the plane would hang
    over the centre.
    """
    pressing = image.pressing
    known = image.loaded & (image.trust > 0)
    if image.loaded.mean() > WHOLE or known.sum() < FEW:
        return None
    low, high = _percentiles_among(image, known, (LOW, HIGH))
    strong = float(np.percentile(high[known], STRONG))
    if not strong > 0:
        return None
    scale = pressing.scale
    if not image.newtons:
        scale = strong / float(pressing.force(np.array(DEEP)))
    bare = known & (low > BARE * high)
    tops, below = pressing.depth(high[known] / scale), pressing.depth(low[bare] / scale)
    basis = np.concatenate([image.plane[known], image.plane[bare]])
    depth = np.concatenate([tops, below + pressing.symbol])
    plane = np.linalg.lstsq(basis, depth, rcond=None)[0]
    if not plane[0] > 0:
        return None
    return np.asarray(bounded_gain(np.array([[math.log(scale), *plane]]))[0])


def balanced_gain(image: Image) -> Array | None:
    """Return the gain (4,) of a plate pressed at its centre that balances over the loaded area.

    None where `deep_gain` is.

    Forces on an even bed u0 + ux x + uy y over that area A balance about the centre if the integral
    of (1, x, y) (1, x, y)^T over A, times (u0, ux, uy), is along (1, 0, 0). Symbols are no even bed
    and tabs harden, so the plate tilts less.
    """
    deep = deep_gain(image)
    if deep is None:
        return None
    basis = image.plane[image.loaded & (image.trust > 0)]
    even = np.linalg.lstsq(basis.T @ basis, np.array([1.0, 0.0, 0.0]), rcond=None)[0]
    slopes = BALANCED_SLOPE * even[1:] / max(float(even[0]), 1e-9)
    scale = deep[0] + (0.0 if image.newtons else BALANCED_SCALE)
    return np.asarray(bounded_gain(np.array([[scale, BALANCED_DEPTH, *slopes]]))[0])


def _percentiles_among(
    image: Image, known: NDArray[np.bool_], shares: tuple[float, ...]
) -> list[Array]:
    """Return percentiles (n,) of the known forces about each tactel; 0 where none is known."""
    forces = np.where(known, image.forces, np.inf).reshape(image.shape)
    ordered = sorted_around(forces, AROUND, constant_values=np.inf).reshape(known.size, -1)
    count = np.isfinite(ordered).sum(axis=1)
    rows = np.arange(known.size)
    return [
        np.where(count > 0, ordered[rows, (count * share / 100.0).astype(np.int64)], 0.0)
        for share in shares
    ]


def find_loaded_area(sensor: SensorType, signal: Signal) -> Flags:
    """Return (rows, columns) where a sensor lies on something, gaps between strokes closed.

    Beyond the edge of a face nothing is pressed, however deep the plate hangs there; at a corner it
    tips, and a plane through its depths is largest where the readings are least. Gain planes are
    judged by the loaded area; an unloaded tactel only speaks against symbols there.

    All tactels where nothing rises over the noise, and under a pad or a gel, which smear the gaps
    between strokes.
    """
    everywhere = np.ones(signal.forces.shape, np.bool_)
    if sensor.overlay.kind != "tab":
        return everywhere
    forces = np.where(signal.trust > 0, signal.forces, 0.0)
    strongest = mean_of_strongest(forces)
    noise = min(signal.noise, NOISE_MOST * strongest)
    reach = AROUND // 2
    high = combine_around(forces, reach, np.maximum)
    least = np.maximum(FAINT * high, SIGMAS * noise)
    near = combine_around(forces > least, reach, np.logical_or)
    closed = combine_around(near, reach, np.logical_and)
    return closed if closed.any() else everywhere


@dataclass(frozen=True, slots=True)
class NormalizedImage:
    """An image under gain planes: b planes, n tactels."""

    psi: Array  #: (b, n) of the forces over the gain
    press: Array  #: (b, n) 0 ... 1, how hard the plane presses; 1 where it does as in the middle
    bare: Array  #: (b, n) force over the bare face, as a share of that on a symbol
    contact: Array  #: (b, n) 1, falling to 0 where the sensor hangs in the air
    trust: Array  #: (n,)
    forces: Array  #: (n,) of the image
    depth: Array  #: (b, n) of the plate below the tops of the symbols, heights of the overlay
    plain: Array  #: (b, n) F of `pressing` there
    lower: Array  #: (b, n) and over the bare face
    plateau: Array  #: (b, n) force on a plateau, no less than where the sensor hangs in the air
    faint: Array  #: (b, n) noise of the readings as a share of that force

    @property
    def measure(self) -> Array:
        """Return (b,) sums of log |d psi / d force|: they make planes of other gain comparable."""
        return -np.asarray((self.trust * np.log(self.plateau + PSI * self.forces)).sum(axis=1))


def normalize_image(image: Image, gain: Array) -> NormalizedImage:
    """Return the image under gains (b, 4)."""
    depth = gain[:, 1:] @ image.plane.T
    if image.falls is not None:
        depth = depth - image.falls
    plain = image.pressing.force(depth)
    lower = image.pressing.force(depth - image.pressing.symbol)
    least = LEAST_GAIN * plain[:, image.loaded].max(axis=1, keepdims=True)
    # what the plane would press where nothing lies is no word about it, however deep it stands
    scale, loaded = np.exp(gain[:, :1]), image.loaded
    plateau = np.where(loaded, scale * np.maximum(plain, least), image.forces.max())
    share = plateau / scale
    usual = gain[:, 1:] @ image.plane[image.loaded].mean(axis=0)
    press = depth / (FULL_PRESS * np.maximum(usual, 1e-9))[:, None]
    return NormalizedImage(
        psi=psi(image.forces / plateau),
        press=np.minimum(np.maximum(press, LEAST_PRESS), 1.0),
        bare=np.where(loaded, lower / share, 0.0),
        contact=np.minimum(np.maximum(plain / least, 0.0), 1.0),
        trust=image.trust,
        forces=image.forces,
        depth=depth,
        plain=plain,
        lower=lower,
        plateau=plateau,
        faint=image.noise / plateau,
    )
