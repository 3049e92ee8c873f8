"""Packets against bytes worked by hand, and every way in which a block is no packet."""

import struct
from binascii import crc_hqx

import numpy as np
import pytest
from cobs import cobs

from probe.errors import FrameError, PortError
from probe.protocol import (
    LONGEST,
    Damage,
    FramePacket,
    IdentPacket,
    Splitter,
    StatisticsPacket,
    bits_command,
    decode,
    encode,
    frame_bytes,
    sensor_command,
)

COUNTS = (np.arange(256, dtype=np.uint16) * 4).reshape(16, 16)
WRIST = np.array([0, 1, 512, 1023], np.uint16)
FRAME = FramePacket(0x1234, 0x89ABCDEF, COUNTS, WRIST)


def wire(payload: bytes) -> bytes:
    """Stuff a payload with its right check sum."""
    return cobs.encode(payload + struct.pack("<H", crc_hqx(payload, 0xFFFF)))


def test_frame_bytes_are_those_of_the_format():
    block = encode(FRAME)
    assert block.count(0) == 1
    assert block[-1] == 0
    payload = cobs.decode(block[:-1])
    assert len(payload) == 532
    assert payload[:8] == bytes.fromhex("46 02 34 12 ef cd ab 89")
    assert payload[8:10] == bytes([16, 16])
    assert payload[10:16] == bytes.fromhex("0000 0400 0800")  # row 0 first
    assert payload[10 + 2 * 16 : 10 + 2 * 16 + 2] == bytes.fromhex("4000")  # row 1 begins: 64
    assert payload[522:530] == bytes.fromhex("0000 0100 0002 ff03")
    assert payload[530:] == struct.pack("<H", crc_hqx(payload[:530], 0xFFFF))


@pytest.mark.parametrize("shape", [(12, 32), (32, 12), (1, 2), (8, 8), (255, 255)])
@pytest.mark.parametrize("byte_wide", [False, True])
def test_frames_tell_their_rows_and_columns(shape, byte_wide):
    counts = (np.arange(shape[0] * shape[1]) % 251).astype(np.uint16).reshape(shape)
    block = encode(FramePacket(3, 4, counts, WRIST, byte_wide))
    assert len(block) <= frame_bytes(shape, byte_wide=byte_wide) <= LONGEST
    back = decode(block[:-1])
    assert isinstance(back, FramePacket)
    assert back.byte_wide == byte_wide
    assert np.array_equal(back.counts, counts)
    assert np.array_equal(back.wrist, WRIST)
    assert not any(array.flags.writeable for array in (back.counts, back.wrist))


