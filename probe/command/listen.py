"""Counts of a port or of a recording, all at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.console import interruption
from encoded_objects.base.output import message
from encoded_objects.base.sensor_type import SensorType, choose_sensor_type
from probe.client.stream import Stream, name_of
from probe.errors import PortError
from probe.port.typed import typed_port
from probe.port.url import means_port
from probe.recording.layout import FrameBlock
from probe.recording.read import Recording

Counts = NDArray[np.uint16]


def frames_of(
    source: str, sensor: int | None, seconds: float, sensor_type: str = ""
) -> tuple[Counts, str, SensorType]:
    """Return counts (N, rows, columns) of a port or a recording, and its sensor: name and type.

    Raises
    ------
    PortError, RecordingError
        When it is not there, or gives no frame.
    SensorTypeError
        No such type, or one of another shape.
    """
    if not means_port(source):
        recording = Recording(source)
        return recording.block().counts, recording.origin.sensor, recording.sensor_type(sensor_type)

    port, kind = typed_port(source, sensor_type)
    with interruption() as interrupted, Stream(port, sensor=sensor) as stream:
        counts = _listen(stream, seconds)
        if interrupted.is_set():
            raise KeyboardInterrupt
        if not len(counts):
            raise PortError("no frame came", fix="see probe-sensor info", place=source)
        kind = choose_sensor_type(kind, "", counts.shape[1:], source)
        return counts, name_of(stream.ident(), source), kind


def _listen(stream: Stream, seconds: float) -> Counts:
    """Return the counts of the next seconds of a probe (device time), (N, rows, columns)."""
    images: list[Counts] = []
    began_ns: int | None = None
    while not stream.ended:
        frames = stream.take(1.0)
        for notice in stream.client.notices():
            message(notice)
        for frame in frames:
            began_ns = frame.t_ns if began_ns is None else began_ns
            if frame.t_ns - began_ns > seconds * 1e9:
                return np.stack(images)
            images.append(frame.counts)
    return np.stack(images) if images else FrameBlock.empty().counts
