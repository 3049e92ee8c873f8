"""Touches of one target in simulation: frames, and the truth where the probe was.

Target + options -> SimulatedProbe -> touches, each with its frames -> Simulation. Touch i draws
from a generator of (seed, i) alone. Its frames follow each other at the board's rate under a steady
force. Truth stands apart from the frames; those of a scan have the pose that the robot believes.
Thesis 4.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import without_password
from encoded_objects.base.files import staged_file
from encoded_objects.base.number import needed_number
from encoded_objects.base.sensor_type import (
    SensorType,
    choose_sensor_type,
    force_share,
    usual_force_n,
)
from probe.contact.contract import Contact, Touch
from probe.contact.press import accuracy_of, level_for
from probe.errors import ContactError, SurfaceError
from probe.frame import Frame, frame_from
from probe.recording.files import check_name
from probe.recording.record import Recorder
from probe.simulate.scan import ScanKind, ScanPath, scan_path
from probe.simulate.scene import Scene, TouchRanges, pose_of, random_touches
from probe.simulate.sensor import simulated_sensor
from probe.simulate.target import surface_of

DRAWS = 50  # of a touch at random until it has an equilibrium
_WAY = 1 << 32  # of the generator that draws a scan's path: no touch has that number
_NUMBERS: dict[str, dict[str, Any]] = {
    **{key: {} for key in ("x_mm", "y_mm", "theta_deg", "force_n", "tilt_x_deg", "tilt_y_deg")},
    "touches": {"whole": True, "least": 1},
    "frames": {"whole": True, "least": 1},
    "seed": {"whole": True, "least": 0},
}  #: of `TouchOptions`


@dataclass(frozen=True, slots=True)
class TouchOptions:
    """Touches as a person names them: mm, degrees, N; None where they say nothing.

    Raises SurfaceError: a value that is no number, or out of its range; an unknown scan.
    """

    x_mm: float | None = None
    y_mm: float | None = None
    theta_deg: float | None = None
    force_n: float | None = None
    tilt_x_deg: float | None = None
    tilt_y_deg: float | None = None
    touches: int | None = None  #: at random; None: one, as named; of a scan at most
    frames: int = 1  #: of each touch
    seed: int = 0
    scan: ScanKind | None = None  #: None: touches by themselves

    def __post_init__(self) -> None:
        for name, limits in _NUMBERS.items():
            value = getattr(self, name)
            if value is None and name not in ("frames", "seed"):
                continue
            if fix := needed_number(value, **limits):
                raise SurfaceError(f"{name.rpartition('_')[0] or name} {value!r}", fix=fix)
        if self.scan not in (None, *get_args(ScanKind)):
            fix = f"give {' or '.join(get_args(ScanKind))}"
            raise SurfaceError(f"scan {self.scan!r}", fix=fix)

    def draw(self, scene: Scene, sensor: SensorType, rng: np.random.Generator) -> Touch:
        """Return a touch; values that are not named are drawn, or have a default of the type."""
        share = force_share(sensor)
        if self.touches is None:
            x, y = scene.centre_mm()
            drawn = Touch(float(x), float(y), 0.0, usual_force_n(sensor))
        else:
            low, high = TouchRanges().force_n
            ranges = TouchRanges(force_n=(share * low, share * high))
            drawn = next(random_touches(scene.region, rng, ranges))
        turns = map(math.degrees, (drawn.theta_rad, drawn.tilt_x_rad, drawn.tilt_y_rad))
        others = (drawn.x_mm, drawn.y_mm, drawn.force_n, *turns)
        named = (self.x_mm, self.y_mm, self.force_n,
                 self.theta_deg, self.tilt_x_deg, self.tilt_y_deg)  # fmt: skip
        values = tuple(b if a is None else a for a, b in zip(named, others, strict=True))
        x, y, force, theta, tilt_x, tilt_y = values
        return Touch(x, y, math.radians(theta), force, math.radians(tilt_x), math.radians(tilt_y),
                     drawn.wrist)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedTouch:
    """One touch and its frames."""

    scene: Scene  #: that it met
    touch: Touch
    contact: Contact
    frames: tuple[Frame, ...]
    T_base_sensor: NDArray[np.float64] | None = None  #: (4, 4) mm, of a scan: as it was

    def truth(self) -> dict[str, Any]:
        """Return where the probe was and its load: mm, degrees, N, as JSON has it."""
        touch, contact = self.touch, self.contact
        touching = math.isfinite(contact.z_mm)
        T_face_probe = pose_of(touch, contact) if touching else None
        T_object_probe, T_object_surface = None, self.scene.T_object_surface
        if T_face_probe is not None and T_object_surface is not None:
            T_object_probe = T_object_surface @ T_face_probe
        T_base = self.T_base_sensor
        return {
            "seq": self.frames[0].seq,
            "x_mm": touch.x_mm,
            "y_mm": touch.y_mm,
            "theta_deg": math.degrees(touch.theta_rad),
            "force_n": touch.force_n,
            "tilt_x_deg": math.degrees(touch.tilt_x_rad),
            "tilt_y_deg": math.degrees(touch.tilt_y_rad),
            "felt_n": float(contact.forces_n.sum()),
            "tactels": int((contact.forces_n > 0).sum()),
            "T_face_probe": None if T_face_probe is None else T_face_probe.tolist(),
            "T_object_probe": None if T_object_probe is None else T_object_probe.tolist(),
            **({} if T_base is None else {"T_base_probe": T_base.tolist()}),
            **({"met_another_face": True} if self.scene.meets_another_face(contact.z_mm) else {}),
        }


class SimulatedProbe:
    """A probe over a target, ready to touch it; parameters as `simulate`.

    Raises
    ------
    SurfaceError
        The target is no surface; exit code 4 if its database cannot be read.
    ContactError
        The accuracy cannot be had.
    PoseError
        A scan's arm does not reach.
    """

    def __init__(
        self,
        target: str | Path,
        options: TouchOptions | None = None,
        *,
        sensor_type: str | SensorType | None = None,
        overlay: str = "",
        accuracy: str = "auto",
        noise: Literal["typical", "quiet"] = "typical",
    ) -> None:
        for name, given, known in (
            ("overlay", overlay, ("tab", "pad", "")),
            ("noise", noise, ("typical", "quiet")),
        ):
            if given not in known:
                raise SurfaceError(f"{name} {given!r}", fix=f"give {known[0]} or {known[1]}")
        if not isinstance(target, str | Path):
            fix = "name a written part, a registered face as lab.db#Cube/F1, or washer"
            raise SurfaceError(f"{target!r} is no target", fix=fix)
        self.target, self.options, self.noise = str(target), options or TouchOptions(), noise
        self.sensor = choose_sensor_type(sensor_type, "", None, self.target).with_overlay(overlay)
        self.overlay = self.sensor.overlay.kind
        self.level = level_for(self.sensor, accuracy_of(accuracy))  #: of the contact model
        self.scene = surface_of(self.target)
        self.path = self._scan_path()  #: None: no scan
        self.drawn_again = 0  #: touches without an equilibrium

    def __len__(self) -> int:
        """Return the number of touches."""
        return (self.options.touches or 1) if self.path is None else len(self.path)

    def touches(self) -> Iterator[SimulatedTouch]:
        """Yield the touches; one at random that has no equilibrium is drawn again.

        Raises `ContactError` for a touch as named, or after `DRAWS` of one at random.
        """
        options, path = self.options, self.path
        quiet = self.noise == "quiet"
        sensor = simulated_sensor(self.sensor, accuracy=self.level, quiet=quiet)
        for i in range(len(self)):
            rng = np.random.default_rng([options.seed, i])
            left = DRAWS if path is None and options.touches is not None else 1
            while left:
                touch = (
                    options.draw(self.scene, self.sensor, rng) if path is None else path.touches[i]
                )
                left -= 1
                try:
                    reading = sensor.read(self.scene, touch, rng, options.frames)
                    break
                except ContactError:
                    if not left:
                        raise
                    self.drawn_again += 1
            contact = reading.contact
            true = believed = wrist = None
            if path is not None and math.isfinite(contact.z_mm):
                true = path.true_pose(i, reading.scene, contact)
                believed = path.believed_pose(i, true)
                wrist = path.wrist_counts(i, contact)
            frames = tuple(
                frame_from(counts, t_ns=sensor.time_ns(seq), seq=seq, wrist=wrist, pose=believed)
                for seq, counts in enumerate(reading.frames, start=i * options.frames)
            )
            yield SimulatedTouch(reading.scene, touch, contact, frames, true)

    @contextmanager
    def recorder(self, out: Path) -> Iterator[Recorder]:
        """Yield the writer of a recording; where a touch is refused, no file is left."""
        attributes: dict[str, Any] = {
            "simulated": self.target, "overlay": self.overlay, "level": self.level,
            "noise": self.noise, "seed": self.options.seed,
            "frames_per_touch": self.options.frames,
        }  # fmt: skip
        if self.path is not None:
            error_mm, error_rad = self.path.error
            attributes |= {"scan": self.options.scan, "pose_error_mm": error_mm,
                           "pose_error_deg": math.degrees(error_rad)}  # fmt: skip
        with (
            staged_file(out) as draft,
            Recorder(draft, sensor=f"simulated/{self.overlay}", sensor_type=self.sensor,
                     attributes=attributes, roll_over_s=math.inf) as writer,
        ):  # fmt: skip
            yield writer

    def truth(self, touches: list[dict[str, Any]]) -> dict[str, Any]:
        """Return the truth of a run whose touches were these, as JSON has it."""
        scan = {}
        if self.path is not None:
            T = self.path.T_base_object
            scan = {"scan": self.options.scan, "T_base_object": None if T is None else T.tolist()}
        return {
            "target": without_password(self.target), "object": self.scene.object_name or None,
            "face": self.scene.face or None, "sensor_type": self.sensor.name,
            "overlay": self.overlay, "level": self.level,
            "seed": self.options.seed, "frames_per_touch": self.options.frames,
            **scan, "touches": touches,
        }  # fmt: skip

    def _scan_path(self) -> ScanPath | None:
        options = self.options
        if options.scan is None:
            return None
        if {options.x_mm, options.y_mm, options.tilt_x_deg, options.tilt_y_deg} != {None}:
            raise SurfaceError("a scan chooses places and tilts by itself",
                               fix="leave x, y and tilts out, or the scan")  # fmt: skip
        return scan_path(
            self.scene, self.sensor, options.scan, np.random.default_rng([options.seed, _WAY]),
            most=options.touches, theta_rad=math.radians(options.theta_deg or 0.0),
            force_n=usual_force_n(self.sensor) if options.force_n is None else options.force_n,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """Touches of a simulated probe: frames like a `Recording`, and the truth."""

    probe: SimulatedProbe
    touches: tuple[SimulatedTouch, ...]

    def frames(self) -> Iterator[Frame]:
        """Yield the frames of all touches, in order."""
        return (frame for touch in self.touches for frame in touch.frames)

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
    target: str | Path,
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
    target
        A written part, `out/cube/Cube-F1.stl` (with `@lab.db`: in the frame of its face), a
        registered face, `lab.db#Cube/F1`, or `washer`.
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
    sensor_type
        A type, its name or file; `fsr-16` if not given.
    overlay
        tab or pad instead of the type's own overlay.
    accuracy
        auto, a level of the contact model (footprint, tabs, layer), or the largest
        error of an image, as "0.01".
    noise
        Of contacts and board: typical or quiet.

    Raises
    ------
    SurfaceError, ContactError, PoseError
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
