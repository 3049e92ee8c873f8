"""What a simulated probe feels, frame by frame: it rests, comes down, holds, and lifts.

Touch on a face -> forces -> counts at the board's rate. On the way down and up, a beat each,
the forces are taken in proportion; the film remembers (hysteresis, creep), and the board is
noisy, as in `probe.simulate`. Thesis 4.2.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.frame import Frame
from probe.simulate.scene import Scene
from probe.simulate.sensor import simulated_sensor
from recognizer.bench.errors import BenchError

Array = NDArray[np.float64]

STEPS = (0.5,)  #: shares of the force on the way down, a frame each
APART_S = 0.08  #: between two touches
LOADED_S = 0.1  #: that a load is on before it counts as put on
UNREAD_S = 5.0  #: longest wait for that
LARGEST_N = 400.0  #: of a touch; a load may be ten times as large


@dataclass(frozen=True, slots=True)
class SimulationSettings:
    """How the simulated probe is built and moves."""

    rate: float = 100.0  #: frames per second
    noise: str = "typical"  #: or quiet
    hold_s: float = 2.0  #: how long a touch lasts
    seed: int = 0


class PressSequence:
    """The probe's state; `touch`, `load` and `lift` may be called from any thread."""

    def __init__(self, sensor: SensorType, manner: SimulationSettings) -> None:
        self.sensor, self.manner = sensor, manner
        quiet, frame_s = manner.noise == "quiet", 1 / manner.rate
        self._sensor = simulated_sensor(sensor, quiet=quiet, frame_s=frame_s)
        self._rest = np.zeros(sensor.shape)
        self._turn = threading.Condition()
        self._felt = 0  #: beats so far
        self._coming: list[tuple[int, Array]] = []  #: beats to stay at these forces
        self._now = self._rest

    def touch(self, scene: Scene, touch: Touch) -> None:
        """Come down on a surface, hold, and lift.

        Raises
        ------
        ContactError
            When the touch has no equilibrium.
        BenchError
            For a force that no operator would use.
        """
        if not 0 < touch.force_n <= LARGEST_N:
            raise BenchError(
                f"a force of {touch.force_n:g} N",
                fix=f"give more than 0, at most {LARGEST_N:g} N",
            )
        full = self._sensor.press(scene, touch).forces_n
        held = self._beats(self.manner.hold_s)
        steps = [(1, share * full) for share in STEPS]
        self._play([*steps, (held, full), *reversed(steps), (1, self._rest)])

    def load(self, newtons: float) -> None:
        """Put an even load on, in newtons; 0 takes it off. It stays.

        Returns when it was felt for `LOADED_S`, or nobody reads the sensor.

        Raises
        ------
        BenchError
            For what is no load.
        """
        if not 0 <= newtons <= 10 * LARGEST_N:
            raise BenchError(f"a load of {newtons:g} N", fix=f"give 0 to {10 * LARGEST_N:g} N")
        self._play([(1, np.full(self._rest.shape, newtons / self._rest.size))])
        with self._turn:
            then = self._felt + self._beats(LOADED_S)
            self._turn.wait_for(lambda: self._felt >= then, UNREAD_S)

    def lift(self) -> None:
        """Lift at once."""
        self._play([(1, self._rest)])

    def frames(self) -> Iterator[Frame]:
        """Yield frames without end, numbered and timed from 0."""
        rng = np.random.default_rng(self.manner.seed)
        return self._sensor.frames((self._beat() for _ in count()), rng)

    def _beats(self, seconds: float) -> int:
        return max(1, round(seconds * self.manner.rate))

    def _play(self, coming: list[tuple[int, Array]]) -> None:
        with self._turn:
            if self._now.any() and len(coming) > 1:
                coming = [(self._beats(APART_S), self._rest), *coming]
            self._coming = coming

    def _beat(self) -> Array:
        with self._turn:
            if self._coming:
                left, self._now = self._coming[0]
                self._coming[0] = (left - 1, self._now)
                if left <= 1:
                    self._coming.pop(0)
            self._felt += 1
            self._turn.notify_all()
            return self._now
