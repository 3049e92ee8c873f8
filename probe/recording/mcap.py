"""Recordings as MCAP files of ROS 2 messages, and back, without ROS and without loss.

::

    /touch/image   sensor_msgs/Image              counts as 32FC1
    /touch/pose    geometry_msgs/PoseStamped      T_base_sensor, m, where it is known
    /touch/frame   encoded_objects_msgs/TouchFrame  the rest, see `probe.recording.ros`
    metadata "recording"                          the attributes of the recording, as JSON

What was exported comes back as it was. Of a file by somebody else `sensor_msgs/Image` messages
(32FC1, 16UC1 or mono8) are enough, values that are no counts are scaled as those of an array;
their stamps are the times, and a `PoseStamped` belongs to the image of its stamp.
"""

from __future__ import annotations

import dataclasses
import json
import os
import struct
import zlib
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import IO, TYPE_CHECKING, Any, BinaryIO, Final, Self

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.errors import require
from encoded_objects.base.foreign import DAMAGE, open_regular, parse_json, regular_size
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type, sensor_type_text
from probe.errors import FrameError, RecordingError
from probe.frame import Frame, frame_from
from probe.recording.files import check_name, explain_errors
from probe.recording.guard import FREE, MOST_CHUNK, PACKED
from probe.recording.hdf5 import write_recording
from probe.recording.imported import scale_attributes, scale_of, to_counts
from probe.recording.layout import FrameBlock, RecordingOrigin, block_of, json_value
from probe.recording.read import Recording
from probe.recording.ros import (
    BASE_FRAME,
    DEFINITIONS,
    IMAGE,
    METADATA,
    POSE,
    TOUCH_FRAME,
    cdr_values,
    frame_message,
    image_message,
    pose_message,
)

if TYPE_CHECKING:
    from mcap.reader import McapReader
    from mcap.summary import Summary

IMAGE_TOPIC: Final = "/touch/image"
POSE_TOPIC: Final = "/touch/pose"
FRAME_TOPIC: Final = "/touch/frame"
Message = dict[str, Any]  #: values by name, `cdr_values`

_MEND: Final = "mend it with `mcap recover`"
_AT_ONCE: Final = 1024  #: frames read at a time
_READ_AT_ONCE: Final = 1 << 20  #: bytes
_FOOTER: Final = struct.Struct("<9xQQI8x")  #: last record: start of the summary, check sum; magic
_AFTER_SUMMARY: Final = 12  #: bytes that its check sum leaves out: itself and the magic
_RECORD_HEAD: Final = 9  #: bytes before a record: kind, length
_PARTS: Final = (("orientation", "xyzw"), ("position", "xyz"))  #: of a pose
_ENCODINGS: Final = {"32FC1": "f4", "16UC1": "u2", "mono16": "u2", "mono8": "u1", "8UC1": "u1"}


class McapWriter:
    """An MCAP file of ROS 2 messages that is being written to a stream.

    Raises MissingExtraError: the libraries of the extra `robot` are not installed.
    """

    def __init__(self, stream: IO[bytes], origin: RecordingOrigin) -> None:
        require("mcap_ros2.writer", extra="robot", purpose="MCAP")
        from mcap_ros2.writer import Writer

        self._writer = Writer(stream)
        self._schemas: dict[str, Any] = {}
        more = json.dumps(dict(origin.more), default=json_value)
        self._writer.add_metadata(METADATA, {**origin.texts(), "more": more})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

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
        """Write the end of the file; the stream stays open."""
        self._writer.finish()


def export_mcap(recording: Recording, out: Path) -> int:
    """Write a recording as an MCAP file; returns the number of frames.

    Raises RecordingError: the recording cannot be read, or the file not be written.
    """
    with (
        explain_errors(out, "write"),
        open(out, "wb") as stream,
        McapWriter(stream, recording.origin) as writer,
    ):
        for frame in recording.frames():
            writer.frame(frame)
    return len(recording)


def import_mcap(
    path: Path, out: Path, *, sensor_type: SensorType | str = "", replace: bool = False
) -> Recording:
    """Make a recording of an MCAP file; `replace` an older one of that name if asked.

    `sensor_type` (name or file) is that of the images, where the file does not tell. Raises
    RecordingError: no MCAP file, no images in it, or images that are none of a touch; a name that
    is taken.
    """
    check_name(out, replace=replace)
    origin, ours = _read_mcap(path)
    kind = SensorType()
    if sensor_type and not origin.sensor_type:
        kind = choose_sensor_type(sensor_type, "", None, str(path))
        origin = dataclasses.replace(origin, sensor_type=sensor_type_text(kind))
    scale = None if ours else scale_of(path, "the file", _values(path), kind)
    if scale:
        units, scaled = scale_attributes(scale, kind)
        more = MappingProxyType({**origin.more, **scaled})
        origin = dataclasses.replace(origin, units=units, more=more)
    write_recording(out, origin, _blocks(_frames(path, scale), path), replace=replace)
    return Recording(out)


