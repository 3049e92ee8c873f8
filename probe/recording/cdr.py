"""ROS 2 messages as bytes: the plain CDR that rmw, zenoh bridges and MCAP files carry.

Little-endian, each number aligned to its own size from behind the four bytes of the head; a string
is its length with the closing zero, then its bytes. OMG, "DDS-XTypes", 7.4.1 (PLAIN_CDR).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, Final

from probe.recording.ros import IMAGE, POSE_WITH_COVARIANCE

_HEADER: Final = (
    ("header.stamp.sec", "i"), ("header.stamp.nanosec", "I"), ("header.frame_id", "string"),
)  # fmt: skip
_POSE: Final = tuple((f"pose.pose.position.{name}", "d") for name in "xyz") + tuple(
    (f"pose.pose.orientation.{name}", "d") for name in "xyzw"
)
#: type -> its fields in order: a letter of `struct`, `string`, `bytes` (of any length), or 36 d
FIELDS: Final[dict[str, tuple[tuple[str, str], ...]]] = {
    IMAGE: (
        *_HEADER, ("height", "I"), ("width", "I"), ("encoding", "string"), ("is_bigendian", "B"),
        ("step", "I"), ("data", "bytes"),
    ),
    POSE_WITH_COVARIANCE: (*_HEADER, *_POSE, ("pose.covariance", "36d")),
}  # fmt: skip


def cdr_bytes(kind: str, fields: Mapping[str, Any]) -> bytes:
    """Return a message of one of the types of `FIELDS`, its values as in `probe.recording.ros`."""
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


def _append(body: bytearray, form: str, *values: float) -> None:
    body += b"\0" * (-len(body) % struct.calcsize(form[-1]))
    body += struct.pack(f"<{form}", *values)
