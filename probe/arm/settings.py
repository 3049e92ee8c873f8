"""Numbers that decide how an arm is moved and its pose is inverted."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ArmSettings:
    """Inverse kinematics and damping."""

    rounding: float = 1e-9  #: of the arm's length: what a pose may be off by rounding
    length_mm: float = 228.6  #: at which a mm/s of the point counts as much as rad/s of turning
    least_singular: float = 0.02
    """Value, of the Jacobian in links and radians, that is damped below."""


ARM_MOTION = ArmSettings()
