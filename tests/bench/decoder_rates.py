"""Error against run time: right, wrong and rejected windows, by decoder, size and damage.

    OPENBLAS_NUM_THREADS=1 python tests/bench/decoder_rates.py --seed 1 --windows 2000 -o rates

writes rates.png and rates.json and prints the table. n = 12, 18, 24 bits, binary and GF(4);
2, 5, 10, 20 % wrong symbols, 20, 40 % missing. Decoders: the thesis's good tuple;
likelihood (the transform; up to 2^18 places); ordered statistics, at every size; both again
with a prior of 400 registered cells among which the window lies. "ML" columns take the
likeliest place whenever it is the only one (the floor's measure); the others take what the
default reject threshold answers. Times are processor time per window in a batch.

    python tests/bench/decoder_rates.py --threshold --seed 1 --windows 20000

shows the reject threshold: every shape of view with minimum distance 5 or 6 on ten arrays,
and views of random cells, at 5 % wrong symbols: answered, wrong, and the wrong answers that
the model expects, which needs no million windows.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from decoder import Likelihood, decode_good_tuple
from decoder.likelihood import _weigh
from decoder.ordered import Ordered
from decoder.ranking import AllPlaces
from decoder.transform import LARGEST_TRANSFORM
from decoder.view import strength_of_window
from decoder.window import hard_scores
from generator.array import FoldedArray, ProductArray, array_from, profile

DAMAGE = ((0.02, 0.0), (0.05, 0.0), (0.10, 0.0), (0.20, 0.0), (0.0, 0.20), (0.0, 0.40))
REGISTERED = 400
ARRAYS = {
    "binary n=12 63x65, 6x6": ({"family": "prba", "polynomial": "0x1655", "rows": 63,
                                "columns": 65}, (6, 6)),
    "binary n=18 511x513, 8x8": ({"family": "prba", "order": 2, "degree": 18}, (8, 8)),
    "binary n=24 4095x4097, 8x8": ({"family": "prba", "order": 2, "degree": 24}, (8, 8)),
    "GF(4) 12 bits 63x65, 4x4": ({"family": "prmva", "order": 4, "degree": 6}, (4, 4)),
    "GF(4) 18 bits 511x513, 5x5": ({"family": "prmva", "order": 4, "degree": 9}, (5, 5)),
    "GF(4) 24 bits 4095x4097, 6x6": ({"family": "prmva", "order": 4, "degree": 12}, (6, 6)),
}  # fmt: skip


@dataclass
class Outcome:
    """One decoder at one damage; shares of all windows, in percent."""

    array: str
    decoder: str
    wrong_symbols: float
    missing: float
    right: float
    wrong: float
    rejected: float
    ml_right: float
    ml_wrong: float
    microseconds: float


class OrderedOnly(Likelihood):
    """Ordered statistics at every size, to compare it with the transform."""

    def ranking(self, shape: tuple[int, int]):
        if shape not in self._places:
            found = AllPlaces(self.array, shape)
            found.work = 64 * shape[0] * shape[1]
            offsets = self.array.offsets(*np.indices(shape))
            found._method = Ordered(self.array.sequence, offsets)
            self._places[shape] = found
        return self._places[shape]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--windows", type=int, default=2000)
    parser.add_argument("--threshold", action="store_true")
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    if options.threshold:
        threshold(options.seed, options.windows)
        return
    outcomes = []
    print(f"{'array':<30}{'decoder':<22}{'wrong':>6}{'missing':>8} |{'right':>7}{'wrong':>7}"
          f"{'reject':>7} |{'ML':>7}{'wrong':>7} |{'us':>9}")  # fmt: skip
    for name, (encoding, shape) in ARRAYS.items():
        array = array_from(encoding)
        for damage in DAMAGE:
            for outcome in measured(name, array, shape, damage, options.windows, options.seed):
                outcomes.append(outcome)
                o = outcome
                print(f"{o.array:<30}{o.decoder:<22}{o.wrong_symbols:>6.2f}{o.missing:>8.2f} |"
                      f"{o.right:>7.1f}{o.wrong:>7.2f}{o.rejected:>7.1f} |{o.ml_right:>7.1f}"
                      f"{o.ml_wrong:>7.2f} |{o.microseconds:>9.1f}", flush=True)  # fmt: skip
    if options.output:
        options.output.with_suffix(".json").write_text(
            json.dumps([asdict(o) for o in outcomes], indent=1)
        )
        draw(outcomes, options.output.with_suffix(".png"))


def measured(name, array, shape, damage, number, seed):
    rng = np.random.default_rng([seed, int(100 * damage[0]), int(100 * damage[1])])
    prior = np.stack([rng.integers(0, array.rows, REGISTERED),
                      rng.integers(0, array.columns, REGISTERED)], axis=1)  # fmt: skip
    truth = prior[rng.integers(0, REGISTERED, number)]
    windows = damaged(seen(array, shape, truth), array.order, damage, rng)
    decoders = {
        "likelihood": Likelihood(array),
        "likelihood, prior": Likelihood(array, prior=prior),
        "ordered statistics": OrderedOnly(array),
    }
    if array.sequence.period >= LARGEST_TRANSFORM:
        del decoders["likelihood"]
    yield good_tuple(name, array, windows, truth, damage)
    for label, decoder in decoders.items():
        decoder.decode(windows[:2])
        part = slice(0, number if array.sequence.period < 1 << 16 or "prior" in label
                     else max(200, number // 4))  # fmt: skip
        scores = hard_scores(windows[part], array.order)
        start = time.process_time()
        ranked, _, doubts, _ = _weigh(decoder, scores, 2)
        spent = (time.process_time() - start) / len(scores) * 1e6
        right = is_at(ranked.rows[:, 0], ranked.columns[:, 0], truth[part])
        single = ranked.values[:, 0] - ranked.values[:, 1] > 1e-3
        answered = doubts <= decoder.doubt
        yield Outcome(name, label, damage[0], damage[1], percent(answered & right),
                      percent(answered & ~right), percent(~answered), percent(single & right),
                      percent(single & ~right), spent)  # fmt: skip


def good_tuple(name, array, windows, truth, damage) -> Outcome:
    start = time.process_time()
    found = decode_good_tuple(array, windows)
    spent = (time.process_time() - start) / len(windows) * 1e6
    right = is_at(found.rows, found.columns, truth) & found.answered
    wrong = found.answered & ~right
    return Outcome(name, "good tuple", damage[0], damage[1], percent(right),
                   percent(wrong), percent(~found.answered), percent(right), percent(wrong),
                   spent)  # fmt: skip


def seen(array, shape: tuple[int, int], places: np.ndarray) -> np.ndarray:
    a, b = np.indices(shape)
    return array.symbols(places[:, 0, None, None] + a, places[:, 1, None, None] + b)


def damaged(windows, order: int, damage, rng) -> np.ndarray:
    error, missing = damage
    other = (windows + rng.integers(1, order, windows.shape)) % order
    read = np.where(rng.random(windows.shape) < error, other, windows)
    return np.where(rng.random(windows.shape) < missing, -1, read)


def is_at(rows, columns, places) -> np.ndarray:
    return (rows == places[:, 0].astype(np.uint64)) & (columns == places[:, 1].astype(np.uint64))


def percent(which: np.ndarray) -> float:
    return float(100 * which.mean())


def threshold(seed: int, number: int) -> None:
    arrays: dict[str, FoldedArray | ProductArray] = {
        name: profile(name).array() for name in ("thesis", "one-touch", "product")
    }
    arrays["large"] = profile("large").array()
    arrays["robust 63x65"] = array_from(ARRAYS["binary n=12 63x65, 6x6"][0])
    for order, degree in ((2, 8), (2, 10), (3, 8), (8, 4), (9, 4)):
        family = "prba" if order == 2 else "prmva"
        arrays[f"GF({order}) n={degree}"] = array_from(
            {"family": family, "order": order, "degree": degree}
        )
    print(f"{'array':<14}{'view':<22}{'d':>3}{'ML right %':>12}{'answered %':>12}{'wrong':>7}"
          f"{'of':>8}{'expected share':>16}")  # fmt: skip
    worst = 0.0
    for name, array in arrays.items():
        rng = np.random.default_rng(seed)
        for label, mask, distance in views(array, rng):
            count = number if array.rows * array.columns < 1 << 14 else number // 20
            share = answers(array, mask, count, rng)
            worst = max(worst, share[-1])
            print(f"{name:<14}{label:<22}{distance:>3}{share[0]:>12.2f}{share[1]:>12.2f}"
                  f"{share[2]:>7}{count:>8}{share[3]:>16.1e}", flush=True)  # fmt: skip
    print(f"largest expected share of wrong answers: {worst:.1e}")


def views(array, rng):
    """Yield views with distance 5 or 6: the smallest shapes, and some with holes."""
    found: dict[int, tuple[int, int]] = {}
    for a in range(1, 9):
        for b in range(1, 9):
            if array.rows * array.columns > 1 << 15 and a * b > 20:
                continue
            distance = strength_of_window(array, a, b).distance
            if distance in (5, 6) and a * b < np.prod(found.get(distance, (99, 99))):
                found[distance] = (a, b)
    for distance, shape in sorted(found.items()):
        yield f"{shape[0]}x{shape[1]}", np.ones(shape, dtype=bool), distance
    wide = min(array.rows, 7), min(array.columns, 7)
    holes = 0
    for _ in range(400):
        mask = rng.random(wide) < rng.uniform(0.3, 0.8)
        cells = np.nonzero(mask)
        if not cells[0].size or not array.identifies(*cells):
            continue
        if array.rows * array.columns > 1 << 15 and cells[0].size > 20:
            continue
        distance = array.minimum_distance(*cells)
        if distance in (5, 6):
            yield f"{cells[0].size} cells of {wide[0]}x{wide[1]}", mask, distance
            holes += 1
            if holes == 4:
                return


def answers(array, mask, number, rng):
    places = np.stack([rng.integers(0, array.rows, number),
                       rng.integers(0, array.columns, number)], axis=1)  # fmt: skip
    windows = damaged(seen(array, mask.shape, places), array.order, (0.05, 0.0), rng)
    scores = hard_scores(np.where(mask, windows, -1), array.order)
    ranked, _, certain, _ = _weigh(Likelihood(array, blank=0), scores, 2)
    doubts = _weigh(Likelihood(array), scores, 2)[2]
    right = is_at(ranked.rows[:, 0], ranked.columns[:, 0], places)
    given = doubts <= Likelihood(array).doubt
    return (percent(right), percent(given), int((given & ~right).sum()),
            float(np.where(given, certain, 0).mean()))  # fmt: skip


def draw(outcomes: list[Outcome], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    damages = sorted({(o.wrong_symbols, o.missing) for o in outcomes}, key=lambda d: (d[1], d[0]))
    names = list(ARRAYS)
    markers = {"good tuple": "x", "likelihood": "o", "likelihood, prior": "s",
               "ordered statistics": "^"}  # fmt: skip
    figure, axes = pyplot.subplots(3, len(damages), figsize=(19, 10), sharex=True)
    for column, damage in enumerate(damages):
        for row, measure in enumerate(("right", "wrong", "rejected")):
            axis = axes[row, column]
            for o in outcomes:
                if (o.wrong_symbols, o.missing) == damage:
                    axis.plot(o.microseconds, getattr(o, measure), markers[o.decoder],
                              color=f"C{names.index(o.array)}", ms=7, mfc="none")  # fmt: skip
            axis.set_xscale("log")
            axis.grid(alpha=0.3)
            if measure == "wrong":
                axis.set_yscale("symlog", linthresh=0.1)
                axis.set_ylim(-0.02, 100)
            else:
                axis.set_ylim(-3, 103)
            if column == 0:
                axis.set_ylabel(f"{measure}, % of windows")
        error, missing = damage
        title = f"{100 * missing:g} % missing" if missing else f"{100 * error:g} % wrong"
        axes[0, column].set_title(f"{title} symbols")
        axes[2, column].set_xlabel("µs per window")
    handles = [pyplot.Line2D([], [], marker=m, ls="", color="k", mfc="none", label=d)
               for d, m in markers.items()]  # fmt: skip
    handles += [pyplot.Line2D([], [], marker="o", ls="", color=f"C{i}", label=name)
                for i, name in enumerate(names)]  # fmt: skip
    figure.legend(handles=handles, loc="lower center", ncol=5, frameon=False)
    figure.tight_layout(rect=(0, 0.07, 1, 1))
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main()
