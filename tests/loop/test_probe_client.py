"""The client against the firmware on an emulated AVR, over a real pseudo-terminal."""

import os
import pty
import time
import tty
from itertools import islice

import numpy as np
import pytest
from reference.emulated_probe import emulated_probe

from probe.client import Client
from probe.errors import PortError
from probe.frame import frame_from
from probe.recording.record import Recorder

PATIENCE_S = 20.0  # of a busy machine
IMAGE_MV = np.random.default_rng(3).uniform(0, 4990, (8, 16, 16))
COUNTS = IMAGE_MV * 1024 / 5000


@pytest.fixture
def probe():
    with emulated_probe() as running:
        running.show(IMAGE_MV, [0, 1000, 2500, 4990])
        yield running


@pytest.fixture
def line():
    """Yield the master of a pty, and the URL of its other end."""
    master, slave = pty.openpty()
    tty.setraw(master)
    yield master, f"serial://{os.ttyname(slave)}"
    os.close(master)
    os.close(slave)


def until(client, reached, seconds=PATIENCE_S):
    """Take frames until something is so; return the last one."""
    end = time.monotonic() + seconds
    for frame in client.frames(timeout_s=seconds):
        if reached(frame):
            return frame
        assert time.monotonic() < end, (client.statistics(), client.notices())
    raise AssertionError(client.statistics())


def sensor_of(frame):
    """Return the sensor whose image this is, within two counts and the settling; or None."""
    full = frame.counts.max() > 255
    errors = np.abs(frame.counts - (COUNTS if full else COUNTS / 4)).max(axis=(1, 2))
    best = int(errors.argmin())
    return best if errors[best] < 2 else None


def test_frames_are_what_the_sensor_feels(probe):
    with Client(probe.url) as client:
        frames = list(islice(client.frames(PATIENCE_S), 60))
        assert [f.seq for f in frames] == list(range(60))
        assert all(sensor_of(f) == 0 for f in frames)
        assert np.abs(frames[-1].wrist - np.array([0, 204.8, 512, 1022])).max() < 2
        assert (np.diff([f.t_ns for f in frames]) > 0).all()
        statistics = client.statistics()
        assert (statistics.lost, statistics.failed, statistics.doubtful) == (0, 0, 0)
        assert statistics.rate > 120
        assert client.ident is not None
        assert (client.ident.bits, client.ident.baud) == (10, 1_000_000)


def test_sensor_and_bits_are_selected_and_told_again_after_a_reset(probe):
    with Client(probe.url, sensor=5, bits=8) as client:
        until(client, lambda f: sensor_of(f) == 5)
        client.select_sensor(2)
        until(client, lambda f: sensor_of(f) == 2 and f.counts.max() < 256)
        until(client, lambda f: client.ident.bits == 8)
        before = until(client, lambda f: f.seq > 30)
        probe.fault("reset")
        after = until(client, lambda f: client.statistics().reboots and f.seq < before.seq)
        assert after.t_ns > before.t_ns
        until(client, lambda f: sensor_of(f) == 2 and f.counts.max() < 256)
        assert client.statistics().reboots == 1
        assert "the probe started anew" in client.notices()
        client.ask_device()
        until(client, lambda f: client.device is not None)


def test_a_reset_within_a_packet_costs_little_time(probe):
    # The ident of the new start is joined to the packet that was being sent, and fails with it.
    with Client(probe.url) as client:
        until(client, lambda f: f.seq > 20)
        probe.fault("reset")
        until(client, lambda f: client.statistics().reboots == 1)
        # Otherwise half a second of silence would have been waited for, and told.
        assert client.notices() == ["the probe started anew"]


def test_unplugging_is_survived_and_told(probe):
    with Client(probe.url) as client:
        before = until(client, lambda f: f.seq > 20)
        probe.fault("unplug 0.5")
        after = until(client, lambda f: client.statistics().reopenings == 1 and f.seq < 20)
        assert after.t_ns - before.t_ns > 400_000_000
        assert any("open again" in notice for notice in client.notices())
        until(client, lambda f: f.seq > 20)


def test_a_device_that_does_not_come_back_is_told(probe):
    with Client(probe.url, reopen_s=0.3) as client:
        until(client, lambda f: f.seq > 5)
        probe.fault("unplug 3600")
        with pytest.raises(PortError, match=r"did not come back in 0.3 s: there is no .*ttyPROBE"):
            until(client, lambda f: False)


def test_a_stream_that_stopped_is_started_again(probe):
    with Client(probe.url) as client:
        stopped = until(client, lambda f: f.seq > 5)
        other = os.open(probe.device, os.O_RDWR | os.O_NOCTTY)
        os.write(other, b"x")
        os.close(other)
        until(client, lambda f: f.t_ns - stopped.t_ns > 400_000_000)
        assert any("started again" in notice for notice in client.notices())
        assert client.statistics().reboots == 0


def test_a_damaged_line_gives_fewer_frames_and_no_wrong_one(probe):
    with Client(probe.url) as client:
        until(client, lambda f: f.seq > 5)
        probe.fault("flip 1000")
        until(client, lambda f: client.statistics().failed > 20)
        probe.fault("flip 0")
        probe.fault("drop 1000")
        probe.fault("garbage 300")
        until(client, lambda f: client.statistics().failed > 50)
        for frame in islice(client.frames(PATIENCE_S), 20):
            assert sensor_of(frame) == 0
        assert client.statistics().lost > 20


def test_a_slow_consumer_loses_the_oldest_and_knows(probe):
    with Client(probe.url, buffer=5) as client:
        first = until(client, lambda f: True)
        time.sleep(0.6)
        late = list(islice(client.frames(PATIENCE_S), 5))
        statistics = client.statistics()
        assert late[0].seq - first.seq > 10
        assert [f.seq for f in late] == list(range(late[0].seq, late[0].seq + 5))
        assert statistics.overruns >= late[0].seq - first.seq - 1
        assert (statistics.lost, statistics.failed) == (0, 0)


def test_a_silent_device_is_told_and_gets_its_commands(line):
    master, url = line
    with Client(url, sensor=3, answer_s=1.2) as client:
        with pytest.raises(PortError, match=r"silent for 1.2 s"):
            until(client, lambda f: True)
        # Greeted at once and after each half second of silence; stopped at the end.
        sent, end_s = b"", time.monotonic() + 10.0
        while not sent.endswith(b"x") and time.monotonic() < end_s:
            sent += os.read(master, 100)
        assert sent == b"3is" * 3 + b"x"


def test_a_recording_waits_for_its_consumer(tmp_path):
    path = tmp_path / "touch.h5"
    with Recorder(path) as recorder:
        for i in range(300):
            image = np.full((16, 16), 200 * i)
            recorder.append(frame_from(image, t_ns=i * 4_545_000, seq=i + 5 * (i > 100)))
    with Client(f"file:{path}?speed=0", buffer=10) as client:
        seen = []
        for frame in client.frames():
            seen.append(frame)
            if len(seen) % 100 == 0:
                time.sleep(0.1)
        assert [int(f.counts[0, 0]) for f in seen] == [200 * i for i in range(300)]
        assert [f.seq for f in seen] == [i + 5 * (i > 100) for i in range(300)]
        assert [f.t_ns for f in seen] == [i * 4_545_000 for i in range(300)]
        statistics = client.statistics()
        assert (statistics.frames, statistics.lost, statistics.overruns) == (300, 5, 0)
