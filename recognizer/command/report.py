"""Answers as text and as JSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from encoded_objects.base.output import count_of

if TYPE_CHECKING:
    from recognizer.thesis.edges.line import Edge
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


def edge_entry(edge: Edge, found: Recognition) -> dict[str, Any]:
    """Return what `--json` gives for an edge: in the sensor frame, on the object if it is known.

    Positions are of the middle of what is seen, mm; the face lies left of the direction.
    """
    value: dict[str, Any] = {
        "position_mm": edge.middle_mm,
        "direction_deg": edge.direction_deg,
        "length_mm": edge.length_mm,
        "position_sd_mm": edge.across_mm,
        "direction_sd_deg": edge.turn_deg,
    }
    if found.T_object_probe is not None:
        T, angle = found.T_object_probe, edge.angle_rad
        value["object_position_mm"] = T[:3, :2] @ edge.middle_mm + T[:3, 3]
        value["object_direction"] = T[:3, 0] * math.sin(angle) - T[:3, 1] * math.cos(angle)
    return value


def edge_words(edge: Edge) -> str:
    """Return an edge in words."""
    x, y = edge.middle_mm.tolist()
    return (
        f"an edge at ({x:.2f}, {y:.2f}) mm +- {edge.across_mm:.2f}, "
        f"{edge.direction_deg:.1f} degrees +- {edge.turn_deg:.1f}"
    )


def sentence(touch: TouchImage, found: Recognition, in_base: ObjectPose | None) -> str:
    """Return an answer in a line: what and where, or why not and what to do."""
    return f"{touch.seq}: {found}" + ("" if in_base is None else f"; {in_base}")


def summary(read: int, answered: int, frames: int | None) -> str:
    """Return what became of all touches, in words."""
    if read == 0:
        return "no touch" + ("" if frames is None else f" in {count_of(frames, 'frame')}")
    many = "1 touch" if read == 1 else f"{read:,} touches"
    return f"{many}, {answered:,} recognised"
