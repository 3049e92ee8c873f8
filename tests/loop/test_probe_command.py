"""`probe-sensor` as its users start it: processes, signals, a terminal, the emulated firmware."""

import fcntl
import json
import os
import pty
import re
import select
import signal
import struct
import subprocess
import termios
import time
from functools import partial

import numpy as np
import pytest
from programs import command, started, wait_for
from recorded import record
from reference.emulated_probe import emulated_probe

from probe.circuit import QUIET, Electronics, fsr_of, read_counts
from probe.command import run
from probe.errors import RecordingError
from probe.frame import frame_from
from probe.recording.read import Recording

FULL_MV = 5000.0
SHORT_S = 20.0  #: for anything, on a busy machine


@pytest.fixture
def asked(ask):
    return partial(ask, run)


def held_in(path):
    """Return how many frames of a recording that is being written are on the disk."""
    try:
        return len(Recording(path, live=True))
    except RecordingError:
        return 0


def test_simulate_that_is_interrupted_leaves_its_touches(tmp_path):
    out, truth = tmp_path / "a.h5", tmp_path / "a.json"
    words = ["--touches", "100000", "-o", out, "--truth", truth, "--accuracy", "footprint"]
    with started("probe", "simulate", "washer", *words) as process:
        wait_for(lambda: any(held_in(path) for path in tmp_path.glob(".a.*.part.h5")))
        process.send_signal(signal.SIGINT)
        text, err = process.communicate(timeout=SHORT_S)
    assert process.returncode == 130
    assert "interrupted after" in err
    touches = json.loads(truth.read_text())["touches"]
    assert len(Recording(out)) == len(touches) > 10
    assert f"{len(touches):,} touches" in text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.h5", "a.json"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_recording_that_is_ended_by_a_signal_is_complete(tmp_path, number):
    out, part = tmp_path / "a.h5", tmp_path / "a.part.h5"
    with started("probe", "record", "sim:?rate=400", "-o", out) as process:
        wait_for(lambda: held_in(part))
        process.send_signal(number)
        text, err = process.communicate(timeout=SHORT_S)
    assert process.returncode == (0 if number == signal.SIGINT else 128 + signal.SIGTERM)
    assert err == ""
    frames = list(Recording(out).frames())
    if number == signal.SIGINT:
        assert text.startswith(f"{out}: {len(frames)} frames in")
    assert [f.seq - frames[0].seq for f in frames] == list(range(len(frames)))
    assert not part.exists()


