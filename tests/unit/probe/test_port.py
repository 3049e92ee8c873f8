"""Ports: URLs, lines, the probe in software, FlexiTac's stream, and a port of another package."""

import errno
import itertools
import os
import pty
import socket
import threading
import time
import tomllib
import tty
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from postgres import free_port

from probe.client.client import Client
from probe.command import run
from probe.errors import PortError, ProbeError
from probe.frame import Frame, frame_from
from probe.port.address import Address
from probe.port.flexitac import MARKER, MarkedImages
from probe.port.serial_line import _explain_refusal
from probe.port.software import SoftwareProbe, endless_frames
from probe.port.url import GROUP, address_of, open_port, typed_port
from probe.protocol import FramePacket, IdentPacket, Splitter, StatisticsPacket, decode, encode
from probe.recording.read import Recording


@pytest.mark.parametrize(
    ("url", "target", "options"),
    [
        ("serial:///dev/ttyACM0?baud=500000", "/dev/ttyACM0", {"baud": "500000"}),
        ("sim:lab.db#Cube/top?rate=5&seed=1", "lab.db#Cube/top", {"rate": "5", "seed": "1"}),
        ("sim:postgresql://h/d?sslmode=require#Cube/1", "postgresql://h/d?sslmode=require#Cube/1",
         {}),
        ("file:touch.h5?speed=0&loop=1", "touch.h5", {"speed": "0", "loop": "1"}),
    ],
)  # fmt: skip
def test_urls_are_read(url, target, options):
    assert address_of(url) == Address(url, url.partition(":")[0], target, options)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("touch.h5", "write file:touch.h5"),
        ("serial:", "names no device"),
        ("file:?speed=1", "names no recording"),
        ("sim:?rate", "options 'rate' cannot be read"),
        ("sim:?rate=fast", "rate='fast' is no number from 0.1"),
        ("sim:?rate=0", "rate='0' is no number from 0.1"),
        ("sim:?rate=inf", "is no number"),
        ("sim:?rate=1e9", "rate='1e9' is no number from 0.1 to 10000"),
        ("sim:?rate=nan", "is no number"),
        ("file:touch.h5?speed=1e300", "is no number from 0 to 1e+06"),
        ("file:touch.h5?loop=2", "is no number from 0 to 1"),
        ("serial:///dev/ttyACM0?baud=1e30", "is no number from 1 to 2e+07"),
        ("file:touch.h5?speed=-1", "no number from 0"),
        ("serial:///dev/ttyACM0?boud=1", "serial: has no option boud"),
        ("sim:washer?period=1e9", "write a number from"),
        ("sim:washer?force=-1", "write a number from"),
        ("sim:washer?seed=1e300", "write a number from"),
        ("sim:washer?x=nan", "write a number from"),
    ],
)
def test_urls_that_mean_nothing_are_refused(url, says):
    with pytest.raises(ProbeError) as refused:
        open_port(url)
    assert says in str(refused.value)
    assert refused.value.fix
    assert refused.value.exit_code == 2


def test_without_permission_the_group_is_named(tmp_path):
    device = tmp_path / "ttyACM0"
    device.touch()
    refused = _explain_refusal(address_of(f"serial://{device}"), OSError(errno.EACCES, "no"), 9600)
    assert f"no permission to open {device}" in refused.cause
    assert "usermod -a -G" in refused.fix


IDENT = IdentPacket(0, 0, name="test")


def packet(seq, shape=(16, 16)) -> bytes:
    counts, wrist = np.full(shape, 7, np.uint16), np.zeros(4, np.uint16)
    return encode(FramePacket(seq % 65536, 10_000 * seq, counts, wrist))


def spoilt(seq) -> bytes:
    """Return a frame whose check sum is wrong."""
    block = bytearray(packet(seq))
    block[20] ^= 1
    return bytes(block)