def _read_mcap(path: Path) -> tuple[RecordingOrigin, bool]:
    """Return the origin of the frames of an MCAP file, and whether it is one of ours."""
    with _open_mcap(path) as reader:
        summary = reader.get_summary()
        kinds = {} if summary is None else {s.id: s.name for s in summary.schemas.values()}
        if summary is not None and IMAGE not in kinds.values():
            there = ", ".join(sorted(set(kinds.values()))) or "nothing"
            raise RecordingError(
                f"no {IMAGE} in it, but {there[:200]}", fix="record the tactile image too",
                place=path
            )  # fmt: skip
        said = {one.name: one.metadata for one in reader.iter_metadata()}.get(METADATA, {})
        more = parse_json(said.get("more", "{}"), RecordingError, fix=_MEND, place=str(path))
        odd = [name for name, value in {**said, **dict(more)}.items() if not _is_kept(value)]
        if odd:
            raise RecordingError(
                f"attribute {odd[0][:60]!r} of the recording is no text, number or array of them",
                fix="write it as one of these", place=path
            )  # fmt: skip
        origin = RecordingOrigin.of_texts(said, dict(more))
    return origin, TOUCH_FRAME in kinds.values()


def _is_kept(value: object) -> bool:
    """Tell whether a recording can hold a value as an attribute."""
    return "\0" not in value if isinstance(value, str) else np.asarray(value).dtype.kind in "biuf"


@contextmanager
def _open_mcap(path: Path) -> Iterator[McapReader]:
    """Open an MCAP file whose chunks unpack to no more than its size allows.

    What its reader raises on damaged content becomes a RecordingError.
    """
    require("mcap.reader", "zstandard", extra="robot", purpose="MCAP")
    from mcap.exceptions import InvalidMagic, McapError
    from mcap.reader import make_reader
    from zstandard import ZstdError

    with explain_errors(path, "open"):
        stream = open_regular(path)
    with stream:
        try:
            reader = make_reader(stream, validate_crcs=True)  # of chunks
            summary = reader.get_summary()
            _check_summary(stream)
            _check_chunks(path, stream, summary)
            yield reader
        except InvalidMagic as error:
            raise RecordingError(
                "this is no MCAP file, or it is cut off",
                fix=f"give a file of ROS 2 messages, or {_MEND}", place=path
            ) from error  # fmt: skip
        except (*DAMAGE, OSError, McapError, ZstdError) as error:
            said = f": {str(error)[:120]}" if str(error) else ""
            raise RecordingError(
                f"it is damaged ({type(error).__name__}{said})", fix=_MEND, place=path
            ) from error


def _check_summary(stream: BinaryIO) -> None:
    """Refuse a summary of another check sum than its footer says; 0: it says none."""
    end = stream.seek(-_FOOTER.size, os.SEEK_END)
    start, _, said = _FOOTER.unpack(stream.read(_FOOTER.size))
    if not said or not start:
        return
    stream.seek(start)
    left, found = end + _FOOTER.size - _AFTER_SUMMARY - start, 0
    while left > 0 and (some := stream.read(min(left, _READ_AT_ONCE))):
        found, left = zlib.crc32(some, found), left - len(some)
    if found != said:
        raise ValueError("its summary has another check sum")


def _check_chunks(path: Path, stream: BinaryIO, summary: Summary | None) -> None:
    """Refuse chunks that unpack to more than a chunk takes, or all to more than the file can."""
    import zstandard
    from mcap.data_stream import ReadDataStream
    from mcap.records import Chunk
    from mcap.stream_reader import StreamReader

    def chunks() -> Iterator[Chunk]:
        if summary is not None and summary.chunk_indexes:
            for index in summary.chunk_indexes:
                stream.seek(index.chunk_start_offset + _RECORD_HEAD)
                yield Chunk.read(ReadDataStream(stream))
            return
        stream.seek(0)
        for record in StreamReader(stream, emit_chunks=True, record_size_limit=MOST_CHUNK).records:
            if isinstance(record, Chunk):
                yield record

    room = FREE + PACKED * regular_size(path)
    for chunk in chunks():
        size = max(chunk.uncompressed_size, len(chunk.data))
        if chunk.compression == "zstd":  # which unpacks what its own head says
            size = max(size, zstandard.frame_content_size(chunk.data))
        room -= size
        if size > MOST_CHUNK or room < 0:
            raise RecordingError(
                f"a chunk of {size:,} bytes when unpacked, more than the file can hold",
                fix="write it again in chunks of some MB", place=path
            )  # fmt: skip