class Terminal:
    """A command on a terminal of its own."""

    def __init__(self, *words):
        self.master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("4H", 24, 90, 0, 0))
        known = {name: value for name, value in os.environ.items() if name != "NO_COLOR"}
        self.process = subprocess.Popen(
            command("probe", *words), stdin=slave, stdout=slave, stderr=slave,
            env={**known, "TERM": "xterm-256color"}, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # Ctrl-C goes to it
        )  # fmt: skip
        os.close(slave)
        self.text = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        os.close(self.master)

    def read(self):
        """Take what was drawn meanwhile."""
        while select.select([self.master], [], [], 0)[0]:
            try:
                self.text += os.read(self.master, 65536).decode()
            except OSError:  # the other end is closed
                return
            if self.process.poll() is not None and not select.select([self.master], [], [], 0)[0]:
                return

    def until(self, pattern):
        """Wait for text that is drawn from now on."""

        def seen():
            self.read()
            return re.search(pattern, re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", self.text))

        found = wait_for(seen)
        self.text = ""
        return found

    def press(self, keys):
        os.write(self.master, keys.encode())

    def ended(self):
        wait_for(lambda: (self.read(), self.process.poll() is not None)[1])
        return self.process.returncode


def test_live_on_a_terminal_obeys_its_keys(tmp_path):
    with Terminal("live", "sim:", "--folder", tmp_path) as terminal:
        terminal.until(r"rate +\d+\.\d frames/s")
        terminal.press("b")
        terminal.until("bias of 32 frames is off the image")
        terminal.press("m3")
        terminal.until("median 3x3")
        terminal.until("3 of sim, 10 bits")
        terminal.press("r")
        terminal.until(r"REC live-001\.h5, [1-9]")
        terminal.press("s")
        terminal.until("saved image-001.png and .npy")
        terminal.press(" ")
        terminal.until("PAUSED")
        assert "\x1b[48;5;" in terminal.text or terminal.until("sensor") is not None
        terminal.press("q")
        assert terminal.ended() == 0
        assert "\x1b[?1049l" in terminal.text, "the screen is given back"
    assert len(Recording(tmp_path / "live-001.h5")) > 5
    assert Recording(tmp_path / "live-001.h5").origin.sensor == "sim/3"
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["image-001.npy", "image-001.png", "live-001.h5"]


def test_the_reader_of_a_replay_may_leave(tmp_path):
    stills = (frame_from(np.full((16, 16), i), t_ns=i * 10**7, seq=i) for i in range(81))
    path = record(tmp_path / "a.h5", stills).files[0]
    with started("probe", "replay", path, "--speed", "1") as process:
        assert process.stdout.readline().startswith("seq,t_ns")
        process.stdout.close()
        process.wait(SHORT_S)
        assert process.stderr.read() == ""
    assert process.returncode == 1


@pytest.fixture(scope="module")
def emulated():
    """What uses it stands last, for it costs a processor as long as it runs."""
    with emulated_probe(noise_mv=4) as probe:  # or no frame would differ from the one before
        probe.show(np.linspace(0, FULL_MV, 256).reshape(16, 16))
        yield probe


def test_record_shows_what_happens_to_the_probe_and_goes_on(asked, emulated, tmp_path):
    out = tmp_path / "a.h5"
    words = ("record", emulated.url, "-o", out, "--seconds", "3", "--sensor", "2")
    with started("probe", *words) as process:
        wait_for(lambda: held_in(tmp_path / "a.part.h5"))
        code, text, _ = asked("info", emulated.url, "--json")
        assert code == 3
        assert "in use by another programme" in json.loads(text)["error"]["cause"]
        emulated.fault("unplug 0.3")
        text, err = process.communicate(timeout=SHORT_S)
    assert process.returncode == 0
    assert "the device went away; it is tried again for 30 s" in err
    assert "the port is open again after" in err
    assert "reopenings 1" in text
    held = Recording(out)
    assert held.origin.sensor == "FSR-uno/2"
    expected = np.rint(np.linspace(0, 1023, 256).reshape(16, 16))
    assert np.abs(held.block().counts[5:].mean(axis=0) - expected).max() < 2


def test_a_calibration_is_guided_through_the_firmware(asked, emulated, tmp_path):
    board = Electronics(noise=QUIET, bias_lsb=4.0)
    out, folder = tmp_path / "cal.json", tmp_path / "loads"

    def put_on(newtons):
        forces = np.full((16, 16), newtons / 256)
        counts, _ = read_counts(forces, board, fsr_of(16, 16), None, np.random.default_rng(1))
        emulated.show(counts * (FULL_MV / 1023))

    words = ["calibrate", "port", emulated.url, "-o", out, "--newtons", "40,130,400",
             "--folder", folder, "--seconds", "0.3", "--board", "simulated"]  # fmt: skip
    with started("probe", *words, stdin=subprocess.PIPE) as process:
        for newtons in (0, 40, 130, 400):
            told = ""
            while not told.endswith("then press Enter: "):
                letter = process.stderr.read(1)
                assert letter, told
                told += letter
            assert f"put {newtons} N" in told or newtons == 0
            put_on(newtons)
            time.sleep(0.3)
            process.stdin.write("\n\n")  # read it, and go on
            process.stdin.flush()
        text, err = process.communicate(timeout=SHORT_S)
    assert process.returncode == 0, err
    assert "felt by 256 of 256 tactels" in err
    assert re.search(r"sound +256 of 256", text)
    again = tmp_path / "again.json"
    code, text, _ = asked("calibrate", "loads", folder / "loads.csv", "-o", again, "--board",
                          "simulated", "--json")  # fmt: skip
    assert (code, json.loads(text)["sound"]) == (0, 256)
    put_on(150)
    npy, made = tmp_path / "a.npy", tmp_path / "a.h5"
    time.sleep(0.3)
    assert asked("record", emulated.url, "-o", made, "--frames", "30", "--calibration", out)[0] == 0
    assert asked("export", made, "--npy", npy, "--calibration", out)[0] == 0
    assert np.load(npy)[5:].mean(axis=0).sum() == pytest.approx(150, rel=0.03)
