"""Corrupt packets in memory and count what the client hands on all the same.

    python tests/campaigns/probe_corruption.py --packets 1000000 --seed 1

Streams of frames with a realistic share of zeros go through the client's receiver; every
second packet on average is corrupted, a kind at a time:

- flips: 1 ... 8 bits; burst: 1 ... 64 bytes replaced; drop: 1 ... 16 bytes missing;
- splice: the head of a packet and the tail of the next, cut anywhere;
- lost whole: the same, with as many bytes missing as a packet has, so that the length fits.

`check` is what the 16-bit check sum alone would have let through, `packet` what passes all
checks of a packet by itself, `wrong` what was handed on and is no frame that was sent, `good
lost` packets that came whole, but were not handed on. Exit code 1 if any 10-bit frame is wrong.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from dataclasses import dataclass

import numpy as np

from probe.client.receiver import Receiver
from probe.protocol import Damage, FramePacket, Splitter, decode, encode

KINDS = ("flips", "burst", "drop", "splice", "lost whole")
CHUNK = 2000
STEP_US = 4545
SILENT = 147 / 256  # tactels that never respond, of a real sensor


@dataclass
class Count:
    """What became of the packets of one kind of corruption."""

    corrupted: int = 0
    check: int = 0
    packet: int = 0
    wrong: int = 0
    intact: int = 0
    handed_on: int = 0


def corrupt(kind: str, rng: random.Random, wire: list[bytes], i: int) -> int:
    """Corrupt packet `i` on the wire; returns how many packets that costs."""
    data, at = wire[i], rng.randrange(len(wire[i]))
    if kind == "flips":
        flipped = bytearray(data)
        for _ in range(rng.randint(1, 8)):
            flipped[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        wire[i] = bytes(flipped)
    elif kind == "burst":
        garbage = rng.randbytes(min(rng.randint(1, 64), len(data) - at))
        wire[i] = data[:at] + garbage + data[at + len(garbage) :]
    elif kind == "drop":
        wire[i] = data[:at] + data[at + rng.randint(1, 16) :]
    else:  # splice, lost whole
        after = at if kind == "lost whole" else rng.randrange(1, len(wire[i + 1]))
        wire[i], wire[i + 1] = data[: max(at, 1)], wire[i + 1][max(after, 1) :]
        return 2
    return 1


def packets_of(rng: np.random.Generator, first: int, byte_wide: bool) -> list[FramePacket]:
    counts = rng.integers(0, 256 if byte_wide else 1024, (CHUNK, 16, 16), dtype=np.uint16)
    counts[rng.random(counts.shape) < SILENT] = 0
    wrist = rng.integers(0, 1024, (CHUNK, 4), dtype=np.uint16)
    return [
        FramePacket(
            (first + i) % 65536, (first + i) * STEP_US % 2**32, counts[i], wrist[i], byte_wide
        )
        for i in range(CHUNK)
    ]


def campaign(kind: str, byte_wide: bool, packets: int, seed: int) -> Count:
    """Send packets until so many are corrupted."""
    rng, numbers = random.Random(f"{kind} {byte_wide} {seed}"), np.random.default_rng(seed)
    receiver, splitter, count, first = Receiver(), Splitter(), Count(), 0
    truth: dict[int, FramePacket] = {}
    while count.corrupted < packets:
        sent = packets_of(numbers, first, byte_wide)
        wire = [encode(packet) for packet in sent]
        whole, i = {w[:-1] for w in wire}, 0
        # The last ones stay whole, so that each chunk can be judged by itself.
        while i < CHUNK - 8:
            if rng.random() < 0.5:
                n = corrupt(kind, rng, wire, i)
                count.corrupted += n
                i += n
            else:
                i += 1
        data = b"".join(wire)
        for block in splitter.feed(data):
            if block in whole:
                count.intact += 1
            else:
                found = decode(block)
                count.check += len(block) > 11 and found not in (Damage.STUFFING, Damage.CHECK)
                count.packet += not isinstance(found, Damage)
        truth |= {first + i: packet for i, packet in enumerate(sent)}
        for frame in receiver.feed(data, 0):
            was = truth.get(frame.seq)
            right = (
                was is not None
                and frame.t_ns == frame.seq * STEP_US * 1000
                and np.array_equal(was.counts, frame.counts)
                and np.array_equal(was.wrist, frame.wrist)
            )
            count.handed_on += right
            count.wrong += not right
        truth = {first + CHUNK - 1: sent[-1]}  # is held until the next chunk
        first += CHUNK
    count.handed_on += len(receiver.settle(0))
    return count


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--packets", type=int, default=1_000_000, help="corrupted, of each width")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bits", choices=("10", "8", "both"), default="both")
    chosen = parser.parse_args()
    widths = {"10": (10,), "8": (8,), "both": (10, 8)}[chosen.bits]
    wrong = 0
    print("bits  kind        corrupted  check  packet  wrong  good came  good lost  seconds")
    for bits in widths:
        for kind in KINDS:
            began = time.process_time()
            c = campaign(kind, bits == 8, chosen.packets // len(KINDS), chosen.seed)
            seconds = time.process_time() - began
            print(
                f"{bits:4d}  {kind:10s}  {c.corrupted:9d}  {c.check:5d}  {c.packet:6d}  "
                f"{c.wrong:5d}  {c.intact:9d}  {c.intact - c.handed_on:9d}  {seconds:7.1f}"
            )
            wrong += c.wrong if bits == 10 else 0
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
