"""Frame rate, losses and errors of the firmware on the emulated 16 MHz part.

    python tests/bench/probe_rates.py --seconds 10 --seed 1
    python tests/bench/probe_rates.py --minutes 10 --only long

Paced at 16 MHz of real time: frames per second by the reader's clock and by the device's, frames
lost, failed checks, and injected against received counts (rms over all tactels of all frames;
a converter that cuts off has 0.58). Images change 20 times a second; which one a frame felt
is noted by the emulator. The second table varies settling and time constant, free-running.
"slipped" is time that a busy machine took from the emulation.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field

import numpy as np

from probe.firmware.emulator import EmulatedProbe, emulated_probe
from probe.port import open_port
from probe.protocol import Command, Damage, FramePacket, Splitter, bits_command, decode

IMAGES = 64
PERIOD_S = 0.05
FULL_MV, COUNTS = 5000.0, 1024


@dataclass
class Tally:
    """What came in one run."""

    frames: int = 0
    lost: int = 0
    failed: int = 0
    squares: float = 0.0
    worst: float = 0.0
    seconds: float = 0.0
    device_us: int = 0
    slipped_s: float = 0.0
    overrun: int = 0
    last: FramePacket | None = field(default=None, repr=False)

    @property
    def rms(self) -> float:
        """Of received minus injected, counts."""
        return float(np.sqrt(self.squares / max(self.frames * 256, 1)))

    def add(self, packet: FramePacket, image_mv: np.ndarray) -> None:
        """Count one frame."""
        scale = COUNTS / FULL_MV / (4 if packet.byte_wide else 1)
        error = packet.counts - np.minimum(
            image_mv * scale, (COUNTS - 1) * scale * FULL_MV / COUNTS
        )
        self.frames += 1
        self.squares += float((error**2).sum())
        self.worst = max(self.worst, float(np.abs(error).max()))
        if self.last is not None:
            self.lost += (packet.seq - self.last.seq - 1) % 65536
            self.device_us += (packet.t_us - self.last.t_us) % 2**32
        self.last = packet


def run(probe: EmulatedProbe, seconds: float, images: np.ndarray, commands: bytes = b"") -> Tally:
    """Stream for so long while images change, and compare every frame with what it felt."""
    port, splitter, tally = open_port(probe.url), Splitter(), Tally()
    before = probe.statistics()
    first = number = probe.show(images[0], images[0, 0, :4])
    shown = {number: 0}
    port.write(commands + Command.START)
    start = due = time.monotonic()
    begun = 0.0
    while (now := time.monotonic()) < start + seconds:
        if now >= due:
            due = now + PERIOD_S
            number = probe.show(images[(number + 1 - first) % len(images)])
            shown[number] = (number - first) % len(images)
        for block in splitter.feed(port.read(0.02)):
            packet = decode(block)
            if isinstance(packet, Damage):
                tally.failed += tally.frames > 0
            elif isinstance(packet, FramePacket) and probe.felt(packet.seq) in shown:
                begun = begun or time.monotonic()
                tally.add(packet, images[shown[probe.felt(packet.seq)]])
    port.write(Command.STOP)
    tally.seconds = time.monotonic() - begun
    after = probe.statistics()
    tally.slipped_s = after.slipped_s - before.slipped_s
    tally.overrun = after.overrun - before.overrun
    port.close()
    return tally


def rates(seconds: float, images: np.ndarray, boards: list[str]) -> None:
    """Print the rate at each speed, with 10 and 8 bits."""
    print(f"{'board':6}{'baud':>9}{'bits':>5}{'fps':>8}{'device':>8}{'frames':>8}{'lost':>6}"
          f"{'failed':>7}{'rms':>7}{'worst':>7}{'slipped':>9}")  # fmt: skip
    for board in boards:
        for baud in (500_000, 1_000_000, 2_000_000):
            with emulated_probe(baud=baud, board=board) as probe:
                for bits in (10, 8):
                    tally = run(probe, seconds, images, bits_command(bits))
                    device = (tally.frames + tally.lost - 1) / (tally.device_us * 1e-6)
                    print(f"{board:6}{baud:9}{bits:5}{tally.frames / tally.seconds:8.1f}"
                          f"{device:8.1f}{tally.frames:8}{tally.lost:6}{tally.failed:7}"
                          f"{tally.rms:7.3f}{tally.worst:7.2f}{tally.slipped_s:8.2f}s")  # fmt: skip


def settling(images: np.ndarray, noise_mv: float, seed: int) -> None:
    """Print the rms error, counts, over settling and time constant, and the rate that is left."""
    taus = (0.5, 1.0, 2.0, 5.0, 10.0)
    print(f"\n{'settling us':>12}{'fps at 1M':>10}"
          + "".join(f"{f'tau {tau:g} us':>12}" for tau in taus))  # fmt: skip
    for settle_us in (0.0, 5.0, 10.0, 20.0, 40.0, 60.0):
        with emulated_probe(
            settle_us=settle_us, noise_mv=noise_mv, seed=seed, paced=False
        ) as probe:
            errors = []
            for tau in taus:
                probe.fault(f"tau {tau}")
                tally = run(probe, 0.4, images)
                errors.append(tally.rms)
            device = (tally.frames + tally.lost - 1) / (tally.device_us * 1e-6)
        print(f"{settle_us:12g}{device:10.1f}" + "".join(f"{error:12.2f}" for error in errors))


def long_run(seconds: float, images: np.ndarray, baud: int) -> None:
    """Print what is lost in a long run."""
    with emulated_probe(baud=baud) as probe:
        tally = run(probe, seconds, images)
    device = (tally.frames + tally.lost - 1) / (tally.device_us * 1e-6)
    print(
        f"\n{seconds:g} s at {baud} baud: {tally.frames} frames, "
        f"{tally.frames / tally.seconds:.1f} fps ({device:.1f} by the device's clock), "
        f"lost {tally.lost}, failed checks {tally.failed}, bytes overrun {tally.overrun}, "
        f"rms {tally.rms:.3f} counts, worst {tally.worst:.2f}, slipped {tally.slipped_s:.2f} s"
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=3.0, help="of each paced run")
    parser.add_argument("--minutes", type=float, help="of the long run; default: --seconds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise-mv", type=float, default=0.0)
    parser.add_argument("--baud", type=int, default=1_000_000, help="of the long run")
    parser.add_argument("--boards", nargs="+", default=["uno", "mega"])
    parser.add_argument("--only", choices=("rates", "settling", "long"))
    given = parser.parse_args()
    images = np.random.default_rng(given.seed).uniform(0, FULL_MV, (IMAGES, 16, 16))
    if given.only in (None, "rates"):
        rates(given.seconds, images, given.boards)
    if given.only in (None, "settling"):
        settling(images, given.noise_mv, given.seed)
    if given.only in (None, "long"):
        long_run(60 * given.minutes if given.minutes else given.seconds, images, given.baud)


if __name__ == "__main__":
    main()