def test_frames_of_version_1_are_read():
    head = struct.pack("<BBHI", ord("F"), 1, 7, 9)
    back = decode(wire(head + COUNTS.tobytes() + WRIST.tobytes()))
    assert isinstance(back, FramePacket)
    assert (back.seq, back.t_us, back.byte_wide) == (7, 9, False)
    assert np.array_equal(back.counts, COUNTS)
    assert np.array_equal(back.wrist, WRIST)
    head = struct.pack("<BBHI", ord("B"), 1, 7, 9)
    back = decode(wire(head + (COUNTS // 4).astype(np.uint8).tobytes() + WRIST.tobytes()))
    assert isinstance(back, FramePacket)
    assert back.byte_wide
    assert np.array_equal(back.counts, COUNTS // 4)


def test_frames_whose_length_does_not_fit_their_shape_are_refused():
    head = struct.pack("<BBHI", ord("B"), 2, 0, 0)
    body = bytes(12 * 32) + WRIST.tobytes()
    assert isinstance(decode(wire(head + bytes([12, 32]) + body)), FramePacket)
    assert decode(wire(head + bytes([12, 31]) + body)) is Damage.LENGTH
    assert decode(wire(head + bytes([0, 32]) + WRIST.tobytes())) is Damage.VALUE
    assert decode(wire(head)) is Damage.LENGTH
    assert decode(wire(struct.pack("<BBHI", ord("F"), 1, 0, 0) + body)) is Damage.LENGTH


def test_ident_bytes_are_those_of_the_format():
    ident = IdentPacket(
        1, 2, bits=8, sensor=3, firmware=(1, 4), settling_us=10.25, baud=500_000, boot=258,
        name="fsr",
    )  # fmt: skip
    body = bytes([16, 16, 8, 8, 3, 1, 4, 41]) + struct.pack("<HH", 500, 258) + b"fsr     "
    assert encode(ident)[:-1] == wire(struct.pack("<BBHI", ord("I"), 2, 1, 2) + body)
    assert decode(encode(ident)[:-1]) == ident


def test_statistics_bytes_are_those_of_the_format():
    statistics = StatisticsPacket(5, 6, 70_000, 8, 9, 123_456)
    body = struct.pack("<IIHI", 70_000, 8, 9, 123_456)
    assert encode(statistics)[:-1] == wire(struct.pack("<BBHI", ord("S"), 2, 5, 6) + body)
    assert decode(encode(statistics)[:-1]) == statistics


def test_readings_beyond_the_bits_are_refused():
    high = COUNTS.copy()
    high[3, 4] = 1024
    block = encode(FramePacket(0, 0, high, WRIST))[:-1]
    assert decode(block, bits=10) is Damage.VALUE
    assert isinstance(decode(block, bits=16), FramePacket)
    wrist = np.array([0, 0, 0, 1024], np.uint16)
    for byte_wide in (False, True):
        block = encode(FramePacket(0, 0, COUNTS // 4, wrist, byte_wide))[:-1]
        assert decode(block, bits=8) is Damage.VALUE


HEADER = struct.pack("<BBHI", ord("I"), 1, 0, 0)
IDENT = bytes([16, 16, 10, 8, 0, 1, 0, 40]) + struct.pack("<HH", 1000, 0) + b"probe   "


@pytest.mark.parametrize(
    ("block", "damage"),
    [
        (b"\x05ab", Damage.STUFFING),
        (cobs.encode(b"short"), Damage.LENGTH),
        (cobs.encode(HEADER + IDENT + b"\x00\x00"), Damage.CHECK),
        (wire(b"I\x03" + HEADER[2:] + IDENT), Damage.VERSION),
        (wire(b"Q" + HEADER[1:] + IDENT), Damage.TYPE),
        (wire(HEADER + IDENT + b"\x00"), Damage.LENGTH),
        (wire(HEADER + bytes([0]) + IDENT[1:]), Damage.VALUE),  # rows
        (wire(HEADER + IDENT[:2] + bytes([7]) + IDENT[3:]), Damage.VALUE),  # bits
        (wire(HEADER + IDENT[:4] + bytes([8]) + IDENT[5:]), Damage.VALUE),  # selected sensor
        (wire(HEADER + IDENT[:-1] + b"\xff"), Damage.VALUE),  # name
    ],
)
def test_what_is_no_packet_says_why(block, damage):
    assert decode(block) is damage


def test_values_that_do_not_fit_are_not_sent():
    with pytest.raises(FrameError, match="8 bits"):
        encode(FramePacket(0, 0, COUNTS, WRIST, byte_wide=True))
    with pytest.raises(FrameError, match="field"):
        encode(FramePacket(65536, 0, COUNTS, WRIST))
    with pytest.raises(FrameError, match="field"):
        encode(IdentPacket(0, 0, name="Fühler"))


def test_commands_for_a_sensor_or_bits_that_a_probe_does_not_have():
    with pytest.raises(PortError, match="no sensor 8"):
        sensor_command(8)
    with pytest.raises(PortError, match="12 bits"):
        bits_command(12)


def test_a_block_without_end_is_cut_and_stays_too_long():
    splitter = Splitter()
    for _ in range(LONGEST // 50_000 + 2):
        assert splitter.feed(b"x" * 50_000) == []
        assert len(splitter._rest) <= LONGEST + 1
    (block,) = splitter.feed(b"\0")
    assert len(block) == LONGEST + 1
    assert splitter.feed(b"good\0") == [b"good"]