NOISE = np.random.default_rng(1).integers(0, 256, 1 << 20, dtype=np.uint8).tobytes()
#: what a device sends as packet number `seq`, and what is said of it
# fmt: off
FAULTS = {
    "bad checks": (lambda seq: encode(IDENT) if not seq else spoilt(seq), "no image comes through"),
    "bad checks alone": (spoilt, "no packets of a probe"),
    "changing shapes": (
        lambda seq: packet(seq, ((16, 16), (12, 32))[seq % 2]), "change their shape"),
    "garbage": (lambda seq: NOISE[500 * seq % (1 << 19) :][:500], "no packets of a probe"),
    "garbage without end": (lambda _: b"x" * 500, "no packets of a probe"),
    "silence": (lambda _: b"", "silent for 0.8 s"),
    "an ident alone": (lambda seq: b"" if seq else encode(IDENT), "sends no images"),
    "no numbers": (lambda _: packet(3), "no image of the last 0.8 s agrees"),
    "another shape": (
        lambda seq: packet(seq, ((16, 16), (12, 32))[seq > 20]), "changed from 16 x 16 to"),
    "silence later": (lambda seq: packet(seq) if seq < 20 else b"", "silent for 0.8 s"),
    "bad checks later": (
        lambda seq: packet(seq) if seq < 20 else spoilt(seq), "packets of a probe"),
}
# fmt: on


@contextmanager
def sending(packet_of, *, greeted=True, goes_after=None):
    """Yield the name of a device that sends packet after packet once it is greeted, or goes."""
    master, slave = pty.openpty()
    tty.setraw(master)
    name = os.ttyname(slave)
    stop = threading.Event()

    def send():
        if greeted:
            os.read(master, 1)
            os.close(slave)
        for seq in itertools.count():
            if stop.wait(0.005) or seq == goes_after:
                break
            if data := packet_of(seq):
                with suppress(OSError):
                    os.write(master, data)
        os.close(master)

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    try:
        yield name
    finally:
        stop.set()
        thread.join(5)
        if not greeted:
            os.close(slave)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_line_without_images_is_told_by_what_comes(fault):
    packet_of, said = FAULTS[fault]
    with sending(packet_of) as name, Client(f"serial://{name}", answer_s=0.8) as client:
        began_s = time.monotonic()
        with pytest.raises(PortError, match=said) as failed:
            list(client.frames(timeout_s=5))
        assert time.monotonic() < began_s + 5
    assert failed.value.exit_code == 3
    assert failed.value.place == f"serial://{name}"
    assert failed.value.fix


def test_what_is_damaged_or_of_another_shape_between_good_images_is_dropped():
    def packet_of(seq):
        return spoilt(seq) if seq % 5 == 4 else packet(seq, (12, 32) if seq == 20 else (16, 16))

    with sending(packet_of) as name, Client(f"serial://{name}", answer_s=0.8) as client:
        read = list(islice(client.frames(timeout_s=5), 100))
        counts = client.statistics()
    assert {frame.counts.shape for frame in read} == {(16, 16)}
    assert len(read) == 100
    assert counts.failed > 15
    assert counts.lost >= 15


