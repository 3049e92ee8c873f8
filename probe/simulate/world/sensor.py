"""A sensor with the faults of a level: scene + touch -> counts (rows, columns).

Contact of an engine of `probe.contact`, film, board, wiring; none of it is the reader's model.
What is wrong with one instance of a sensor is drawn in standard deviations and in orders of
failing, so that an instance exists at every level: drawn for each touch, or once for a run.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.circuit.fsr import GAIN_S, Fsr, conductances, fsr_of
from probe.circuit.network import loaded_columns
from probe.contact.contract import Contact, Touch
from probe.contact.engines import Engine, engine_named
from probe.contact.gel import blur, depths_mm, gel
from probe.contact.tips import Tips
from probe.errors import CircuitError
from probe.simulate.scene import Scene
from probe.simulate.sensor import Counts, SensorReading
from probe.simulate.world.levels import TYPICAL, Level
from probe.simulate.world.surfaces import DistortedSurface
from probe.surface.contract import HeightMap

Array = NDArray[np.float64]

COUNTS_PER_N = 150.0  #: of a tactel under small forces, unless the supply is too low
BIAS = 8.0  #: counts of an unloaded tactel
VIRTUAL_OHM = 1e-3  #: load of a board whose readings are conductances or forces
FULL = 1023  #: of the readings that these counts are of; of other widths in proportion
PEAK = 1.4  #: force before a film with hysteresis is read, of the force when it is
SLIDE_STEP_MM = 0.5  #: places along a slide are at most this far apart
SHADE_PIXELS = 6.0  #: length over which the error of a gel's lighting changes

#: How a sensor can be mounted or wired: its counts arrive in other places. The sensor itself stands
#: where it stands: the truth of a touch does not turn with its image.
MOUNTINGS: dict[str, Callable[[Counts], Counts]] = {
    "as drawn": lambda counts: counts,
    "quarter turn": np.rot90,
    "mirrored": np.fliplr,
    "transposed": np.transpose,
    "halves swapped": lambda counts: np.roll(counts, counts.shape[1] // 2, axis=1),
    "rolled": lambda counts: np.roll(counts, 1, axis=1),
}


@dataclass(frozen=True, slots=True, eq=False)
class SensorInstance:
    """One sensor among those of its type."""

    gains: Array  #: (rows, columns) standard deviations, as all that follow
    lengths: Array  #: (rows, columns)
    shifts: Array  #: (rows, columns, 2)
    failing: NDArray[np.int64]  #: (rows * columns,) tactels in the order in which they die
    loose: NDArray[np.int64]  #: (rows,) rows in the order in which they come to float

    def tips(self, sensor: SensorType, level: Level, points: int) -> Tips:
        """Return the tips at a level; a pad has none."""
        if sensor.overlay.kind != "tab":
            return Tips(points=points)
        return Tips(
            points=points,
            dome_mm=level.dome_mm,
            lengths_mm=level.length_mm * self.lengths,
            shifts_mm=level.shift_mm * self.shifts,
        )

    def film(self, sensor: SensorType, level: Level) -> Fsr:
        """Return the law of every tactel at a level."""
        rows, columns = self.gains.shape
        plain, none = fsr_of(rows, columns), np.zeros((rows, columns))
        dead = self.dead(level) | ~sensor.present()
        hot = np.zeros(dead.size)
        hot[self.failing[dead.size - round(level.hot * dead.size) :]] = GAIN_S * level.hot_n
        return Fsr(
            gain_s=plain.gain_s * np.exp(level.gain * self.gains),
            exponent=level.exponent * sensor.exponent * plain.exponent,
            break_n=none if sensor.value == "force" else plain.break_n,
            preload_n=none,
            series_ohm=none,
            stuck_s=hot.reshape(rows, columns),
            dead=dead,
            hysteresis=level.hysteresis,
        )

    def dead(self, level: Level) -> NDArray[np.bool_]:
        """Return which tactels are dead (rows, columns) at a level."""
        dead = np.zeros(self.gains.size, dtype=np.bool_)
        dead[self.failing[: round(level.dead * self.gains.size)]] = True
        return dead.reshape(self.gains.shape)

    def floating_rows(self, level: Level) -> NDArray[np.bool_]:
        """Return which rows float (rows,) at a level."""
        floating = np.zeros(len(self.loose), dtype=np.bool_)
        floating[self.loose[: round(level.floating * len(self.loose))]] = True
        return floating


def sample_sensor(sensor: SensorType, rng: np.random.Generator) -> SensorInstance:
    """Draw an instance of a sensor type."""
    shape = (sensor.rows, sensor.columns)
    return SensorInstance(
        gains=rng.standard_normal(shape),
        lengths=rng.standard_normal(shape),
        shifts=rng.standard_normal((*shape, 2)),
        failing=rng.permutation(sensor.rows * sensor.columns),
        loose=rng.permutation(sensor.rows),
    )


@dataclass(frozen=True, slots=True, eq=False)
class LevelSensor:
    """A sensor of a level, and the print that it touches."""

    sensor: SensorType
    level: Level
    engine: str = "own"  #: of contact, `probe.contact.engines`
    instance: SensorInstance | None = None  #: None: each reading draws one

    def read(self, scene: Scene, touch: Touch, rng: np.random.Generator) -> SensorReading:
        """Return what the sensor reads of a touch.

        The scene is without the faults of its print, whose scale leaves its middle in its place.
        `rng` draws the instance unless it is given, the direction of a slide, the noise.

        Raises `ContactError` if the touch has no equilibrium; `CircuitError` if the level does not
        suit the sensor.
        """
        level, met = self.level, scene.under(touch)
        instance = self.instance or sample_sensor(self.sensor, rng)
        surface = met.surface
        if level.wider_mm > 0 or level.scale != 0:
            x, y = scene.centre_mm().tolist() if level.scale else (0.0, 0.0)
            surface = DistortedSurface(surface, level.wider_mm, level.scale, (x, y))
        read = self._read_gel if self.sensor.value == "depth" else self._read_board
        counts, contact = read(surface, touch, instance, rng)
        counts = np.clip(np.rint(counts), 0, self.sensor.full)
        return SensorReading(met, contact, (mount(counts.astype(np.uint16), level.mounting),))

    def _read_board(
        self, surface: HeightMap, touch: Touch, instance: SensorInstance, rng: np.random.Generator
    ) -> tuple[Array, Contact]:
        """Return counts that are not rounded, and the contact, of a film and a board.

        A board that gives conductances or forces has undone its divider: of a level count all but
        `load_ohm`, and `noise_n` as for a gel.
        """
        sensor, level, contacts = self.sensor, self.level, engine_named(self.engine)
        tips = instance.tips(sensor, level, contacts.points)
        forces, contact = _slip(contacts, surface, sensor, touch, tips, level.slide_mm, rng)
        film, state = instance.film(sensor, level), None
        if level.hysteresis > 0:
            a, b = touch.tilt_x_rad, touch.tilt_y_rad
            rocked = replace(touch, force_n=PEAK * touch.force_n, tilt_x_rad=-a, tilt_y_rad=-b)
            before = contacts.press(surface, sensor, rocked, tips).forces_n
            _, state = conductances(film, blur(before, level.cross_talk))
        conductance, _ = conductances(film, blur(forces, level.cross_talk), state)
        load_ohm = level.load_ohm if sensor.value == "counts" else VIRTUAL_OHM
        share = loaded_columns(conductance, instance.floating_rows(level), load_ohm)
        if sensor.value != "counts":
            seen = _row_leakage(share / load_ohm, level.bleed)
            if sensor.value == "force":
                seen = (seen - film.leak_s) / GAIN_S
            counts = seen / sensor.unit + _noise(sensor, level, rng)
            return np.where(sensor.present(), counts, 0.0), contact
        coarse = sensor.full / FULL
        amplification = max(1.0, COUNTS_PER_N / (FULL * level.load_ohm * GAIN_S))
        offered = sensor.full * amplification * _row_leakage(share, level.bleed)
        noise = coarse * COUNTS_PER_N * level.noise_n * rng.standard_normal(forces.shape)
        return coarse * BIAS + offered + noise, contact

    def _read_gel(
        self, surface: HeightMap, touch: Touch, instance: SensorInstance, rng: np.random.Generator
    ) -> tuple[Array, Contact]:
        """Return counts that are not rounded, and the contact, of a gel's depth map.

        Of a level count its print, `gain` (the depth made of a shade is off by a share that changes
        slowly over the gel, half of the spread of tactels), `exponent` (its law), `dead`
        (blemishes), `cross_talk` (blur, pixels), `noise_n` (over that of `typical`, times the
        type's noise) and the wrist.
        """
        from scipy.ndimage import gaussian_filter

        sensor, level = self.sensor, self.level
        contact = gel(surface, sensor, touch)
        depth = blur(depths_mm(sensor, contact.forces_n), level.cross_talk)
        shade = gaussian_filter(instance.gains, SHADE_PIXELS, mode="reflect")
        shade = shade / max(float(shade.std()), 1e-12)
        top = max(float(depth.max()), 1e-12)
        seen = top * (depth / top) ** (level.exponent * sensor.exponent)
        counts: Array = seen * np.exp(level.gain / 2 * shade) / sensor.unit
        counts = counts + _noise(sensor, level, rng)
        counts[instance.dead(level) | ~sensor.present()] = 0.0
        return counts, contact


def mount(counts: Counts, mounting: str) -> Counts:
    """Return counts as a mounting leaves them.

    Raises `CircuitError` if the matrix is not square, and the mounting would give it another shape.
    """
    found = MOUNTINGS[mounting](counts)
    if found.shape != counts.shape:
        raise CircuitError(
            f"a matrix of {counts.shape[0]} x {counts.shape[1]} cannot be mounted '{mounting}'",
            fix="take a square sensor, or another level",
        )
    return np.ascontiguousarray(found)


def _slip(
    contacts: Engine, surface: HeightMap, sensor: SensorType, touch: Touch, tips: Tips,
    slide_mm: float, rng: np.random.Generator,
) -> tuple[Array, Contact]:  # fmt: skip
    """Return the mean of the forces along a slide, and the contact in its middle."""
    middle = contacts.press(surface, sensor, touch, tips)
    if slide_mm == 0:
        return middle.forces_n, middle
    towards = rng.uniform(-math.pi, math.pi)
    side = np.linspace(0.0, slide_mm / 2, math.ceil(slide_mm / 2 / SLIDE_STEP_MM) + 1)[1:]
    forces = [middle.forces_n]
    for way in np.r_[-side, side].tolist():
        at = replace(touch, x_mm=touch.x_mm + way * math.cos(towards),
                     y_mm=touch.y_mm + way * math.sin(towards))  # fmt: skip
        forces.append(contacts.press(surface, sensor, at, tips).forces_n)
    return np.mean(forces, axis=0), middle


def _noise(sensor: SensorType, level: Level, rng: np.random.Generator) -> Array:
    """Return the type's noise as a level has it, counts (rows, columns)."""
    noise = sensor.noise * level.noise_n / TYPICAL.noise_n
    drawn: Array = noise * rng.standard_normal(sensor.shape)
    return drawn


def _row_leakage(share: Array, bleed: float) -> Array:
    """Return readings in which each row holds a share of the row above and of the one below."""
    around = np.pad(share, ((1, 1), (0, 0)))
    mixed: Array = (1 - 2 * bleed) * share + bleed * (around[:-2] + around[2:])
    return mixed
