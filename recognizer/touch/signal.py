"""Frame -> forces that can be fitted, and how far each tactel is trusted. Thesis 4.3.

With a calibration: newtons, and bad tactels are masked. Without: counts over the lowest
reading, as any roughly proportional response. Tactels that stand alone above all their
neighbours (spikes) and dead rows or columns are told from the image itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.around import quantile
from recognizer.touch.sensor_state import SensorState
from recognizer.touch.settings import DEFAULTS, SignalSettings

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """What of a frame is worth fitting."""

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
    settings: SignalSettings = DEFAULTS.signal,
) -> Signal:
    """Return the signal of one image.

    Parameters
    ----------
    readings
        (rows, columns) newtons or counts.
    trust
        (rows, columns) of a calibration: 0 for bad tactels; 1 everywhere if not given.
    floor
        Reading without force; by default what the lowest of the tactels read.
    newtons
        Whether the readings are newtons.
    sensor
        Type of the sensor: where it has tactels, its bits, noise and law; as of `fsr-16` if not
        given.
    settings
        How far the strongest tactels must rise for a contact, and the like. Readings that are
        no whole numbers are counts averaged, or on a scale of their own (0 ... 1): what rises out
        of their own noise is a contact too.
    """
    known = np.ones(readings.shape) if trust is None else trust.astype(np.float64)
    if sensor is not None:
        settings = signal_limits(sensor, settings)
        if sensor.missing:
            known = known * sensor.present()
    good = readings[known > 0]
    if good.size == 0:
        return Signal(np.zeros(readings.shape), known, contact=False, newtons=newtons)
    good = np.sort(good)
    lowest = float(quantile(good, settings.background)) if floor is None else floor
    level = _background(good, lowest, settings) if floor is None else floor
    forces = np.maximum(readings - level, 0.0)
    strongest = max(float(good[-settings.strongest :][0]) - lowest, 0.0)
    if sensor is not None and sensor.exponent != 1.0 and not newtons:
        forces = forces ** (1.0 / sensor.exponent)
        strongest **= 1.0 / sensor.exponent
    rise = settings.contact_n if newtons else settings.contact_counts
    noise = noise_of(good)
    if not (newtons or (good == np.rint(good)).all()):  # no counts: of a scale of their own
        rise = min(rise, settings.contact_sigmas * noise)
    alive = _live_mask(forces, known, settings)
    return Signal(forces, known * alive, strongest > rise, newtons, noise)


def noise_of(readings: Array) -> float:
    """Return the standard deviation of readings (n,) of tactels that nothing presses.

    Those are the ones about the densest readings (the mode of half samples, begun with a quarter:
    symbols may press most of the tactels); what lies below it is noise alone. At least what
    rounding leaves: to whole numbers, or to the smallest step between two readings.

    References
    ----------
    T. Robertson and J. D. Cryer, an iterative procedure for estimating the mode.
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


def signal_limits(sensor: SensorType, settings: SignalSettings = DEFAULTS.signal) -> SignalSettings:
    """Return the settings for a type: a contact rises by as much of its full scale, or its noise.

    Examples
    --------
    >>> signal_limits(SensorType()) == SignalSettings()
    True
    """
    share = sensor.full / SensorType().full
    rise = max(settings.contact_counts * share, settings.quiet_sigmas * sensor.noise)
    return replace(settings, contact_counts=float(rise ** (1.0 / sensor.exponent)))


def _background(readings: Array, low: float, settings: SignalSettings) -> float:
    """Return what most of the lowest readings are: tactels that feel nothing, where some do.

    Where most tactels are pressed alike, readings that are low and rare are believed.

    Parameters
    ----------
    readings
        (n,) rising.
    low
        What a few readings lie below.
    """
    lowest = readings[: max(math.ceil(settings.lowest * readings.size), 2)]
    count = math.ceil(settings.densest * (lowest.size - 1))
    first = int(np.argmin(lowest[count:] - lowest[: lowest.size - count]))
    most = low + settings.above * (float(quantile(readings, settings.fifth)) - low)
    level = min(float(lowest[first : first + count + 1].mean()), most)
    middle, strong = (float(quantile(readings, share)) for share in (0.5, settings.strong))
    even = strong - middle < settings.tail * (middle - low)  # strokes leave few strong ones
    return low if even else level


def _live_mask(forces: Array, known: Array, settings: SignalSettings) -> Array:
    """Return 0 for whole rows and columns that read nothing between ones that do."""
    alive = np.ones(forces.shape)
    for axis in (0, 1):
        total = (forces * known).sum(axis=1 - axis)
        middle = quantile(np.sort(total), 0.5)
        dead = total < settings.dead * middle
        dead[0] = dead[-1] = False  # at the rim: rather the edge of a face
        if not dead.any():
            continue
        neighbours = np.minimum(np.roll(total, 1), np.roll(total, -1)) > settings.beside * middle
        where = np.flatnonzero(dead & neighbours)
        if axis == 0:
            alive[where] = 0
        else:
            alive[:, where] = 0
    return alive
