"""One touch of a set of objects: answered, right, wrong, pose; and surfaces of no database.

    python tests/campaigns/recognizer_touches.py --database lab40.db --touches 2000 \
        --levels low,typical,hard,mismatch --kinds face,edge,worn,blank -j 2

Truth is what the simulation drew; seeds are explicit.
"""

from __future__ import annotations

from functools import lru_cache

import runner

from encoded_objects.base.sensor_type import SensorType
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.validation.draw import FOREIGN
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import Trial, trial

BATCH = 50  #: touches that a process takes at once
HEADS = ("touches", "right", "wrong", "rejected", "rms_mm", "rms_deg", "inside", "reasons")


def read_batch(job: tuple[TouchPlan, str, range]) -> list[Trial]:
    """Return what became of touches of a plan."""
    plan, overlay, numbers = job
    return [trial(plan, number, reader_of(plan.database, overlay)) for number in numbers]


@lru_cache(maxsize=2)
def reader_of(database: str, overlay: str) -> Reader:
    """Return the reader of a process."""
    return Reader(open_lab(database), SensorType().with_overlay(overlay))


def main() -> None:
    """Print a line for each kind and level, and every wrong answer."""
    parser = runner.arguments(__doc__, touches=1000, seed=1, jobs=2)
    parser.add_argument("--database", required=True)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--levels", default="typical,mismatch")
    parser.add_argument("--kinds", default="face")
    parser.add_argument("--overlay", default="tab")
    options = runner.parse(parser)
    kinds = [k for k in options.kinds.split(",") if k != "foreign"]
    if "foreign" in options.kinds.split(","):
        kinds += list(FOREIGN)
    end = options.first + options.touches
    numbers = [range(k, min(k + BATCH, end)) for k in range(options.first, end, BATCH)]
    runner.table(("kind", "level", *HEADS, "CPU, ms"))
    for kind in kinds:
        for level in options.levels.split(","):
            plan = TouchPlan(options.database, options.seed, level, kind)
            jobs = [(plan, options.overlay, some) for some in numbers]
            batches = runner.in_processes(read_batch, jobs, options.jobs)
            found = [one for batch in batches for one in batch]
            line, ms = runner.outcome(found), 1e3 * sum(t.seconds for t in found) / len(found)
            runner.row(kind, level, *(line[head] for head in HEADS), ms)
            for one in found:
                if one.verdict == "wrong":
                    print("   wrong:", one, flush=True)


if __name__ == "__main__":
    main()
