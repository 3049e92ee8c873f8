"""Frames as ROS 2 messages: plain values under the field names of the message definitions.

Images are `sensor_msgs/Image` (32FC1, counts as 32-bit floats, which hold them exactly), poses
`geometry_msgs/PoseStamped` in metres. What no message of ROS holds without loss stands in
`encoded_objects_msgs/TouchFrame`, what a touch says in `encoded_objects_msgs/Recognition`. The
values fit any writer that takes dictionaries, and rclpy's `set_message_fields`.

`cdr_bytes` writes messages as the plain CDR that rmw, zenoh bridges and MCAP files carry:
little-endian, each number aligned to its own size from behind the four bytes of the head; a string
is its length with the closing zero, then its bytes. OMG, "DDS-XTypes", 7.4.1 (PLAIN_CDR).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from probe.frame import Frame

IMAGE: Final = "sensor_msgs/msg/Image"
POSE: Final = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE: Final = "geometry_msgs/msg/PoseWithCovarianceStamped"
TOUCH_FRAME: Final = "encoded_objects_msgs/msg/TouchFrame"
RECOGNITION: Final = "encoded_objects_msgs/msg/Recognition"
SENSOR_FRAME: Final = "sensor"  #: frame_id: x right, y up, z away from the object
BASE_FRAME: Final = "base"  #: frame_id of the robot's base
METADATA: Final = "recording"  #: name of the metadata of an MCAP file

_LINE = "=" * 80 + "\n"
_HEADER = (
    f"{_LINE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{_LINE}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
_POSE = (
    f"{_LINE}MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n"
    f"{_LINE}MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n"
    f"{_LINE}MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
)
#: type -> definition, with those of its parts
DEFINITIONS: Final[dict[str, str]] = {
    IMAGE: (
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\n"
        "uint8 is_bigendian\nuint32 step\nuint8[] data\n" + _HEADER
    ),
    POSE: "std_msgs/Header header\ngeometry_msgs/Pose pose\n" + _HEADER + _POSE,
    POSE_WITH_COVARIANCE: (
        "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"
        + _HEADER
        + f"{_LINE}MSG: geometry_msgs/PoseWithCovariance\nPose pose\nfloat64[36] covariance\n"
        + _POSE
    ),
    TOUCH_FRAME: (
        "# What a frame of a tactile probe holds beside its image.\n"
        "int64 t_ns           # device time, unwrapped, ns\n"
        "int64 seq            # number of the frame, unwrapped; a gap means lost frames\n"
        "uint16[] wrist       # ADC counts of the wrist's transducers\n"
        "bool has_pose\n"
        "float64[16] pose     # T_base_sensor by rows, mm\n"
    ),
    RECOGNITION: (
        "# What a touch says.\n"
        "int64 t_ns          # device time of the touch, ns\n"
        "int64 seq           # number of its first frame\n"
        "string object       # empty: not recognised\n"
        "string face\n"
        "int32 row           # of the array's cell under the sensor's centre; -1: none\n"
        "int32 column\n"
        "float64 margin      # nats to the runner-up; NaN: not known\n"
        "float64 doubt       # expected number of places that fit by chance; NaN: not known\n"
        "string reason       # why not\n"
        "string json         # the whole answer, as recognize-object --json prints it\n"
    ),
}

_HEADER_FIELDS: Final = (
    ("header.stamp.sec", "i"), ("header.stamp.nanosec", "I"), ("header.frame_id", "string")
)  # fmt: skip
_POSE_FIELDS: Final = tuple((f"pose.pose.position.{name}", "d") for name in "xyz") + tuple(
    (f"pose.pose.orientation.{name}", "d") for name in "xyzw"
)
#: type -> its fields in order: a letter of `struct`, `string`, `bytes` and `[]H` (of any length),
#: or 36 d
FIELDS: Final[dict[str, tuple[tuple[str, str], ...]]] = {
    IMAGE: (
        *_HEADER_FIELDS, ("height", "I"), ("width", "I"), ("encoding", "string"),
        ("is_bigendian", "B"), ("step", "I"), ("data", "bytes")
    ),
    POSE_WITH_COVARIANCE: (*_HEADER_FIELDS, *_POSE_FIELDS, ("pose.covariance", "36d")),
    POSE: (*_HEADER_FIELDS, *((name.removeprefix("pose."), form) for name, form in _POSE_FIELDS)),
    TOUCH_FRAME: (
        ("t_ns", "q"), ("seq", "q"), ("wrist", "[]H"), ("has_pose", "?"), ("pose", "16d")
    ),
}  # fmt: skip


def image_message(frame: Frame) -> dict[str, Any]:
    """Return the `sensor_msgs/Image` of a frame."""
    rows, columns = frame.counts.shape
    return {
        "header": header(frame.t_ns, SENSOR_FRAME),
        "height": rows,
        "width": columns,
        "encoding": "32FC1",
        "is_bigendian": 0,
        "step": 4 * columns,
        "data": frame.counts.astype("<f4").tobytes(),
    }


def frame_message(frame: Frame) -> dict[str, Any]:
    """Return the `TouchFrame` of a frame."""
    pose = np.zeros(16) if frame.pose is None else frame.pose.ravel()
    return {
        "t_ns": frame.t_ns,
        "seq": frame.seq,
        "wrist": frame.wrist.tolist(),
        "has_pose": frame.pose is not None,
        "pose": pose.tolist(),
    }


def pose_message(T: ArrayLike, t_ns: int, frame_id: str) -> dict[str, Any]:
    """Return the `geometry_msgs/PoseStamped` of a pose (4, 4), mm."""
    return {"header": header(t_ns, frame_id), "pose": pose_fields(np.asarray(T, np.float64))}


def covariance_message(
    T: ArrayLike, covariance: ArrayLike, t_ns: int, frame_id: str
) -> dict[str, Any]:
    """Return the `geometry_msgs/PoseWithCovarianceStamped` of a pose (4, 4), mm.

    `covariance` (6, 6) is of (x, y, z, rx, ry, rz), mm and rad, in the axes of the frame
    `frame_id`.
    """
    metres = np.diag([1e-3] * 3 + [1.0] * 3)
    spread = metres @ np.asarray(covariance, np.float64) @ metres
    pose = pose_fields(np.asarray(T, np.float64))
    return {
        "header": header(t_ns, frame_id),
        "pose": {"pose": pose, "covariance": spread.ravel().tolist()},
    }


def header(t_ns: int, frame_id: str) -> dict[str, Any]:
    """Return a `std_msgs/Header`."""
    sec, nanosec = divmod(max(t_ns, 0), 1_000_000_000)
    return {"stamp": {"sec": sec & 0x7FFFFFFF, "nanosec": nanosec}, "frame_id": frame_id}


def pose_fields(T: NDArray[np.float64]) -> dict[str, Any]:
    """Return the `geometry_msgs/Pose` of (4, 4), mm: metres and a quaternion."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat(canonical=True).tolist()
    at = dict(zip("xyz", (T[:3, 3] * 1e-3).tolist(), strict=True))
    return {"position": at, "orientation": {"x": x, "y": y, "z": z, "w": w}}


