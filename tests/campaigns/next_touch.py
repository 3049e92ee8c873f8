"""Touches until one is answered: where the answers propose against a random walk.

    python tests/campaigns/next_touch.py LAB.db --touches 200 --seed 17 --engine mujoco
    python tests/campaigns/next_touch.py GEL.db --sensor-type gel-24x32 --kinds edge,corner

Touches registered faces of a lab (parts made by `validate-set SPEC -o DIR`), as `validate-set
--policy next` does, up to `--most` of them, and the same first touches again with steps of 10 mm in
random directions. Prints right at once, within two and within three for both, by kind.
"""

from __future__ import annotations

import math
import time
from collections import Counter

import numpy as np
import runner

from encoded_objects.base.sensor_type_file import sensor_type_named
from recognizer.touch.lab import open_lab
from recognizer.touch.reader import Reader
from recognizer.touch.recognition import NextTouch, Recognition
from recognizer.validation.campaign import Work, campaign_of, series_of
from recognizer.validation.trial import Proposal, judge, touch_until_answered


def walk(_answer: Recognition, rng: np.random.Generator) -> NextTouch:
    """Return a step of 10 mm anywhere."""
    turn = rng.uniform(0, 2 * math.pi)
    return NextTouch(10 * math.cos(turn), 10 * math.sin(turn), 0.0, 80.0, "at random")


def main() -> None:
    parser = runner.arguments(__doc__, "database", touches=200, seed=17)
    parser.add_argument("--first", type=int, default=0, help="number of the first touch")
    parser.add_argument("--kinds", default="face=.55,edge=.1,corner=.05,worn=.1")
    parser.add_argument("--levels", default="typical,mismatch")
    parser.add_argument("--engine", default="own")
    parser.add_argument("--sensor-type", default="fsr-16")
    parser.add_argument("--most", type=int, default=3)
    parser.add_argument("--policy", choices=("next", "walk"), action="append")
    parser.add_argument("--seconds", type=float, default=math.inf, help="end after so many")
    options = runner.parse(parser)
    sensor = sensor_type_named(options.sensor_type)
    given = {name: getattr(options, name) for name in ("seed", "kinds", "levels", "engine")}
    campaign = campaign_of(given | {"sensor_type": sensor}, None)
    work, series = Work(campaign, options.database), series_of(campaign)[0]
    reader = Reader(open_lab(options.database), sensor)
    policies: dict[str, Proposal] = {"next": lambda answer, _: answer.next, "walk": walk}
    found: dict[tuple[str, str], Counter[tuple[str, int]]] = {}
    end, number = time.monotonic() + options.seconds, options.first
    while number < options.first + options.touches and time.monotonic() < end:
        plan = work.plan(series, number)
        for name in options.policy or policies:
            made = list(touch_until_answered(plan, number, reader, options.most, policies[name]))
            trial = judge(plan, number, made[-1].found, made[-1].answer, reader)
            for key in ((name, plan.level + " " + plan.counted_as), (name, "all")):
                found.setdefault(key, Counter())[trial.verdict, len(made)] += 1
        number += 1
    print(f"touches {options.first} ... {number - 1} of seed {options.seed}, {options.engine}")
    for (name, kind), counts in sorted(found.items()):
        within = [sum(counts["right", k] for k in range(1, n + 1)) for n in (1, 2, 3)]
        wrong = sum(count for (verdict, _), count in counts.items() if verdict == "wrong")
        print(f"{name} {kind}: {counts.total()} begun, right {within}, wrong {wrong}")


if __name__ == "__main__":
    main()
