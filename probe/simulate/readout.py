"""What a sensor type reads of a contact: counts of its board, or of its depth map.

SensorType + noise -> SensorReadout; contact -> counts (rows, columns), frame after frame.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.circuit import QUIET, Electronics, FilmState, Fsr, Noise, fsr_of, read_counts

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SensorReadout:
    """A sensor and its board; a gel has no film and no board, but a camera's noise."""

    sensor: SensorType
    board: Electronics
    film: Fsr
    quiet: bool = False

    def read(
        self, forces_n: Array, state: FilmState | None, rng: np.random.Generator
    ) -> tuple[NDArray[np.uint16], FilmState | None]:
        """Return the counts (rows, columns) under forces (rows, columns), and the film's state."""
        if self.sensor.value == "depth":
            return self._depths(forces_n, rng), None
        return read_counts(forces_n, self.board, self.film, state, rng)

    def _depths(self, forces_n: Array, rng: np.random.Generator) -> NDArray[np.uint16]:
        from probe.contact.gel import depths_mm

        noise = 0.0 if self.quiet else self.sensor.noise
        counts = depths_mm(self.sensor, forces_n) / self.sensor.unit
        counts = counts + noise * rng.standard_normal(self.sensor.shape)
        counts[~self.sensor.present()] = 0.0
        return np.clip(np.rint(counts), 0, self.sensor.full).astype(np.uint16)


def readout_of(
    sensor: SensorType, *, quiet: bool = False, frame_s: float | None = None
) -> SensorReadout:
    """Return the readout of a sensor type whose tactels are sound and alike."""
    board = Electronics(readout=sensor.wiring, bits=sensor.bits, noise=QUIET if quiet else Noise())
    if frame_s is not None:
        board = replace(board, frame_s=frame_s)
    return SensorReadout(sensor, board, film_of(sensor), quiet)


def film_of(sensor: SensorType) -> Fsr:
    """Return the film of a sensor type: sound and alike, dead where a tactel is missing."""
    film = fsr_of(sensor.rows, sensor.columns)
    if sensor.missing or sensor.exponent != 1.0:
        film = replace(film, dead=~sensor.present(), exponent=sensor.exponent * film.exponent)
    return film
