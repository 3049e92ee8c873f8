"""A FlexiTac board: its images out of a serial line, as packets of a probe.

On its wire an image is AA 55 and a byte for each tactel, row after row, without check sum,
number or time, at 2 Mbaud. Numbers are counted here, times are the host's. Written from the
protocol; its own client, `flexitac` 0.3.1, is what the tests compare with.

The marker AA 55 may stand inside an image too. The length of an image and the pauses of the line
tell where it begins: markers stand an image apart, and a board pauses between images. Where only
one distance in the stream bears a marker every time it is the true one; where an image that does
not change holds the marker too, the one nearest to the pauses counts.
"""

from __future__ import annotations

import re
import time
from itertools import combinations

import numpy as np

from encoded_objects.base.document import Problem
from encoded_objects.base.sensor_type import SensorType, SensorTypeError, fix_of_type
from encoded_objects.base.sensor_type_file import sensor_type_named
from probe.port.address import Address, Port, refuse_unknown
from probe.port.commanded import CommandedProbe
from probe.port.serial_line import open_line
from probe.port.url import USUAL_TYPES
from probe.protocol import FramePacket, IdentPacket, encode

BAUD = 2_000_000
MARKER = b"\xaa\x55"
PAUSE_LEAST_S = 0.5e-3  #: quiet line that counts as a pause between images
_MARKED_IMAGES = 4  #: markers an image apart by which it is known where images begin
_MARKS = 24  #: the last markers that are remembered while it is not known where images begin
_PAUSES = 8  #: the last ones that are remembered


def open_flexitac(address: Address) -> Port:
    """Open a board's line.

    Raises PortError: the line is not there, busy or forbidden, or an option unknown;
    SensorTypeError: there is no such type, and from `read`, images of another length come.
    """
    refuse_unknown(address, ("sensor_type",))
    named = address.options.get("sensor_type", USUAL_TYPES[address.scheme])
    return FlexiTacPort(address.url, open_line(address, BAUD), sensor_type_named(named))


class FlexiTacPort(CommandedProbe):
    """A line of images of a sensor as a `Port`; it answers for the board, which cannot."""

    def __init__(self, url: str, line: Port, sensor: SensorType) -> None:
        ident = IdentPacket(seq=0, t_us=0, bits=8, sensors=1, settling_us=0.0, baud=BAUD,
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
            if length := self._images.other_length:
                raise self._refusal(length)
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

    def _refusal(self, length: int) -> SensorTypeError:
        rows, columns = self._shape
        cause = f"images of {length} bytes come, "
        cause += f"{rows} x {columns} ({rows * columns} bytes) was expected"
        fix = fix_of_type(lambda kind: kind.rows * kind.columns == length)
        return SensorTypeError([Problem(cause, fix, file=self.url)])

    def _packets(self, images: list[bytes]) -> list[bytes]:
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


class MarkedImages:
    """Images of `length` bytes out of a stream; none is passed on before its next marker came."""

    def __init__(self, length: int) -> None:
        self.sure = False  #: whether it is known where images begin
        self.lost = 0  #: bytes that belonged to no image
        self._step = len(MARKER) + length
        self._rest = bytearray()
        self._at = 0  # bytes that left `_rest`
        self._marks: list[int] = []  # places of the last markers while nothing is sure
        self._paused: list[int] = []  # where in the stream the line began again after a pause

    def feed(self, data: bytes, *, quiet_s: float = 0.0) -> list[bytes]:
        """Return the images that `data` completes.

        `quiet_s`: how long the line was seen empty before the first byte of `data`.
        """
        if data and quiet_s >= PAUSE_LEAST_S:
            self._paused = [*self._paused[1 - _PAUSES :], self._at + len(self._rest)]
        if not self.sure:
            self._note_marks(data)
        self._rest += data
        images: list[bytes] = []
        while self.sure or self._find():
            if len(self._rest) < self._step + len(MARKER):
                break
            if self._marked(self._step):
                images.append(bytes(self._rest[len(MARKER) : self._step]))
                self._take(self._step)
                continue
            self.sure = False  # bytes of this image were lost, or came in between
            self._drop(len(MARKER))
        return images

    @property
    def other_length(self) -> int:
        """Return the length of the images that come where it is another one; 0: not so."""
        known = set(self._marks)
        steps = [
            after - before
            for before, after in combinations(self._marks, 2)
            if all(before + k * (after - before) in known for k in range(_MARKED_IMAGES + 1))
        ]
        step = min(steps, default=self._step)
        return 0 if self._step % step == 0 else step - len(MARKER)  # a marker inside divides it

    def _note_marks(self, data: bytes) -> None:
        held = bytes(self._rest[-1:]) + data
        first = self._at + len(self._rest) + len(data) - len(held)
        marks = [first + found.start() for found in re.finditer(MARKER, held)]
        self._marks = [*self._marks, *marks][-_MARKS:]

    def _find(self) -> bool:
        """Go to where an image begins, and tell whether that is known."""
        needed = (_MARKED_IMAGES + 1) * self._step + len(MARKER)  # for a start at any place
        while len(self._rest) >= needed:
            starts = [at for at in range(self._step) if self._marked_always(at)]
            if len(starts) > 1 and self._paused:
                starts = [min(starts, key=self._from_pause)]
            if len(starts) == 1:
                self._drop(starts[0])
                self.sure, self._marks = True, []
                return True
            self._drop(self._step)
        return False

    def _marked_always(self, at: int) -> bool:
        return all(self._marked(at + k * self._step) for k in range(_MARKED_IMAGES))

    def _marked(self, at: int) -> bool:
        return self._rest[at : at + len(MARKER)] == MARKER

    def _from_pause(self, at: int) -> int:
        """Return how many bytes a place lies from where the line pauses, image by image."""
        away = [(self._at + at - pause) % self._step for pause in self._paused]
        return sum(min(a, self._step - a) for a in away)

    def _drop(self, number: int) -> None:
        self.lost += number
        self._take(number)

    def _take(self, number: int) -> None:
        self._at += number
        del self._rest[:number]
