"""What comes over a serial line, and the URLs of ports."""

import struct
from binascii import crc_hqx
from contextlib import suppress

import numpy as np
from cobs import cobs

from foreign.case import GOOD, FaultError, Kind, kept
from foreign.damage import WORDS, damaged, no_file
from foreign.models import shapes
from foreign.recordings import recorded_files


def _packet(rng, number):
    from probe.protocol import FramePacket, IdentPacket, StatisticsPacket, encode

    frame = kept()[1][number % GOOD]
    do = rng.random()
    if do < 0.8:
        counts = frame.counts
        return encode(FramePacket(number % 65536, number * 4545 % 2**32, counts, frame.wrist))
    if do < 0.86:
        return encode(IdentPacket(number % 65536, number * 4545 % 2**32))
    if do < 0.9:
        return encode(StatisticsPacket(number % 65536, number * 4545 % 2**32, 1, 2, 3, 4))
    rows, columns = rng.choice(((16, 16), (0, 0), (255, 255), (1, 1), (0, 16), (16, 0), (16, 17)))
    head = struct.pack(
        "<BBHI",
        rng.choice((*b"FBIS", 0, 255)),
        rng.choice((1, 2, 2, 2, 3, 255)),
        rng.choice((number % 65536, 0, 65535)),
        rng.choice((0, 2**32 - 1, 4545)),
    )
    body = bytes((rows, columns)) + rng.choice(
        (b"", bytes(rows * columns * 2 + 8), bytes(520), b"\xff" * 520, bytes(range(22)), bytes(14))
    )
    if rng.random() < 0.3:
        body = bytes((rows, columns, rng.choice((0, 7, 16, 17, 255)), 1, 0, 1, 1, 1)) + struct.pack(
            "<2H8s", 1, rng.choice((0, 7)), rng.choice((b"probe   ", b"\xff" * 8, b"\0\x1b[2J   "))
        )
    payload = head + body
    return cobs.encode(payload + struct.pack("<H", crc_hqx(payload, 0xFFFF))) + b"\0"


def write_packets(rng, _folder):
    """Return pieces of a stream with damage, and the numbers of frames that may come of it."""
    stream = [_packet(rng, number) for number in range(rng.choice((3, 12, 40)))]
    for _ in range(rng.choice((0, 1, 3))):
        at = rng.randrange(len(stream))
        do = rng.randrange(5)
        if do < 3:
            stream[at] = damaged(rng, stream[at])
        elif do == 3:
            stream.insert(at, rng.choice((rng.randbytes(99), bytes(50), b"\xff" * 9000)))
        else:
            del stream[at : at + rng.choice((1, 5))]
        if not stream:
            break
    whole, pieces = b"".join(stream), []
    while whole:
        size = rng.choice((1, 7, 100, 536, 4096))
        pieces.append(whole[:size])
        whole = whole[size:]
    return pieces, set()


def read_packets(given, _out):
    """Receive a stream; what is handed on is what was sent, pixel for pixel."""
    from probe.client.receiver import Receiver

    receiver, now = Receiver(), 0
    for piece in given[0]:
        now += 10**7
        last = receiver.settle if len(piece) == 7 else lambda _: ()
        for frame in (*receiver.feed(piece, now), *last(now)):
            if frame.counts.shape == (16, 16) and frame.counts.max() > 0:
                true = kept()[1][frame.seq % 65536 % GOOD]
                if not (frame.counts == true.counts).all() and frame.counts.max() < 1023:
                    raise FaultError("wrong value", "a frame that was not sent")
    receiver.statistics()


def write_line(rng, _folder):
    """Return what a board says that has no check sums: images between markers."""
    images = [b"\xaa\x55" + one.counts.astype(np.uint8).tobytes() * 2 for one in kept()[1][:20]]
    whole = damaged(rng, b"".join(images) * rng.choice((1, 2)))
    return [whole[at : at + 700] for at in range(0, len(whole), 700)]


def read_line(pieces, _out):
    from probe.port.flexitac import MarkedImages

    images = MarkedImages(512)
    for number, piece in enumerate(pieces):
        for image in images.feed(piece, quiet_s=0.001 * (number % 2)):
            if len(image) != 512:
                raise FaultError("wrong value", "an image of another length")


def write_url(rng, folder):
    """Return the URL of a port that cannot be meant, or hardly."""
    (folder / "a.h5").write_bytes(recorded_files()["ours"])
    (folder / "m.stl").write_bytes(shapes(".stl")[0])
    path = folder / "odd"
    no_file(rng, path)
    sane = {"file": str(folder / "a.h5"), "sim": rng.choice(("", str(folder / "m.stl"))),
            "serial": str(path), "flexitac": str(path)}  # fmt: skip
    options = {"rate": "100", "speed": "0", "loop": "0", "baud": "1000000", "noise": "1",
               "sensor_type": "fsr-16", "sensor": "0", "seed": "1", "force": "20",
               "": ""}  # fmt: skip
    scheme = rng.choice(("file", "file", "sim", "sim", "serial", "flexitac"))
    target, name = sane[scheme], rng.choice(list(options))
    value, query, stroke = options[name], rng.choice(("", "?{0}={1}")), rng.choice(("", "", "//"))
    do = rng.randrange(5)
    if do == 0:
        target = rng.choice((str(path), "", "//", "#", "a#b", str(folder), "../secret.txt", *WORDS))
    elif do in (1, 2):
        query = "?{0}={1}"
        value = rng.choice(("0", "-1", "1e9", "1e999", "nan", "1e-9", "no-such", *WORDS))
    elif do == 3:
        query = rng.choice(("?{0}", "?{0}={1}&{0}={1}", "?", "??", "?x={1}", "?={1}", "&{0}={1}"))
    else:
        scheme = rng.choice((scheme, scheme, "touch", "http", "", "x", "FILE", "file ", "\0"))
    return f"{scheme}:{stroke}{target}{query.format(name, value)}"


def read_url(url, _out):
    """Open a port and read a little."""
    from probe.port.url import open_port, typed_port

    typed_port(url)
    port = open_port(url)
    try:
        with suppress(EOFError):
            for _ in range(3):
                port.read(0.01)
    finally:
        port.close()


KINDS = {
    "packets": Kind(write_packets, read_packets, file=False),
    "line": Kind(write_line, read_line, file=False),
    "port": Kind(write_url, read_url, (2, 3, 4), file=False, placed=False, sound=(recorded_files,)),
}
