"""One campaign over all worlds and kinds, a million touches, that can be stopped and resumed.

    python tests/campaigns/million.py -o out/million -j 2            # about six hours
    python tests/campaigns/million.py -o out/million -j 2            # again: goes on where it was
    python tests/campaigns/million.py -o out/million --touches 5000  # the same in small
    python tests/campaigns/million.py -o out/million --cluster HOST:PORT  # on workers of a cluster
    python tests/campaigns/million.py -o out/million --table         # of what is there

Each world is a run of `validate-set` with a share of the touches: 40 objects and 40 small ones,
letters of today and of before, every sensor type, own engine and MuJoCo, written files and prints,
with what is wrong with sensors, light and heavy presses, touches along rows, parts made to be
mistaken, other labs' parts and steps to a next touch. Stopped by Ctrl-C it says so (exit code 130)
and goes on by the same command; at most a thousand touches are made again. What became of a world
stands in DIR/million.json once it is finished, every wrong answer in full: with that file alone
another machine goes on after it. Prints need PrusaSlicer, the world `drake` its extra. `--worlds`
names some of them, `own` and `small` before those that touch their parts.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import runner

from recognizer.validation.statistics import clopper_pearson

SPECS = Path("docs/validation")
SUMMARY = "million.json"  #: of the worlds that are finished
COUNTS = ("touches", "on_faces", "right", "wrong")
FIGURES = {"rms_mm": 4, "worst_mm": 3, "inside": 4, "normalised": 3}  #: of right answers, digits
GROUPS = ("kind", "level")
#: What is kept of a wrong answer.
WRONG = ("number", "kind", "level", "object", "face", "x_mm", "y_mm", "theta_deg", "force_n",
         "tilt_deg", "edge_mm", "answer", "margin")  # fmt: skip
#: One of its own each; a quarter turn of the mounting is left out, which no touch tells.
SENSORS = (
    "sound,places-08,bleed-2,places-25,domed,dead-10,dead-20,dead-40,hot-5,gain-30,hysteresis-15,"
    "hysteresis-40,saturated,floating-10,floating-30,floating,slide-2,slide-6,tilt-5,light,"
    "mirrored,transposed,halves-swapped,rolled"
)
MEMBERS = "copy,near,side,same_profile"


@dataclass(frozen=True)
class World:
    """A run of `validate-set`."""

    share: float  #: of all touches
    seed: int
    options: tuple[str, ...] = ()
    spec: str = "forty"  #: set that is touched
    makes: bool = False  #: the parts, as all other worlds of the set touch them
    profile: str = ""  #: of the parts that it makes; empty: as the specs say


def _printed(faults: str) -> tuple[str, ...]:
    return ("--surfaces", "printed", "--faults", faults)


NEXT = ("--policy", "next", "--kinds", "face=.5,edge=.4,corner=.1")
KNOWN = ("--kinds", "face=.55,edge=.1,corner=.05,worn=.1")
LIGHT = ("--kinds", "face", "--levels", "light")
HEAVY = ("--kinds", "face,row,edge", "--levels", "heavy")
TYPES = ("fsr-8x8", "flexitac-12x32", "flexitac-16x32", "gel-24x32", "mat-32x32")
MUJOCO = ("--engine", "mujoco", *KNOWN)
WORLDS = {
    "own": World(0.0002, 300, makes=True),
    "small": World(0.0002, 300, spec="small", makes=True),
    "members": World(0.03, 309, ("--kinds", MEMBERS), makes=True),
    "mujoco": World(0.007, 310, MUJOCO),
    "drake": World(0.01, 328, ("--engine", "drake", *KNOWN)),
    "small-mujoco": World(0.0031, 311, MUJOCO, "small"),
    "printed-none": World(0.03, 41, _printed("none")),
    "printed-usual": World(0.06, 41, _printed("usual")),
    "printed-bad": World(0.03, 41, _printed("bad")),
    "small-printed-none": World(0.01, 41, _printed("none"), "small"),
    "small-printed-usual": World(0.02, 41, _printed("usual"), "small"),
    "small-printed-bad": World(0.01, 41, _printed("bad"), "small"),
    "light": World(0.02, 312, LIGHT),
    "small-light": World(0.01, 313, LIGHT, "small"),
    "decoys": World(0.01, 329, ("--kinds", "decoy")),
    "rows": World(0.02, 321, ("--kinds", "row")),
    "small-rows": World(0.01, 322, ("--kinds", "row"), "small"),
    "heavy": World(0.01, 323, HEAVY),
    "small-heavy": World(0.005, 324, HEAVY, "small"),
    "large": World(0.04, 325, makes=True, profile="large"),
    "tactel-16": World(0.04, 326, makes=True, profile="tactel-16"),
    **{name: World(0.01, 327, ("--sensor-type", name), makes=True) for name in TYPES},
    "next": World(0.01, 314, NEXT),
    "small-next": World(0.005, 315, NEXT, "small"),
    "sensors": World(0.048, 316, ("--kinds", "face,edge", "--levels", SENSORS)),
    "one-sensor": World(0.02, 317, ("--sensor-per", "run")),
    "pad": World(0.02, 318, ("--overlay", "pad")),
    "registered": World(0.021, 319, ("--surfaces", "database")),
    "anything": World(0.0225, 320, ("--kinds", "blank,foreign")),
    **{f"own-{k}": World(0.06, 300 + k) for k in range(1, 6)},
    **{f"small-{k}": World(0.064, 300 + k, spec="small") for k in range(1, 3)},
}


def touches_of(name: str, asked: argparse.Namespace) -> int:
    """Return how many touches a world has."""
    return max(10, round(WORLDS[name].share * asked.touches))


def touch(name: str, asked: argparse.Namespace) -> None:
    """Do a world's run, or go on with it."""
    world, folder = WORLDS[name], asked.output / name
    touches = touches_of(name, asked)
    options = [*world.options]
    if world.makes:
        spec = SPECS / f"{world.spec}.yaml"
        if world.profile:
            text = f"profile: {world.profile}\n{spec.read_text()}"
            spec = asked.output / f"{name}.yaml"
            spec.write_text(text)
        options = [str(spec), *options]
    else:
        made = "small" if world.spec == "small" else "own"
        options += ["--database", str(asked.output / made / "lab.db")]
    workers = ("--cluster", asked.cluster) if asked.cluster else ("-j", asked.jobs)
    if "printed" in name:
        options += ["--prints", str(asked.output / f"prints-{world.spec}")]
    runner.run("recognizer.validation", *options, "--touches", touches, "--seed", world.seed,
               "--study", 0, "--resume", *workers, "-o", folder)  # fmt: skip


