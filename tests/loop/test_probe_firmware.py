"""The firmware itself, on an emulated AVR, read through its serial port.

Counts are compared with the images that were felt, frame by frame. Free-running emulations
where time does not matter: they take an eighth of the time.
"""

import re
import subprocess
from contextlib import closing

import numpy as np
import pytest
from reference.emulated_probe import FIRMWARE, build, emulated_probe

from probe.circuit import QUIET, Electronics, invert_readings
from probe.circuit.reading import shares
from probe.port import open_port
from probe.protocol import FramePacket, IdentPacket, Splitter, StatisticsPacket, decode

HERTZ = 16_000_000
ADC_CLOCK = 16  # cycles


class Line:
    """Packets of an open port, good and bad."""

    def __init__(self, url):
        self.port = open_port(url)
        self.splitter = Splitter()
        self.waiting = []

    def close(self):
        self.port.close()

    def send(self, commands):
        self.port.write(commands)

    def packets(self, seconds=10.0):
        """Yield packets and damages until nothing was received for so long."""
        while True:
            while self.waiting:
                yield decode(self.waiting.pop(0))
            data = self.port.read(seconds)
            if not data:
                return
            self.waiting += self.splitter.feed(data)

    def next(self, kind, seconds=10.0):
        for packet in self.packets(seconds):
            if isinstance(packet, kind):
                return packet
        raise AssertionError(f"no {kind.__name__} in {seconds} s")

    def take(self, count, kind=FramePacket):
        return [self.next(kind) for _ in range(count)]

    def quiet(self):
        """Stop it; commands are obeyed in their order, so nothing comes after the ident."""
        for _ in range(5):
            self.send(b"xi")
            if any(isinstance(packet, IdentPacket) for packet in self.packets(1.0)):
                return
        raise AssertionError("no ident")

    def ask(self, command, kind):
        self.send(command)
        return self.next(kind)


def images(count, seed=1):
    return np.random.default_rng(seed).uniform(0, 5000, (count, 16, 16))


def counts_of(millivolts):
    return np.minimum(
        np.floor(np.asarray(millivolts, np.float32).astype(float) * 1024 / 5000), 1023
    )


@pytest.fixture(scope="module")
def probe():
    with emulated_probe(tau_us=0, paced=False) as running:
        yield running


@pytest.fixture
def line(probe):
    with closing(Line(probe.url)) as opened:
        opened.send(b"a0")
        opened.quiet()
        yield opened
        opened.send(b"x")


def test_ident_says_what_it_is(line):
    ident = line.ask(b"b5i", IdentPacket)
    assert (ident.rows, ident.columns, ident.sensors) == (16, 16, 8)
    assert (ident.bits, ident.sensor) == (8, 5)
    assert (ident.baud, ident.settling_us) == (1_000_000, 10.0)
    assert (ident.firmware, ident.name) == ((2, 0), "FSR-uno")


def test_every_frame_is_the_image_that_was_felt_whole(probe, line):
    shown, seen, source = {}, set(), images(100)
    line.send(b"s")
    while len(seen) < 40:
        for _ in range(4):  # faster than scans begin
            image = source[len(shown) % 100]
            shown[probe.show(image, image[0, :4])] = image
        packet = line.next(FramePacket)
        number = probe.seen(packet.seq)
        if number in shown:  # the first ones were felt before
            seen.add(number)
            assert (packet.counts == counts_of(shown[number])).all()
            assert (packet.wrist == counts_of(shown[number][0, :4])).all()


