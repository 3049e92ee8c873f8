"""Answers as text and as JSON."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from encoded_objects.console.output import number

if TYPE_CHECKING:
    from recognizer.touch.contacts import TouchImage
    from recognizer.touch.recognition import Recognition
    from recognizer.touch.robot import ObjectPose

#: what a person does about a reason for which there is no answer
WAYS_OUT = {
    "no contact": "press the probe onto the object",
    "too few symbols": "press harder, or where more symbols are: away from edges and holes",
    "ambiguous": "touch again a few mm beside",
    "not an encoded surface": "touch again more evenly, away from edges; is the object in this "
    "database, and the overlay the right one (--overlay)?",
    "outside every face": "move the probe onto the face",
}


def entry(touch: TouchImage, found: Recognition, placed: ObjectPose | None) -> dict[str, Any]:
    """Return what `--json` gives for a touch."""
    values = found.as_json()
    x, y, theta = (None, None, None) if found.T_face_probe is None else on_face(found)
    values |= {"x_mm": x, "y_mm": y, "theta_deg": theta, "frames": touch.frames, "t_ns": touch.t_ns}
    values["T_robot_object"] = None if placed is None else placed.T_robot_object
    values["robot_covariance"] = None if placed is None else placed.covariance
    return values


def on_face(found: Recognition) -> tuple[float, float, float]:
    """Return x, y (mm) and the turn (degrees) of the probe on the face."""
    T = found.T_face_probe
    if T is None:
        return math.nan, math.nan, math.nan
    return float(T[0, 3]), float(T[1, 3]), math.degrees(math.atan2(T[1, 0], T[0, 0]))


def sentence(touch: TouchImage, found: Recognition, placed: ObjectPose | None) -> str:
    """Return an answer in a line: what and where, or why not and what to do."""
    head = f"{touch.seq}: "
    if not found:
        way_out = WAYS_OUT.get(found.reason, "")
        doubt = ""
        if found.runner_up is not None and found.reason == "ambiguous":
            other = found.runner_up
            doubt = f", {other.object}/{other.face} among others"
        return f"{head}not recognised: {found.reason}{doubt}" + (f"; {way_out}" if way_out else "")
    x, y, theta = on_face(found)
    row, column = found.index or (0, 0)
    where = f"({x:.2f}, {y:.2f}) mm{_give(found)} turned {theta:.1f} degrees"
    alone = found.margin is None or math.isinf(found.margin)
    parts = [
        f"{head}{found.object}/{found.face} at {where}",
        f"array ({row}, {column})",
        "no other place comes near" if alone else f"margin {found.margin:.0f} nats",
    ]
    if placed is not None:
        at = ", ".join(f"{value:.1f}" for value in placed.T_robot_object[:3, 3])
        spread = math.sqrt(max(float(placed.covariance[:3, :3].trace()), 0.0))
        parts.append(f"object in the robot's base at ({at}) mm +- {spread:.1f}")
    return "; ".join(parts)


def summary(read: int, answered: int, frames: int | None) -> str:
    """Return what became of all touches, in words."""
    if read == 0:
        return "no touch" + ("" if frames is None else f" in {number(frames, 'frame')}")
    many = "1 touch" if read == 1 else f"{read:,} touches"
    return f"{many}, {answered:,} recognised"


def _give(found: Recognition) -> str:
    """Return the standard deviation of the place, in words."""
    if found.covariance is None:
        return ""
    return f" +- {math.sqrt(max(float(found.covariance[:2, :2].trace()), 0.0)):.2f}"
