"""The two wirings of the board on the emulated part: rates, and touches through them, read.

    python tests/bench/probe_board.py                    # rates, free-running, by device time
    python tests/bench/probe_board.py --database lab.db  # and touches of its faces, read
    python tests/bench/probe_board.py --minutes 10       # frames lost or damaged in ten minutes

Every tactel is a resistor of the film under a simulated touch; counts are what the firmware sends.
Touches are read as counts at face value, and inverted: of floating rows by a sensor type that
says `wiring: floating`, of grounded ones by the equations of the board, as a calibration has them.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from encoded_objects.base.sensor_type import SensorType
from probe.circuit import QUIET, Electronics, conductances, fsr_of, invert_readings
from probe.client.client import Client
from probe.contact.press import press
from probe.port import open_port
from probe.protocol import Command, Damage, FramePacket, Splitter, decode
from probe.simulate.registered import registered_surface
from probe.simulate.scene import TouchRanges, random_touches
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.emulated_probe import EmulatedProbe, emulated_probe

WIRINGS = ("grounded", "floating", "virtual")
LOADS_OHM = {"grounded": 1000.0, "floating": 2200.0, "virtual": 330.0}
READINGS = ("as they are", "inverted")  #: the column's sum, the network


def take_frames(probe: EmulatedProbe, number: int) -> list[FramePacket]:
    """Return the next frames of a running emulation."""
    splitter, frames = Splitter(), []
    port = open_port(probe.url)
    port.write(Command.START)
    while len(frames) < number:
        found = (decode(block) for block in splitter.feed(port.read(1.0)))
        frames += [packet for packet in found if isinstance(packet, FramePacket)]
    port.close()
    return frames[:number]


def print_rates(frames: int) -> None:
    """Print frames per second of device time, and numbers that are missing."""
    print(f"{'wiring':10} {'baud':>9} {'frames/s':>9} {'lost':>5}   of {frames} frames")
    for wiring in WIRINGS:
        for baud in (500_000, 1_000_000, 2_000_000):
            with emulated_probe(wiring=wiring, baud=baud, paced=False) as probe:
                got = take_frames(probe, frames + 3)[3:]
            seconds = (got[-1].t_us - got[0].t_us) * 1e-6
            lost = got[-1].seq - got[0].seq - (len(got) - 1)
            print(f"{wiring:10} {baud:9,} {(len(got) - 1) / seconds:9.1f} {lost:5}")


def print_endurance(minutes: float, baud: int) -> None:
    """Print what is lost, damaged or wrong in so many minutes of device time, grounded rows."""
    rng = np.random.default_rng(7)
    image = rng.uniform(0, 5000, (16, 16))
    asked, frames, lost, bad, wrong = minutes * 60e6, 0, 0, 0, 0
    with emulated_probe(baud=baud, paced=False, tau_us=0.0) as probe:
        probe.show(image)
        splitter, port = Splitter(), open_port(probe.url)
        port.write(Command.START)
        first = before = None
        expected = None
        while first is None or before is None or (before.t_us - first.t_us) % 2**32 < asked:
            for block in splitter.feed(port.read(1.0)):
                packet = decode(block)
                if isinstance(packet, Damage):
                    bad += 1
                if not isinstance(packet, FramePacket):
                    continue
                if before is not None:
                    lost += (packet.seq - before.seq - 1) % 2**16
                before = packet
                if expected is None and frames > 2:
                    first, expected = packet, packet.counts
                wrong += expected is not None and not np.array_equal(packet.counts, expected)
                frames += 1
        port.close()
    print(
        f"{minutes:g} min of device time at {baud:,} baud: {frames} frames, "
        f"{frames / minutes / 60:.1f} a second, {lost} lost, {bad} damaged, {wrong} wrong"
    )


def print_answers(database: str, touches: int, seed: int) -> None:
    """Print how many touches are answered right, by wiring and by what the reader knows of it."""
    lab = open_lab(database)
    usual = SensorType()
    reader = Reader(lab, usual)
    inverting = Reader(lab, replace(usual, wiring="floating"))
    face = lab.arrays[0].face(0)
    scene = registered_surface(database, face.object, face.face)
    print(f"{'wiring':10} {'counts':12} {'right':>6} {'wrong':>6} {'refused':>8}  of {touches}")
    for wiring in WIRINGS:
        rng = np.random.default_rng(seed)
        drawn = random_touches(scene.region, rng, TouchRanges(margin_mm=12.0))
        with emulated_probe(wiring=wiring, load_ohm=LOADS_OHM[wiring], tau_us=0.0) as probe:
            images = []
            with Client(probe.url, buffer=1) as client:
                for touch, _ in zip(drawn, range(touches), strict=False):
                    forces = press(scene.surface, usual, touch).forces_n
                    g, _ = conductances(fsr_of(usual.rows, usual.columns), forces)
                    shown = probe.show_conductances(g)
                    for frame in client.frames(timeout_s=10):
                        if probe.seen(frame.seq) == shown:
                            images.append((touch, frame.counts))
                            break
        board = Electronics(
            "virtual" if wiring == "virtual" else "grounded", reference_v=5.0,
            load_ohm=LOADS_OHM[wiring], feedback_ohm=LOADS_OHM[wiring], bias_lsb=0, coupling=0,
            noise=QUIET,
        )  # fmt: skip
        for reading in READINGS:
            right = wrong = 0
            for touch, counts in images:
                if reading == READINGS[0]:
                    answer = reader.read(counts)
                elif wiring == "floating":
                    answer = inverting.read(counts)
                else:
                    answer = reader.read(1e6 * invert_readings(counts, board).conductance_s)
                if answer:
                    same = (answer.object, answer.face) == (face.object, face.face)
                    away = np.hypot(answer.x_mm - touch.x_mm, answer.y_mm - touch.y_mm)
                    right, wrong = right + (same and away < 2), wrong + (not same or away >= 2)
            print(f"{wiring:10} {reading:12} {right:6} {wrong:6} {len(images) - right - wrong:8}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--database", default="")
    parser.add_argument("--touches", type=int, default=14)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--baud", type=int, default=1_000_000)
    given = parser.parse_args()
    if given.minutes:
        print_endurance(given.minutes, given.baud)
        return
    print_rates(given.frames)
    if given.database:
        print_answers(given.database, given.touches, given.seed)


if __name__ == "__main__":
    main()