def cdr_bytes(kind: str, fields: Mapping[str, Any]) -> bytes:
    """Return a message of one of the types of `FIELDS`, its from its values."""
    body = bytearray()
    for path, form in FIELDS[kind]:
        value: Any = fields
        for name in path.split("."):
            value = value[name]
        if form == "string":
            text = value.encode() + b"\0"
            _append(body, "I", len(text))
            body += text
        elif form == "bytes":
            _append(body, "I", len(value))
            body += value
        elif form[-1] == "d" and len(form) > 1:
            _append(body, form, *value)
        else:
            _append(body, form, value)
    return b"\0\1\0\0" + bytes(body)


def cdr_values(kind: str, message: bytes) -> dict[str, Any]:
    """Return the values of a message of one of the types of `FIELDS` by their names; undoes it.

    The layout is that of the type, whatever definition a file gives it. Raises ValueError: it is
    no plain CDR, or ends too early.
    """
    if len(message) < 4 or message[0] or message[1] > 1:
        raise ValueError("a message that is no plain CDR")
    order, at = "<" if message[1] else ">", 4
    values: dict[str, Any] = {}

    def take(form: str) -> tuple[Any, ...]:
        nonlocal at
        at += -(at - 4) % struct.calcsize(form[-1])
        at += struct.calcsize(order + form)
        if at > len(message):
            raise ValueError(f"a message of {len(message)} bytes, which is cut off")
        return struct.unpack_from(order + form, message, at - struct.calcsize(order + form))

    for name, form in FIELDS[kind]:
        if form in ("string", "bytes", "[]H"):
            (length,) = take("I")
            if form == "[]H":
                values[name] = take(f"{length}H") if length else ()
                continue
            (text,) = take(f"{length}s")
            values[name] = text.rstrip(b"\0").decode() if form == "string" else text
        else:
            found = take(form)
            values[name] = found if len(form) > 1 else found[0]
    return values


def _append(body: bytearray, form: str, *values: float) -> None:
    body += b"\0" * (-len(body) % struct.calcsize(form[-1]))
    body += struct.pack(f"<{form}", *values)