def _blocks(frames: Iterator[Frame], path: Path) -> Iterator[FrameBlock]:
    while some := list(islice(frames, _AT_ONCE)):
        odd = [frame for frame in some if frame.counts.shape != some[0].counts.shape]
        if odd:
            raise RecordingError(
                f"images of {some[0].counts.shape} and of {odd[0].counts.shape} readings",
                fix="keep the images of one sensor in a file", place=path
            )  # fmt: skip
        yield block_of(some)


def _values(path: Path) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield images of others as they are, by their numbers."""
    for number, (_, message) in enumerate(_messages(path, {IMAGE})):
        values = _counts(message, number, path)
        if values.size:
            yield number, values


def _frames(path: Path, scale: tuple[float, float] | None) -> Iterator[Frame]:
    """Yield the frames of an MCAP file: ours in the order of the file, others' in that of time."""
    number = 0
    poses = {_stamp(message): _pose(message, path) for _, message in _messages(path, {POSE})}
    image: Message | None = None
    rest: Message | None = None
    for kind, message in _messages(path, {IMAGE, TOUCH_FRAME}):
        if kind == IMAGE:
            if image is not None:
                yield _frame(image, rest, poses, scale, number, path)
                number += 1
            image, rest = message, None
        elif image is not None:
            rest = message
    if image is not None:
        yield _frame(image, rest, poses, scale, number, path)


def _messages(path: Path, kinds: Collection[str]) -> Iterator[tuple[str, Message]]:
    """Yield type and content of the messages of some types.

    Of a file with `TouchFrame` messages poses are left out, for these hold them, and the rest comes
    as it was written: the clock of a probe may restart.
    """
    with _open_mcap(path) as reader:
        summary = reader.get_summary()
        names = {} if summary is None else {s.id: s.name for s in summary.schemas.values()}
        channels = {} if summary is None else summary.channels
        topics = [c.topic for c in channels.values() if names.get(c.schema_id) in kinds]
        ours = TOUCH_FRAME in names.values()
        if not topics or (ours and IMAGE not in kinds):
            return
        for schema, channel, message in reader.iter_messages(topics, log_time_order=not ours):
            kind = "" if schema is None else schema.name
            if kind not in kinds or channel.message_encoding != "cdr":
                raise ValueError(f"messages of {kind[:60]!r} as {channel.message_encoding[:20]!r}")
            yield kind, cdr_values(kind, message.data)


def _frame(
    image: Message,
    rest: Message | None,
    poses: Mapping[int, NDArray[np.float64]],
    scale: tuple[float, float] | None,
    number: int,
    path: Path,
) -> Frame:
    t_ns, seq, wrist = _stamp(image), number, None
    T = poses.get(t_ns)
    if rest is not None:
        t_ns, seq, wrist = rest["t_ns"], rest["seq"], np.array(rest["wrist"], np.uint16)
        T = np.array(rest["pose"]).reshape(4, 4) if rest["has_pose"] else None
    try:
        counts = _counts(image, number, path)
        counts = to_counts(counts, scale) if scale else counts
        return frame_from(counts, t_ns=t_ns, seq=seq, wrist=wrist, pose=T)
    except FrameError as error:
        raise RecordingError(f"image {number}: {error.cause}", fix=error.fix, place=path) from error


def _stamp(message: Message) -> int:
    sec, nanosec = message["header.stamp.sec"], message["header.stamp.nanosec"]
    return int(sec) * 1_000_000_000 + int(nanosec)


def _counts(image: Message, number: int, path: Path) -> NDArray[Any]:
    kind = _ENCODINGS.get(image["encoding"])
    if kind is None:
        raise RecordingError(
            f"image {number} is encoded as {image['encoding'][:40]}",
            fix=f"take {', '.join(_ENCODINGS)}", place=path
        )  # fmt: skip
    order = ">" if image["is_bigendian"] else "<"
    rows = np.frombuffer(image["data"], np.uint8)
    height, width, step = image["height"], image["width"], image["step"]
    if rows.size != height * step or step < width * int(kind[1]):
        raise RecordingError(
            f"image {number} has {rows.size} bytes, not {height} rows of {step}",
            fix="write its step and height as they are", place=path
        )  # fmt: skip
    plain = rows.reshape(height, step)[:, : width * int(kind[1])]
    return np.ascontiguousarray(plain).view(order + kind)


def _pose(pose: Message, path: Path) -> NDArray[np.float64]:
    from scipy.spatial.transform import Rotation

    turn, at = ([pose[f"pose.{part}.{name}"] for name in names] for part, names in _PARTS)
    T = np.eye(4)
    try:
        T[:3, :3] = Rotation.from_quat(turn).as_matrix()
    except ValueError as error:
        raise RecordingError(
            f"the pose at {_stamp(pose)} ns has no orientation: {turn}",
            fix="write a unit quaternion", place=path
        ) from error  # fmt: skip
    T[:3, 3] = 1e3 * np.array(at)
    return T
