"""Packets and recordings: any stream is read as it was, any bytes at all are survived."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recorded import record, same

from probe.client.receiver import Receiver
from probe.frame import frame_from
from probe.protocol import (
    LONGEST,
    Damage,
    FramePacket,
    IdentPacket,
    Splitter,
    StatisticsPacket,
    decode,
    encode,
    frame_bytes,
)
from probe.recording.read import Recording

U16, U32 = st.integers(0, 2**16 - 1), st.integers(0, 2**32 - 1)
U8 = st.integers(0, 255)
NAMES = st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=8)
STEP_US = 4545


@st.composite
def frames(draw):
    rng = np.random.default_rng(draw(U32))
    byte_wide = draw(st.booleans())
    top = draw(st.sampled_from((1, 256) if byte_wide else (1, 256, 257, 1024)))
    shape = draw(st.sampled_from([(16, 16), (12, 32), (32, 12), (1, 2), (8, 8), (255, 255)]))
    counts = rng.integers(0, top, shape, dtype=np.uint16)
    wrist = rng.integers(0, 1024, 4, dtype=np.uint16)
    return FramePacket(draw(U16), draw(U32), counts, wrist, byte_wide)


IDENTS = st.builds(
    IdentPacket,
    U16,
    U32,
    bits=st.integers(8, 16),
    sensor=st.integers(0, 7),
    firmware=st.tuples(U8, U8),
    settling_us=U8.map(lambda n: n / 4),
    baud=U16.map(lambda n: n * 1000),
    boot=U16,
    name=NAMES,
)
STATISTICS = st.builds(StatisticsPacket, U16, U32, U32, U32, U16, U32)


@settings(deadline=None, max_examples=100)
@given(st.one_of(IDENTS, STATISTICS))
def test_decode_after_encode_is_the_identity(packet):
    block = encode(packet)
    assert block.count(0) == 1
    assert decode(block[:-1]) == packet


@settings(deadline=None, max_examples=100)
@given(frames())
def test_frames_come_back(packet):
    block = encode(packet)
    assert block.count(0) == 1
    back = decode(block[:-1])
    assert (back.seq, back.t_us, back.byte_wide) == (packet.seq, packet.t_us, packet.byte_wide)
    assert np.array_equal(back.counts, packet.counts)
    assert np.array_equal(back.wrist, packet.wrist)
    assert not any(array.flags.writeable for array in (back.counts, back.wrist))
    size = frame_bytes(packet.counts.shape, byte_wide=packet.byte_wide)
    assert len(block) <= size <= LONGEST


@settings(deadline=None, max_examples=100)
@given(st.binary(max_size=3000))
def test_no_bytes_are_an_error(data):
    splitter = Splitter()
    for block in [*splitter.feed(data), data]:
        decode(block)
    assert len(splitter._rest) <= LONGEST + 1


@settings(deadline=None, max_examples=100)
@given(frames().filter(lambda packet: packet.counts.size < 1000), st.data())
def test_up_to_three_flipped_bits_are_always_found(packet, data):
    # The CRC's distance is 4 up to 32,751 bits. Flips are made before COBS, where it stands.
    from cobs import cobs

    payload = bytearray(cobs.decode(encode(packet)[:-1]))
    bits = data.draw(st.sets(st.integers(0, 8 * len(payload) - 1), min_size=1, max_size=3))
    for bit in bits:
        payload[bit // 8] ^= 1 << bit % 8
    assert decode(cobs.encode(bytes(payload))) is Damage.CHECK


def stream(n, seed):
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 1024, (n, 16, 16), dtype=np.uint16)
    counts[rng.random(counts.shape) < 0.5] = 0
    wrist = np.zeros(4, np.uint16)
    return [encode(FramePacket(i, i * STEP_US, counts[i], wrist)) for i in range(n)]


@settings(deadline=None, max_examples=50)
@given(U32, st.data())
def test_any_split_gives_the_same_frames(seed, data):
    sent = b"".join(stream(12, seed))
    cuts = sorted(data.draw(st.lists(st.integers(0, len(sent)), max_size=40)))
    receiver, seen = Receiver(), []
    for start, stop in zip([0, *cuts], [*cuts, len(sent)], strict=True):
        seen += receiver.feed(sent[start:stop], 0)
    seen += receiver.settle(0)
    assert [f.seq for f in seen] == list(range(12))
    assert receiver.statistics().failed == 0
    assert receiver.statistics().rate == pytest.approx(1e6 / STEP_US)


@settings(deadline=None, max_examples=50)
@given(U32, st.lists(st.tuples(st.integers(1, 10), st.binary(max_size=700)), max_size=5))
def test_garbage_costs_the_packet_that_it_touches(seed, bursts):
    blocks = stream(12, seed)
    touched = set()
    for i, garbage in bursts:  # stands before packet i
        blocks[i] = garbage + blocks[i]
        touched.add(i)
    receiver = Receiver()
    seen = receiver.feed(b"".join(blocks), 0) + receiver.settle(0)
    assert {f.seq for f in seen} >= set(range(12)) - touched
    assert {f.t_ns for f in seen} <= {i * STEP_US * 1000 for i in range(12)}


@settings(deadline=None, max_examples=50)
@given(U32, st.integers(0, 11), st.integers(0, 2**31))
def test_damage_costs_no_other_frame(seed, i, damage):
    blocks = stream(12, seed)
    rng = np.random.default_rng(damage)
    body = bytearray(blocks[i][:-1])
    for at in rng.integers(0, len(body), 3):
        body[at] = max(1, body[at] ^ int(rng.integers(1, 256)))
    whole = bytes(body) == blocks[i][:-1]
    blocks[i] = bytes(body) + b"\0"
    receiver = Receiver()
    seen = [f.seq for f in receiver.feed(b"".join(blocks), 0) + receiver.settle(0)]
    assert seen == [n for n in range(12) if n != i or whole]


def recorded_frames(seed, count, poses):
    rng = np.random.default_rng(seed)
    t, seq, frames = 0, 0, []
    for _ in range(count):
        t += int(rng.integers(0, 10**8))
        seq += 1 + int(rng.geometric(0.5)) * bool(rng.random() < 0.1)
        pose = np.eye(4)
        pose[:3, 3] = rng.normal(0, 400, 3)
        frames.append(
            frame_from(rng.integers(0, 65536, (16, 16)) * (rng.random((16, 16)) < 0.1),
                       t_ns=t, seq=seq, wrist=rng.integers(0, 65536, 4),
                       pose=pose if rng.random() < poses else None)
        )  # fmt: skip
    return frames


@settings(deadline=None, max_examples=15)
@given(
    seed=st.integers(0, 2**32),
    count=st.integers(0, 300),
    poses=st.sampled_from([0.0, 0.01, 0.5, 1.0]),
    flush_s=st.sampled_from([0.0, 0.2, 1e9]),
    roll_over_s=st.sampled_from([2.0, 9.0, 1e9]),
    start=st.integers(0, 320),
    length=st.integers(0, 320),
)
def test_any_stream_is_read_as_it_was(seed, count, poses, flush_s, roll_over_s, start, length):
    frames = recorded_frames(seed, count, poses)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "touch.h5"
        record(path, frames, flush_s=flush_s, roll_over_s=roll_over_s)
        recording = Recording(path)
        assert len(recording) == count
        assert all(map(same, recording.frames(), frames))
        part = list(recording.frames(start, start + length))
        assert len(part) == len(frames[start : start + length])
        assert all(map(same, part, frames[start : start + length]))
        assert len(recording.block(start, start + length)) == len(part)
