"""Which load resistor for which film: what ten bits and their noise leave of a touch.

    python tests/bench/load_resistor.py                          # the table
    python tests/bench/load_resistor.py --png docs/load-resistor.png
    python tests/bench/load_resistor.py --touches 30             # and touches read, film of 100 uS

Films of 10, 30, 100 and 300 uS at a newton on a tactel, read by the grounded board and through a
virtual ground. Touches of an encoded face, 20, 60 and 120 N on the whole sensor; counts are
inverted by the board's equations. Error: of the tactels that carry more than a tenth of the highest
force, root mean square over the touch, of the force. The best load is the one whose worst
touch errs least.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from encoded_objects import Reader, encode, open_lab
from encoded_objects.base.sensor_type import SensorType
from probe.circuit import Electronics, Noise, conductances, fsr_of, invert_readings
from probe.circuit.reading import scan_shares, shares
from probe.contact.contract import Touch
from probe.contact.press import press
from probe.simulate.registered import registered_surface
from probe.simulate.touch import TouchRanges, random_touches

FILMS_US = (10.0, 30.0, 100.0, 300.0)  #: at 1 N on a tactel
FORCES_N = (20.0, 60.0, 120.0)
LOADS_OHM = np.round(np.geomspace(30, 100_000, 22), -1)
READ_LOADS_OHM = (220.0, 1000.0, 2200.0, 4700.0, 10_000.0)
BOARD = Electronics(reference_v=5.0, coupling=0.0, noise=Noise(0.3, 0.0, 0.05, 0.0, 0.0))


def touches() -> list[np.ndarray]:
    """Return the forces of the tactels, one image a force."""
    with tempfile.TemporaryDirectory() as folder:
        encode({"name": "Box", "shape": {"box": ["60 mm", "60 mm", "40 mm"]}},
               database=f"{folder}/lab.db", formats=())  # fmt: skip
        scene = registered_surface(f"{folder}/lab.db", "Box", "F1")
        sensor = SensorType()
        return [
            press(scene.surface, sensor, Touch(30.0, 29.0, 0.4, force)).forces_n
            for force in FORCES_N
        ]


def error(forces: np.ndarray, film_us: float, board: Electronics) -> float:
    """Return the relative error of what is read of a touch."""
    rng = np.random.default_rng(1)
    film = fsr_of(16, 16)
    film = replace(film, gain_s=film.gain_s * film_us / 100.0,
                   series_ohm=film.series_ohm * 100.0 / film_us)  # fmt: skip
    g, _ = conductances(film, forces)
    read = 1023 * scan_shares(shares(g, board), board) + board.bias_lsb
    counts = np.clip(np.rint(read + 0.3 * rng.standard_normal(g.shape)), 0, 1023)
    found = invert_readings(counts, board).conductance_s
    carrying = g > 0.1 * g.max()
    return float(np.sqrt(np.mean((found[carrying] / g[carrying] - 1) ** 2)))


def curves(images: list[np.ndarray], film_us: float, readout: str) -> np.ndarray:
    """Return the errors (loads, forces)."""
    return np.array([
        [error(one, film_us, replace(BOARD, readout=readout, load_ohm=load, feedback_ohm=load))
         for one in images]
        for load in LOADS_OHM
    ])  # fmt: skip


def print_answers(touches: int) -> None:
    """Print what the reader makes of counts as they are, and of what is inverted."""
    with tempfile.TemporaryDirectory() as folder:
        database = f"{folder}/lab.db"
        encode({"name": "Box", "shape": {"box": ["60 mm", "60 mm", "40 mm"]}},
               database=database, formats=())  # fmt: skip
        scene = registered_surface(database, "Box", "F1")
        reader, film = Reader(open_lab(database)), fsr_of(16, 16)
        print("| load, ohm | as they are: right, rms mm | inverted: right, rms mm |")
        print("| --- " * 3 + "|")
        for load in READ_LOADS_OHM:
            board = replace(BOARD, load_ohm=load)
            errors: dict[str, list[float]] = {"as they are": [], "inverted": []}
            rng = np.random.default_rng(2)
            drawn = random_touches(scene.region, rng, TouchRanges(margin_mm=9.0))
            for touch, _ in zip(drawn, range(touches), strict=False):
                g, _ = conductances(film, press(scene.surface, reader.sensor, touch).forces_n)
                read = 1023 * scan_shares(shares(g, board), board) + board.bias_lsb
                counts = np.clip(np.rint(read + 0.3 * rng.standard_normal(g.shape)), 0, 1023)
                siemens = invert_readings(counts, board).conductance_s
                for name, image in (("as they are", counts), ("inverted", 1e6 * siemens)):
                    answer = reader.read(image)
                    if answer:
                        away = np.hypot(answer.x_mm - touch.x_mm, answer.y_mm - touch.y_mm)
                        errors[name].append(float(away))
            said = [f"{len(one)} of {touches}, {np.sqrt(np.mean(np.square(one))):.3f}"
                    for one in errors.values()]  # fmt: skip
            print(f"| {load:g} | {' | '.join(said)} |", flush=True)


def main() -> None:
    """Print the table, and draw it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--png", type=Path)
    parser.add_argument("--touches", type=int, default=0)
    given = parser.parse_args()
    if given.touches:
        print_answers(given.touches)
        return
    images = touches()
    found = {(readout, film): curves(images, film, readout)
             for readout in ("grounded", "virtual") for film in FILMS_US}  # fmt: skip
    print("| film, uS at 1 N | readout | best load, ohm | error at 20, 60, 120 N | within 2 x |")
    print("| --- " * 5 + "|")
    for (readout, film), errors in found.items():
        worst = errors.max(axis=1)
        best = int(np.argmin(worst))
        near = LOADS_OHM[worst <= 2 * worst[best]]
        said = ", ".join(f"{100 * one:.1f}" for one in errors[best])
        print(f"| {film:g} | {readout} | {LOADS_OHM[best]:g} | {said} % "
              f"| {near.min():g} ... {near.max():g} ohm |")  # fmt: skip
    if given.png:
        draw(found, given.png)


def draw(found: dict[tuple[str, float], np.ndarray], file: Path) -> None:
    """Draw the worst error over the load."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
    for axis, readout in zip(axes, ("grounded", "virtual"), strict=True):
        for film in FILMS_US:
            axis.loglog(LOADS_OHM, 100 * found[readout, film].max(axis=1), label=f"{film:g} uS")
        axis.set(title={"grounded": "grounded rows, load", "virtual": "virtual ground, feedback"}[
            readout], xlabel="ohm", ylim=(0.1, 100))  # fmt: skip
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("error of a force, worst of 20, 60, 120 N, %")
    axes[0].legend(title="film at 1 N", fontsize=8)
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main()
