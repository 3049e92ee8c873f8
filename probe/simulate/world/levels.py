"""How bad sensors and prints are: distributions, and what a sensor of them reads.

Level + surface + touch -> counts of the 16x16 matrix. None of it is known to the reader: the
contact is that of `probe.contact`, not of the reader's template, and a sensor is drawn anew
for every touch. `MISMATCH` is wrong in everything at once: strokes printed too wide, a scale
that is off, tabs of other lengths at other places, a force law that is not the one taken
off, tactels that hear their neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import Contact, Touch
from probe.contact.engines import engine_named
from probe.contact.tips import Tips
from probe.sensor import SensorType
from probe.simulate.world.distorted import DistortedSurface
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ReadoutSettings:
    """What all levels share: the board, and how finely the contact is computed."""

    counts_per_n: float = 150.0  #: of a tactel under small forces
    full: int = 1023  #: counts, 10 bits
    bias: float = 8.0  #: counts of an unloaded tactel


READOUT = ReadoutSettings()


@dataclass(frozen=True, slots=True)
class Level:
    """Standard deviations over the tactels, and what is wrong with all of them."""

    name: str
    gain: float  #: of the logarithm of the force
    length_mm: float  #: of the tabs
    noise_n: float  #: of a reading
    shift_mm: float = 0.0  #: of the tabs' places, each way
    dead: int = 0  #: tactels that read nothing, unknown to the reader
    exponent: float = 1.0  #: reading ~ force^exponent
    cross_talk: float = 0.0  #: tactels, width of the bell by which neighbours are heard
    wider_mm: float = 0.0  #: strokes
    scale: float = 0.0  #: of the print, less 1


LOW = Level("low", gain=0.05, length_mm=0.0, noise_n=0.01)
TYPICAL = Level("typical", gain=0.10, length_mm=0.03, noise_n=0.02, dead=1)
HARD = Level("hard", gain=0.15, length_mm=0.05, noise_n=0.03, dead=3)
MISMATCH = Level(
    "mismatch", gain=0.12, length_mm=0.08, noise_n=0.03, shift_mm=0.12, exponent=0.8,
    cross_talk=0.45, wider_mm=0.2, scale=0.01,
)  # fmt: skip
LEVELS = {level.name: level for level in (LOW, TYPICAL, HARD, MISMATCH)}


def read_sensor(
    surface: HeightMap,
    sensor: SensorType,
    touch: Touch,
    level: Level,
    rng: np.random.Generator,
    engine: str = "own",
) -> tuple[NDArray[np.uint16], Contact]:
    """Return the counts (rows, columns) of a sensor drawn from a level, and the contact.

    Raises
    ------
    ContactError
        The touch has no equilibrium.
    """
    shape = (sensor.rows, sensor.columns)
    if level.wider_mm > 0 or level.scale != 0:
        about = (touch.x_mm, touch.y_mm)
        surface = DistortedSurface(surface, level.wider_mm, level.scale, about)
    contacts, tips = engine_named(engine), Tips()
    if sensor.overlay.kind == "tab":
        tips = Tips(
            points=contacts.points,
            lengths_mm=level.length_mm * rng.standard_normal(shape),
            shifts_mm=level.shift_mm * rng.standard_normal((*shape, 2)),
        )
    contact = contacts.press(surface, sensor, touch, tips)
    forces = contact.forces_n
    if level.cross_talk > 0:
        from scipy.ndimage import gaussian_filter

        forces = gaussian_filter(forces, level.cross_talk, mode="nearest")
    forces = np.exp(level.gain * rng.standard_normal(shape)) * forces**level.exponent
    forces = forces + level.noise_n * rng.standard_normal(shape)
    forces.reshape(-1)[rng.permutation(forces.size)[: level.dead]] = 0.0
    counts = np.rint(READOUT.bias + READOUT.counts_per_n * forces)
    return np.clip(counts, 0, READOUT.full).astype(np.uint16), contact
