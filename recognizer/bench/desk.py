"""What a desk needs of the session that it belongs to: the sensor that is read, and who is told.

A desk does a part of the session's work under its lock; it knows the session by this alone.
"""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Protocol

from encoded_objects.base.sensor_type import SensorType
from recognizer.bench.feed import Feed
from recognizer.bench.frames import FrameHandler
from recognizer.bench.recognition_thread import RecognitionThread


class DeskSession(Protocol):
    """A session as desks see it."""

    @property
    def turn(self) -> threading.RLock:
        """Held by whoever works on the session."""

    @property
    def folder(self) -> Path:
        """For recordings, calibrations and what is learned; made when something is written."""

    @property
    def sensor(self) -> SensorType:
        """What the probe is."""

    @property
    def feed(self) -> Feed:
        """Where frames come from now."""

    @property
    def frames(self) -> FrameHandler:
        """What is done with each frame."""

    @property
    def recognition(self) -> RecognitionThread:
        """Who reads."""

    def sensor_name(self) -> str:
        """Return device and sensor; empty where nothing is connected."""

    def note(self, text: str) -> None:
        """Let the pages know what happened."""

    def report(self) -> None:
        """Tell the pages the state as it is now."""
