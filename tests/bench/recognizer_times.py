"""Time of a touch by stage, and error against run time of the reader's effort.

    python tests/bench/recognizer_times.py --database lab.db [--touches 40] [--png PICTURE.png]

Process time on one core, medians; touches are those of `recognizer.validation`, by number.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from recognizer.touch.hypothesis import find_hypotheses
from recognizer.touch.lab import open_lab
from recognizer.touch.options import DEFAULTS, Effort
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.touch.signal import signal_of
from recognizer.touch.symbols.fit import fit_lattices, search_image
from recognizer.touch.verify import TouchImages, verify_hypotheses
from recognizer.validation.draw import draw_touch
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import judge

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

EFFORTS = {
    "1 lattice, 1 + 1 steps": Effort(1, 1, 1, 1),
    "2 lattices, 2 + 2 steps (default)": Effort(),
    "3 lattices, 3 + 4 steps": Effort(3, 3, 2, 4),
    "8 lattices, 4 + 10 steps": Effort(8, 4, 4, 10),
    "24 lattices, 6 + 14 steps": Effort(24, 6, 6, 14),
}


def stages(reader, signals):
    """Return medians of the stages, ms."""
    prepared, first = reader.prepared[0], reader.options.first
    rows = []
    for signal in signals:
        image, made = runner.clocked(reader.image, signal, prepared)
        searches, coarse = runner.clocked(search_image, image, prepared.bank)
        found, fitted = runner.clocked(fit_lattices, image, prepared.bank, first, searches)
        _, placed = runner.clocked(find_hypotheses, prepared.embossed, found)
        _, read = runner.clocked(verify_hypotheses, TouchImages(reader, signal), first)
        _, whole = runner.clocked(read_touch, reader, signal)
        rows.append((made, coarse, fitted, placed, read - made - coarse - fitted - placed, whole))
    names = ("image", "coarse search", "refinement", "places", "verification", "whole touch")
    return dict(zip(names, np.median(rows, axis=0), strict=True))


def main() -> None:
    """Print the tables."""
    options = runner.asked(__doc__, database="lab.db", touches=40, seed=9, png=str)
    reader = Reader(open_lab(options.database))
    points = defaultdict(list)
    for level in ("typical", "mismatch"):
        plan = TouchPlan(options.database, options.seed, level)
        touches = [draw_touch(plan, number, reader) for number in range(options.touches)]
        signals = [signal_of(each.counts.astype(float)) for each in touches]
        runner.table((level, "ms"), stages(reader, signals).items())
        runner.table((level, "ms", "rms mm", "right", "wrong"))
        for name, effort in EFFORTS.items():
            one = replace(reader, options=replace(DEFAULTS, first=effort, thorough=effort))
            found, times = [], []
            for number, (touch, signal) in enumerate(zip(touches, signals, strict=True)):
                reading, ms = runner.clocked(read_touch, one, signal)
                found.append(judge(plan, number, touch, reading.answer, reader, ms / 1e3))
                times.append(ms)
            line, ms = runner.outcome(found), float(np.median(times))
            points[level].append((ms, line["rms_mm"], line["right"] / len(found), name))
            runner.row(name, ms, line["rms_mm"], line["right"], line["wrong"])
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
