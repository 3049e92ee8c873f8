"""Packets on the wire and commands to the probe.

Little endian: type u8, version u8, seq u16, t_us u32, body, CRC u16 over all before it;
COBS over that, then one zero byte. The CRC is CRC-16-CCITT with initial value 0xFFFF (check
value of "123456789": 0x29B1).

====  ==========  ==============================================================================
type  packet      body
====  ==========  ==============================================================================
F     frame       u8: rows, columns; counts u16, row 0 first; 4 x u16 wrist
B     frame       the same with counts u8
I     ident       u8: rows, columns, bits, sensors, sensor, firmware (2), settling/0.25 us;
                  u16: kbaud, boot; name, 8 characters
S     statistics  frames u32, transmit waits u32, receive errors u16, uptime ms u32
====  ==========  ==============================================================================

That is version 2, which is written. Version 1 is read as well: its frames tell no rows and
columns, they are 16x16 (530 and 274 bytes with header and check sum).

A block that is no whole packet is no error but a `Damage`: on a real line it is expected.
The packet after Cheshire and Baker, "Consistent overhead byte stuffing", 1999.

A command is one byte, so there is nothing to resynchronise. A byte that is none is counted by the
device as a receive error. Nothing answers a lost command: the client repeats `START` after silence.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from dataclasses import dataclass
from enum import Enum

import numpy as np
from cobs import cobs
from numpy.typing import NDArray

from probe.errors import FrameError, PortError
from probe.frame import WRIST

VERSION = 2
WRIST_BITS = 10  #: the wrist is read with at least so many bits, whatever the tactels are
LINES_MAX = 255  #: rows or columns
FIRST_SHAPE = (16, 16)  #: of the frames of version 1

_HEADER = struct.Struct("<BBHI")
_CRC = struct.Struct("<H")
_IDENT = struct.Struct("<8B2H8s")
_STATISTICS = struct.Struct("<IIHI")
_FRAME, _BYTES, _IDENT_TYPE, _STATISTICS_TYPE = b"FBIS"
_SHAPE = struct.Struct("<BB")
_BODY = {_IDENT_TYPE: _IDENT.size, _STATISTICS_TYPE: _STATISTICS.size}


class Damage(Enum):
    """Why a block is no packet."""

    STUFFING = "the block is no COBS"
    CHECK = "the check sum is wrong"
    VERSION = "the packet is of another version of the protocol"
    TYPE = "the packet is of an unknown type"
    LENGTH = "the length does not fit the type"
    VALUE = "a value is outside its range"


@dataclass(frozen=True, slots=True, eq=False)
class FramePacket:
    """One image as it crosses the wire."""

    seq: int  #: 0 ... 65535, wraps
    t_us: int  #: us, device time, wraps at 2^32
    counts: NDArray[np.uint16]  #: (rows, columns) row 0 first
    wrist: NDArray[np.uint16]  #: (4,)
    byte_wide: bool = False  #: sent with 8 bits a tactel


@dataclass(frozen=True, slots=True)
class IdentPacket:
    """The description of the device. It comes at boot and on request."""

    seq: int  #: number of the next frame
    t_us: int
    bits: int = 10  #: of a reading
    sensor: int = 0  #: the selected one
    sensors: int = 8
    firmware: tuple[int, int] = (1, 0)  #: major, minor
    settling_us: float = 10.0  #: wait between addressing a tactel and reading it
    baud: int = 1_000_000
    boot: int = 0  #: counts the device's starts
    name: str = "probe"  #: at most 8 characters of ASCII
    rows: int = FIRST_SHAPE[0]
    columns: int = FIRST_SHAPE[1]


@dataclass(frozen=True, slots=True)
class StatisticsPacket:
    """The counts of the device since it started."""

    seq: int  #: number of the next frame
    t_us: int
    frames: int  #: sent
    transmit_waits: int  #: times a scan had to wait for the line
    receive_errors: int  #: bytes that are no command
    uptime_ms: int


Packet = FramePacket | IdentPacket | StatisticsPacket


def _frame_body(shape: tuple[int, int], byte_wide: bool) -> int:
    return shape[0] * shape[1] * (1 if byte_wide else 2) + 2 * WRIST


def frame_bytes(shape: tuple[int, int], *, byte_wide: bool = False) -> int:
    """Return the bytes of a frame on the wire, at most: with check sum, stuffing and delimiter.

    Examples
    --------
    >>> frame_bytes((16, 16)), frame_bytes((16, 16), byte_wide=True)
    (536, 279)
    """
    payload = _HEADER.size + _SHAPE.size + _frame_body(shape, byte_wide) + _CRC.size
    return payload + payload // 254 + 2


LONGEST = frame_bytes((LINES_MAX, LINES_MAX))  #: bytes of a packet, at most


def encode(packet: Packet) -> bytes:
    """Return the bytes of a packet on the wire, with its delimiter.

    Raises FrameError: a number does not fit its field.
    """
    try:
        kind, body = _body(packet)
        payload = _HEADER.pack(kind, VERSION, packet.seq, packet.t_us) + body
    except (struct.error, UnicodeEncodeError) as bad:
        raise FrameError(f"a value does not fit its field of the packet: {bad}") from bad
    stuffed: bytes = cobs.encode(payload + _CRC.pack(crc_hqx(payload, 0xFFFF)))
    return stuffed + b"\0"


def decode(block: bytes, bits: int = 10) -> Packet | Damage:
    """Return the packet of a block between two delimiters, or its damage.

    Readings of two bytes that need more than `bits` are refused.
    """
    try:
        payload: bytes = cobs.decode(block)
    except cobs.DecodeError:
        return Damage.STUFFING
    if len(payload) < _HEADER.size + _CRC.size:
        return Damage.LENGTH
    if crc_hqx(payload[:-2], 0xFFFF) != payload[-2] + (payload[-1] << 8):
        return Damage.CHECK
    kind, version, seq, t_us = _HEADER.unpack_from(payload)
    if version not in (1, VERSION):
        return Damage.VERSION
    if kind in (_FRAME, _BYTES):
        return _decode_frame(seq, t_us, payload, bits, first=version == 1, byte_wide=kind == _BYTES)
    if kind not in _BODY:
        return Damage.TYPE
    if len(payload) != _HEADER.size + _BODY[kind] + _CRC.size:
        return Damage.LENGTH
    if kind == _IDENT_TYPE:
        return _decode_ident(seq, t_us, payload)
    return StatisticsPacket(seq, t_us, *_STATISTICS.unpack_from(payload, _HEADER.size))


def _body(packet: Packet) -> tuple[int, bytes]:
    if isinstance(packet, FramePacket):
        wrist = packet.wrist.astype("<u2").tobytes()
        shape = _SHAPE.pack(*packet.counts.shape)
        if not packet.byte_wide:
            return _FRAME, shape + packet.counts.astype("<u2").tobytes() + wrist
        if (packet.counts > 255).any():
            raise FrameError(
                f"a reading of {packet.counts.max()} does not fit 8 bits", fix="send 10 bits"
            )
        return _BYTES, shape + packet.counts.astype(np.uint8).tobytes() + wrist
    if isinstance(packet, IdentPacket):
        fields = (packet.rows, packet.columns, packet.bits, packet.sensors, packet.sensor)
        settling, kbaud = round(packet.settling_us * 4), packet.baud // 1000
        name = packet.name.encode("ascii").ljust(8)[:8]
        return _IDENT_TYPE, _IDENT.pack(
            *fields, *packet.firmware, settling, kbaud, packet.boot, name
        )
    counted = (packet.frames, packet.transmit_waits, packet.receive_errors, packet.uptime_ms)
    return _STATISTICS_TYPE, _STATISTICS.pack(*counted)


def _decode_frame(
    seq: int, t_us: int, payload: bytes, bits: int, *, first: bool, byte_wide: bool
) -> FramePacket | Damage:
    start = _HEADER.size if first else _HEADER.size + _SHAPE.size
    if len(payload) < start + _CRC.size:
        return Damage.LENGTH
    rows, columns = FIRST_SHAPE if first else _SHAPE.unpack_from(payload, _HEADER.size)
    if len(payload) != start + _frame_body((rows, columns), byte_wide) + _CRC.size:
        return Damage.LENGTH
    if not rows * columns:
        return Damage.VALUE
    # Views of immutable bytes: read-only, and nothing is copied.
    tactels, width = rows * columns, 1 if byte_wide else 2
    counts = np.frombuffer(payload, "u1" if byte_wide else "<u2", tactels, start)
    wrist = np.frombuffer(payload, "<u2", WRIST, start + width * tactels)
    limit = max(bits, WRIST_BITS)
    if int(wrist.max()) >> limit or (not byte_wide and int(counts.max()) >> limit):
        return Damage.VALUE
    if byte_wide:
        counts = counts.astype(np.uint16)
        counts.setflags(write=False)
    return FramePacket(seq, t_us, counts.reshape(rows, columns), wrist, byte_wide)


def _decode_ident(seq: int, t_us: int, payload: bytes) -> IdentPacket | Damage:
    fields = _IDENT.unpack_from(payload, _HEADER.size)
    rows, columns, bits, sensors, sensor, major, minor, settling, kbaud, boot, name = fields
    sane = rows * columns > 0 and 8 <= bits <= 16 and sensor < sensors
    name = name.rstrip(b"\0")  # as C fills what is left of a text
    if not sane or not name.isascii() or not name.decode("ascii").isprintable():
        return Damage.VALUE
    return IdentPacket(
        seq, t_us, bits, sensor, sensors, (major, minor), settling / 4, kbaud * 1000, boot,
        name.decode("ascii").rstrip(), rows, columns
    )  # fmt: skip


SENSORS = 8  #: sensors among which a probe selects, thesis 4.2


class Command:
    """The commands without a number."""

    START = b"s"  #: send frame after frame
    STOP = b"x"
    ONE = b"g"  #: send one frame
    IDENT = b"i"
    STATISTICS = b"t"


def sensor_command(sensor: int) -> bytes:
    """Return the command that selects a sensor, 0 ... 7; PortError for others."""
    if sensor not in range(SENSORS):
        raise PortError(
            f"there is no sensor {sensor}, a probe has sensors 0 ... {SENSORS - 1}",
            fix="select one of them",
        )
    return str(sensor).encode()


def bits_command(bits: int) -> bytes:
    """Return the command for readings of 8 or 10 bits; PortError for others."""
    if bits not in (8, 10):
        raise PortError(f"readings of {bits} bits, a probe reads 8 or 10", fix="take 8 or 10")
    return b"b" if bits == 8 else b"a"


DELIMITER = b"\0"


class Splitter:
    """Collects bytes until their delimiter comes; never holds more than `LONGEST` + 1."""

    __slots__ = ("_rest",)

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Return the blocks that `data` completes, without delimiters and empty blocks.

        Of a block without end only the beginning is kept: it is too long to be a packet, and
        stays so.
        """
        *blocks, rest = (self._rest + data).split(DELIMITER)
        self._rest = rest[: LONGEST + 1]
        return [block for block in blocks if block]
