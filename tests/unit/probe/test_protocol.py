"""Packets against bytes worked by hand; bytes -> trusted frames; damage stays out."""

import struct
from binascii import crc_hqx

import numpy as np
import pytest
from cobs import cobs

from probe.client.receiver import FrameOrder, Receiver
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
    sensor_command,
)

COUNTS = (np.arange(256, dtype=np.uint16) * 4).reshape(16, 16)
READ_WRIST = np.array([0, 1, 512, 1023], np.uint16)


def wire(payload: bytes) -> bytes:
    """Stuff a payload with its right check sum."""
    return cobs.encode(payload + struct.pack("<H", crc_hqx(payload, 0xFFFF)))


@pytest.mark.parametrize("byte_wide", [False, True])
def test_frames_of_version_1_are_read(byte_wide):
    sent = COUNTS // 4 if byte_wide else COUNTS
    head = struct.pack("<BBHI", ord("B" if byte_wide else "F"), 1, 7, 9)
    body = sent.astype(np.uint8 if byte_wide else "<u2").tobytes()
    back = decode(wire(head + body + READ_WRIST.tobytes()))
    assert isinstance(back, FramePacket)
    assert (back.seq, back.t_us, back.byte_wide) == (7, 9, byte_wide)
    assert np.array_equal(back.counts, sent)
    assert np.array_equal(back.wrist, READ_WRIST)


def test_readings_beyond_the_bits_are_refused():
    high = COUNTS.copy()
    high[3, 4] = 1024
    block = encode(FramePacket(0, 0, high, READ_WRIST))[:-1]
    assert decode(block, bits=10) is Damage.VALUE
    assert isinstance(decode(block, bits=16), FramePacket)
    wrist = np.array([0, 0, 0, 1024], np.uint16)
    for byte_wide in (False, True):
        block = encode(FramePacket(0, 0, COUNTS // 4, wrist, byte_wide))[:-1]
        assert decode(block, bits=8) is Damage.VALUE


HEADER = struct.pack("<BBHI", ord("I"), 1, 0, 0)
IDENT = bytes([16, 16, 10, 8, 0, 1, 0, 40]) + struct.pack("<HH", 1000, 0) + b"probe   "
SHAPED, OLD = (
    struct.pack("<BBHI", ord(kind), version, 0, 0) for kind, version in (("B", 2), ("F", 1))
)
BODY = bytes(12 * 32) + READ_WRIST.tobytes()


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
        (wire(SHAPED + bytes([12, 31]) + BODY), Damage.LENGTH),
        (wire(SHAPED + bytes([0, 32]) + READ_WRIST.tobytes()), Damage.VALUE),
        (wire(SHAPED), Damage.LENGTH),
        (wire(OLD + BODY), Damage.LENGTH),
    ],
)
def test_what_is_no_packet_says_why(block, damage):
    assert decode(block) is damage


@pytest.mark.parametrize("filling", [b" ", b"\0"])
def test_a_short_name_may_be_filled_up_as_c_does(filling):
    block = wire(HEADER + IDENT[:-8] + b"mine".ljust(8, filling))
    assert decode(block).name == "mine"


@pytest.mark.parametrize(
    ("call", "error", "says"),
    [
        (lambda: encode(FramePacket(0, 0, COUNTS, READ_WRIST, True)), FrameError, "8 bits"),
        (lambda: encode(FramePacket(65536, 0, COUNTS, READ_WRIST)), FrameError, "field"),
        (lambda: encode(IdentPacket(0, 0, name="Fühler")), FrameError, "field"),
        (lambda: sensor_command(8), PortError, "no sensor 8"),
        (lambda: bits_command(12), PortError, "12 bits"),
    ],
)
def test_what_a_packet_or_a_command_cannot_say_is_refused(call, error, says):
    with pytest.raises(error, match=says):
        call()


