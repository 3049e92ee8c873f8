"""What a port is: bytes both ways, whatever stands behind it.

A port knows nothing of packets. `probe.port.open_port(url)` makes one, `probe.client`
reads frames from it, and opens it again when it went away.
"""

from __future__ import annotations

from typing import Protocol


class Port(Protocol):
    """A byte stream to a probe. Every method raises `PortError` once the device is gone."""

    @property
    def url(self) -> str:
        """The URL that opens this port again."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return what has come, waiting at most `timeout_s` for the first byte; b"" if nothing.

        Raises EOFError at the end of a port that ends (a recording played once).
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of `data`."""
        ...

    def close(self) -> None:
        """Let go of the device; may be called twice."""
        ...
