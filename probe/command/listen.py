"""Counts of a port or of a recording, all at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from encoded_objects.console.interruption import interruption
from encoded_objects.console.output import message
from probe.client.stream import Stream, name_of
from probe.errors import PortError
from probe.frame import COLUMNS, ROWS
from probe.port.url import is_url
from probe.recording.read import Recording

Counts = NDArray[np.uint16]


def frames_of(source: str, sensor: int | None, seconds: float) -> tuple[Counts, str]:
    """Return counts (N, 16, 16) of a port or a recording, and the sensor's name.

    Raises
    ------
    PortError, RecordingError
        When it is not there, or gives no frame.
    """
    if not is_url(source):
        recording = Recording(source)
        return recording.block().counts, recording.origin.sensor

    with interruption() as interrupted, Stream(source, sensor=sensor) as stream:
        counts = _listen(stream, seconds)
        if interrupted.is_set():
            raise KeyboardInterrupt
        if not len(counts):
            raise PortError("no frame came", fix="see probe-sensor info", place=source)
        return counts, name_of(stream.ident(), source)


def _listen(stream: Stream, seconds: float) -> Counts:
    """Return the counts of the next seconds of a probe (device time), (N, 16, 16)."""
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
    return np.stack(images) if images else np.empty((0, ROWS, COLUMNS), np.uint16)
