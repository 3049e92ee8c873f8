"""Answers as ROS 2 messages, and a file of images and answers as they come.

::

    /touch/object   geometry_msgs/PoseWithCovarianceStamped  the object, in the robot's base where
                    that is known (frame_id "base"), else in the sensor's frame ("sensor")
    /touch/answer   encoded_objects_msgs/Recognition         every answer, refusals too
    /touch/image, /touch/frame, /touch/pose                  see `probe.recording.mcap`

Positions in metres; covariances (x, y, z, rx, ry, rz) in the axes of the frame_id, in m and rad.
"""

from __future__ import annotations

import json
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import numpy as np

from encoded_objects.base.files import refuse_taken, staged_file
from encoded_objects.base.output import json_value
from probe.arm import SensorPose
from probe.frame import Frame
from probe.recording.layout import RecordingOrigin
from probe.recording.mcap import McapWriter
from probe.recording.ros import (
    BASE_FRAME,
    POSE_WITH_COVARIANCE,
    RECOGNITION,
    SENSOR_FRAME,
    covariance_message,
)
from recognizer.command.answers import Answer, AnswerSink
from recognizer.touch.recognition import Recognition
from recognizer.touch.robot import ObjectPose, object_pose

OBJECT_TOPIC: Final = "/touch/object"
ANSWER_TOPIC: Final = "/touch/answer"


class McapSink(AnswerSink):
    """An MCAP file of images and answers; it appears when it is closed.

    Raises EncodedObjectsError, MissingExtraError: a file is there already, or the extra `robot` is
    not installed.
    """

    def __init__(self, out: Path, origin: RecordingOrigin, *, replace: bool) -> None:
        refuse_taken(out, ".mcap", replace=replace)
        with ExitStack() as stack:
            stream = stack.enter_context(open(stack.enter_context(staged_file(out)), "wb"))
            self._writer = stack.enter_context(McapWriter(stream, origin))
            self._open = stack.pop_all()

    def frame(self, frame: Frame) -> None:
        """Append an image."""
        self._writer.frame(frame)

    def answer(self, answer: Answer) -> None:
        """Append an answer, and the object where it is known."""
        at = answer.touch.t_ns, answer.touch.seq
        self._writer.message(ANSWER_TOPIC, RECOGNITION, recognition_message(answer), *at)
        placed = object_message(answer.found, answer.in_base, answer.touch.t_ns)
        if placed is not None:
            self._writer.message(OBJECT_TOPIC, POSE_WITH_COVARIANCE, placed, *at)

    def close(self) -> None:
        """Finish the file and give it its name."""
        self._open.close()


def recognition_message(answer: Answer) -> dict[str, Any]:
    """Return the `Recognition` of an answer."""
    found = answer.found
    row, column = found.index or (-1, -1)
    return {
        "t_ns": answer.touch.t_ns,
        "seq": answer.touch.seq,
        "object": found.object or "",
        "face": found.face or "",
        "row": row,
        "column": column,
        "margin": np.nan if found.margin is None else found.margin,
        "doubt": np.nan if found.doubt is None else found.doubt,
        "reason": found.reason,
        "json": json.dumps(json_value(answer.as_json())),
    }


def object_message(
    found: Recognition, in_base: ObjectPose | None, t_ns: int
) -> dict[str, Any] | None:
    """Return the `PoseWithCovarianceStamped` of the object; None where it is not known.

    It is the object in the robot's base; without that, in the sensor's frame.
    """
    placed, frame_id = in_base, BASE_FRAME
    if placed is None:
        here = SensorPose(np.eye(4), np.zeros((6, 6)))
        placed, frame_id = object_pose(found, here), SENSOR_FRAME
    if placed is None:
        return None
    return covariance_message(placed.T_robot_object, placed.covariance, t_ns, frame_id)
