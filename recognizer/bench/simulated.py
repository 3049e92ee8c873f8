"""A probe that comes down on a registered part where the bench says.

    sim:touch

Options: rate (frames a second, 100), noise (typical, quiet), hold (s, 2), seed. `touch:` is the old
spelling. It is a device on a serial line, which can be unplugged, and its frames say nothing of
where it stands.

Touch on a face -> forces -> counts at the board's rate. The probe rests, comes down, holds, and
lifts; on the way down and up, a beat each, the forces are taken in proportion. The film remembers
(hysteresis, creep), and the board is noisy, as in `probe.simulate`. Thesis 4.2.
"""

from __future__ import annotations

import math
import os
import pty
import tempfile
import threading
import tty
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from itertools import count
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.contact.contract import Touch
from probe.errors import ProbeError
from probe.frame import Frame
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket
from probe.simulate.registered import registered_object, registered_surface
from probe.simulate.scene import Scene
from probe.simulate.sensor import simulated_sensor
from recognizer.bench.errors import BenchError

TOUCH, FORMERLY = "sim:touch", "touch:"
WAIT_S = 0.005  #: of the probe for its next frame, and so of a command for its answer
IDLE_S = 0.05  #: where no frames are wanted
AT_ONCE = 4096  #: bytes read
LOST = 65536  #: bytes that wait for a reader; more are thrown away, as on a real line
SCENES = 32  #: surfaces that are kept
UNPLUGGED_S = 60.0  #: at most
STEPS = (0.5,)  #: shares of the force on the way down, a frame each
APART_S = 0.08  #: between two touches
LOADED_S = 0.1  #: that a load is on before it counts as put on
UNREAD_S = 5.0  #: longest wait for that
LARGEST_N = 400.0  #: of a touch; a load may be ten times as large
#: default, least and most of the numbers among the options
RANGES = {"rate": (100.0, 1.0, 500.0), "hold": (2.0, 0.1, 3600.0), "seed": (0.0, 0.0, 2.0**31)}

Array = NDArray[np.float64]


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
        quiet = manner.noise == "quiet"
        self._sensor = simulated_sensor(sensor, quiet=quiet, frame_s=1 / manner.rate)
        self._rest = np.zeros(sensor.shape)
        self._turn = threading.Condition()
        self._sent = 0  #: beats so far
        self._coming: list[tuple[int, Array]] = []  #: beats to stay at these forces
        self._now = self._rest

    def touch(self, scene: Scene, touch: Touch) -> None:
        """Come down on a surface, hold, and lift.

        Raises ContactError, BenchError: the touch has no equilibrium, or a force that no operator
        would use.
        """
        if not 0 < touch.force_n <= LARGEST_N:
            raise BenchError(
                f"a force of {touch.force_n:g} N", fix=f"give more than 0, at most {LARGEST_N:g} N"
            )
        full = self._sensor.press(scene, touch).forces_n
        held = self._beats(self.manner.hold_s)
        steps = [(1, share * full) for share in STEPS]
        self._play([*steps, (held, full), *reversed(steps), (1, self._rest)])

    def load(self, newtons: float) -> None:
        """Put an even load on, newtons; 0 takes it off. It stays.

        Returns when it was read for `LOADED_S`, or nobody reads the sensor.
        """
        if not 0 <= newtons <= 10 * LARGEST_N:
            raise BenchError(f"a load of {newtons:g} N", fix=f"give 0 to {10 * LARGEST_N:g} N")
        self._play([(1, np.full(self._rest.shape, newtons / self._rest.size))])
        with self._turn:
            then = self._sent + self._beats(LOADED_S)
            self._turn.wait_for(lambda: self._sent >= then, UNREAD_S)

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
            self._sent += 1
            self._turn.notify_all()
            return self._now


