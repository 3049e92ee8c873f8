"""The probe in software: it obeys like the firmware and sends what it was given."""

import time
from itertools import islice

import numpy as np
import pytest

from encoded_objects.base.sensor_type import SensorType
from probe.frame import Frame, frame_from
from probe.port.simulated import moving_pattern
from probe.port.software import SoftwareProbe, endless_frames
from probe.protocol import FramePacket, IdentPacket, Splitter, StatisticsPacket, decode

IDENT = IdentPacket(0, 0, name="test")


def frame(seq: int, t_ns: int) -> Frame:
    return frame_from(np.full((16, 16), seq % 1024), t_ns=t_ns, seq=seq, wrist=[1, 2, 3, 4])


def frames(n: int, step_ns: int = 10_000_000):
    return iter([frame(i, i * step_ns) for i in range(n)])


def packets(port, reads: int = 1, bits: int = 10) -> list:
    splitter = Splitter()
    blocks = [b for _ in range(reads) for b in splitter.feed(port.read(0.0))]
    return [decode(block, bits) for block in blocks]


def test_it_is_silent_until_it_is_started_and_after_it_is_stopped():
    port = SoftwareProbe("sim:", frames(10), IDENT, speed=0)
    assert packets(port) == []
    port.write(b"s")
    assert [p.seq for p in packets(port)] == list(range(10))
    port = SoftwareProbe("sim:", frames(10), IDENT, speed=0)
    port.write(b"sx")
    assert packets(port) == []


def test_one_frame_at_a_time():
    port = SoftwareProbe("sim:", frames(10), IDENT, speed=1)
    port.write(b"g")
    assert [p.seq for p in packets(port, 3)] == [0]
    port.write(b"gg")
    assert [p.seq for p in packets(port, 3)] == [1, 2]


def test_ident_and_statistics_answer():
    port = SoftwareProbe("sim:", frames(10), IDENT, speed=0)
    port.write(b"5bgQ#")
    (first,) = packets(port)
    assert isinstance(first, FramePacket)
    assert first.byte_wide
    port.write(b"it")
    ident, statistics = packets(port)
    assert (ident.sensor, ident.bits, ident.name, ident.seq) == (5, 8, "test", 1)
    assert isinstance(statistics, StatisticsPacket)
    assert (statistics.frames, statistics.receive_errors) == (1, 2)


def test_the_end_is_told_after_the_last_frame():
    port = SoftwareProbe("file:x", frames(3), IDENT, speed=0)
    port.write(b"s")
    assert len(packets(port)) == 3
    with pytest.raises(EOFError):
        port.read(0.0)


def test_jumps_are_announced():
    jumping = [
        frame(0, 0),
        frame(1, 10**7),
        frame(5, 5 * 10**7),
        frame(6, 10**10),
        frame(2, 10**10),
    ]
    port = SoftwareProbe("file:x", iter(jumping), IDENT, speed=0)
    port.write(b"s")
    seen = [(type(p).__name__[0], p.seq) for p in packets(port)]
    assert seen == [
        ("F", 0), ("F", 1), ("S", 2), ("F", 5), ("S", 6), ("F", 6), ("S", 7), ("F", 2)
    ]  # fmt: skip


def test_frames_leave_in_real_time():
    port = SoftwareProbe("sim:", frames(100), IDENT, speed=2.0)
    port.write(b"s")
    began, count = time.monotonic(), 0
    while count < 41:
        count += len([p for p in packets(port) if isinstance(p, FramePacket)])
        time.sleep(0.001)
    assert 0.19 <= time.monotonic() - began < 0.5  # 40 steps of 10 ms at double speed


def test_a_late_reader_makes_the_device_wait():
    port = SoftwareProbe("sim:", frames(1000), IDENT, speed=1.0)
    port.write(b"s")
    packets(port)
    time.sleep(0.7)
    assert len(packets(port)) == 1  # not the seventy that were due
    port.write(b"t")
    (statistics,) = packets(port)
    assert statistics.transmit_waits == 1


def test_a_recording_repeats_with_rising_numbers_and_times():
    seen = list(islice(endless_frames(lambda: iter([frame(7, 5), frame(9, 25)])), 5))
    assert [f.seq for f in seen] == [0, 2, 3, 5, 6]
    assert [f.t_ns for f in seen] == [0, 20, 10_000_020, 10_000_040, 20_000_040]
    assert list(endless_frames(lambda: iter([]))) == []


def test_the_pattern_moves_and_tells_up_from_down():
    shown = list(islice(moving_pattern(100.0, SensorType()), 400))
    assert [f.seq for f in shown] == list(range(400))
    assert shown[250].t_ns == 2_500_000_000
    images = np.array([f.counts for f in shown])
    assert images.max() > 800
    assert images.max() <= 1023
    assert (images[:, -1] == 0).all()
    assert len({image.tobytes() for image in images}) > 300
    top_left = images[100, :8, :8].mean()
    assert shown[100].wrist[0] == int(top_left)
