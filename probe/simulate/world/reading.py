"""What a sensor of a level reads of a touch: contact, film, board, wiring.

Surface + touch + level -> counts (rows, columns). The contact is that of an engine of
`probe.contact`, the network that of `probe.circuit`; neither is the reader's model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.circuit.fsr import GAIN_S, conductances
from probe.circuit.network import loaded_columns
from probe.contact.contract import Contact, Touch
from probe.contact.engines import Engine, engine_named
from probe.contact.tips import Tips
from probe.simulate.world.distorted import DistortedSurface
from probe.simulate.world.gel import read_gel
from probe.simulate.world.levels import Level
from probe.simulate.world.mounting import mount
from probe.simulate.world.sensor_copy import SensorCopy, draw_copy
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ReadoutSettings:
    """What all levels share: the board, and how a hand comes down, rocks and slides."""

    counts_per_n: float = 150.0  #: of a tactel under small forces, unless the supply is too low
    bias: float = 8.0  #: counts of an unloaded tactel
    bits: int = 10  #: of the readings that these counts are of; of other widths in proportion
    peak: float = 1.4  #: force before a film with hysteresis is read, of the force when it is
    slide_step_mm: float = 0.5  #: places along a slide are at most so far apart


READOUT = ReadoutSettings()


def read_sensor(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    level: Level,
    rng: np.random.Generator,
    engine: str = "own",
    *,
    datum_mm: tuple[float, float] = (0.0, 0.0),
    copy: SensorCopy | None = None,
) -> tuple[NDArray[np.uint16], Contact]:
    """Return the counts (rows, columns) of a sensor of a level, and the contact.

    Parameters
    ----------
    surface, sensor, touch
        What is touched, with what and where.
    level
        How bad sensor and print are.
    rng
        Draws the noise, the way of a slide, and the sensor unless it is given.
    engine
        Of contact, `probe.contact.engines`.
    datum_mm
        Point of the surface that a print's scale leaves where it is.
    copy
        The sensor; drawn if not given.

    Raises
    ------
    ContactError
        The touch has no equilibrium.
    CircuitError
        The level does not suit the sensor.
    """
    sensor_copy = copy or draw_copy(sensor, rng)
    if level.wider_mm > 0 or level.scale != 0:
        surface = DistortedSurface(surface, level.wider_mm, level.scale, datum_mm)
    if sensor.value == "depth":
        return read_gel(surface, sensor, touch, level, rng, sensor_copy)
    contacts = engine_named(engine)
    tips = sensor_copy.tips(sensor, level, contacts.points)
    forces, contact = _slid(contacts, surface, sensor, touch, tips, level, rng)
    film, state = sensor_copy.film(sensor, level), None
    if level.hysteresis > 0:
        rocked = replace(touch, force_n=READOUT.peak * touch.force_n,
                         tilt_x_rad=-touch.tilt_x_rad, tilt_y_rad=-touch.tilt_y_rad)  # fmt: skip
        before = contacts.press(surface, sensor, rocked, tips).forces_n
        _, state = conductances(film, _heard(before, level))
    conductance, _ = conductances(film, _heard(forces, level), state)
    share = loaded_columns(conductance, sensor_copy.floating_rows(level), level.load_ohm)
    coarse = sensor.full / ((1 << READOUT.bits) - 1)
    offered = sensor.full * _amplification(level.load_ohm) * _bleed_rows(share, level.bleed)
    noise = coarse * READOUT.counts_per_n * level.noise_n * rng.standard_normal(forces.shape)
    counts = np.clip(np.rint(coarse * READOUT.bias + offered + noise), 0, sensor.full)
    return mount(counts.astype(np.uint16), level.mounting), contact


def _slid(
    contacts: Engine, surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips,
    level: Level, rng: np.random.Generator,
) -> tuple[Array, Contact]:  # fmt: skip
    """Return the mean of the forces along a slide, and the contact in its middle."""
    middle = contacts.press(surface, sensor, touch, tips)
    if level.slide_mm == 0:
        return middle.forces_n, middle
    towards = rng.uniform(-math.pi, math.pi)
    half = level.slide_mm / 2
    side = np.linspace(0.0, half, math.ceil(half / READOUT.slide_step_mm) + 1)[1:]
    forces = [middle.forces_n]
    for way in np.r_[-side, side].tolist():
        at = replace(touch, x_mm=touch.x_mm + way * math.cos(towards),
                     y_mm=touch.y_mm + way * math.sin(towards))  # fmt: skip
        forces.append(contacts.press(surface, sensor, at, tips).forces_n)
    return np.mean(forces, axis=0), middle


def _heard(forces_n: Array, level: Level) -> Array:
    """Return what the tactels feel of each other's forces through the overlay."""
    if level.cross_talk == 0:
        return forces_n
    from scipy.ndimage import gaussian_filter

    return np.asarray(gaussian_filter(forces_n, level.cross_talk, mode="nearest"))


def _bleed_rows(share: Array, bleed: float) -> Array:
    """Return readings in which each row holds a share of the row above and of the one below."""
    around = np.pad(share, ((1, 1), (0, 0)))
    mixed: Array = (1 - 2 * bleed) * share + bleed * (around[:-2] + around[2:])
    return mixed


def _amplification(load_ohm: float) -> float:
    """Return supply over full scale: small forces read alike, but the supply stays within range."""
    full = (1 << READOUT.bits) - 1
    return max(1.0, READOUT.counts_per_n / (full * load_ohm * GAIN_S))
