"""Errors and times of the matrix's readouts and their inverses.

    OPENBLAS_NUM_THREADS=1 python tests/bench/circuit.py --seed 1

1. The network, forward and back, over zero to six decades of conductance, against 50 digits.
2. A 10-bit board at a contrast of 1000:1 with 5, 30, 80 tactels pressed (even in 0.3 ... 1):
   floating rows taken at face value and inverted, grounded rows, virtual ground. Error: of the
   pressed tactels, median / largest; ghost: the highest tactel that is not pressed, over full
   scale; time of one inversion.
3. What the multiplexer's resistance costs, before and after inversion.
4. What noise leaves of floating rows: rank, tactels lost, error of those that are not.
5. The simulated board against the measured sensor, and the time of a frame.

Times are processor time, medians.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import mpmath
import numpy as np

from probe.circuit import (
    DATASHEET,
    MEASURED,
    QUIET,
    Electronics,
    Noise,
    draw_fsr,
    effective_resistances,
    invert_readings,
    read_counts,
    read_sequence,
    transconductances,
)
from probe.circuit.network import solve_floating
from probe.circuit.reading import scan_shares, shares

X = np.arange(16) - 7.5
RADIUS = np.hypot(X, X[:, None])
MAX_S = 1e-4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--repeats", type=int, default=20)
    options = parser.parse_args()
    network(options.seed)
    contrast(options.seed, options.repeats)
    multiplexer()
    noise(options.seed)
    board(options.seed)


def scenes(decades: int, seed: int) -> dict[str, np.ndarray]:
    low = 10.0**-decades
    rng = np.random.default_rng(seed)
    hidden = np.full((16, 16), low)
    hidden[[2, 2, 9], [2, 9, 2]] = 1
    return {
        "even in decades": 10 ** rng.uniform(-decades, 0, (16, 16)),
        "washer": np.where((RADIUS > 2.2) & (RADIUS < 4.8), 1.0, low),
        "cross": np.where((np.abs(X) < 1) | (np.abs(X[:, None]) < 1), 1.0, low),
        "hidden corner": hidden,
    }


def exact(g: np.ndarray) -> np.ndarray:
    """Return the resistances by an inverse in 50 digits."""
    with mpmath.workdps(50):
        laplacian = mpmath.zeros(32)
        for r, c in np.ndindex(16, 16):
            x, b = mpmath.mpf(float(g[r, c])), 16 + c
            laplacian[r, r] += x
            laplacian[b, b] += x
            laplacian[r, b] -= x
            laplacian[b, r] -= x
        z = laplacian[:31, :31] ** -1
        full = [
            [z[a, b] if max(a, b) < 31 else mpmath.mpf(0) for b in range(32)] for a in range(32)
        ]
        return np.array(
            [[float(full[r][r] + full[b][b] - 2 * full[r][b]) for b in range(16, 32)]
             for r in range(16)]
        )  # fmt: skip


def network(seed: int) -> None:
    print("\n1. network: largest relative error")
    print(f"{'scene':<17}{'decades':>8}{'forward':>10}{'ms':>7}{'back':>10}{'steps':>7}{'ms':>7}"
          f"{'least gR':>10}")  # fmt: skip
    for decades in (0, 2, 4, 6):
        for name, g in scenes(decades, seed).items():
            truth = exact(g)
            forward = np.abs(effective_resistances(g) / truth - 1).max()
            found = solve_floating(truth)
            back = np.abs(found.conductance_s / g - 1).max()
            print(f"{name:<17}{decades:>8}{forward:>10.1e}{timed(effective_resistances, g):>7.2f}"
                  f"{back:>10.1e}{found.steps:>7}{timed(solve_floating, truth):>7.1f}"
                  f"{found.own.min():>10.1e}")  # fmt: skip


def pressed(number: int, rng: np.random.Generator) -> np.ndarray:
    g = np.full(256, 1e-3 * MAX_S)
    g[rng.choice(256, number, replace=False)] = MAX_S * rng.uniform(0.3, 1, number)
    return g.reshape(16, 16)


def contrast(seed: int, repeats: int) -> None:
    print("\n2. 10 bits, contrast 1000:1, idle noise 0.3 LSB: error median / largest, ghost")
    print(f"{'pressed':>8} {'readout':<24}{'median %':>10}{'largest %':>11}{'ghost':>8}{'ms':>8}")
    plain = Electronics(supply_v=1.0, reference_v=1.0, noise=Noise(0.3, 0.0, 0.05, 0.0, 0.0))
    boards = {
        "floating": replace(plain, readout="floating", load_ohm=1 / MAX_S),
        "grounded": replace(plain, readout="grounded", load_ohm=0.5 / MAX_S),
        "virtual": replace(plain, readout="virtual", feedback_ohm=0.95 / MAX_S),
    }
    for number in (5, 30, 80):
        rows: dict[str, list[tuple[float, float, float, float]]] = {}
        rng = np.random.default_rng([seed, number])
        for _ in range(repeats):
            g = pressed(number, rng)
            for readout, e in boards.items():
                read = scan_shares(shares(g, e), e) * 1023 + 4 + 0.3 * rng.standard_normal(g.shape)
                counts = np.clip(np.rint(read), 0, 1023)
                if readout == "floating":
                    share = np.maximum((counts - 4) / 1023, 0.5 / 1023)
                    face = 1 / (e.load_ohm * (1 / share - 1))
                    rows.setdefault("floating, face value", []).append(judged(face, g, 0.0))
                start = time.process_time()
                found = invert_readings(counts, e)
                spent = time.process_time() - start
                rows.setdefault(readout, []).append(judged(found.conductance_s, g, spent))
        for name, values in rows.items():
            median, most, ghost, spent = np.median(values, axis=0)
            print(f"{number:>8} {name:<24}{100 * median:>10.2f}{100 * most:>11.2f}{ghost:>8.3f}"
                  f"{1e3 * spent:>8.2f}")  # fmt: skip


def judged(found: np.ndarray, g: np.ndarray, spent: float) -> tuple[float, float, float, float]:
    on = g > 0.1 * MAX_S
    error = np.abs(found / g - 1)[on]
    return float(np.median(error)), float(error.max()), float(found[~on].max() / MAX_S), spent


def multiplexer() -> None:
    print("\n3. virtual ground on a washer: error of pressed tactels, read / inverted")
    g = MAX_S * scenes(4, 1)["washer"]
    on = g > 0.5 * MAX_S
    for ratio in (1e-4, 1e-2, 0.1):
        ohm = ratio / MAX_S
        e = Electronics(
            readout="virtual", row_ohm=ohm, column_ohm=ohm, noise=QUIET, bits=16, coupling=0.0,
            supply_v=1.0, reference_v=1.0, feedback_ohm=0.95 / MAX_S,
        )  # fmt: skip
        read = transconductances(g, ohm, ohm)
        back = invert_readings(
            scan_shares(shares(g, e), e) * e.full + e.bias_lsb * e.lsb, e
        ).conductance_s
        print(f"  resistance x conductance {ratio:g}: {np.abs(read / g - 1)[on].max():.2e} / "
              f"{np.abs(back / g - 1)[on].max():.1e}")  # fmt: skip


def noise(seed: int) -> None:
    print("\n4. floating rows with noise, 30 pressed of contrast 1000:1")
    print(f"{'bits':>5}{'idle LSB10':>12}{'rank':>6}{'lost':>6}{'of pressed':>12}{'median %':>10}"
          f"{'off / sigma':>13}")  # fmt: skip
    for bits, idle in ((16, 0.003), (12, 0.05), (10, 0.3), (10, 3.0), (10, 30.0)):
        rng = np.random.default_rng(seed)
        g = pressed(30, rng)
        e = Electronics(
            readout="floating", bits=bits, supply_v=1.0, reference_v=1.0, load_ohm=1 / MAX_S,
            noise=Noise(idle, 0.0, 0.05, 0.0, 0.0),
        )  # fmt: skip
        clean = scan_shares(shares(g, e), e) * e.full + e.bias_lsb * e.lsb
        read = np.rint(clean + idle * e.lsb * rng.standard_normal(g.shape))
        found = invert_readings(np.clip(read, 0, e.full), e)
        on, kept = g > 0.1 * MAX_S, ~found.lost & (g > 0.1 * MAX_S)
        error = np.abs(found.conductance_s / g - 1)[kept]
        off = (np.abs(found.conductance_s - g) / found.sigma_s)[~on]
        print(f"{bits:>5}{idle:>12g}{int(found.rank):>6}{int(found.lost.sum()):>6}"
              f"{int(found.lost[on].sum()):>12}{100 * np.median(error):>10.2f}"
              f"{np.sqrt((off**2).mean()):>13.2f}")  # fmt: skip


def board(seed: int) -> None:
    print("\n5. the simulated board, default noise; measured sensor in brackets")
    rng = np.random.default_rng(seed)
    forces = np.where(rng.random((16, 16)) < 0.25, rng.uniform(0.1, 1.5, (16, 16)), 0.0)
    for readout in ("grounded", "virtual", "floating"):
        e, fsr = Electronics(readout=readout), draw_fsr(rng, DATASHEET)
        counts, _ = read_sequence(np.broadcast_to(forces, (1000, 16, 16)), e, fsr, None, rng)
        away = counts - np.median(counts, axis=0)
        deviation = np.nanstd(np.where(np.abs(away) > 50, np.nan, away), axis=0)
        active = deviation[forces > 0]
        quiet = deviation[forces == 0]
        spikes = (np.abs(away[:, forces == 0]) > 50).mean()
        worn = [read_counts(forces, e, draw_fsr(rng, MEASURED), None, rng)[0] for _ in range(200)]
        saturated = (np.stack(worn) >= e.full).mean()
        one = timed(lambda f, e=e, fsr=fsr: read_counts(f, e, fsr, None, rng), forces)
        many = np.broadcast_to(forces, (200, 16, 16))
        batch = timed(lambda f, e=e, fsr=fsr: read_counts(f, e, fsr, None, rng), many, 5) / 200
        print(f"  {readout:<9} idle {np.median(quiet):.2f} LSB (0.24-0.30), active least "
              f"{active.min():.1f} (6-9) median {np.median(active):.1f} (14-22), spikes "
              f"{1e6 * spikes:.0f} (451) and saturated {1e6 * saturated:.0f} (230) of 10^6; "
              f"{one:.2f} ms a frame, {batch:.3f} ms in batches")  # fmt: skip


def timed(function: Callable[[np.ndarray], object], given: np.ndarray, repeats: int = 15) -> float:
    """Return the median processor time, ms."""
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        function(given)
        spent.append(time.process_time() - start)
    return 1e3 * statistics.median(spent)


if __name__ == "__main__":
    main()
