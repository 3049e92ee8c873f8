"""Recordings as MCAP files of ROS 2 messages, without ROS and without loss.

::

    /touch/image   sensor_msgs/Image              counts as 32FC1
    /touch/pose    geometry_msgs/PoseStamped      T_base_sensor, m, where it is known
    /touch/frame   encoded_objects_msgs/TouchFrame  the rest, see `probe.recording.ros`
    metadata "recording"                          what the attributes of a recording say, as JSON

`probe.recording.mcap_reader` reads them, and files by somebody else.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from encoded_objects.base.errors import require
from probe.closing import Closing
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin
from probe.recording.opened import explain_errors
from probe.recording.read import Recording
from probe.recording.ros import (
    BASE_FRAME,
    DEFINITIONS,
    IMAGE,
    METADATA,
    POSE,
    TOUCH_FRAME,
    frame_message,
    image_message,
    pose_message,
)

IMAGE_TOPIC: Final = "/touch/image"
POSE_TOPIC: Final = "/touch/pose"
FRAME_TOPIC: Final = "/touch/frame"


class McapWriter(Closing):
    """An MCAP file of ROS 2 messages that is being written.

    Parameters
    ----------
    stream
        Where it goes.
    origin
        Where the frames come from.

    Raises
    ------
    MissingExtraError
        The libraries of the extra `robot` are not installed.
    """

    def __init__(self, stream: IO[bytes], origin: RecordingOrigin) -> None:
        require("mcap_ros2.writer", extra="robot", purpose="MCAP")
        from mcap_ros2.writer import Writer

        self._writer = Writer(stream)
        self._schemas: dict[str, Any] = {}
        said = {
            "sensor": origin.sensor,
            "calibration": origin.calibration,
            "units": origin.units,
            "sensor_type": origin.sensor_type,
            "more": json.dumps({name: _plain(value) for name, value in origin.more.items()}),
        }
        self._writer.add_metadata(METADATA, said)

    def frame(self, frame: Frame) -> None:
        """Append a frame."""
        self.message(IMAGE_TOPIC, IMAGE, image_message(frame), frame.t_ns, frame.seq)
        self.message(FRAME_TOPIC, TOUCH_FRAME, frame_message(frame), frame.t_ns, frame.seq)
        if frame.pose is not None:
            pose = pose_message(frame.pose, frame.t_ns, BASE_FRAME)
            self.message(POSE_TOPIC, POSE, pose, frame.t_ns, frame.seq)

    def message(self, topic: str, kind: str, fields: Mapping[str, Any], t_ns: int, n: int) -> None:
        """Append a message of one of the types of `DEFINITIONS`."""
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_msgdef(kind, DEFINITIONS[kind])
        self._writer.write_message(
            topic, self._schemas[kind], fields, log_time=max(t_ns, 0), sequence=n & 0xFFFFFFFF
        )

    def close(self) -> None:
        """Write what belongs at the end of the file; the stream stays open."""
        self._writer.finish()


def export_mcap(recording: Recording, out: Path) -> int:
    """Write a recording as an MCAP file; returns the number of frames.

    Raises
    ------
    RecordingError
        The recording cannot be read, or the file not be written.
    """
    with (
        explain_errors(out, "write"),
        open(out, "wb") as stream,
        McapWriter(stream, recording.origin) as writer,
    ):
        for frame in recording.frames():
            writer.frame(frame)
    return len(recording)


def _plain(value: Any) -> Any:
    """Return a value of an attribute as JSON holds it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value.item() if isinstance(value, np.generic) else value