def figures_of(rows: Iterable[runner.Row]) -> dict[str, Any]:
    """Return how many touches there are, on registered faces, and answered; how true answers are.

    `inside` the 95 % ellipsoids, and `normalised`: squared error over variance, 1 where these are
    true.
    """
    found = list(rows)
    verdicts = [row["verdict"] for row in found]
    line: dict[str, Any] = {
        "touches": len(found), "on_faces": sum(row["object"] != "" for row in found),
        **{name: verdicts.count(name) for name in ("right", "wrong")},
    }  # fmt: skip
    if line["right"]:
        outcome = runner.outcome(found)
        line |= {name: round(outcome[name], digits) for name, digits in FIGURES.items()}
    return line


def line_of(rows: list[runner.Row]) -> dict[str, Any]:
    """Return what became of the touches of a world."""
    line = figures_of(rows)
    for group in GROUPS:
        names = sorted({row[group] for row in rows})
        line[group] = {
            name: figures_of(row for row in rows if row[group] == name) for name in names
        }
    wrong = [row for row in rows if row["verdict"] == "wrong"]
    if wrong:
        line["wrong_answers"] = [{name: row[name] for name in WRONG} for row in wrong]
    return line


def all_of(lines: Collection[dict[str, Any]]) -> dict[str, Any]:
    """Return what became of the touches of several worlds."""
    line = {key: sum(one[key] for one in lines) for key in COUNTS}
    answered = [one for one in lines if one["right"]]
    if answered:
        share = [one["right"] / line["right"] for one in answered]
        several = list(zip(share, answered, strict=True))
        line["rms_mm"] = round(sum(s * one["rms_mm"] ** 2 for s, one in several) ** 0.5, 4)
        line["worst_mm"] = max(one["worst_mm"] for one in answered)
        for name in ("inside", "normalised"):
            line[name] = round(sum(s * one[name] for s, one in several), 4)
    return line


