"""Parts of other labs, made with the same profile, read against the database of one lab.

    python tests/campaigns/other_labs.py -o out/labs --touches 20000     # 40 min of CPU
    python tests/campaigns/other_labs.py -o out/large --touches 20000 --profile large
    python tests/campaigns/other_labs.py -o out/labs --own 2000          # its own parts: 4 min
    python tests/campaigns/other_labs.py -o out/labs --touches 0 --own 0  # the table

Touches are read as `Reader` does but without its limit of doubt, and doubt and margin of each are
kept, so that the table says how many would be accepted at any limit by their symbols alone: of
other labs' parts, where every answer is wrong, and of the lab's own. What is answered so is read
again by the reader as it is, which counts borders, too (`recognizer.touch.chance`): "accepted".
What is there is kept, and an interrupted run goes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import runner

from encoded_objects import encode
from generator.array.lab_key import lab_key_of
from recognizer.touch.lab import open_lab
from recognizer.touch.options import ReaderOptions
from recognizer.touch.reader import Reader
from recognizer.touch.recognise import read_touch
from recognizer.validation.campaign import LEVEL_SHARES
from recognizer.validation.draw import draw_touch
from recognizer.validation.touch_plan import TouchPlan
from recognizer.validation.trial import judge

LABS, OBJECTS, SIZES_MM = 8, 40, (35.0, 75.0)
KINDS = (("face", 0.5), ("edge", 0.35), ("corner", 0.15))  # nearly as touches fall on such faces
PITCH = {"symbols": {"pitch": "5 mm"}}  # what `auto` gives such a set
OWN = (
    ("Cube", {"cube": "60 mm"}),
    ("Prism", {"triangular_prism": {"side": "60 mm", "height": "50 mm"}}),
    ("Box", {"box": ["80 mm", "60 mm", "40 mm"]}),
    ("Tetra", {"tetrahedron": "80 mm"}),
)
LIMITS = (math.inf, 1e-2, 1e-3, 1e-4)


def main() -> None:
    """Touch what is not touched yet, and print the tables."""
    asked = runner.asked(__doc__, output=True, touches=0, own=0, seed=18, profile="tactel-8")
    own, others = make_labs(asked.output, asked.seed, asked.profile)
    reader = Reader(open_lab(own), options=ReaderOptions(doubt=math.inf))
    for name, labs, number in (("touches", others, asked.touches), ("own", [own], asked.own)):
        work = touch_labs(reader, labs, asked.seed, registered=name == "own")
        rows = runner.resume(asked.output / f"{name}.jsonl", range(number), work)
        print(f"\n{name}")
        table(rows)


def make_labs(folder: Path, seed: int, profile: str) -> tuple[str, list[str]]:
    """Make the databases that are not there yet, and return their names."""
    folder.mkdir(parents=True, exist_ok=True)
    own = folder / "own.db"
    if not own.exists():
        specs = [{"name": name, "shape": shape, "copies": 10} for name, shape in OWN]
        _make(own, profile, specs)
    others = []
    for number in range(LABS):
        lab = folder / f"lab-{number + 1}.db"
        if not lab.exists():
            _make(lab, profile, list(_random_objects(np.random.default_rng([seed, number, 5]))))
        others.append(str(lab))
    return str(own), others


def _make(database: Path, profile: str, specs: list[dict[str, Any]]) -> None:
    """Make a lab with a key of its own, as a new database draws it; whole or not at all."""
    unfinished = database.with_suffix(".part")
    unfinished.unlink(missing_ok=True)
    objects = [PITCH | {"profile": profile} | one for one in specs]
    key = np.random.default_rng(list(database.stem.encode())).bytes(16)
    whole = {"version": 1, "objects": objects, "output": {"lab_key": lab_key_of(key)}}
    encode(whole, database=str(unfinished), folder=database.with_suffix(""), formats=())
    unfinished.rename(database)
    print(f"{database.name}: {len(objects)} specs", flush=True)


def _random_objects(rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    for k in range(OBJECTS):
        x, y, z = (f"{size:.1f} mm" for size in rng.uniform(*SIZES_MM, 3))
        shapes: tuple[dict[str, Any], ...] = (
            {"box": [x, y, z]},
            {"triangular_prism": {"side": x, "height": y}},
            {"cube": x},
        )
        yield {"name": f"Other {k + 1}", "shape": shapes[k % 3]}


def touch_labs(
    reader: Reader, labs: list[str], seed: int, *, registered: bool
) -> Callable[[int], runner.Row]:
    """Return what touches a part of the labs; a touch is drawn from seed and number alone."""
    makers = [Reader(open_lab(lab)) for lab in labs]
    usual = Reader(reader.lab)

    def touch(number: int) -> runner.Row:
        rng = np.random.default_rng([seed, number, 8])
        lab = int(rng.integers(len(labs)))
        kind, level = (_choose(rng, shares) for shares in (KINDS, LEVEL_SHARES))
        plan = TouchPlan(labs[lab], seed, level, kind)
        drawn = draw_touch(plan, number, makers[lab])
        answer = read_touch(reader, reader.signal(drawn.counts), number).answer
        accepted = bool(answer) and bool(usual.read(drawn.counts, seq=number))
        if not registered:  # every answer is wrong
            drawn = replace(drawn, contact=replace(drawn.contact, registered=False))
        return {
            "number": number, "lab": lab + 1, "kind": kind, "level": level,
            "verdict": judge(plan, number, drawn, answer, reader).verdict,
            "answer": f"{answer.object}/{answer.face}" if answer else "",
            "reason": answer.reason, "doubt": answer.doubt if answer else None,
            "margin": answer.margin, "accepted": accepted,
        }  # fmt: skip

    return touch


def _choose(rng: np.random.Generator, shares: tuple[tuple[str, float], ...]) -> str:
    names, weights = zip(*shares, strict=True)
    return str(rng.choice(names, p=weights))


def table(rows: list[dict[str, Any]]) -> None:
    """Print how many touches are accepted at each limit, by kind, and why others are not."""
    runner.table(("touches of", "number", *(f"doubt <= {x:g}" for x in LIMITS), "accepted"))
    for kind in ("all", *(kind for kind, _ in KINDS)):
        some = [row for row in rows if kind in ("all", row["kind"])]
        doubts = [row["doubt"] for row in some if row["answer"]]
        counts = [sum(doubt <= limit for doubt in doubts) for limit in LIMITS]
        runner.row(kind, len(some), *counts, sum(row["accepted"] for row in some))
    reasons = [row["reason"] for row in rows if row["reason"]]
    print({reason: reasons.count(reason) for reason in sorted(set(reasons))})
    for row in rows:
        if row["answer"] and row.get("verdict") != "right":
            print(row)


if __name__ == "__main__":
    main()
