"""One touch of a mosaic: what was felt, and what is known of where. Thesis 4.3.

Three things can be known. The arm believes a pose in a frame of its own (the robot's base, or a
first touch): every touch of a scan has it, with an error of a tactel or so. The reader decodes
a pose in the frame of the face, with an error of hundredths of a tactel, where there are
symbols enough. A probe that is moved by hand counts its steps from touch to touch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from recognizer.scan.mosaic.errors import MosaicError
from recognizer.scan.mosaic.planar import planar_pose
from recognizer.touch.recognition import Recognition
from recognizer.touch.signal import Signal

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PlanarBelief:
    """A pose in the plane and how sure it is."""

    pose: Array  #: (3,) x, y (mm), theta (rad)
    covariance: Array  #: (3, 3) of them


@dataclass(frozen=True, slots=True, eq=False)
class PlacedTouch:
    """What was felt, and where that may be; one of the places is enough."""

    signal: Signal
    believed: PlanarBelief | None = None  #: by the arm, in the arm's plane
    decoded: PlanarBelief | None = None  #: by the reader, in the frame of the face
    stepped: PlanarBelief | None = None  #: from the touch before, in its frame (dead reckoning)
    seq: int = 0

    def __post_init__(self) -> None:
        if self.believed is None and self.decoded is None and self.stepped is None:
            raise MosaicError(
                f"touch {self.seq} has no place",
                fix="give what the arm believes, or leave the touch out if it was not decoded",
                place=f"touch {self.seq}",
            )


def planar_belief(pose: ArrayLike, covariance: ArrayLike) -> PlanarBelief:
    """Return a checked place.

    Parameters
    ----------
    pose
        (3,) x, y (mm) and theta (rad), or T_plane_sensor (4, 4).
    covariance
        (3, 3) of x, y and theta; or (3,) standard deviations.

    Raises
    ------
    MosaicError
        Numbers that are no pose, or a covariance that is not positive definite.
    """
    at = np.array(pose, np.float64)
    if at.shape == (4, 4):
        at = planar_pose(at)
    spread = np.array(covariance, np.float64)
    if spread.shape == (3,):
        spread = np.diag(spread**2)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise MosaicError(
            f"a place of shape {at.shape} or with values that are no numbers",
            fix="give x, y (mm) and theta (rad), or T_plane_sensor (4, 4)",
        )
    sound = spread.shape == (3, 3) and bool(np.isfinite(spread).all())
    sound = sound and np.allclose(spread, spread.T, rtol=1e-6, atol=0)
    scale = np.sqrt(np.diag(spread)) if sound else np.zeros(3)
    if not (scale > 0).all() or np.linalg.eigvalsh(spread / np.outer(scale, scale))[0] < 1e-12:
        raise MosaicError(
            "a covariance that is not positive definite",
            fix="give (3,) standard deviations above 0, or a covariance (3, 3)",
        )
    at.setflags(write=False)
    spread.setflags(write=False)
    return PlanarBelief(at, spread)


def decoded_place(recognition: Recognition) -> PlanarBelief | None:
    """Return where the reader says that a touch stands on its face; None without an answer."""
    if recognition.T_face_probe is None or recognition.covariance is None:
        return None
    return planar_belief(recognition.T_face_probe, recognition.covariance)
