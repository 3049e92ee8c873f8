"""Bytes -> trusted frames: confirmed by a neighbour, counted, unwrapped; damage stays out."""

import numpy as np
import pytest

from probe.client.receiver import FrameOrder, Receiver
from probe.protocol import Damage, FramePacket, IdentPacket, StatisticsPacket, encode

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


def numbers(order: FrameOrder, packets: list) -> list[int]:
    return [seq for seq, _ in run(order, packets)]


def test_a_frame_waits_for_its_neighbour():
    order = FrameOrder()
    assert order.take(packet(0), 0) is None
    assert order.take(packet(1), 0).seq == 0
    assert order.settle(0).seq == 1
    assert order.settle(0) is None


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
    assert numbers(order, packets) == seen
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
    packets = [packet(i) for i in range(10)]
    order.lost, out = 0, run(order, packets)
    out += run(order, [packet(i + gap) for i in range(10, 20)])
    assert [seq for seq, _ in out] == [*range(10), *range(10 + gap, 20 + gap)]
    assert order.lost == gap
    assert order.reboots == 0


def test_a_reboot_with_its_ident_starts_the_numbers_anew():
    order = FrameOrder()
    before = [ident(0, 0, boot=7), *(packet(i) for i in range(1000))]
    assert len(run(order, before, now_ns=0)) == 1000
    after = run(order, [ident(0, 50, boot=8), packet(0, 100), packet(1, 100 + STEP_US)],
                now_ns=2_000_000_000)  # fmt: skip
    # Two seconds by the host's clock.
    assert after == [(0, 999 * STEP_US + 2_000_000), (1, 1000 * STEP_US + 2_000_000)]
    assert (order.reboots, order.lost) == (1, 0)


def test_a_reboot_before_the_first_frame_is_counted_once():
    order = FrameOrder()
    assert numbers(order, [ident(0, 5, boot=1), ident(0, 5, boot=2), packet(0), packet(1)]) == [
        0,
        1,
    ]
    assert order.reboots == 1


@pytest.mark.parametrize("later_ns", [0, 700_000_000])
def test_a_reboot_without_its_ident_is_told_by_the_clock(later_ns):
    order = FrameOrder()
    run(order, [packet(i) for i in range(1000)])
    after = run(order, [packet(0, 300), packet(1, 300 + STEP_US)], now_ns=later_ns)
    assert [seq for seq, _ in after] == [0, 1]
    assert after[0][1] > 999 * STEP_US
    assert after[1][1] == after[0][1] + STEP_US
    assert (order.reboots, order.lost) == (1, 0)


def test_a_number_that_goes_back_while_the_clock_goes_on_is_a_start_too():
    order = FrameOrder()
    run(order, [packet(i) for i in range(1000)])
    after = run(order, [packet(i, (1000 + i) * STEP_US) for i in range(3)])
    assert after == [(i, (1000 + i) * STEP_US) for i in range(3)]
    assert (order.reboots, order.lost) == (1, 0)


def wire(seq: int, value: int | None = None) -> bytes:
    counts = np.full((16, 16), seq % 1024 if value is None else value, np.uint16)
    return encode(FramePacket(seq, seq * STEP_US, counts, np.full(4, 9, np.uint16)))


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


def test_the_rate_is_that_of_the_devices_clock():
    receiver = Receiver()
    assert receiver.statistics().rate == 0
    for seq in range(200):
        receiver.feed(wire(seq), 0)
    assert receiver.statistics().rate == pytest.approx(1e6 / STEP_US)
