"""A scan: where to press on a face, the guarded approach, the arm's errors. Thesis 4.3.

- Polygon of a face -> raster, left to right and top to bottom (figure 4.11). Neighbours overlap by
  three quarters of the sensor. The step is 4.25 tactels, not 4: steps of whole tactels see every
  edge at the same place between two tactels. Places stand on a lattice that may be turned; it is as
  wide as the face, so that its outer touches reach the face's edge or a little beyond.
- `T_surface_sensor = [Rz(theta) Rx(tilt_x) Ry(tilt_y) | x, y, z]`: the tips' plane then stands at
  z + tilt_x y - tilt_y x over the sensor's point (x, y), as the contact models have it for small
  tilts.
- Commanded poses -> joint angles -> believed and true poses, with the covariance of the errors. The
  encoders sit before the gears: what the arm believes is what was commanded. A joint follows its
  motor only when the play is used up, so its error depends on the way it came; on top there is
  noise, drawn for each touch.

mm, rad, surface frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.arm import AXES, Arm, forward, inverse, sensor_pose
from probe.contact.contract import Touch, WristStiffness
from probe.errors import ContactError, PoseError, SurfaceError
from probe.surface.polygon import polygon, signed_area
from probe.wrist import Wrist, WristPose, gripper_to_plate, plate_to_sensor

STEP_TACTELS = 4.25  #: between neighbours, which then share three quarters


@dataclass(frozen=True, slots=True)
class RasterPlan:
    """Where to press."""

    places_mm: NDArray[np.float64]  #: (n, 2) of the sensor's centre, in the order of scanning
    cover: NDArray[np.float64]  #: (n,) share of the sensor that lies over the face
    lines: NDArray[np.int64]  #: (n,) number of the line, from the top
    theta_rad: float  #: the sensor's x axis from the surface's

    def __len__(self) -> int:
        return len(self.places_mm)

    def there_and_back(self, least_cover: float = 0.0) -> NDArray[np.float64]:
        """Return the places (n, 2) line by line, every other line back.

        Those that cover less than `least_cover` of what the best one covers are left out.
        """
        kept = self.cover >= least_cover * self.cover.max(initial=0.0)
        lines = [self.places_mm[kept & (self.lines == line)] for line in np.unique(self.lines)]
        return np.concatenate([line[:: (-1) ** n] for n, line in enumerate(lines)])


def raster(
    loops: Sequence[ArrayLike],
    sensor: SensorType | None = None,
    *,
    step_tactels: float = STEP_TACTELS,
    theta_rad: float = 0.0,
    least_cover: float = 0.1,
) -> RasterPlan:
    """Lay a raster of touches over a face.

    Parameters
    ----------
    loops
        (n, 2) corners of the face, and of its holes after it, mm, either way round.
    step_tactels
        Between neighbours, both ways.
    theta_rad
        The sensor's x axis, and the lines of the raster, from the surface's x axis.
    least_cover
        Places with a smaller share of the sensor over the face are left out.

    Raises
    ------
    SurfaceError
        A loop that is no polygon, or a step that is none.
    """
    sensor = sensor or SensorType()
    if not (0 < step_tactels <= min(sensor.rows, sensor.columns)):
        raise SurfaceError(
            f"a step of {step_tactels:g} tactels",
            fix=f"take more than 0 and at most {min(sensor.rows, sensor.columns)}",
        )
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    turn = np.array([[c, -s], [s, c]])  # from the raster's axes to the surface's
    polygons = [loop @ turn for loop in polygon(loops).loops()]
    half = np.array(sensor.half_mm)
    low, high = polygons[0].min(axis=0), polygons[0].max(axis=0)
    xs, ys = (
        _positions(low[i], high[i], half[i], step_tactels * sensor.step_mm[i]) for i in (0, 1)
    )
    places, cover, lines = [], [], []
    for line, y in enumerate(ys[::-1]):
        strips = [_clip_polygon(p, 1, y - half[1], y + half[1]) for p in polygons]
        for x in xs:
            areas = [
                abs(signed_area(_clip_polygon(p, 0, x - half[0], x + half[0]))) for p in strips
            ]
            share = (areas[0] - sum(areas[1:])) / float(4 * half[0] * half[1])
            if share > 0 and share >= least_cover:
                places.append((x, y))
                cover.append(share)
                lines.append(line)
    if not places:
        raise SurfaceError(
            f"no place covers {least_cover:.0%} of the sensor",
            fix="take a larger face, or a smaller share",
        )
    return RasterPlan(
        np.array(places).reshape(-1, 2) @ turn.T, np.array(cover), np.array(lines, int), theta_rad
    )


def _positions(low: float, high: float, half: float, step: float) -> NDArray[np.float64]:
    """Return centres, a step apart, about the middle, that together reach from low to high."""
    rest = max(0.0, high - low - 2 * half)
    count = math.ceil(rest / step - 1e-9) + 1
    numbers = np.arange(count, dtype=np.float64) - (count - 1) / 2
    return (low + high) / 2 + numbers * step


def _clip_polygon(
    polygon: NDArray[np.float64], axis: int, low: float, high: float
) -> NDArray[np.float64]:
    """Cut a polygon to low ... high of one coordinate (Sutherland and Hodgman).

    What falls apart stays joined along the cut, which has no area.
    """
    for bound, sign in ((low, 1.0), (high, -1.0)):
        if not len(polygon):
            break
        inside = sign * (polygon[:, axis] - bound)
        following, beyond = np.roll(polygon, -1, axis=0), np.roll(inside, -1)
        kept = []
        for a, b, u, v in zip(polygon, following, inside, beyond, strict=True):
            if u >= 0:
                kept.append(a)
            if (u < 0) != (v < 0):
                cut = a + (b - a) * (u / (u - v))
                cut[axis] = bound
                kept.append(cut)
        polygon = np.array(kept, np.float64).reshape(-1, 2)
    return polygon


def surface_to_sensor(
    x_mm: float, y_mm: float, theta_rad: float, z_mm: float = 0.0
) -> NDArray[np.float64]:
    """Return T_surface_sensor (4, 4) of a level sensor."""
    c, s = math.cos(theta_rad), math.sin(theta_rad)
    return np.array(
        [[c, -s, 0.0, x_mm], [s, c, 0.0, y_mm], [0.0, 0.0, 1.0, z_mm], [0.0, 0.0, 0.0, 1.0]]
    )


def touch_at(
    T_surface_sensor: ArrayLike, force_n: float, wrist: WristStiffness | None = None
) -> Touch:
    """Return the touch of a sensor that stands there, its tilts being those of the arm.

    Raises `PoseError` for no pose, or a sensor that does not face the surface.
    """
    T = np.asarray(T_surface_sensor, np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise PoseError(f"a pose of shape {T.shape}", fix="give T_surface_sensor (4, 4), mm")
    if T[2, 2] < 0.5:
        angle = math.degrees(math.acos(max(-1.0, min(1.0, T[2, 2]))))
        raise PoseError(
            f"the sensor is tilted by {angle:.0f} degrees, it must face the surface within 60",
            fix="take the surface frame of the face that is touched, z outward",
        )
    return Touch(
        x_mm=float(T[0, 3]),
        y_mm=float(T[1, 3]),
        theta_rad=math.atan2(-T[0, 1], T[1, 1]),
        force_n=force_n,
        tilt_x_rad=math.asin(max(-1.0, min(1.0, T[2, 1]))),
        tilt_y_rad=math.atan2(-T[2, 0], T[2, 2]),
        wrist=wrist or WristStiffness(),
    )


_SHORT = 0.7  #: share of the step that the stiffness so far would ask for
Reason = Literal["contact", "no contact", "force limit", "travel limit", "too stiff"]


@dataclass(frozen=True, slots=True)
class ApproachLimits:
    """What an approach wants, and what it may do."""

    force_n: float = 80.0  #: to be reached
    tolerance_n: float = 1.0  #: either way
    felt_n: float = 0.5  #: from here on something is touched
    most_n: float = 120.0  #: at more, the sensor is lifted at once
    travel_mm: float = 20.0  #: from the start of the approach
    step_mm: float = 0.5  #: while nothing is felt
    finest_mm: float = 1e-4  #: that the arm can do


@dataclass(frozen=True, slots=True)
class Approach:
    """How an approach ended."""

    reason: Reason  #: "contact": the wanted force is there; otherwise why not
    travel_mm: float  #: where the sensor is now, from the start
    force_n: float  #: the last that was felt there

    def __bool__(self) -> bool:
        return self.reason == "contact"


def guarded_approach(
    feel: Callable[[float], float], limits: ApproachLimits | None = None
) -> Approach:
    """Move the sensor on until the wanted force is felt.

    `feel` moves the sensor to a travel (mm from the start, towards the object) and returns the
    force (N) there. After "no contact" and "force limit" the sensor is back at the start.

    Raises ContactError: limits that contradict each other, or a force that is no number.

    Examples
    --------
    >>> end = guarded_approach(lambda travel: max(0.0, 8.0 * (travel - 3.0)))
    >>> end.reason, round(end.travel_mm)
    ('contact', 13)
    """
    limits = limits or ApproachLimits()
    _check(limits)
    before = low = (0.0, 0.0)  # travel and force; low is the furthest with too little force
    high: tuple[float, float] | None = None  # the nearest with too much
    at, touched = 0.0, False
    while True:
        force = _feel_n(feel, at)
        touched |= force >= limits.felt_n
        if force > limits.most_n:
            feel(0.0)
            return Approach("force limit", 0.0, force)
        if abs(force - limits.force_n) <= limits.tolerance_n:
            return Approach("contact", at, force)
        if force > limits.force_n:
            high = (at, force)
        else:
            before, low = low, (at, force)
        if high and high[0] - low[0] <= limits.finest_mm:
            return Approach("too stiff", low[0], _feel_n(feel, low[0]))
        if not high and low[0] >= limits.travel_mm:
            if touched:
                return Approach("travel limit", at, force)
            feel(0.0)
            return Approach("no contact", 0.0, force)
        at = (
            _interpolate_travel(low, high, limits) if high else _advance_travel(before, low, limits)
        )


def _advance_travel(
    before: tuple[float, float], low: tuple[float, float], limits: ApproachLimits
) -> float:
    """Return the next travel while the force is still too small."""
    step = limits.step_mm
    if low[1] >= limits.felt_n:
        stiffness = (low[1] - before[1]) / max(low[0] - before[0], limits.finest_mm)
        wanted = _SHORT * (limits.force_n - low[1])
        step = min(step, wanted / stiffness) if stiffness > 0 else step / 4
    return min(low[0] + max(step, limits.finest_mm), limits.travel_mm)


def _interpolate_travel(
    low: tuple[float, float], high: tuple[float, float], limits: ApproachLimits
) -> float:
    """Return the next travel between too little and too much, by proportion."""
    share = (limits.force_n - low[1]) / (high[1] - low[1])
    return low[0] + min(max(share, 0.1), 0.9) * (high[0] - low[0])


def _feel_n(feel: Callable[[float], float], travel: float) -> float:
    force = float(feel(travel))
    if not math.isfinite(force):
        raise ContactError(
            f"the force at {travel:.4g} mm is {force}", fix="check the sensor and its calibration"
        )
    return force


def _check(limits: ApproachLimits) -> None:
    rising = 0 < limits.felt_n <= limits.force_n - limits.tolerance_n
    rising = rising and limits.force_n + limits.tolerance_n <= limits.most_n < math.inf
    steps = 0 < limits.finest_mm <= limits.step_mm <= limits.travel_mm < math.inf
    if not (rising and steps and limits.tolerance_n > 0):
        raise ContactError(
            f"limits that contradict each other: {limits}",
            fix="felt_n < force_n < most_n, and finest_mm < step_mm < travel_mm, all above 0",
        )


@dataclass(frozen=True, slots=True)
class JointErrors:
    """How joints fail to stand where they should."""

    noise_rad: tuple[float, ...] = (3e-4,) * AXES  #: standard deviation
    backlash_rad: tuple[float, ...] = (1e-3,) * AXES  #: whole width of the play

    def covariance(self) -> NDArray[np.float64]:
        """Return (5, 5), rad^2, the way the joint came taken as unknown."""
        noise, play = np.array(self.noise_rad), np.array(self.backlash_rad)
        return np.diag(noise**2 + play**2 / 12)


@dataclass(frozen=True, slots=True)
class ArmPath:
    """Poses of a scan, one after the other."""

    believed: NDArray[np.float64]  #: (n, 4, 4) T_base_sensor, mm
    true: NDArray[np.float64]  #: (n, 4, 4) T_base_sensor, mm
    covariance: NDArray[np.float64]  #: (n, 6, 6) of true about believed, as in `probe.arm`


def follow_poses(
    arm: Arm, commanded: Sequence[ArrayLike], errors: JointErrors, rng: np.random.Generator
) -> ArmPath:
    """Follow commanded poses (n, 4, 4) T_base_sensor, mm, with an arm that is not perfect.

    They are in the order of the scan; lifts between touches may be among them, they decide on which
    side of its play a joint arrives. `rng` draws the noise, and where in their play the joints
    start. The probe hangs level and half way.

    Raises `PoseError` for a pose that the arm cannot reach.
    """
    wrist = Wrist()
    hanging = WristPose(sum(wrist.travel_mm) / 2, 0.0, 0.0, np.zeros((3, 3)))
    T_gripper_sensor = gripper_to_plate(wrist, hanging) @ plate_to_sensor(wrist)
    back = np.linalg.inv(T_gripper_sensor)
    angles = joint_path(arm, [np.asarray(T, np.float64) @ back for T in commanded])
    actual = (
        joints_with_play(angles, errors, rng) + rng.normal(0, 1, angles.shape) * errors.noise_rad
    )
    spread = errors.covariance()
    believed = [sensor_pose(arm, q, spread, wrist, hanging) for q in angles]
    true = [forward(arm, q) @ T_gripper_sensor for q in actual]
    return ArmPath(
        np.array([pose.T_base_sensor for pose in believed]).reshape(-1, 4, 4),
        np.array(true).reshape(-1, 4, 4),
        np.array([pose.covariance for pose in believed]).reshape(-1, 6, 6),
    )


def joint_path(arm: Arm, poses: Sequence[ArrayLike]) -> NDArray[np.float64]:
    """Return joint angles (n, 5) for poses T_base_gripper, each branch next to the last one.

    Raises `PoseError` for a pose that the arm cannot reach; the message names its number.
    """
    path: list[NDArray[np.float64]] = []
    for number, pose in enumerate(poses):
        try:
            branches = inverse(arm, pose)
        except PoseError as error:
            raise PoseError(
                f"pose {number} of {len(poses)}: {error.cause}", fix=error.fix, place=error.place
            ) from error
        last = path[-1] if path else branches[0]
        path.append(min(branches, key=lambda q: float(np.abs(q - last).max())))
    return np.array(path).reshape(-1, AXES)


def joints_with_play(
    angles: NDArray[np.float64], errors: JointErrors, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return where joints with play stand, (n, 5), when their motors go through `angles`.

    A joint stays where it is while its motor moves within the play, and is dragged along at
    either end of it.
    """
    half = np.array(errors.backlash_rad) / 2
    stands = np.empty_like(angles)
    now = angles[:1] + rng.uniform(-1, 1, (1, AXES)) * half
    for i, motor in enumerate(angles):
        now = np.clip(now, motor - half, motor + half)
        stands[i] = now
    return stands
