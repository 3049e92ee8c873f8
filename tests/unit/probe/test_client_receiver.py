"""Bytes to trusted frames: the counts are right, and damage stays out."""

import numpy as np
import pytest

from probe.client.receiver import Receiver
from probe.protocol import Damage, FramePacket, IdentPacket, StatisticsPacket, encode

STEP_US = 5000


def wire(seq: int, value: int | None = None) -> bytes:
    counts = np.full((16, 16), seq % 1024 if value is None else value, np.uint16)
    return encode(FramePacket(seq, seq * STEP_US, counts, np.full(4, 9, np.uint16)))


def test_frames_come_out_one_later():
    receiver = Receiver()
    assert receiver.feed(wire(0), 0) == []
    assert [f.seq for f in receiver.feed(wire(1) + wire(2), 0)] == [0, 1]
    (last,) = receiver.settle(0)
    assert (last.seq, last.t_ns) == (2, 2 * STEP_US * 1000)
    assert (last.counts == 2).all()
    assert (last.wrist == 9).all()
    assert not last.counts.flags.writeable
    assert receiver.settle(0) == []


def test_a_stream_that_is_joined_in_the_middle_counts_nothing_as_failed():
    receiver = Receiver()
    frames = receiver.feed(wire(0)[100:] + wire(1) + wire(2), 0)
    assert [f.seq for f in frames] == [1]
    assert receiver.statistics().failed == 0
    receiver.settle(0)
    receiver.reopened()
    receiver.feed(wire(7)[300:] + wire(8), 0)
    statistics = receiver.statistics()
    assert (statistics.failed, statistics.lost) == (0, 0)


def test_a_first_packet_that_is_whole_is_taken():
    receiver = Receiver()
    receiver.feed(encode(IdentPacket(0, 0, name="first")), 0)
    assert receiver.ident.name == "first"


def test_damage_is_counted_by_kind_and_stays_out():
    receiver = Receiver()
    flipped = bytearray(wire(1))
    flipped[200] ^= 4
    data = wire(0) + bytes(flipped) + wire(2) + b"\xffgarbage\0" + wire(3, value=1024) + wire(4)
    frames = receiver.feed(data, 0) + receiver.settle(0)
    assert [f.seq for f in frames] == [0, 2, 4]
    assert receiver.damages[Damage.CHECK] == 1
    assert receiver.damages[Damage.STUFFING] == 1
    assert receiver.damages[Damage.VALUE] == 1
    statistics = receiver.statistics()
    assert (statistics.frames, statistics.failed, statistics.lost) == (3, 3, 2)


def test_the_ident_tells_how_wide_readings_are():
    receiver = Receiver()
    receiver.feed(encode(IdentPacket(0, 0, bits=16)), 0)
    frames = receiver.feed(wire(0, value=40_000), 0) + receiver.settle(0)
    assert (frames[0].counts == 40_000).all()


def test_statistics_of_the_device_are_kept():
    receiver = Receiver()
    sent = StatisticsPacket(1, 2, 3, 4, 5, 6)
    receiver.feed(encode(sent), 0)
    assert receiver.device == sent


def test_the_rate_is_that_of_the_devices_clock():
    receiver = Receiver()
    assert receiver.statistics().rate == 0
    for seq in range(200):
        receiver.feed(wire(seq), 0)
    assert receiver.statistics().rate == pytest.approx(1e6 / STEP_US)
