"""Frame -> forces that can be fitted, and the trust of each tactel. Thesis 4.3.

With a calibration: newtons, and bad tactels are masked. Without: counts over the lowest reading, as
any roughly proportional response. Dead rows and columns are found in the image itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.options import DEFAULTS, ReaderOptions
from recognizer.touch.sensor_state import SensorState

Array = NDArray[np.float64]
Kind = TypeVar("Kind", np.bool_, np.float64)
Scalar = TypeVar("Scalar", bound=np.generic)

QUIET_SIGMAS = 6.0  #: standard deviations of the type's noise that a contact rises, at least
SCALE_SIGMAS = 7.0  #: of the image's own noise, where readings are on another scale than counts
RISEN = 6  #: tactels that must rise for a contact; a spike is one
BACKGROUND = 0.05  #: share of the tactels below the reading that a contact rises over
LOWEST = 0.6  #: share of the tactels among which the background is sought ...
DENSEST = 0.4  #: ... where so many of them read most alike, and ...
FIFTH = 0.2  #: ... no higher over the reading that `BACKGROUND` names ...
ABOVE = 1.4  #: ... than so many times as this share of the tactels is
STRONG = 0.95  #: share of the tactels below the reading that stands for strokes ...
#: ... that rise over the middle so many times as this does over the lowest, unless a bare plate is
#: pressed: 0.9-1.6 at 20-120 N; symbols 1.6-3 from 4 N on
TAIL = 1.6
DEAD = 0.02  #: of the median row (column): one below it is dead ...
LIVE_NEIGHBOURS = 0.3  #: ... if both its neighbours are above this share
STRONGEST = 12  #: tactels whose mean says how hard is pressed


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """The part of a frame that is worth fitting."""

    forces: Array  #: (rows, columns) newtons, or counts over the background
    trust: Array  #: (rows, columns) 0 ... 1
    contact: bool  #: whether anything is touched
    newtons: bool  #: whether forces are in newtons
    noise: float = 0.0  #: standard deviation of readings that nothing presses
    state: SensorState | None = None  #: of the sensor that felt them, as far as it was learned


def signal_of(
    readings: Array,
    *,
    trust: Array | None = None,
    floor: float | None = None,
    newtons: bool = False,
    sensor: SensorType | None = None,
    options: ReaderOptions = DEFAULTS,
) -> Signal:
    """Return the signal of one image, `readings` (rows, columns) in newtons or counts.

    `trust` (rows, columns) is 0 for bad tactels of a calibration; `sensor` is `fsr-16` if not
    given.

    `options` say how far the strongest tactels must rise for a contact. Readings that are no whole
    numbers are counts averaged, or on a scale of their own (0 ... 1): a rise out of their own noise
    is a contact too.
    """
    known = np.ones(readings.shape) if trust is None else trust.astype(np.float64)
    if sensor is not None and sensor.missing:
        known = known * sensor.present()
    good = readings[known > 0]
    if good.size == 0:
        return Signal(np.zeros(readings.shape), known, contact=False, newtons=newtons)
    good = np.sort(good)
    lowest = float(quantile(good, BACKGROUND)) if floor is None else floor
    level = _background(good, lowest) if floor is None else floor
    forces = np.maximum(readings - level, 0.0)
    strongest = max(float(good[-RISEN:][0]) - lowest, 0.0)
    if sensor is not None and sensor.exponent != 1.0 and not newtons:
        forces = forces ** (1.0 / sensor.exponent)
        strongest **= 1.0 / sensor.exponent
    rise = options.contact_n if newtons else contact_counts(sensor, options)
    noise = noise_of(good)
    if not (newtons or (good == np.rint(good)).all()):  # no counts: of a scale of their own
        rise = min(rise, SCALE_SIGMAS * noise)
    alive = _live_mask(forces, known)
    return Signal(forces, known * alive, strongest > rise, newtons, noise)


def noise_of(readings: Array) -> float:
    """Return the standard deviation of readings (n,) of tactels that nothing presses.

    Those lie about the densest readings (the mode of half samples, begun with a quarter, as symbols
    may press most tactels: T. Robertson and J. D. Cryer, an iterative procedure for estimating the
    mode); below it is noise alone. At least the deviation of rounding, to whole numbers or to the
    smallest step between two readings.
    """
    whole = found = np.sort(readings)
    share = 4
    while len(found) > 2:
        part = max(2, (len(found) + 1) // share)
        start = int(np.argmin(found[part - 1 :] - found[: len(found) - part + 1]))
        found, share = found[start : start + part], 2
    mode = float(found.mean())
    below, at = mode - whole[whole < mode], int((whole == mode).sum())
    steps = np.diff(whole)
    step = float(steps[steps > 0].min()) if steps.any() else 0.0
    if (whole == np.rint(whole)).all():
        step = 1.0
    square = float((below**2).sum()) / max(len(below) + at / 2, 1.0)
    return math.sqrt(square + step**2 / 12)


def contact_counts(sensor: SensorType | None, options: ReaderOptions = DEFAULTS) -> float:
    """Return the rise of a contact on a type: as much of its full scale, or of its noise."""
    if sensor is None:
        return options.contact_counts
    share = sensor.full / SensorType().full
    rise = max(options.contact_counts * share, QUIET_SIGMAS * sensor.noise)
    return float(rise ** (1.0 / sensor.exponent))


def _background(readings: Array, low: float) -> float:
    """Return the mean of most of the lowest readings (n,): of unloaded tactels, if there are some.

    Where most tactels are pressed alike, readings that are low and rare are believed: a few lie
    below `low`.
    """
    lowest = readings[: max(math.ceil(LOWEST * readings.size), 2)]
    count = math.ceil(DENSEST * (lowest.size - 1))
    first = int(np.argmin(lowest[count:] - lowest[: lowest.size - count]))
    most = low + ABOVE * (float(quantile(readings, FIFTH)) - low)
    level = min(float(lowest[first : first + count + 1].mean()), most)
    middle, strong = (float(quantile(readings, share)) for share in (0.5, STRONG))
    even = strong - middle < TAIL * (middle - low)  # strokes leave few strong ones
    return low if even else level


def _live_mask(forces: Array, known: Array) -> Array:
    """Return 0 for whole rows and columns that read nothing between ones that do."""
    alive = np.ones(forces.shape)
    for axis in (0, 1):
        total = (forces * known).sum(axis=1 - axis)
        middle = quantile(np.sort(total), 0.5)
        dead = total < DEAD * middle
        dead[0] = dead[-1] = False  # at the rim: rather the edge of a face
        if not dead.any():
            continue
        neighbours = np.minimum(np.roll(total, 1), np.roll(total, -1)) > LIVE_NEIGHBOURS * middle
        alive.swapaxes(0, axis)[dead & neighbours] = 0
    return alive


def combine_around(image: NDArray[Kind], reach: int, combine: np.ufunc) -> NDArray[Kind]:
    """Return a combination of the values about each tactel (rows, columns), as `np.maximum`.

    The square of 2 `reach` + 1 tactels is gone through line by line, first along columns and then
    along rows; beyond the rim of the matrix nothing counts. `combine` must not depend on order or
    repetition.
    """
    found: Any = image
    for axis in (0, 1):
        line = found.swapaxes(0, axis)
        found = line.copy()
        for away in range(1, min(reach, len(line) - 1) + 1):
            combine(found[away:], line[:-away], out=found[away:])
            combine(found[:-away], line[away:], out=found[:-away])
        found = found.swapaxes(0, axis)
    return np.asarray(found)


def sorted_around(image: Array, around: int, **pad: Any) -> Array:
    """Return the sorted values (rows, columns, around^2) of the square about each tactel.

    Beyond the rim they are those of `numpy.pad`.
    """
    before = around // 2
    wide = np.pad(image, (before, around - 1 - before), **pad)
    each = np.lib.stride_tricks.sliding_window_view(wide, (around, around))
    return np.sort(each.reshape(*image.shape, around**2), axis=-1)


def quantile(ordered: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the quantile of values that rise along the last axis, as `numpy.quantile` does."""
    at = (ordered.shape[-1] - 1) * share
    low = min(int(at), ordered.shape[-1] - 1)
    one, other = ordered[..., low], ordered[..., min(low + 1, ordered.shape[-1] - 1)]
    part = at - low
    between = other - one
    return np.asarray(one + between * part if part < 0.5 else other - between * (1 - part))


def mean_of_strongest(forces: NDArray[np.float64]) -> float:
    """Return the mean of the `STRONGEST` highest readings."""
    return float(np.sort(forces, axis=None)[-STRONGEST:].mean())


def swap_halves(image: NDArray[Scalar], axis: int) -> NDArray[Scalar]:
    """Return an image (rows, columns) with its halves along `axis` swapped."""
    return np.roll(image, image.shape[axis] // 2, axis)