def test_a_recording_whose_device_goes_says_that_it_ended_early(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("probe.command.recorded._SILENT_S", 0.5)
    out = tmp_path / "touch.h5"
    with sending(packet, goes_after=60) as name:
        assert run(["record", f"serial://{name}", "-o", str(out), "--seconds", "1"]) == 3
    said = capsys.readouterr().err
    assert f"serial://{name}: error: the recording ended early: 0." in said
    assert "of 1 s" in said
    assert len(Recording(out)) > 30


def frame(seq: int, t_ns: int) -> Frame:
    return frame_from(np.full((16, 16), seq % 1024), t_ns=t_ns, seq=seq, wrist=[1, 2, 3, 4])


def frames(n: int):
    return iter([frame(i, i * 10_000_000) for i in range(n)])


def packets(port, reads: int = 1, bits: int = 10) -> list:
    splitter = Splitter()
    blocks = [b for _ in range(reads) for b in splitter.feed(port.read(0.0))]
    return [decode(block, bits) for block in blocks]


def test_ident_and_statistics_answer():
    port = SoftwareProbe("sim:", frames(10), IDENT, speed=0)
    assert packets(port) == []
    port.write(b"5bgQ#")
    (first,) = packets(port, 3)
    assert isinstance(first, FramePacket)
    assert first.byte_wide
    port.write(b"it")
    ident, statistics = packets(port)
    assert (ident.sensor, ident.bits, ident.name, ident.seq) == (5, 8, "test", 1)
    assert isinstance(statistics, StatisticsPacket)
    assert (statistics.frames, statistics.receive_errors) == (1, 2)
    port.write(b"sx")
    assert packets(port) == []


def test_jumps_are_announced():
    at_ns = {0: 0, 1: 10**7, 5: 5 * 10**7, 6: 10**10, 2: 10**10}
    port = SoftwareProbe("file:x", itertools.starmap(frame, at_ns.items()), IDENT, speed=0)
    port.write(b"s")
    seen = [(type(p).__name__[0], p.seq) for p in packets(port)]
    assert seen == [
        ("F", 0), ("F", 1), ("S", 2), ("F", 5), ("S", 6), ("F", 6), ("S", 7), ("F", 2)
    ]  # fmt: skip


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


LENGTH = 512
RNG = np.random.default_rng(3)


def images_of(number):
    """Return images (number, 512), in many of which the marker stands at some place."""
    images = RNG.integers(0, 256, (number, LENGTH), dtype=np.uint8)
    for image in images[::2]:
        at = int(RNG.integers(LENGTH - 2))
        image[at : at + 2] = 0xAA, 0x55
    return images


def stream_of(images):
    return b"".join(MARKER + image.tobytes() for image in images)


def found_in(stream, pieces, **told):
    marked, found = MarkedImages(LENGTH), []
    cuts = np.sort(RNG.integers(0, len(stream), pieces))
    for part in np.split(np.frombuffer(stream, np.uint8), cuts):
        found += marked.feed(part.tobytes(), **told)
    return np.array([np.frombuffer(image, np.uint8) for image in found]), marked


@pytest.mark.parametrize("pieces", [1, 40, 3000])
def test_images_come_out_of_any_pieces(pieces):
    images = images_of(40)
    found, marked = found_in(stream_of(images)[777:] + MARKER, pieces)
    assert np.array_equal(found, images[2:])  # the first two began before the stream
    assert marked.sure


def test_lost_and_added_bytes_cost_the_images_that_they_are_in():
    images = images_of(60)
    stream = bytearray(stream_of(images))
    del stream[20 * 514 + 99 : 20 * 514 + 102]  # of image 20
    stream[40 * 514 : 40 * 514] = b"\x00\xaa\x55\x01\x02"  # before image 40
    found, marked = found_in(bytes(stream) + MARKER, 30)
    true = {image.tobytes() for image in images}
    assert all(image.tobytes() in true for image in found)
    assert len(found) >= 60 - 2
    assert marked.lost == 511 + 514 + 5


def sending_images(images):
    """Yield the device of a board that sends images again and again, from within the first on."""

    def block(seq):
        return (MARKER + images[seq % len(images)].tobytes())[0 if seq else 50 :]

    return sending(block, greeted=False)


STILL = np.zeros((1, LENGTH), np.uint8)
STILL[0, 100:102], STILL[0, 200] = (0xAA, 0x55), 7  # the marker in it


@pytest.mark.parametrize("images", [images_of(9), STILL], ids=["changing", "still"])
def test_a_board_is_read_over_a_line(images):
    true = {image.tobytes() for image in images}
    with sending_images(images) as device, Client(f"flexitac://{device}") as client:
        frames = [frame for frame, _ in zip(client.frames(timeout_s=5), range(40), strict=False)]
        ident = client.ident
    assert len(frames) == 40
    assert all(frame.counts.astype(np.uint8).tobytes() in true for frame in frames)
    assert frames[0].counts.shape == (16, 32)
    assert [frame.seq - frames[0].seq for frame in frames] == list(range(40))
    assert all(a.t_ns < b.t_ns for a, b in itertools.pairwise(frames))
    assert (ident.name, ident.rows, ident.columns, ident.bits) == ("flexitac", 16, 32, 8)


def test_a_board_of_another_size_is_read_with_its_type_and_named_without(capsys):
    with sending_images(images_of(9)[:, : 12 * 32]) as device:
        url = f"flexitac://{device}"
        assert run(["info", url]) == 2
        said = capsys.readouterr().err
        assert "images of 384 bytes come, 16 x 32 (512 bytes) was expected" in said
        assert "give --sensor-type flexitac-12x32, or" in said
        assert run(["info", url, "--sensor-type", "flexitac-12x32", "--seconds", "0.2"]) == 0
        assert "12x32, 8 bits" in capsys.readouterr().out
    with sending_images(images_of(9)) as device:
        assert run(["info", f"flexitac://{device}", "--sensor-type", "flexitac-12x32"]) == 2
        assert "images of 512 bytes come" in capsys.readouterr().err


def test_it_reads_what_its_own_client_reads():
    """The reference: `flexitac` 0.3.1, images in which no marker stands."""
    flexitac = pytest.importorskip("flexitac")
    images = RNG.integers(0, 160, (12, LENGTH), dtype=np.uint8)
    with sending_images(images) as device:
        with flexitac.FlexiTacSensor(port=device, rows=16, cols=32, baseline=0.0) as theirs:
            read = [theirs.read().raw for _ in range(24)]
        with Client(f"flexitac://{device}") as client:
            ours = [f.counts for f, _ in zip(client.frames(timeout_s=5), range(24), strict=False)]
    number = {image.tobytes(): i for i, image in enumerate(images)}
    for got in (read, [counts.astype(np.uint8) for counts in ours]):
        order = [number[one.tobytes()] for one in got]
        assert all((b - a) % len(images) == 1 for a, b in itertools.pairwise(order))


EXAMPLE = Path(__file__).parents[3] / "docs/examples/udp_probe"


@pytest.fixture
def udp(tmp_path, monkeypatch):
    """Install the package as pip would, and yield a free port of this machine."""
    entries = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]["entry-points"]
    info = tmp_path / "udp_probe-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: udp-probe\nVersion: 1.0\n")
    text = "".join(f"{scheme} = {opener}\n" for scheme, opener in entries[GROUP].items())
    (info / "entry_points.txt").write_text(f"[{GROUP}]\n{text}lost = no_such_module:Port\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.syspath_prepend(EXAMPLE)
    return free_port()


def test_images_of_another_package_are_frames(udp):
    images = np.random.default_rng(1).integers(0, 4096, (6, 8, 8)).astype("<u2")
    url = f"udp://127.0.0.1:{udp}?sensor_type=fsr-8x8"
    assert typed_port(url)[1].name == "fsr-8x8"
    stop = threading.Event()

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not stop.is_set():
                for image in images:
                    out.sendto(image.tobytes(), ("127.0.0.1", udp))
                    time.sleep(0.005)

    sender = threading.Thread(target=send, daemon=True)
    sender.start()
    with Client(url) as client:
        frames = [frame for frame, _ in zip(client.frames(timeout_s=5), range(12), strict=False)]
        assert (client.ident.name, client.ident.rows) == ("udp", 8)
    stop.set()
    sender.join()
    assert len(frames) == 12
    known = {image.tobytes() for image in images}
    assert all(frame.counts.astype("<u2").tobytes() in known for frame in frames)


def test_it_refuses_as_ports_do(udp):
    with pytest.raises(PortError, match=r"cannot listen.*write udp://"):
        open_port("udp://127.0.0.1:port")
    with pytest.raises(PortError, match=r"no_such_module.*install it again"):
        open_port("lost:")
    with pytest.raises(PortError, match="sim:, file:, lost: or udp:"):
        open_port("http://probe")
    with pytest.raises(PortError, match="udp: has no option rows"):
        open_port(f"udp://127.0.0.1:{udp}?rows=8")
