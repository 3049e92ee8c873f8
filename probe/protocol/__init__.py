"""Packets on the wire: COBS, CRC16-CCITT, frames, ident, statistics."""

from probe.protocol.command import Command, bits_command, sensor_command
from probe.protocol.packet import (
    BYTE_FRAME_BYTES,
    FRAME_BYTES,
    VERSION,
    Damage,
    FramePacket,
    IdentPacket,
    Packet,
    StatisticsPacket,
    decode,
    encode,
)
from probe.protocol.splitter import Splitter

__all__ = [
    "BYTE_FRAME_BYTES",
    "FRAME_BYTES",
    "VERSION",
    "Command",
    "Damage",
    "FramePacket",
    "IdentPacket",
    "Packet",
    "Splitter",
    "StatisticsPacket",
    "bits_command",
    "decode",
    "encode",
    "sensor_command",
]
