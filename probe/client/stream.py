"""Frames of a client while something else is done, as a terminal served.

A thread takes the frames from the client; `Stream.take` returns those that wait, or none
after a while, so that its caller is never held up.
"""

from __future__ import annotations

import queue
import threading
import time
from typing import Self

from encoded_objects.base.errors import EncodedObjectsError
from probe.client.client import Client
from probe.frame import Frame
from probe.port.url import address_of
from probe.protocol import IdentPacket

_WAITING = 2048  #: frames between the threads; beyond, the client counts overruns
_IDENT_S = 2.0  #: for which a stream waits for the description of the probe


class Stream:
    """The frames of a `Client`; a context manager that lets go of the port too.

    Raises PortError when the port cannot be opened.
    """

    def __init__(self, url: str, *, sensor: int | None = None, bits: int | None = None) -> None:
        self.client = Client(url, sensor=sensor, bits=bits)
        self._asked = sensor
        if sensor is not None:
            self.client.select_sensor(sensor)  # so that the ident tells of the sensor selected
        self.ended = False  #: whether there will be no more frames
        self._queue: queue.Queue[Frame | None] = queue.Queue(_WAITING)
        self._failure: EncodedObjectsError | None = None
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._feed, name="frames", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop, and close the client."""
        self._closed.set()
        self.client.close()
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def take(self, timeout_s: float) -> list[Frame]:
        """Return all frames that wait; none if none came in `timeout_s`, or at the end.

        Raises ProbeError: the probe went away for good, or a recording is damaged.
        """
        frames: list[Frame] = []
        try:
            frame = self._queue.get(timeout=timeout_s)
            while frame is not None:
                frames.append(frame)
                frame = self._queue.get_nowait()
            self.ended = True
        except queue.Empty:
            return frames
        if self._failure is not None:
            if frames:  # the next call raises the failure
                self._queue.put(None)
                self.ended = False
                return frames
            raise self._failure
        return frames

    def ident(self) -> IdentPacket | None:
        """Return what the device is, after a short wait for its answer."""
        until_s = time.monotonic() + _IDENT_S
        while time.monotonic() < until_s:
            ident = self.client.ident
            if ident is not None and self._asked in (None, ident.sensor):
                break
            time.sleep(0.02)
        return self.client.ident

    def _feed(self) -> None:
        try:
            for frame in self.client.frames():
                self._put(frame)
        except EncodedObjectsError as failure:
            self._failure = failure
        self._put(None)

    def _put(self, item: Frame | None) -> None:
        while not self._closed.is_set():
            try:
                self._queue.put(item, timeout=0.1)
            except queue.Full:
                continue
            return


def name_of(ident: IdentPacket | None, url: str) -> str:
    """Return how recordings and calibrations call the sensor that is read; empty: unknown.

    A recording that is played names the sensor that made it; RecordingError if it is gone.
    """
    address = address_of(url)
    if address.scheme == "file":
        from probe.recording.read import Recording

        return Recording(address.target).origin.sensor
    return "" if ident is None else f"{ident.name}/{ident.sensor}"
