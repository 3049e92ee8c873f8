"""Forces on the lower plate -> where it hangs, between the end stops. Thesis 4.1.

A spring at each corner and one in the middle, linear; small tilts. mm, N, rad.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from probe.contact.contract import WristStiffness
from probe.errors import PoseError
from probe.wrist.geometry import FREEDOMS, Wrist, WristPose


def pose_under_load(
    wrist: Wrist, force_n: float, moment_x_nmm: float = 0.0, moment_y_nmm: float = 0.0
) -> WristPose:
    """Return where the lower plate hangs under a force and moments about its centre.

    Parameters
    ----------
    wrist
        The wrist; its plate hangs at the lower end stop when nothing presses.
    force_n
        Pressing the plates together, along -z.
    moment_x_nmm, moment_y_nmm
        Turning the plate about x and y, wrist frame, N mm.
    """
    z = wrist.travel_mm[1] - force_n / (4 * wrist.spring_n_mm + wrist.axial_n_mm)
    turns = np.linalg.solve(_tilt_springs(wrist), [moment_x_nmm, moment_y_nmm])
    free = (z, float(turns[0]), float(turns[1]))
    held = [min(max(v, low), high) for v, (low, high) in zip(free, wrist.ranges(), strict=True)]
    stops = tuple(
        name
        for name, value, (low, high) in zip(FREEDOMS, free, wrist.ranges(), strict=True)
        if not low < value < high
    )
    return WristPose(held[0], held[1], held[2], np.zeros((3, 3)), 0.0, stops)


def stiffness(wrist: Wrist) -> WristStiffness:
    """Return how the springs hold the plate, for the contact models.

    Raises
    ------
    PoseError
        The springs couple the two turns, which the contact models cannot say.
    """
    springs = _tilt_springs(wrist)
    if abs(springs[0, 1]) > 0.01 * math.sqrt(springs[0, 0] * springs[1, 1]):
        raise PoseError(
            f"at gamma = {math.degrees(wrist.gamma_rad):g} degrees a turn about x makes a moment "
            "about y",
            fix="take gamma = 90 degrees, or no springs at the corners",
        )
    return WristStiffness(float(springs[0, 0]), float(springs[1, 1]))


def _tilt_springs(wrist: Wrist) -> NDArray[np.float64]:
    """Return moments about (x, y) per turn about (x, y), N mm / rad, at small tilts."""
    x, y = wrist.corners_mm().T
    k = wrist.spring_n_mm
    return np.array([[k * (y @ y), -k * (x @ y)], [-k * (x @ y), k * (x @ x)]])