class TouchProbe:
    """The simulated probe, running, over the objects of a database; `url` is its serial line.

    Raises BenchError: an option is unknown or no number.
    """

    def __init__(self, url: str, database: str, sensor: SensorType) -> None:
        self.database = database
        self._presses = PressSequence(sensor, parse_simulation(url))
        self._scene = lru_cache(SCENES)(partial(registered_surface, database))
        self._last: tuple[str, str, float, float, float, float] | None = None
        self._turn = threading.Lock()
        self._closed = threading.Event()
        self._line = SoftwareLine(self._presses.frames(), "bench", sensor.shape)
        self.url = self._line.url

    def touch(
        self, object_name: str, face: str, x_mm: float, y_mm: float, theta_deg: float,
        force_n: float,
    ) -> None:  # fmt: skip
        """Touch a face at (x, y), face frame.

        Raises SurfaceError, ContactError, BenchError: there is no such face, or no such touch.
        """
        if not all(map(math.isfinite, (x_mm, y_mm, theta_deg, force_n))):
            raise BenchError("a touch at what is no number", fix="give mm, degrees and N")
        touch = Touch(x_mm, y_mm, math.radians(theta_deg), force_n)
        with self._turn:
            self._presses.touch(self._scene(object_name, face), touch)
            self._last = (object_name, face, x_mm, y_mm, theta_deg, force_n)

    def step(self, dx_mm: float, dy_mm: float, turn_deg: float, force_n: float) -> None:
        """Touch again, a step further in the axes of the sensor as it stood; force 0: as before."""
        if self._last is None:
            raise BenchError("nothing was touched yet", fix="touch the part first")
        object_name, face, x, y, theta_deg, force = self._last
        c, s = math.cos(math.radians(theta_deg)), math.sin(math.radians(theta_deg))
        x, y = x + c * dx_mm - s * dy_mm, y + s * dx_mm + c * dy_mm
        self.touch(object_name, face, x, y, theta_deg + turn_deg, force_n or force)

    def prepare(self, object_name: str) -> None:
        """Read an object's faces meanwhile, so that its first touch does not wait for it."""

        def read() -> None:
            with suppress(ProbeError):  # a touch of it says why
                held = registered_object(self.database, object_name)
                for face in held.faces:
                    if face.placement is not None and not self._closed.is_set():
                        with self._turn:
                            self._scene(object_name, face.name)

        threading.Thread(target=read, name="faces", daemon=True).start()

    def load(self, newtons: float) -> None:
        """Put an even load on; see `PressSequence.load`."""
        self._presses.load(newtons)

    def unplug(self, seconds: float) -> None:
        """Pull the plug, and put it in again after so many seconds."""
        if not 0 < seconds <= UNPLUGGED_S:
            raise BenchError(f"unplugged for {seconds:g} s", fix=f"give up to {UNPLUGGED_S:g} s")
        self._line.unplug(seconds)

    def forget(self) -> None:
        """Read the surfaces from the database again."""
        with self._turn:
            self._scene.cache_clear()

    def close(self) -> None:
        """End the simulation; the port is gone."""
        self._closed.set()
        self._line.close()


def is_simulation(url: str) -> bool:
    """Whether a URL names the probe of this module."""
    return url.partition("?")[0] in (TOUCH, FORMERLY)


class SoftwareLine:
    """A probe in software behind a pseudo-terminal: it goes away with its name, and comes back."""

    def __init__(self, frames: Iterator[Frame], name: str, shape: tuple[int, int]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="bench-probe-")
        self._link = Path(self._folder.name) / "ttyPROBE"
        rows, columns = shape
        ident = IdentPacket(
            seq=0, t_us=0, settling_us=0.0, baud=0, name=name, rows=rows, columns=columns
        )
        self._probe = SoftwareProbe(self.url, frames, ident)
        self._away_s = 0.0
        self._unplugged = threading.Event()
        self._closed = threading.Event()
        self._plug()
        self._thread = threading.Thread(target=self._serve, name="software line", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """The port as a URL."""
        return f"serial://{self._link}?baud=1000000"

    def unplug(self, seconds: float) -> None:
        """Take the line away, and give it back after so many seconds."""
        self._away_s = seconds
        self._unplugged.set()

    def close(self) -> None:
        """Take the line away for good."""
        self._closed.set()
        self._thread.join()
        self._folder.cleanup()

    def _plug(self) -> None:
        self._near, self._far = pty.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self._link.symlink_to(os.ttyname(self._far))

    def _pull(self) -> None:
        self._link.unlink()
        os.close(self._far)
        os.close(self._near)

    def _serve(self) -> None:
        waiting = b""
        while not self._closed.is_set():
            if self._unplugged.is_set():
                self._pull()
                self._closed.wait(self._away_s)
                self._unplugged.clear()
                self._plug()
                waiting = b""
            with suppress(BlockingIOError):
                self._probe.write(os.read(self._near, AT_ONCE))
            waiting += self._probe.read(WAIT_S if self._probe.streaming else IDLE_S)
            with suppress(BlockingIOError):
                waiting = waiting[os.write(self._near, waiting) :] if waiting else b""
            if len(waiting) > LOST:  # nobody listens: as on a real line
                waiting = b""
        self._pull()


def parse_simulation(url: str) -> SimulationSettings:
    """Read the options of a URL: how the probe moves."""
    _, _, query = url.partition("?")
    given = dict(parse_qsl(query, keep_blank_values=True))
    unknown = sorted(set(given) - {*RANGES, "noise"})
    noise = given.get("noise", "typical")
    if unknown or noise not in ("typical", "quiet"):
        raise BenchError(
            f"the simulated probe cannot be had with {query}",
            fix="its options are rate, noise, hold, seed; noise=typical or quiet",
            place=url,
        )
    numbers = {}
    for name, (default, low, high) in RANGES.items():
        try:
            value = float(given.get(name, default))
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise BenchError(f"{name}={given[name]!r}", fix=f"give {low:g} to {high:g}", place=url)
        numbers[name] = value
    return SimulationSettings(
        rate=numbers["rate"], noise=noise, hold_s=numbers["hold"], seed=int(numbers["seed"])
    )
