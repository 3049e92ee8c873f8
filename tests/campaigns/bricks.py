"""Copies of one brick in one lab, touched: which of them is told, and how sure.

    python tests/campaigns/bricks.py -o out/bricks --copies 200 --touches 150     # 3 min

Bricks of 45 x 35 x 28 mm by default settings; touches inside faces, by level.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from pathlib import Path

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from encoded_objects import encode  # noqa: E402
from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.validation.touch_plan import TouchPlan  # noqa: E402
from recognizer.validation.trial import trial  # noqa: E402

SIZE_MM = (45, 35, 28)
LEVELS = ("typical", "mismatch")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--copies", type=int, default=200)
    parser.add_argument("--touches", type=int, default=150)
    parser.add_argument("--seed", type=int, default=4)
    asked = parser.parse_args()
    asked.output.mkdir(parents=True, exist_ok=True)
    lab = asked.output / "lab.db"
    if not lab.exists():
        shape = {"box": [f"{size} mm" for size in SIZE_MM]}
        spec = {"name": "Brick", "shape": shape, "copies": asked.copies}
        print(encode(spec, database=str(lab), formats=()))
    reader = Reader(open_lab(lab))
    print(reader.lab)
    for kind in ("face", "anywhere"):
        for level in LEVELS:
            plan = TouchPlan(str(lab), asked.seed, level, kind)
            made = [trial(plan, n, reader) for n in range(asked.touches // 4)]
            count = Counter(one.verdict for one in made)
            why = Counter(one.reason for one in made if one.reason)
            margin = np.median([one.margin for one in made if one.verdict == "right"])
            told = f"{dict(count)}, margin {margin:.0f} nats {dict(why)}"
            print(f"{kind:9} {level:9} {told}", flush=True)


if __name__ == "__main__":
    main()
