"""Time of a touch by stage, and error against run time of the reader's effort.

    python tests/bench/recognizer_times.py --database lab.db [--touches 40] [--png PICTURE.png]

Process time on one core, medians; touches are those of `recognizer.validation`, by number.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace

for library in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(library, "1")

import numpy as np  # noqa: E402

from recognizer.touch.hypothesis import find_hypotheses  # noqa: E402
from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.options import DEFAULTS, Effort  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.recognise import read_touch  # noqa: E402
from recognizer.touch.signal import signal_of  # noqa: E402
from recognizer.touch.symbols.fit import fit_lattices, search_image  # noqa: E402
from recognizer.touch.verify import TouchImages, verify_hypotheses  # noqa: E402
from recognizer.validation.draw import draw_touch  # noqa: E402
from recognizer.validation.touch_plan import TouchPlan  # noqa: E402
from recognizer.validation.trial import judge  # noqa: E402

EFFORTS = {
    "1 lattice, 1 + 1 steps": Effort(1, 1, 1, 1),
    "2 lattices, 2 + 2 steps (default)": Effort(),
    "3 lattices, 3 + 4 steps": Effort(3, 3, 2, 4),
    "8 lattices, 4 + 10 steps": Effort(8, 4, 4, 10),
    "24 lattices, 6 + 14 steps": Effort(24, 6, 6, 14),
}


def clocked(action):
    start = time.process_time()
    found = action()
    return found, 1e3 * (time.process_time() - start)


def stages(reader, signals):
    """Return medians of the stages, ms."""
    prepared, first = reader.prepared[0], reader.options.first
    rows = []
    for signal in signals:
        image, made = clocked(lambda s=signal: reader.image(s, prepared))
        searches, coarse = clocked(lambda i=image: search_image(i, prepared.bank))
        found, fitted = clocked(
            lambda i=image, c=searches: fit_lattices(i, prepared.bank, first, c)
        )
        _, placed = clocked(lambda f=found: find_hypotheses(prepared.embossed, f))
        touch = TouchImages(reader, signal)
        _, read = clocked(lambda t=touch: verify_hypotheses(t, first))
        _, whole = clocked(lambda s=signal: read_touch(reader, s))
        rows.append((made, coarse, fitted, placed, read - made - coarse - fitted - placed, whole))
    names = ("image", "coarse search", "refinement", "places", "verification", "whole touch")
    return dict(zip(names, np.median(rows, axis=0), strict=True))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--database", required=True)
    parser.add_argument("--touches", type=int, default=40)
    parser.add_argument("--seed", type=int, default=9)
    parser.add_argument("--png")
    options = parser.parse_args()
    reader = Reader(open_lab(options.database))
    points = {}
    for level in ("typical", "mismatch"):
        plan = TouchPlan(options.database, options.seed, level)
        touches = [draw_touch(plan, number, reader) for number in range(options.touches)]
        signals = [signal_of(each.counts.astype(float)) for each in touches]
        print(f"{level}:")
        for name, ms in stages(reader, signals).items():
            print(f"  {name:16s} {ms:7.2f} ms")
        for name, effort in EFFORTS.items():
            one = replace(reader, options=replace(DEFAULTS, first=effort, thorough=effort))
            found = []
            for number, (touch, signal) in enumerate(zip(touches, signals, strict=True)):
                reading, ms = clocked(lambda s=signal, r=one: read_touch(r, s))
                found.append((judge(plan, number, touch, reading.answer, reader, ms / 1e3), ms))
            right = [t for t, _ in found if t.verdict == "right"]
            wrong = sum(t.verdict == "wrong" for t, _ in found)
            rms = float(np.sqrt(np.mean([t.error_mm**2 for t in right])))
            ms = float(np.median([m for _, m in found]))
            points.setdefault(level, []).append((ms, rms, len(right) / len(found), name))
            print(f"  {name:36s} {ms:7.1f} ms  rms {rms:.3f} mm  right {len(right)}, wrong {wrong}")
    if options.png:
        draw(points, options.png)


def draw(points, path):
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    for level, each in points.items():
        ms, rms, share, _ = zip(*each, strict=True)
        left.plot(ms, rms, "o-", label=level)
        right.plot(ms, 100 * np.array(share), "o-", label=level)
    left.set_ylabel("rms error of the position, mm")
    right.set_ylabel("answered right at the first try, %")
    for axes in (left, right):
        axes.set_xlabel("processor time of a touch, ms")
        axes.set_xscale("log")
        axes.grid(alpha=0.3)
        axes.legend(title="level")
    left.set_ylim(bottom=0)
    figure.suptitle("Reader: error against run time, 1 ... 24 lattices")
    figure.savefig(path, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    main()
