"""FlexiTac's stream of images: where they begin, losses, and its own client on the same pty."""

from __future__ import annotations

import itertools
import os
import pty
import threading
import tty
from contextlib import contextmanager

import numpy as np
import pytest

from probe.client.client import Client
from probe.port.flexitac import MARKER, PAUSE_LEAST_S, MarkedImages
from probe.port.url import typed_port

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


def test_a_marker_inside_images_that_stand_still_is_told_by_the_pauses():
    image = np.zeros(LENGTH, np.uint8)
    image[100:102], image[200] = (0xAA, 0x55), 7
    marked, found = MarkedImages(LENGTH), []
    block = MARKER + image.tobytes()
    for part in [block[300:], *[block] * 20]:
        found += marked.feed(part[:400], quiet_s=2 * PAUSE_LEAST_S)
        found += marked.feed(part[400:])
    assert len(found) >= 15
    assert all(one == image.tobytes() for one in found)


def test_without_pauses_nothing_is_guessed():
    image = np.zeros(LENGTH, np.uint8)
    image[100:102] = 0xAA, 0x55
    found, marked = found_in(stream_of(np.tile(image, (50, 1))), 20)
    assert len(found) == 0
    assert not marked.sure
    assert len(marked._rest) <= 5 * (LENGTH + 2) + 1


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


@contextmanager
def board(images, period_s=0.004, skip=50):
    """Yield the device of a board that sends images again and again, from within the first on."""
    master, slave = pty.openpty()
    tty.setraw(master)
    name = os.ttyname(slave)
    stop = threading.Event()

    def send():
        first = True
        while not stop.is_set():
            for image in images:
                os.write(master, (MARKER + image.tobytes())[skip if first else 0 :])
                first = False
                if stop.wait(period_s):
                    return

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    try:
        yield name
    finally:
        stop.set()
        thread.join(5)
        os.close(slave)
        os.close(master)


def still_image():
    image = np.zeros(LENGTH, np.uint8)
    image[100:102], image[200] = (0xAA, 0x55), 7
    return image


@pytest.mark.parametrize("images", [images_of(9), still_image()[None]], ids=["changing", "still"])
def test_a_board_is_read_over_a_line(images):
    true = {image.tobytes() for image in images}
    with board(images) as device, Client(f"flexitac://{device}") as client:
        frames = [frame for frame, _ in zip(client.frames(timeout_s=5), range(40), strict=False)]
        ident = client.ident
    assert len(frames) == 40
    assert all(frame.counts.astype(np.uint8).tobytes() in true for frame in frames)
    assert frames[0].counts.shape == (16, 32)
    assert [frame.seq - frames[0].seq for frame in frames] == list(range(40))
    assert all(a.t_ns < b.t_ns for a, b in itertools.pairwise(frames))
    assert (ident.name, ident.rows, ident.columns) == ("flexitac", 16, 32)


def test_it_reads_what_its_own_client_reads():
    """The reference: `flexitac` 0.3.1, images in which no marker stands."""
    flexitac = pytest.importorskip("flexitac")
    images = RNG.integers(0, 160, (12, LENGTH), dtype=np.uint8)
    with board(images) as device:
        with flexitac.FlexiTacSensor(port=device, rows=16, cols=32, baseline=0.0) as theirs:
            read = [theirs.read().raw for _ in range(24)]
        with Client(f"flexitac://{device}") as client:
            ours = [f.counts for f, _ in zip(client.frames(timeout_s=5), range(24), strict=False)]
    number = {image.tobytes(): i for i, image in enumerate(images)}
    for got in (read, [counts.astype(np.uint8) for counts in ours]):
        order = [number[one.tobytes()] for one in got]
        assert all((b - a) % len(images) == 1 for a, b in itertools.pairwise(order))


def test_the_type_of_the_line_is_that_of_the_scheme_or_the_one_asked_for():
    assert typed_port("flexitac:///dev/ttyUSB0")[1].shape == (16, 32)
    assert typed_port("flexitac:///dev/ttyUSB0?sensor_type=flexitac-12x32")[1].shape == (12, 32)
    url, kind = typed_port("sim:?rate=50", "fsr-8x8")
    assert (url, kind.name) == ("sim:?rate=50&sensor_type=fsr-8x8", "fsr-8x8")
    assert typed_port("serial:///dev/ttyACM0") == ("serial:///dev/ttyACM0", None)
