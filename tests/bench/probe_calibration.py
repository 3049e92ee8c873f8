"""Force error after calibration against the number of loads, and its run time.

    OPENBLAS_NUM_THREADS=1 python tests/bench/probe_calibration.py --sensors 5 --seed 1

Sensors are drawn with the measured spread (57 % dead, gain 30 %, exponent 8 %, break force
50 %) and read by the default, noisy board, or by one with virtual ground. An air cushion
presses all tactels alike with forces spaced evenly in logarithms from 0.15 to 2.5 N, one
second (220 frames) each. Held-out touches press 30 % of the tactels with 0.2 ... 2 N.

law      error of the force of noise-free readings, rms over tactels: what the calibration costs
frame    of one noisy frame; second: of the mean of 220
plain    of noise-free readings with the median law for all tactels: without calibration
sigmas   rms of (frame - truth) / sigma, spikes left out: 1 where sigma is honest
refused  sensors whose loads were refused (too few in the ADC's range); left out of the row
wrong    tactels whose condition is misjudged; a preload below the break force is no preload
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from probe.calibration import (
    Calibration,
    CalibrationLoad,
    Condition,
    calibrate_image,
    calibration_from,
    known_load,
)
from probe.circuit import QUIET, Electronics, Fsr, fsr_of, read_counts, read_sequence
from probe.circuit.fsr import BREAK_N, GAIN_S
from probe.errors import CalibrationError

sys.path.insert(0, str(Path(__file__).parents[1]))
from reference.drawn_fsr import DATASHEET, MEASURED, draw_fsr

NONE = np.zeros((16, 16))
FRAMES = 220
BOARDS = {
    "grounded": Electronics(),
    "virtual": Electronics(readout="virtual", feedback_ohm=1000.0),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensors", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{'board':<10}{'spread':<11}{'loads':>6}{'law %':>8}{'frame %':>9}{'second %':>10}"
          f"{'plain %':>9}{'sigmas':>8}{'wrong':>7}{'refused':>9}{'fit ms':>8}"
          f"{'apply ms':>10}")  # fmt: skip
    for board in BOARDS:
        for name, spread in (("measured", MEASURED), ("datasheet", DATASHEET)):
            for number in (3, 4, 6, 10, 20):
                rows, refused = [], 0
                for sensor in range(options.sensors):
                    rng = np.random.default_rng([options.seed, sensor])
                    try:
                        rows.append(tried(draw_fsr(rng, spread), BOARDS[board], number, rng))
                    except CalibrationError:
                        refused += 1
                if not rows:
                    print(f"{board:<10}{name:<11}{number:>6}   all {refused} refused")
                    continue
                law, frame, second, plain, sigmas, wrong, fit, apply = np.mean(rows, axis=0)
                print(f"{board:<10}{name:<11}{number:>6}{100 * law:>8.1f}{100 * frame:>9.1f}"
                      f"{100 * second:>10.1f}{100 * plain:>9.1f}{sigmas:>8.2f}{wrong:>7.1f}"
                      f"{refused:>9}{1e3 * fit:>8.1f}{1e3 * apply:>10.2f}")  # fmt: skip


def tried(fsr: Fsr, board: Electronics, number: int, rng: np.random.Generator) -> list[float]:
    levels = np.geomspace(0.15, 2.5, number)
    rest = recorded(fsr, NONE, board, rng)
    loads = [known_load(recorded(fsr, NONE + f, board, rng), NONE + f) for f in levels]
    calibration, fit = fitted_in(rest, loads, board)
    quiet = replace(board, noise=QUIET, bits=16)
    ideal = nominal(quiet)
    exact = replace(calibration, board=quiet, full=quiet.full,
                    bias_counts=np.full(NONE.shape, board.bias_lsb * quiet.lsb))  # fmt: skip
    errors: dict[str, list[np.ndarray]] = {}
    spent = []
    for _ in range(6):
        forces = np.where(rng.random(NONE.shape) < 0.3, rng.uniform(0.2, 2.0, NONE.shape), 0.0)
        clean = read_counts(forces, quiet, fsr, None, rng)[0]
        frames = recorded(fsr, forces, board, rng)
        start = time.process_time()
        single = calibrate_image(frames[0], calibration)
        spent.append(time.process_time() - start)
        told = (forces > 0) & ~calibration.bad & ~single.bad
        share = np.where(told, forces, 1.0)
        for key, values in (
            ("law", calibrate_image(clean, exact).values),
            ("plain", calibrate_image(clean, ideal).values),
            ("frame", single.values),
            ("second", calibrate_image(frames.mean(axis=0), calibration).values),
        ):
            errors.setdefault(key, []).append((values / share - 1)[told])
        errors.setdefault("sigmas", []).append(((single.values - forces) / single.sigma)[told])
    rms = {key: float(np.sqrt((np.concatenate(v) ** 2).mean())) for key, v in errors.items()}
    scaled = np.concatenate(errors["sigmas"])
    rms["sigmas"] = float(np.sqrt((scaled[np.abs(scaled) < 8] ** 2).mean()))
    return [rms[key] for key in ("law", "frame", "second", "plain", "sigmas")] + [
        float(misjudged(fsr, calibration)), fit, statistics.median(spent),
    ]  # fmt: skip


def recorded(
    fsr: Fsr, forces: np.ndarray, board: Electronics, rng: np.random.Generator
) -> np.ndarray:
    steady = np.broadcast_to(forces, (FRAMES, 16, 16))
    return read_sequence(steady, board, fsr, None, rng)[0]


def fitted_in(
    rest: np.ndarray, loads: list[CalibrationLoad], board: Electronics
) -> tuple[Calibration, float]:
    spent = []
    for _ in range(3):
        start = time.process_time()
        calibration = calibration_from(rest, loads, sensor="bench", board=board)
        spent.append(time.process_time() - start)
    return calibration, statistics.median(spent)


def nominal(board: Electronics) -> Calibration:
    """Return the calibration of a sensor whose tactels are all as the median."""
    one, shape = np.ones(NONE.shape), fsr_of().shape
    return Calibration(
        sensor="nominal", made="", board=board, full=board.full, loads=(),
        condition=np.zeros(shape), bias_counts=board.bias_lsb * board.lsb * one,
        rest_counts=board.bias_lsb * board.lsb * one, noise_counts=one, gain_s=GAIN_S * one,
        exponent=one, break_n=BREAK_N * one, covariance=np.zeros((*shape, 6)),
        most_n=one, scatter=1.0, repeat=0.05,
    )  # fmt: skip


def misjudged(fsr: Fsr, calibration: Calibration) -> int:
    truth = np.where(fsr.dead, Condition.DEAD, np.where(fsr.stuck_s > 0, Condition.STUCK, 0))
    seen = np.where(calibration.condition == Condition.PRELOADED, 0, calibration.condition)
    seen[calibration.condition == Condition.HIDDEN] = 0
    raised = (fsr.preload_n > 2 * fsr.break_n) & ~fsr.dead & (fsr.stuck_s == 0)
    missed = raised & (calibration.condition == Condition.SOUND)
    false = (calibration.condition == Condition.PRELOADED) & (fsr.preload_n == 0)
    return int((truth != seen).sum() + missed.sum() + false.sum())


if __name__ == "__main__":
    main()
