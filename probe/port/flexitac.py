"""A FlexiTac board: its images out of a serial line, told on as a probe would.

On its wire an image is AA 55 and a byte for each tactel, row after row, without check sum,
number or time, at 2 Mbaud. Numbers are counted here, times are the host's. Where an image
begins is found by `MarkedImages`. Written from the protocol; its own client, `flexitac` 0.3.1,
is what the tests compare with.
"""

from __future__ import annotations

import time

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.port.address import Address, Port, refuse_unknown
from probe.port.commanded import CommandedProbe
from probe.port.marked import MarkedImages
from probe.port.serial_line import open_line
from probe.port.url import USUAL_TYPES
from probe.protocol import FramePacket, IdentPacket, encode

BAUD = 2_000_000


def open_flexitac(address: Address) -> Port:
    """Open a board's line.

    Raises
    ------
    PortError
        When the line is not there, busy or forbidden, or an option is unknown.
    SensorTypeError
        The sensor type that the URL names is none.
    """
    refuse_unknown(address, ("sensor_type",))
    named = address.options.get("sensor_type", USUAL_TYPES[address.scheme])
    return FlexiTacPort(address.url, open_line(address, BAUD), sensor_type_named(named))


class FlexiTacPort(CommandedProbe):
    """A line of images as a `Port`: it answers for the board, which takes no commands.

    Parameters
    ----------
    url
        What opens it again.
    line
        Bytes of the board.
    sensor
        Rows and columns of its images.
    """

    def __init__(self, url: str, line: Port, sensor: SensorType) -> None:
        ident = IdentPacket(seq=0, t_us=0, bits=10, sensors=1, settling_us=0.0, baud=BAUD,
                            name="flexitac", rows=sensor.rows, columns=sensor.columns)  # fmt: skip
        super().__init__(url, ident)
        self._line, self._shape = line, sensor.shape
        self._images = MarkedImages(sensor.rows * sensor.columns)
        self._seq = self._t_us = 0

    def read(self, timeout_s: float) -> bytes:
        """Return packets of the images that came; b"" if none came in `timeout_s`."""
        if replies := self.take_replies():
            return replies
        until_s = time.monotonic() + timeout_s
        while True:
            began_s = time.monotonic()
            data = self._line.read(max(until_s - began_s, 0.0))
            now_s = time.monotonic()
            images = self._images.feed(data, quiet_s=now_s - began_s)
            if images or self._images.sure or now_s >= until_s:
                break  # where images begin is found by pauses, so until then nothing is put off
        return b"".join(self._packets(images))

    def close(self) -> None:
        """Let go of the line."""
        super().close()
        self._line.close()

    def now(self) -> tuple[int, int]:
        """Return number and time for a packet that is no frame."""
        return self._seq % 65536, self._t_us % 2**32

    def _packets(self, images: list[bytes]) -> list[bytes]:
        """Return the packets of images that are wanted."""
        packets = []
        for image in images:
            # Several images of one read follow each other: a clock that stands would deny it.
            self._t_us = max(time.monotonic_ns() // 1000, self._t_us + 1)
            if self.streaming or self.wanted:
                self.wanted = max(self.wanted - 1, 0)
                counts = np.frombuffer(image, np.uint8).reshape(self._shape).astype(np.uint16)
                wrist = np.zeros(4, np.uint16)
                packets.append(encode(FramePacket(*self.now(), counts, wrist, byte_wide=True)))
            self._seq += 1
        self.sent += len(packets)
        return packets
