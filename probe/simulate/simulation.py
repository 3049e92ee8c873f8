"""Simulated touches of one target as a value: frames, counts, truth, and a recording of them.

Target by its name + options -> Simulation. Thesis 4.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.frame import Frame
from probe.recording.files import check_name
from probe.simulate.scan import ScanKind
from probe.simulate.simulated_probe import SimulatedProbe, SimulatedTouch, TouchOptions


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """What a simulated probe read: like a `Recording`, and with the truth."""

    probe: SimulatedProbe
    touches: tuple[SimulatedTouch, ...]

    def frames(self) -> Iterator[Frame]:
        """Yield the frames of all touches, in order."""
        for touch in self.touches:
            yield from touch.frames

    @property
    def counts(self) -> NDArray[np.uint16]:
        """(rows, columns) ADC counts of the first frame."""
        return self.touches[0].frames[0].counts

    def truth(self) -> dict[str, Any]:
        """Return where every touch was, as `probe-sensor simulate --truth` writes it."""
        return self.probe.truth([touch.truth() for touch in self.touches])

    def save(self, path: Path | str, *, replace: bool = False) -> Path:
        """Write a recording that `recognize-object` reads; the truth is not in it."""
        out = Path(path)
        check_name(out, replace=replace)
        with self.probe.recorder(out) as writer:
            for frame in self.frames():
                writer.append(frame)
        return out

    def __len__(self) -> int:
        """Return the number of frames."""
        return sum(len(touch.frames) for touch in self.touches)

    def __str__(self) -> str:
        first, probe = self.touches[0], self.probe
        number = "1 touch" if len(self.touches) == 1 else f"{len(self.touches):,} touches"
        return (
            f"{probe.scene.name}: {number}, {probe.overlay} overlay, level {probe.level}, "
            f"{first.touch.force_n:g} N, peak {first.frames[0].counts.max()} counts"
        )


def simulate(
    target: str,
    *,
    x: float | None = None,
    y: float | None = None,
    theta: float | None = None,
    force: float | None = None,
    tilt_x: float | None = None,
    tilt_y: float | None = None,
    touches: int | None = None,
    scan: ScanKind | None = None,
    frames: int = 1,
    seed: int = 0,
    sensor_type: str | SensorType | None = None,
    overlay: str = "",
    accuracy: str = "auto",
    noise: Literal["typical", "quiet"] = "typical",
) -> Simulation:
    """Touch a part in simulation, as `probe-sensor simulate` does.

    Parameters
    ----------
    target, sensor_type, overlay, accuracy, noise
        See `SimulatedProbe`.
    x, y
        Place of the sensor's centre, mm, frame of the face: origin at its first vertex, x
        along its first edge. The middle, or anywhere with `touches`.
    theta
        Turn of the sensor, degrees; 0, or any with `touches`.
    force
        N; 80, or 20 ... 120 with `touches`, on `fsr-16`; on another type as hard.
    tilt_x, tilt_y
        Tilts about the sensor's own axes, degrees; 0, or up to 2 with `touches`.
    touches
        So many at random; what is given is kept. Of a scan so many at most.
    scan
        Touches side by side on a way over the face, with the pose of each in the robot's base:
        raster, as it is; kinesthetic, as an arm with play believes.
    frames
        Of each touch, 220 a second.
    seed
        Of places and noise.

    Raises
    ------
    SurfaceError, ContactError
        As `SimulatedProbe`; also for a touch that has no equilibrium.

    Examples
    --------
    >>> touch = simulate("washer", force=80.0)
    >>> print(touch)  # doctest: +ELLIPSIS
    washer: 1 touch, tab overlay, level ..., 80 N, peak ... counts
    >>> touch.counts.shape, touch.truth()["touches"][0]["force_n"]
    ((16, 16), 80.0)
    """
    options = TouchOptions(x, y, theta, force, tilt_x, tilt_y, touches, frames, seed, scan)
    probe = SimulatedProbe(
        target, options, sensor_type=sensor_type, overlay=overlay, accuracy=accuracy, noise=noise
    )
    return Simulation(probe, tuple(probe.touches()))
