"""A scan in simulation: touches one after the other on a way over a face. Thesis 4.3.

Region of a scene + sensor -> the places of a raster, line by line, there and back; `raster`
stands on them exactly, `kinesthetic` is an arm with play in its joints, which presses until it
measures the force, and believes to stand where it was sent. Poses are in the robot's base: the
face lies there level, before the arm, at a place that frames do not say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.sensor_type import SensorType
from probe.arm import Arm
from probe.contact.contract import Contact, Touch
from probe.errors import SurfaceError
from probe.scan import (
    ApproachLimits,
    JointErrors,
    follow_poses,
    guarded_approach,
    raster,
    surface_to_sensor,
    touch_at,
)
from probe.simulate.scene import Scene, pose_of
from probe.wrist import Wrist, counts_of, distances_at, stiffness, travel_under_load

Array = NDArray[np.float64]
ScanKind = Literal["raster", "kinesthetic"]

KINDS: Final = ("raster", "kinesthetic")
_PLANAR: Final = (0, 1, 5)  # x, y and the turn about z among a pose's six freedoms

FACE_AT_MM: Final = (300.0, 0.0, 100.0)  #: middle of the region in the base, within reach
FACE_TURN_RAD: Final = 0.2  #: of the face about the base's z, so that no axes agree by chance
LEAST_COVER: Final = 0.5  #: over the face, of the best place's: with less the sensor slips off
LIFT_MM: Final = 10.0  #: between two touches; the way decides on which side of its play a joint is
GAP_MM: Final = 3.0  #: from where an approach begins to the surface


@dataclass(frozen=True, slots=True, eq=False)
class ScanPath:
    """Where a scan touches, and where the robot believes it does."""

    touches: tuple[Touch, ...]
    T_base_surface: Array | None  #: (4, 4) mm; None: a round face, every touch has its own
    T_base_object: Array | None  #: (4, 4) mm; None: the object's frame is not known
    slips: tuple[Array, ...] = ()  #: (4, 4) from true to believed poses, base; none: as it is
    error: tuple[float, float] = (0.0, 0.0)  #: standard deviation of believed from true: mm, rad
    wrist: Wrist | None = None  #: None: its transducers are not read

    def __len__(self) -> int:
        return len(self.touches)

    def true_pose(self, number: int, scene: Scene, contact: Contact) -> Array:
        """Return T_base_sensor (4, 4) of a touch that pressed on a scene, as it is."""
        T_base_surface = self.T_base_surface
        if T_base_surface is None:
            T_base_surface = _require_transform(self.T_base_object) @ _require_transform(
                scene.T_object_surface
            )
        return T_base_surface @ pose_of(self.touches[number], contact)

    def believed_pose(self, number: int, true: Array) -> Array:
        """Return T_base_sensor (4, 4), the robot's estimate; depth along the normal is exact."""
        return self.slips[number] @ true if self.slips else true

    def wrist_counts(self, number: int, contact: Contact) -> NDArray[np.uint16] | None:
        """Return (4,) readings of the wrist's transducers while it pressed."""
        if self.wrist is None:
            return None
        touch = self.touches[number]
        z_mm = travel_under_load(self.wrist, touch.force_n)
        bent_x = contact.tilt_x_rad - touch.tilt_x_rad
        bent_y = contact.tilt_y_rad - touch.tilt_y_rad
        return counts_of(self.wrist, distances_at(self.wrist, z_mm, bent_x, -bent_y))


def scan_path(
    scene: Scene,
    sensor: SensorType,
    kind: ScanKind,
    rng: np.random.Generator,
    *,
    most: int | None = None,
    theta_rad: float = 0.0,
    force_n: float = 80.0,
) -> ScanPath:
    """Plan a scan of a face.

    Parameters
    ----------
    kind
        Poses as they are, or those that an arm believes.
    rng
        Where on its way a shorter scan begins; the arm's play and noise.
    most
        Touches; so many that follow each other, all by default.
    theta_rad
        Turn of the sensor, and of the lines.

    Raises
    ------
    SurfaceError
        When the sensor finds no place on the face, or an arm shall touch a round one.
    PoseError
        When the arm does not reach.
    ContactError
        When the force cannot be measured.
    """
    way = raster(scene.region.loops(), sensor, theta_rad=theta_rad).there_and_back(LEAST_COVER)
    if most is not None and most < len(way):
        begin = int(rng.integers(len(way) - most + 1))
        way = way[begin : begin + most]
    x_mm, y_mm, z_mm = FACE_AT_MM
    T_base_middle = surface_to_sensor(x_mm, y_mm, FACE_TURN_RAD, z_mm)
    level = tuple(Touch(x, y, theta_rad, force_n) for x, y in way.tolist())
    if scene.scene_at is not None:
        if kind == "kinesthetic":
            raise SurfaceError("an arm of five axes cannot go round a round face",
                               fix="scan it by raster", place=scene.name)  # fmt: skip
        return ScanPath(level, None, T_base_middle)
    x, y = scene.centre_mm().tolist()
    T_base_surface = T_base_middle @ surface_to_sensor(-x, -y, 0.0)
    T_base_object = None
    if scene.T_object_surface is not None:
        T_base_object = T_base_surface @ np.linalg.inv(scene.T_object_surface)
    if kind == "raster":
        return ScanPath(level, T_base_surface, T_base_object)
    wrist, lift = Wrist(), surface_to_sensor(0.0, 0.0, 0.0, LIFT_MM)
    stands = [T_base_surface @ surface_to_sensor(x, y, theta_rad) for x, y in way.tolist()]
    went = follow_poses(
        Arm(), [pose for stand in stands for pose in (lift @ stand, stand)], JointErrors(), rng
    )
    true, spread = went.true[1::2], went.covariance[1::2]
    T_surface_base, springs = np.linalg.inv(T_base_surface), stiffness(wrist)
    touches = tuple(
        touch_at(T_surface_base @ stand, _pressed_n(wrist, force_n, rng), springs) for stand in true
    )
    sd_x, sd_y, sd_turn = np.sqrt(np.diagonal(spread, axis1=1, axis2=2).mean(axis=0))[list(_PLANAR)]
    error = (math.sqrt((sd_x**2 + sd_y**2) / 2), float(sd_turn))
    pairs = zip(went.believed[1::2], true, strict=True)
    slips = tuple(believed @ np.linalg.inv(stand) for believed, stand in pairs)
    return ScanPath(touches, T_base_surface, T_base_object, slips, error, wrist)


def _pressed_n(wrist: Wrist, force_n: float, rng: np.random.Generator) -> float:
    """Return the force at which an approach ends; the wrist gives way, not the overlay."""
    springs_n_mm = 4 * wrist.spring_n_mm + wrist.axial_n_mm
    gap_mm = GAP_MM + rng.uniform(-1.0, 1.0)
    limits = ApproachLimits(
        force_n=force_n,
        tolerance_n=min(1.0, force_n / 20),
        felt_n=min(0.5, force_n / 4),
        most_n=1.5 * force_n,
        travel_mm=2 * GAP_MM + 1.5 * force_n / springs_n_mm,
    )
    return guarded_approach(lambda at: springs_n_mm * max(0.0, at - gap_mm), limits).force_n


def _require_transform(transform: Array | None) -> Array:
    if transform is None:
        raise SurfaceError("the object's frame is not known", fix="touch a registered face")
    return transform
