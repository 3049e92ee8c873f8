"""Answers as text and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from encoded_objects.console.output import number

if TYPE_CHECKING:
    from recognizer.touch.contacts import TouchImage
    from recognizer.touch.recognition import Recognition
    from recognizer.touch.robot import ObjectPose


def entry(touch: TouchImage, found: Recognition, in_base: ObjectPose | None) -> dict[str, Any]:
    """Return what `--json` gives for a touch."""
    return found.as_json() | {
        "x_mm": found.x_mm,
        "y_mm": found.y_mm,
        "theta_deg": found.theta_deg,
        "frames": touch.frames,
        "t_ns": touch.t_ns,
        "T_robot_object": None if in_base is None else in_base.T_robot_object,
        "robot_covariance": None if in_base is None else in_base.covariance,
    }


def sentence(touch: TouchImage, found: Recognition, in_base: ObjectPose | None) -> str:
    """Return an answer in a line: what and where, or why not and what to do."""
    return f"{touch.seq}: {found}" + ("" if in_base is None else f"; {in_base}")


def summary(read: int, answered: int, frames: int | None) -> str:
    """Return what became of all touches, in words."""
    if read == 0:
        return "no touch" + ("" if frames is None else f" in {number(frames, 'frame')}")
    many = "1 touch" if read == 1 else f"{read:,} touches"
    return f"{many}, {answered:,} recognised"