def table(lines: Mapping[str, dict[str, Any]]) -> None:
    """Print what became of all touches, by world, kind and level, as Markdown."""
    heads = ("touches", "on faces", "right", "wrong", "95 % of wrong", "rms mm", "inside",
             "error over variance")  # fmt: skip
    runner.table(("world", *heads))
    for name, line in {**lines, "all": all_of(lines.values())}.items():
        runner.row(name, *_cells(line))
    for group in GROUPS:
        print()
        runner.table((group, *heads))
        every = [line.get(group, {}) for line in lines.values()]
        for name in sorted(set().union(*every)):
            runner.row(name, *_cells(all_of([one[name] for one in every if name in one])))


def _cells(line: Mapping[str, Any]) -> list[str]:
    """Return the counts, the exact interval of the share that is wrong, and the figures."""
    low, high = clopper_pearson(line["wrong"], line["touches"])
    cells = [*(f"{line[key]:,}" for key in COUNTS), f"{100 * low:.2g}-{100 * high:.2g} %"]
    if not line["right"]:
        return [*cells, "", "", ""]
    true = f"{100 * line['inside']:.0f} %", f"{line['normalised']:.2f}"
    return [*cells, f"{line['rms_mm']:.3f}", *true]


def run(asked: argparse.Namespace, finished: dict[str, dict[str, Any]]) -> None:
    """Run the worlds that are left, each put down as soon as it is finished."""
    for number, name in enumerate(asked.worlds, 1):
        world = WORLDS[name]
        there = finished.get(name, {}).get("touches") == touches_of(name, asked)
        if there and (not world.makes or (asked.output / name / "lab.db").exists()):
            continue
        start = time.monotonic()
        print(f"run {number} of {len(asked.worlds)}: {name}", end="", flush=True, file=sys.stderr)
        touch(name, asked)
        finished[name] = line_of(runner.rows_of(asked.output / name))
        (asked.output / SUMMARY).write_text(json.dumps(finished, indent=1) + "\n")
        print(f", {time.monotonic() - start:.0f} s", flush=True, file=sys.stderr)


def main() -> int:
    """Run what is left and print the table."""
    asked = runner.asked(__doc__, output=True, touches=1_000_000, jobs=1, cluster="",
                         worlds=[*WORLDS], table=False)  # fmt: skip
    if unknown := set(asked.worlds) - set(WORLDS):
        raise SystemExit(f"no world {', '.join(sorted(unknown))}; there are {', '.join(WORLDS)}")
    asked.output = asked.output.absolute()
    summary = asked.output / SUMMARY
    finished = json.loads(summary.read_text()) if summary.exists() else {}
    if not asked.table:
        try:
            run(asked, finished)
        except KeyboardInterrupt:
            print("\nstopped; the same command goes on", file=sys.stderr)
            return 130
    lines = {}
    for name in WORLDS:
        if rows := runner.rows_of(asked.output / name):
            lines[name] = line_of(rows)
        elif name in finished:
            lines[name] = finished[name]
    table(lines)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
