"""What a sensor is worth before and after it was learned: touches of one sensor with a fault.

    python tests/campaigns/learned.py lab.db --seed 52
    python tests/campaigns/learned.py lab.db --seed 52 --levels dead-40,floating --sensors 4

For each level of `probe.simulate.world.levels`: sensors with that fault, each learned from touches
of registered faces and judged on as many others, amid faces, at 20-120 N. Prints a line a level.
"""

from __future__ import annotations

import argparse
import math
import os
from dataclasses import replace

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

from recognizer.sensor.learn import learn_sensor  # noqa: E402
from recognizer.touch.lab import open_lab  # noqa: E402
from recognizer.touch.reader import Reader  # noqa: E402
from recognizer.touch.recognise import recognise  # noqa: E402
from recognizer.validation.draw import DrawnTouch, draw_touch  # noqa: E402
from recognizer.validation.statistics import chi2_quantile  # noqa: E402
from recognizer.validation.touch_plan import TouchPlan  # noqa: E402
from recognizer.validation.trial import Trial, judge  # noqa: E402

LEVELS = "typical,dead-10,dead-20,dead-40,hot-5,gain-30,places-25,floating"
INSIDE = chi2_quantile(0.95)  #: squared error over covariance, 95 % of three degrees of freedom


def main() -> None:
    """Print what sensors answer before and after."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("database")
    parser.add_argument("--seed", type=int, default=52)
    parser.add_argument("--levels", default=LEVELS)
    parser.add_argument("--sensors", type=int, default=2, help="of each level")
    parser.add_argument("--touches", type=int, default=50, help="of each sensor, twice")
    asked = parser.parse_args()
    reader = Reader(open_lab(asked.database))
    print("| sensor | touches | before: right, rms mm, inside, wrong | after |")
    print("| --- | --- | --- | --- |")
    for level in asked.levels.split(","):
        before: list[Trial] = []
        after: list[Trial] = []
        for sensor in range(asked.sensors):
            plan = TouchPlan(
                asked.database, 100 * asked.seed + sensor, level, "face", sensor_per="run"
            )
            drawn = [draw_touch(plan, number, reader) for number in range(2 * asked.touches)]
            learned_from, others = drawn[: asked.touches], drawn[asked.touches :]
            state = learn_sensor(reader, [one.counts for one in learned_from])
            before += read_all(reader, plan, others)
            after += read_all(replace(reader, state=state), plan, others)
        print(f"| `{level}` | {len(before)} | {words(before)} | {words(after)} |", flush=True)


def read_all(reader: Reader, plan: TouchPlan, drawn: list[DrawnTouch]) -> list[Trial]:
    """Return what became of touches under what is known of their sensor."""
    return [
        judge(plan, number, one, recognise(reader, reader.signal(one.counts), number), 0.0)
        for number, one in enumerate(drawn)
    ]


def words(trials: list[Trial]) -> str:
    """Return right answers, their errors, how many are inside, and wrong ones."""
    right = [one for one in trials if one.verdict == "right"]
    wrong = sum(one.verdict == "wrong" for one in trials)
    if not right:
        return f"0, -, -, {wrong}"
    rms = math.sqrt(sum(one.error_mm**2 for one in right) / len(right))
    inside = sum(one.chi2 < INSIDE for one in right) / len(right)
    return f"{len(right)}, {rms:.3f}, {inside:.0%}, {wrong}"


if __name__ == "__main__":
    main()