def test_statistics_count_frames_waits_and_wrong_commands(line):
    before = line.ask(b"t", StatisticsPacket)
    line.send(b"s")
    line.take(20)
    line.quiet()
    after = line.ask(b"?\0\xfft", StatisticsPacket)
    assert after.receive_errors - before.receive_errors == 3
    frames = after.frames - before.frames
    assert frames >= 20
    assert (after.seq - before.seq) % 65536 == frames
    assert frames - 3 <= after.transmit_waits - before.transmit_waits <= frames  # line-bound
    assert abs(after.uptime_ms - after.t_us // 1000) <= 2


def test_device_time_counts_microseconds(line):
    line.send(b"s")
    packets = line.take(200)
    steps = np.diff([packet.t_us for packet in packets]) % 2**32
    # 534 bytes of 10 bits at 1 Mbaud; COBS needs a byte less when no block of 254 is full
    assert np.median(steps) == pytest.approx(5340, abs=20)


def pins_of(board):
    """Return the pin map of the README: signal to pins, for one board."""
    rows = re.findall(r"^\| (.*) \|$", (FIRMWARE / "README.md").read_text(), re.MULTILINE)
    cells = [row.split(" | ") for row in rows]
    head = next(row for row in cells if row[0] == "signal")
    column = next(i for i, cell in enumerate(head) if f"`{board}`" in cell)
    return {
        row[0].split(" S0")[0].split(" A0")[0]: re.findall(r"\bP([A-L])(\d)\b", row[column])
        for row in cells[cells.index(head) + 2 :]
        if len(row) == len(head)
    }


def level(ports, pins):
    return sum((ports[port] >> int(bit) & 1) << i for i, (port, bit) in enumerate(pins))


@pytest.mark.parametrize("board", ["uno", "mega"])
@pytest.mark.parametrize("wiring", ["grounded", "floating"])
def test_pins_move_as_documented(board, wiring, tmp_path):
    trace = tmp_path / "trace.txt"
    running = emulated_probe(board=board, wiring=wiring, paced=False, trace=trace)
    with running as probe, closing(Line(probe.url)) as line:
        line.send(b"6")
        line.ask(b"g", FramePacket)
    pins = pins_of(board)
    ports = dict.fromkeys("ABCD", 0)
    data, clock, latch = pins["rows, grounded: SER SRCLK RCLK"]
    held, rows = 0b1010, 0b1010  # of the registers, and behind their latch
    seen, switched, converted, early, settling = [], 0, 0, [], []
    for entry in trace.read_text().splitlines():
        cycle, what, *rest = entry.split()
        if what == "port":
            before = level(ports, [clock]), level(ports, [latch])
            ports[rest[0]] = int(rest[1])
            after = level(ports, [clock]), level(ports, [latch])
            if after[0] > before[0]:
                held = (held << 1 | level(ports, [data])) & 0xFFFF
            if after[1] > before[1]:
                rows = held
            switched = int(cycle)
            early.append(int(cycle) - converted)
        else:
            row = level(ports, pins["rows, floating:"])
            if wiring == "grounded":
                row = {1 << i: i for i in range(16)}.get(rows)  # one at the supply, no other
            seen.append((row, level(ports, pins["column address"]), int(rest[0])))
            settling.append((int(cycle) - switched, int(rest[0])))
            converted = int(cycle)
    scan = [(r, c, 0) for r in range(16) for c in range(16)] + [(0, 0, k) for k in (1, 2, 3, 4)]
    assert seen[-260:] == scan
    assert level(ports, pins["sensor select"]) == 6
    assert min(gap for gap, channel in settling[1:] if channel == 0) >= 10e-6 * HERTZ
    assert min(early[-255:]) >= 2.5 * ADC_CLOCK


@pytest.mark.parametrize("board", ["uno", "mega", "teensy"])
def test_it_builds_without_a_warning_and_leaves_512_bytes_for_the_stack(board):
    folder = build(FIRMWARE, f"BOARD={board}", "ROWS=16", "COLUMNS=16")
    words = ["avr-size", folder / "probe.elf"]
    sizes = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    text, data, bss = map(int, sizes.splitlines()[1].split()[:3])
    assert text <= 16384
    assert data + bss <= {"uno": 2048, "mega": 8192, "teensy": 8192}[board] - 512


def test_a_rate_that_is_not_exact_is_refused(tmp_path):
    words = ["make", "-C", FIRMWARE, f"OUT={tmp_path}", "BAUD=115200"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert done.returncode
    assert "BAUD is not exact at 16 MHz" in done.stderr


def test_frames_are_of_version_2_and_tell_their_shape():
    mv = np.arange(256.0).reshape(16, 16) * 15
    running = emulated_probe(tau_us=0, paced=False, shape=(8, 12))
    with running as probe, closing(Line(probe.url)) as line:
        probe.show(mv)
        line.ask(b"g", FramePacket)
        frame = line.ask(b"g", FramePacket)
        ident = line.ask(b"i", IdentPacket)
    assert (ident.rows, ident.columns, ident.firmware) == (8, 12, (2, 0))
    assert (frame.counts == counts_of(mv[:8, :12])).all()


@pytest.mark.parametrize("wiring", ["grounded", "floating", "virtual"])
def test_a_matrix_of_resistors_reads_as_its_network(wiring):
    rng = np.random.default_rng(4)
    g = np.full((16, 16), 1e-7)
    g[rng.integers(16, size=40), rng.integers(16, size=40)] = 10.0 ** rng.uniform(-5, -3, 40)
    board = Electronics(readout=wiring, reference_v=5.0, bias_lsb=0.0, coupling=0.0, noise=QUIET,
                        feedback_ohm=1000.0)  # fmt: skip
    load = board.feedback_ohm if wiring == "virtual" else board.load_ohm
    running = emulated_probe(wiring=wiring, load_ohm=load, tau_us=0, paced=False)
    with running as probe, closing(Line(probe.url)) as line:
        probe.show_conductances(g)
        line.ask(b"g", FramePacket)
        counts = line.ask(b"g", FramePacket).counts.astype(float)
    expected = np.floor(1024 * shares(g, board)).clip(0, 1023)
    assert np.abs(counts - expected).max() <= 1
    found = invert_readings(counts, board).conductance_s
    clear = g > 1e-4
    assert np.abs(found[clear] / g[clear] - 1).max() < (0.5 if wiring == "floating" else 0.1)
    ghosts = counts[(g < 1e-6)].max()
    assert ghosts > 100 if wiring == "floating" else ghosts <= 1
