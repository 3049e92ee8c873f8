"""Packets on the wire: COBS, CRC16-CCITT, frames, ident, statistics."""

from probe.protocol.command import Command, bits_command, sensor_command
from probe.protocol.packet import (
    LONGEST,
    VERSION,
    Damage,
    FramePacket,
    IdentPacket,
    Packet,
    StatisticsPacket,
    decode,
    encode,
    frame_bytes,
)
from probe.protocol.splitter import Splitter

__all__ = [
    "LONGEST",
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
    "frame_bytes",
    "sensor_command",
]
