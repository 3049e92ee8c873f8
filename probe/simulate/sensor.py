"""A simulated sensor as its type describes it: scene + touch -> contact -> counts.

The contact model presses, the film remembers (hysteresis, creep), and the board of
`probe.circuit` reads with noise. Readings that are conductances have no such board, forces and
depths no film either: they are counted in the type's unit, with the type's noise. Tactels are
sound and alike; `world.sensor` has sensors with faults. Thesis 4.2.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.circuit import (
    QUIET,
    Electronics,
    FilmState,
    Fsr,
    Noise,
    conductances,
    fsr_of,
    read_counts,
)
from probe.contact.contract import Contact, Touch
from probe.contact.press import Accuracy, press
from probe.frame import Frame, frame_from
from probe.simulate.scene import Scene

Array = NDArray[np.float64]
Counts = NDArray[np.uint16]


@dataclass(frozen=True, slots=True, eq=False)
class SensorReading:
    """A touch as a sensor reads it."""

    scene: Scene  #: that the touch met
    contact: Contact
    frames: tuple[Counts, ...]  #: (rows, columns) each, one after another

    @property
    def counts(self) -> Counts:
        """Counts (rows, columns) of the first frame."""
        return self.frames[0]


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedSensor:
    """A sensor, its film and its board."""

    sensor: SensorType
    board: Electronics
    film: Fsr
    accuracy: Accuracy = "auto"  #: of the contact model, `probe.contact.press`
    quiet: bool = False  #: without noise

    def press(self, scene: Scene, touch: Touch) -> Contact:
        """Return the contact of a touch; raises `ContactError` if it has no equilibrium."""
        return press(scene.under(touch).surface, self.sensor, touch, accuracy=self.accuracy)

    def read(
        self, scene: Scene, touch: Touch, rng: np.random.Generator, frames: int = 1
    ) -> SensorReading:
        """Return what the sensor reads under a steady force; the film was not loaded before.

        Raises `ContactError` if the touch has no equilibrium.
        """
        met = scene.under(touch)
        contact = press(met.surface, self.sensor, touch, accuracy=self.accuracy)
        counts = tuple(self.counts(repeat(contact.forces_n, frames), rng))
        return SensorReading(met, contact, counts)

    def counts(self, forces_n: Iterable[Array], rng: np.random.Generator) -> Iterator[Counts]:
        """Yield counts (rows, columns) under forces (rows, columns), a frame apart each."""
        state: FilmState | None = None
        for image in forces_n:
            if self.sensor.value == "counts":
                counts, state = read_counts(image, self.board, self.film, state, rng)
            else:
                values, state = self._values(image, state)
                counts = self._counted(values, rng)
            yield counts

    def frames(self, forces_n: Iterable[Array], rng: np.random.Generator) -> Iterator[Frame]:
        """Yield frames under forces (rows, columns), numbered and timed from 0."""
        for seq, counts in enumerate(self.counts(forces_n, rng)):
            yield frame_from(counts, t_ns=self.time_ns(seq), seq=seq)

    def time_ns(self, seq: int) -> int:
        """Return when a frame is read, ns after frame 0."""
        return round(seq * self.board.frame_s * 1e9)

    def _values(self, forces_n: Array, state: FilmState | None) -> tuple[Array, FilmState | None]:
        """Return depths (mm), conductances (S) or forces (N), and the film's new state."""
        if self.sensor.value == "depth":
            from probe.contact.gel import depths_mm

            return depths_mm(self.sensor, forces_n), state
        if self.sensor.value == "conductance":
            return conductances(self.film, forces_n, state, self.board.frame_s)
        return forces_n**self.sensor.exponent, state

    def _counted(self, values: Array, rng: np.random.Generator) -> Counts:
        noise = 0.0 if self.quiet else self.sensor.noise
        counts = values / self.sensor.unit
        counts = counts + noise * rng.standard_normal(self.sensor.shape)
        counts[~self.sensor.present()] = 0.0
        return np.clip(np.rint(counts), 0, self.sensor.full).astype(np.uint16)


def simulated_sensor(
    sensor: SensorType,
    *,
    accuracy: Accuracy = "auto",
    quiet: bool = False,
    frame_s: float | None = None,
) -> SimulatedSensor:
    """Return a sensor of a type, its tactels sound and alike, dead where one is missing.

    `quiet` leaves the noise out; `frame_s` is from frame to frame, s: None as the board reads.
    """
    board = Electronics(readout=sensor.wiring, bits=sensor.bits, noise=QUIET if quiet else Noise())
    if frame_s is not None:
        board = replace(board, frame_s=frame_s)
    film = fsr_of(sensor.rows, sensor.columns)
    if sensor.missing or sensor.exponent != 1.0:
        film = replace(film, dead=~sensor.present(), exponent=sensor.exponent * film.exponent)
    return SimulatedSensor(sensor, board, film, accuracy, quiet)
