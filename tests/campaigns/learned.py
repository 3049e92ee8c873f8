"""What a sensor is worth before and after it was learned: touches of one sensor with a fault.

    python tests/campaigns/learned.py lab.db --seed 52
    python tests/campaigns/learned.py lab.db --seed 52 --levels dead-40,floating --sensors 4

For each level of `probe.simulate.world.levels`: sensors with that fault, each learned from touches
of registered faces and judged on as many others, amid faces, at 20-120 N. Prints a line a level.
"""

from __future__ import annotations

from dataclasses import replace

import runner

from recognizer.sensor.learn import learn_sensor
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import recognise
from recognizer.validation.draw import DrawnTouch, draw_touch
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import Trial, judge

LEVELS = "typical,dead-10,dead-20,dead-40,hot-5,gain-30,places-25,floating"


def main() -> None:
    """Print what sensors answer before and after."""
    parser = runner.arguments(__doc__, "database", seed=52)
    parser.add_argument("--levels", default=LEVELS)
    parser.add_argument("--sensors", type=int, default=2, help="of each level")
    parser.add_argument("--touches", type=int, default=50, help="of each sensor, twice")
    asked = runner.parse(parser)
    reader = Reader(open_lab(asked.database))
    runner.table(("sensor", "touches", "before: right, rms mm, inside, wrong", "after"))
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
        runner.row(f"`{level}`", len(before), words(before), words(after))


def read_all(reader: Reader, plan: TouchPlan, drawn: list[DrawnTouch]) -> list[Trial]:
    """Return what became of touches under what is known of their sensor."""
    return [
        judge(plan, number, one, recognise(reader, reader.signal(one.counts), number), reader)
        for number, one in enumerate(drawn)
    ]


def words(trials: list[Trial]) -> str:
    """Return right answers, their errors, how many are inside, and wrong ones."""
    found = runner.outcome(trials)
    return "{right}, {rms_mm:.3f}, {inside:.0%}, {wrong}".format(**found)


if __name__ == "__main__":
    main()
