"""One touch of a set of objects: answered, right, wrong, pose; and surfaces of no database.

    python tests/campaigns/recognizer_touches.py --database lab40.db --touches 2000 \
        --levels low,typical,hard,mismatch --kinds face,edge,worn,blank -j 2

Truth is what the simulation drew; seeds are explicit.
"""

from __future__ import annotations

import argparse
import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np  # noqa: E402

from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.validation.statistics import chi2_quantile  # noqa: E402
from recognizer.validation.surfaces import FOREIGN  # noqa: E402
from recognizer.validation.touch_plan import TouchPlan, sensor_of  # noqa: E402
from recognizer.validation.trial import Trial, trial  # noqa: E402

CHI2_95 = chi2_quantile(0.95)  # 3 degrees of freedom


def several(job: tuple[TouchPlan, str, range]) -> list[Trial]:
    plan, overlay, numbers = job
    key = (plan.database, overlay)
    if key not in READERS:
        READERS[key] = Reader(open_lab(plan.database), sensor_of("", overlay))
    return [trial(plan, number, READERS[key]) for number in numbers]


READERS: dict[tuple[str, str], object] = {}


def line(found: list[Trial]) -> str:
    count = Counter(t.verdict for t in found)
    right = [t for t in found if t.verdict == "right"]
    rms = np.sqrt(np.mean([t.error_mm**2 for t in right])) if right else np.nan
    deg = np.sqrt(np.mean([t.error_deg**2 for t in right])) if right else np.nan
    inside = np.mean([t.chi2 < CHI2_95 for t in right]) if right else np.nan
    ms = 1e3 * np.median([t.seconds for t in found])
    reasons = Counter(t.reason for t in found if t.reason)
    return (
        f"{len(found):6d} {count['right']:6d} {count['wrong']:5d} {count['rejected']:6d} "
        f"{rms:6.3f} {deg:6.3f} {100 * inside:5.1f} {ms:6.1f}  {dict(reasons)}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--database", required=True)
    parser.add_argument("--touches", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--levels", default="typical,mismatch")
    parser.add_argument("--kinds", default="face")
    parser.add_argument("--overlay", default="tab")
    parser.add_argument("-j", type=int, default=2)
    options = parser.parse_args()
    kinds = [k for k in options.kinds.split(",") if k != "foreign"]
    if "foreign" in options.kinds.split(","):
        kinds += list(FOREIGN)
    print("kind           level     touches  right wrong reject  rms mm    deg  in95    ms")
    with ProcessPoolExecutor(options.j) as pool:
        for kind in kinds:
            for level in options.levels.split(","):
                plan = TouchPlan(options.database, options.seed, level, kind)
                starts = range(options.first, options.first + options.touches, 50)
                end = options.first + options.touches
                jobs = [(plan, options.overlay, range(s, min(s + 50, end))) for s in starts]
                found = [t for some in pool.map(several, jobs) for t in some]
                print(f"{kind:14s} {level:9s} {line(found)}", flush=True)
                for t in found:
                    if t.verdict == "wrong":
                        print("   wrong:", t, flush=True)


if __name__ == "__main__":
    main()