def test_a_block_without_end_is_cut_and_stays_too_long():
    splitter = Splitter()
    for _ in range(LONGEST // 50_000 + 2):
        assert splitter.feed(b"x" * 50_000) == []
        assert len(splitter._rest) <= LONGEST + 1
    (block,) = splitter.feed(b"\0")
    assert len(block) == LONGEST + 1
    assert splitter.feed(b"good\0") == [b"good"]


STEP_US = 10_000
IMAGE = np.zeros((16, 16), np.uint16)
WRIST = np.zeros(4, np.uint16)


def packet(seq: int, t_us: int | None = None) -> FramePacket:
    t_us = seq * STEP_US if t_us is None else t_us
    return FramePacket(seq % 65536, t_us % 2**32, IMAGE, WRIST)


def ident(seq: int, t_us: int, boot: int = 0) -> IdentPacket:
    return IdentPacket(seq, t_us, boot=boot)


def run(order: FrameOrder, packets: list, now_ns: int = 0) -> list[tuple[int, int]]:
    """Return number and time (us) of the frames that come out; a number is a failed block."""
    out = []
    for p in packets:
        if isinstance(p, int):
            order.fail(p)
        elif (frame := order.take(p, now_ns)) is not None:
            out.append((frame.seq, frame.t_ns // 1000))
    if (frame := order.settle(now_ns)) is not None:
        out.append((frame.seq, frame.t_ns // 1000))
    return out


@pytest.mark.parametrize(
    ("packets", "seen", "lost", "doubtful"),
    [
        # packets that are no frames confirm too
        ([packet(0), ident(1, 5000), packet(1), packet(2)], [0, 1, 2], 0, 0),
        ([packet(0), StatisticsPacket(1, 0, 1, 0, 0, 0), packet(7)], [0, 7], 6, 0),
        # failed blocks account for a gap
        ([packet(0), 20, packet(2), 530, 9, packet(5), 1060, packet(8)], [0, 2, 5, 8], 5, 0),
        # head of 1 and tail of 2, with a check sum that is right by chance
        ([packet(0), packet(1), packet(3), packet(4)], [0, 3, 4], 2, 1),
        # more is lost than failed
        ([packet(0), 530, packet(3), packet(4)], [3, 4], 0, 1),
        # a wrong number, a wrong time, and one frame of another start
        ([packet(0), packet(1), packet(40_000, 20_000), packet(3), packet(4)], [0, 3, 4], 2, 2),
        ([packet(0), packet(1), packet(2, 3 * 10**9), packet(3), packet(4)], [0, 3, 4], 2, 2),
        ([packet(50), packet(51), packet(3, 30), packet(53), packet(54)], [50, 53, 54], 2, 2),
    ],
)
def test_frames_that_no_neighbour_confirms_stay_out(packets, seen, lost, doubtful):
    order = FrameOrder()
    assert [seq for seq, _ in run(order, packets)] == seen
    assert (order.lost, order.doubtful, order.reboots) == (lost, doubtful, 0)


def test_numbers_and_times_unwrap():
    first = 2**32 // STEP_US - 3  # the clock wraps after three frames, the number later
    order = FrameOrder()
    seen = run(order, [packet(i, i * STEP_US) for i in range(first, first + 70_000)])
    assert len(seen) == 70_000
    assert seen[0] == (first % 65536, first * STEP_US)
    assert [seq for seq, _ in seen] == list(range(first % 65536, first % 65536 + 70_000))
    assert [t for _, t in seen] == [i * STEP_US for i in range(first, first + 70_000)]
    assert order.lost == order.reboots == 0


@pytest.mark.parametrize("gap", [1, 300, 40_000, 65_536, 65_537, 200_000])
def test_gaps_of_any_length_are_counted(gap):
    order = FrameOrder()
    out = run(order, [packet(i) for i in range(10)])
    out += run(order, [packet(i + gap) for i in range(10, 20)])
    assert [seq for seq, _ in out] == [*range(10), *range(10 + gap, 20 + gap)]
    assert order.lost == gap
    assert order.reboots == 0


@pytest.mark.parametrize(
    ("before", "after", "now_ns", "first_us"),
    [
        # with its ident: two seconds by the host's clock
        ([ident(0, 0, boot=7)], [ident(0, 50, boot=8), packet(0, 100), packet(1, 100 + STEP_US)],
         2_000_000_000, 999 * STEP_US + 2_000_000),
        # without it: told by the device's clock
        ([], [packet(0, 300), packet(1, 300 + STEP_US)], 0, None),
        ([], [packet(0, 300), packet(1, 300 + STEP_US)], 700_000_000, None),
        # its number goes back while its clock goes on
        ([], [packet(i, (1000 + i) * STEP_US) for i in range(2)], 0, 1000 * STEP_US),
    ],
)  # fmt: skip
def test_a_reboot_starts_the_numbers_anew_and_no_time_goes_back(before, after, now_ns, first_us):
    order = FrameOrder()
    assert len(run(order, [*before, *(packet(i) for i in range(1000))])) == 1000
    seen = run(order, after, now_ns)
    assert [seq for seq, _ in seen] == [0, 1]
    assert seen[0][1] > 999 * STEP_US if first_us is None else seen[0][1] == first_us
    assert seen[1][1] == seen[0][1] + STEP_US
    assert (order.reboots, order.lost) == (1, 0)


def test_a_reboot_before_the_first_frame_is_counted_once():
    order = FrameOrder()
    run(order, [ident(0, 5, boot=1), ident(0, 5, boot=2), packet(0), packet(1)])
    assert order.reboots == 1


def frame_block(seq: int, value: int | None = None) -> bytes:
    counts = np.full((16, 16), seq % 1024 if value is None else value, np.uint16)
    return encode(FramePacket(seq, seq * STEP_US, counts, np.full(4, 9, np.uint16)))


def test_a_stream_that_is_joined_in_the_middle_counts_nothing_as_failed():
    receiver = Receiver()
    frames = receiver.feed(frame_block(0)[100:] + frame_block(1) + frame_block(2), 0)
    assert [f.seq for f in frames] == [1]
    receiver.settle(0)
    receiver.reopened()
    receiver.feed(frame_block(7)[300:] + frame_block(8), 0)
    assert (receiver.statistics().failed, receiver.statistics().lost) == (0, 0)
