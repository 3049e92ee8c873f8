"""An answer of `recognize-object`: as a value, as JSON and in words."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

from encoded_objects.base.output import count_of
from recognizer.touch.recognition import NO_CONTACT

if TYPE_CHECKING:
    from probe.frame import Frame
    from recognizer.thesis.edges import Edge
    from recognizer.touch.recognition import Recognition
    from recognizer.touch.robot import ObjectPose
    from recognizer.touch.source import TouchImage


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """A touch and what it says."""

    touch: TouchImage
    found: Recognition
    in_base: ObjectPose | None
    touches: int | None = None  #: of the scan that it rests on; None: no scan
    edges: tuple[Edge, ...] | None = None  #: seen in the touch; None: not asked for

    def as_json(self) -> dict[str, Any]:
        """Return what files and networks get."""
        return self.found.as_json() | {
            "x_mm": self.found.x_mm,
            "y_mm": self.found.y_mm,
            "theta_deg": self.found.theta_deg,
            "frames": self.touch.frames,
            "t_ns": self.touch.t_ns,
            "T_robot_object": None if self.in_base is None else self.in_base.T_robot_object,
            "robot_covariance": None if self.in_base is None else self.in_base.covariance,
        }

    def printed_json(self) -> dict[str, Any]:
        """Return what `--json` prints: of a scan with its touches, and edges if asked for."""
        entry = self.as_json()
        if self.touches is not None:
            entry["touches"] = self.touches
        if self.edges is not None:
            entry["edges"] = [_edge_json(edge, self.found) for edge in self.edges]
        return entry

    def sentence(self, needed: int) -> str:
        """Return it in a line: object and place, or the reason and the way out.

        An answer of a scan takes about `needed` touches.
        """
        text = f"{self.touch.seq}: {self.found}"
        if self.touches is None:
            return text + ("" if self.in_base is None else f"; {self.in_base}")
        if not self.found and self.found.reason != NO_CONTACT:
            more = f"; go on: about {needed} touches" if self.touches < needed else ""
            text = f"{self.touch.seq}: not yet: {self.found.reason}{more}"
            text += f"; next: {self.found.next}" if self.found.next is not None else ""
        text += f" ({count_of(self.touches, 'touch')})"
        return "; ".join((text, *map(_edge_text, self.edges or ())))


class AnswerSink(ABC):
    """Takes images and answers as they come; a context manager."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None:
        """Complete the output; a second call does nothing."""

    @abstractmethod
    def frame(self, frame: Frame) -> None:
        """Take an image."""

    @abstractmethod
    def answer(self, answer: Answer) -> None:
        """Take an answer."""


def _edge_json(edge: Edge, found: Recognition) -> dict[str, Any]:
    """Return an edge in the sensor frame, and on the object if it is known.

    Positions are those of its middle, mm; the face lies left of the direction.
    """
    value: dict[str, Any] = {
        "position_mm": edge.middle_mm, "direction_deg": edge.direction_deg,
        "length_mm": edge.length_mm,
        "position_sd_mm": edge.across_mm, "direction_sd_deg": edge.turn_deg,
    }  # fmt: skip
    if found.T_object_probe is not None:
        T, angle = found.T_object_probe, edge.angle_rad
        value["object_position_mm"] = T[:3, :2] @ edge.middle_mm + T[:3, 3]
        value["object_direction"] = T[:3, 0] * math.sin(angle) - T[:3, 1] * math.cos(angle)
    return value


def _edge_text(edge: Edge) -> str:
    x, y = edge.middle_mm.tolist()
    return (
        f"an edge at ({x:.2f}, {y:.2f}) mm +- {edge.across_mm:.2f}, "
        f"{edge.direction_deg:.1f} degrees +- {edge.turn_deg:.1f}"
    )
