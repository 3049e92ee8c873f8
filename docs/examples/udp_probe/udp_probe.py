"""A tactile sensor on the network as a port: each datagram is an image, u16 little endian.

    pip install ./udp_probe
    probe-sensor live 'udp://127.0.0.1:5005?sensor_type=fsr-8x8'
    recognize-object --port 'udp://127.0.0.1:5005?sensor_type=fsr-8x8' --follow

A sensor on another machine sends to an address of this one: give that one, and know that whoever
reaches it can send images too.

`CommandedProbe` answers commands for a sensor that takes none; what is left to write is `read`.
"""

from __future__ import annotations

import select
import socket
import time

import numpy as np

from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.errors import PortError
from probe.port.address import Address, refuse_unknown
from probe.port.commanded import CommandedProbe
from probe.protocol import FramePacket, IdentPacket, encode


class UdpPort(CommandedProbe):
    """Datagrams in, packets of a probe out."""

    def __init__(self, address: Address) -> None:
        self.sensor = sensor_type_named(address.options.get("sensor_type", "fsr-16"))
        ident = IdentPacket(
            seq=0, t_us=0, bits=16, name="udp", rows=self.sensor.rows, columns=self.sensor.columns
        )
        super().__init__(address.url, ident)
        host, _, port = address.target.rpartition(":")
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host or "127.0.0.1", int(port)))
        except (OSError, ValueError) as failed:
            self._socket.close()
            raise PortError(
                f"cannot listen: {failed}", fix="write udp://127.0.0.1:5005", place=address.url
            ) from failed
        self._seq = 0

    def read(self, timeout_s: float) -> bytes:
        """Return the packet of the next image; b"" if none came in time."""
        if replies := self.take_replies():
            return replies
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return b""
        image = self._socket.recv(1 << 16)
        rows, columns = self.sensor.shape
        if len(image) != 2 * rows * columns or not (self.streaming or self.wanted):
            return b""
        self.wanted, self._seq = max(self.wanted - 1, 0), self._seq + 1
        counts = np.frombuffer(image, "<u2").reshape(rows, columns)
        return encode(FramePacket(*self.now(), counts, np.zeros(4, np.uint16)))

    def now(self) -> tuple[int, int]:
        """Return number and time (us), as they stand in packets."""
        return self._seq % 65536, time.monotonic_ns() // 1000 % 2**32

    def close(self) -> None:
        """Let go of the socket."""
        super().close()
        self._socket.close()


def open_udp(address: Address) -> UdpPort:
    """Open `udp://HOST:PORT?sensor_type=NAME`."""
    refuse_unknown(address, ("sensor_type",))
    return UdpPort(address)
