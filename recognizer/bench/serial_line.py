"""A probe in software behind a serial line of its own, that can be unplugged.

Frames -> `SoftwareProbe` -> pseudo-terminal. Who reads it cannot tell it from a device: it
goes away with its name, and comes back.
"""

from __future__ import annotations

import os
import pty
import tempfile
import threading
import tty
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from probe.frame import Frame
from probe.port.software import SoftwareProbe
from probe.protocol import IdentPacket

WAIT_S = 0.005  #: of the probe for its next frame, and so of a command for its answer
IDLE_S = 0.05  #: where no frames are wanted
AT_ONCE = 4096  #: bytes read
LOST = 65536  #: bytes that wait for a reader; more are thrown away, as on a real line


class SoftwareLine:
    """Frames at a name under which a serial port opens."""

    def __init__(self, frames: Iterator[Frame], name: str, shape: tuple[int, int]) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="bench-probe-")
        self._link = Path(self._folder.name) / "ttyPROBE"
        rows, columns = shape
        ident = IdentPacket(
            seq=0, t_us=0, settling_us=0.0, baud=0, name=name, rows=rows, columns=columns
        )
        self._probe = SoftwareProbe(self.url, frames, ident)
        self._away_s = 0.0
        self._unplugged = threading.Event()
        self._closed = threading.Event()
        self._plug()
        self._thread = threading.Thread(target=self._serve, name="software line", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """The port as a URL."""
        return f"serial://{self._link}?baud=1000000"

    def unplug(self, seconds: float) -> None:
        """Take the line away, and give it back after so many seconds."""
        self._away_s = seconds
        self._unplugged.set()

    def close(self) -> None:
        """Take the line away for good."""
        self._closed.set()
        self._thread.join()
        self._folder.cleanup()

    def _plug(self) -> None:
        self._near, self._far = pty.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self._link.symlink_to(os.ttyname(self._far))

    def _pull(self) -> None:
        self._link.unlink()
        os.close(self._far)
        os.close(self._near)

    def _serve(self) -> None:
        waiting = b""
        while not self._closed.is_set():
            if self._unplugged.is_set():
                self._pull()
                self._closed.wait(self._away_s)
                self._unplugged.clear()
                self._plug()
                waiting = b""
            with suppress(BlockingIOError):
                self._probe.write(os.read(self._near, AT_ONCE))
            asked = self._probe.streaming
            waiting += self._probe.read(WAIT_S if asked else IDLE_S)
            with suppress(BlockingIOError):
                waiting = waiting[os.write(self._near, waiting) :] if waiting else b""
            if len(waiting) > LOST:  # nobody listens: as on a real line
                waiting = b""
        self._pull()
