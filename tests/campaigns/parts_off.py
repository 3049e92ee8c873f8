"""What each part of the reader is worth and costs: the same touches, one part switched off.

    python tests/campaigns/parts_off.py lab.db --touches 400 --seed 7
    python tests/campaigns/parts_off.py lab.db --engine mujoco --touches 100 --seed 7

Touches of registered faces (faces, edges, corners and worn .55 : .3 : .1 : .05), all levels.
Prints for each reader what it answered, root mean square of the right answers, how many errors lie
within their own 95 % ellipsoid, and processor time, ms a touch.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.settings import DEFAULTS, ReaderSettings  # noqa: E402
from recognizer.validation.campaign import LEVEL_SHARES  # noqa: E402
from recognizer.validation.draw import draw_touch  # noqa: E402
from recognizer.validation.statistics import chi2_quantile  # noqa: E402
from recognizer.validation.touch_plan import TouchPlan  # noqa: E402
from recognizer.validation.trial import judge  # noqa: E402

KINDS = (("face", 0.55), ("edge", 0.3), ("corner", 0.1), ("worn", 0.05))
INSIDE = chi2_quantile(0.95)  #: squared error over covariance, 95 % of three degrees of freedom
D = DEFAULTS
_FORM = (0.0, 0.0, 0.0, 1e-4, 1e-4, 1e-4, 1e-6)  #: deviations that hold width ... scale in place
#: by name: the reader's settings without it
PARTS: dict[str, ReaderSettings] = {
    "nothing off": D,
    "stroke, cross-talk, exponent, scale": replace(D, refine=replace(D.refine, prior=_FORM)),
    "depth and tilt": replace(D, refine=replace(D.refine, step=(*D.refine.step[:8], *3 * (1e-9,)))),
    "deep at edges": replace(D, gain=replace(D.gain, deep=D.gain.usual)),
    "noise of weak readings": replace(D, noise=replace(D.noise, loud=math.inf)),
    "outliers left out": replace(D, noise=replace(D.noise, far=1e3, most=1e3)),
    "last fit: offset and blur": replace(D, posterior=replace(D.posterior, offset=1e-6, blur=1e-6)),
    "errors with long tails": replace(D, spread=replace(D.spread, freedom=1e3)),
    "tips stand elsewhere": replace(D, spread=replace(D.spread, aside_mm=1e-4, touches=1e6)),
    "prints are off": replace(
        D, printed=replace(D.printed, scale=1e-9, apart=1e-9, skew_rad=1e-9, aside_mm=1e-9)
    ),
    "strange forms are wider": replace(D, covariance=replace(D.covariance, form=0.0)),
    "second, wide search": replace(D, thorough=D.first),
    "first look": replace(D, first_look=replace(D.first_look, gaps=0.0, foreign=-math.inf)),
    "chance counted": replace(D, belief=replace(D.belief, doubt=math.inf)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("database")
    parser.add_argument("--touches", type=int, default=400)
    parser.add_argument("--engine", default="own", choices=("own", "mujoco"))
    parser.add_argument("--seed", type=int, default=7)
    asked = parser.parse_args()
    lab = open_lab(asked.database)
    readers = {name: Reader(lab, settings=settings) for name, settings in PARTS.items()}
    usual = readers["nothing off"]
    seen: dict[str, list[tuple[str, float, bool]]] = {name: [] for name in readers}
    spent = dict.fromkeys(readers, 0.0)
    for number in range(asked.touches):
        rng = np.random.default_rng([asked.seed, number, 19])
        kind, level = (_choose(rng, shares) for shares in (KINDS, LEVEL_SHARES))
        plan = TouchPlan(asked.database, asked.seed, level, kind, engine=asked.engine)
        drawn = draw_touch(plan, number, usual)
        for name, reader in readers.items():
            if not number:
                reader.read(drawn.counts)  # what is prepared once
            start = time.process_time()
            answer = reader.read(drawn.counts, seq=number)
            spent[name] += time.process_time() - start
            found = judge(plan, number, drawn, answer, 0.0)
            seen[name].append((found.verdict, found.error_mm, found.chi2 <= INSIDE))
    print(f"{asked.touches} touches, {asked.engine}, seed {asked.seed}")
    print("| switched off | right | wrong | refused | rms mm | inside | ms |")
    print("| --- " * 7 + "|")
    for name, rows in seen.items():
        verdicts = [row[0] for row in rows]
        right = [row for row in rows if row[0] == "right"]
        rms = math.sqrt(sum(row[1] ** 2 for row in right) / max(1, len(right)))
        inside = 100 * sum(row[2] for row in right) / max(1, len(right))
        print(f"| {name} | {len(right)} | {verdicts.count('wrong')} | "
              f"{len(rows) - len(right) - verdicts.count('wrong')} | {rms:.3f} | {inside:.0f} % | "
              f"{1e3 * spent[name] / asked.touches:.1f} |")  # fmt: skip


def _choose(rng: np.random.Generator, shares: tuple[tuple[str, float], ...]) -> str:
    names, weights = zip(*shares, strict=True)
    return str(rng.choice(names, p=weights))


if __name__ == "__main__":
    main()
