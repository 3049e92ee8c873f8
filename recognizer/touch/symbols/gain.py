"""The image that is fitted, and its gain: what a plateau would read, all over the sensor.

A gain is a plane of depths under a force scale (`pressing`): (logarithm of the scale, depth at
the centre, its slopes per half width). It is guessed from the forces alone, as if symbols
stood all over, or as if a part of the sensor came down on the bare face. A round face falls
away under the plane by what its bend tells. Sensor frame, mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from generator.database.registered import Bend
from recognizer.touch.sensor_state import PRIOR
from recognizer.touch.settings import DEFAULTS, ReaderSettings
from recognizer.touch.signal import Signal
from recognizer.touch.symbols.loaded_area import find_loaded_area
from recognizer.touch.symbols.noise import NormalizedImage
from recognizer.touch.symbols.pressing import Pressing, pressing_of
from recognizer.touch.symbols.template import psi

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Image:
    """What is fitted: forces of the tactels that tell something."""

    points_mm: Array  #: (n, 2) sensor frame; of a round face, as it is unrolled
    forces: Array  #: (n,) newtons, or anything proportional
    trust: Array  #: (n,) 0 ... 1, 0 for bad tactels
    shape: tuple[int, int]  #: rows and columns
    pressing: Pressing
    newtons: bool  #: whether the scale of the pressing is that of the forces
    plane: Array  #: (n, 3) basis of planes: 1, x and y over the half widths
    settings: ReaderSettings
    loaded: NDArray[np.bool_]  #: (n,) where the sensor lies on something, `loaded_area`
    noise: float = 0.0  #: standard deviation of forces where nothing is felt; 0: it is not one
    aside: Array | float = 1.0  #: (n,) variance of tips' places over that of an unlearned tip
    falls: Array | None = None  #: (1 or b, n) of a round face under b planes, overlay heights


def image_of_signal(
    sensor: SensorType, signal: Signal, height_mm: float, settings: ReaderSettings = DEFAULTS
) -> Image:
    """Return what is fitted of a touch of symbols of a height.

    The face is taken as flat; `bend_image` gives the same image of a round one.
    """
    points, aside = sensor.centres_mm().reshape(-1, 2), np.ones(signal.forces.size)
    if signal.state is not None:
        points = points + signal.state.aside_mm.reshape(-1, 2)
        learned = signal.state.aside_deviation_mm.reshape(-1, 2) / PRIOR.aside_mm
        aside = (learned**2).mean(axis=1)
    return Image(
        points_mm=points,
        forces=signal.forces.reshape(-1).astype(np.float64),
        trust=signal.trust.reshape(-1).astype(np.float64),
        shape=signal.forces.shape,
        pressing=pressing_of(sensor, height_mm, settings.gain),
        newtons=signal.newtons,
        noise=signal.noise if signal.newtons or sensor.exponent == 1.0 else 0.0,
        plane=np.column_stack([np.ones(len(points)), points / np.array(sensor.half_mm)]),
        settings=settings,
        aside=aside,
        loaded=find_loaded_area(sensor, signal, settings.loaded).reshape(-1),
    )


def bend_image(
    image: Image, sensor: SensorType, bend: Bend, shares: tuple[float, ...] = (1.0,)
) -> Image:
    """Return an image of a flat face as one of a face with a bend, in the axes of the sensor.

    Parameters
    ----------
    shares
        By how much less than the bend says the face falls away, of each of the gains under
        which the image is seen; one for all of them.
    """
    height, points = sensor.overlay.height_mm, image.points_mm
    symbol = image.pressing.symbol * height
    return replace(
        image,
        points_mm=bend.unrolled_mm(points, symbol),
        loaded=np.ones_like(image.loaded),  # where it falls away is told by the bend
        falls=np.multiply.outer(np.array(shares), bend.raised(symbol).falls_mm(points) / height),
    )


def first_gain(image: Image, ink: float) -> Array | None:
    """Return the gain (4,) of an image with symbols of mean response `ink` all over what is loaded.

    None where nothing presses.
    """
    basis = image.plane
    root = np.sqrt(image.trust * image.loaded)
    plane = np.linalg.lstsq(basis * (root * ink)[:, None], image.forces * root, rcond=None)[0]
    if not (np.isfinite(plane).all() and plane[0] > 0):
        return None
    pressing, usual = image.pressing, np.array(image.settings.gain.usual)
    scale = pressing.scale if image.newtons else plane[0] / float(pressing.force(usual))
    depth = pressing.depth(np.array(plane[0] / scale))
    slopes = plane[1:] / (scale * float(pressing.slope(depth)))
    gain = np.array([math.log(scale), depth, *slopes])
    return np.asarray(bounded_gain(gain[None], image.settings.gain.steepest_first)[0])


def tilted_gain(image: Image) -> Array | None:
    """Return the gain (4,) of an image in which a part of the bare face is pressed; None if not.

    Where a plate tilts over blank ground it comes down on the face itself, far deeper than on
    symbols. There even the lowest readings of a neighbourhood as wide as a symbol are high.
    """
    settings, forces = image.settings.gain, image.forces.reshape(image.shape)
    shares = (settings.low_percent, settings.high_percent)
    low, high = _percentiles_around(forces, settings.around, shares)
    known = image.trust > 0
    flat = known & (low > settings.even * high) & (low > settings.high * np.max(high))
    top = known & (low < settings.even / 2 * high) & (image.forces > settings.top * high)
    if flat.sum() < settings.few or top.sum() < settings.few:
        return None
    pressing = image.pressing
    scale = pressing.scale
    if not image.newtons:
        scale = float(np.median(image.forces[top])) / float(
            pressing.force(np.array(settings.usual))
        )
    depth = pressing.depth(image.forces / scale) + np.where(flat, pressing.symbol, 0.0)
    basis, sure = image.plane, np.sqrt(image.trust * (flat | top))
    plane = np.linalg.lstsq(basis * sure[:, None], depth * sure, rcond=None)[0]
    if not (np.isfinite(plane).all() and plane[0] > 0):
        return None
    return np.asarray(bounded_gain(np.array([[math.log(scale), *plane]]), settings.steepest)[0])


def _percentiles_around(forces: Array, around: int, shares: tuple[float, ...]) -> list[Array]:
    """Return a percentile of the forces about each tactel (n,), for every share.

    Of the `around` x `around` tactels about it, beyond the rim those on the rim, the one of that
    rank; as `scipy.ndimage.percentile_filter(..., mode="nearest")`, whose import takes longer than
    reading a touch.
    """
    before = around // 2
    wide = np.pad(forces, (before, around - 1 - before), mode="edge")
    each = np.lib.stride_tricks.sliding_window_view(wide, (around, around))
    ordered = np.sort(each.reshape(forces.size, around**2), axis=1)
    return [ordered[:, int(around**2 * share / 100.0)] for share in shares]


def bounded_gain(gain: Array, steepest: float) -> Array:
    """Return gains (b, 4) whose slopes are at most `steepest` times the depth at the centre."""
    slope = np.abs(gain[:, 2:]).sum(axis=1)
    limit = steepest * gain[:, 1]
    factor = np.where(slope > limit, limit / np.maximum(slope, 1e-300), 1.0)
    return np.concatenate([gain[:, :2], gain[:, 2:] * factor[:, None]], axis=1)


def normalize_image(image: Image, gain: Array) -> NormalizedImage:
    """Return the image as it is under gains (b, 4)."""
    settings = image.settings.gain
    depth = gain[:, 1:] @ image.plane.T
    if image.falls is not None:
        depth = depth - image.falls
    plain = image.pressing.force(depth)
    lower = image.pressing.force(depth - image.pressing.symbol)
    least = settings.least_gain * plain[:, image.loaded].max(axis=1, keepdims=True)
    # what the plane would press where nothing lies is no word about it, however deep it stands
    scale, loaded = np.exp(gain[:, :1]), image.loaded
    plateau = np.where(loaded, scale * np.maximum(plain, least), image.forces.max())
    share = plateau / scale
    usual = gain[:, 1:] @ _mean_plane(image)
    press = depth / (settings.full_press * np.maximum(usual, 1e-9))[:, None]
    return NormalizedImage(
        psi=psi(image.forces / plateau),
        press=np.minimum(np.maximum(press, settings.least_press), 1.0),
        bare=np.where(loaded, lower / share, 0.0),
        contact=np.minimum(np.maximum(plain / least, 0.0), 1.0),
        trust=image.trust,
        forces=image.forces,
        depth=depth,
        plain=plain,
        lower=lower,
        plateau=plateau,
        faint=image.noise / plateau,
        settings=image.settings.noise,
    )


@lru_cache(maxsize=8)
def _mean_plane(image: Image) -> Array:
    """Return the mean (3,) of the planes' basis over what is loaded."""
    return np.asarray(image.plane[image.loaded].mean(axis=0))
