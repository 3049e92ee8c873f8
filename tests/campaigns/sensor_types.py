"""Every shipped sensor type on symbols of the pitch that it proposes: right, wrong, refused.

    python tests/campaigns/sensor_types.py -o out/types -j 2
    python tests/campaigns/sensor_types.py -o out/types --rounds 1 --types fsr-8x8
    python tests/campaigns/sensor_types.py -o out/types --table # of what is there

Rounds of 500 touches a type, each with its own seed, so that all types have about as many whenever
it is stopped: the usual kinds (faces, edges, corners, worn, blank and foreign surfaces) and levels
of `validate-set` on written files; 40 of faces in MuJoCo, where the type has tabs; and 40 of faces
of a block as filament printers leave it with the usual faults, where its symbols are not too fine
(needs PrusaSlicer; each block is printed once). 5,000 touches each are ten rounds. Interrupted by
Ctrl-C it goes on with the touches that are there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import runner

from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names

SHAPES = {
    "Cube": "{cube: 80 mm}",
    "Box": "{box: [90 mm, 70 mm, 60 mm]}",
    "Prism": "{triangular_prism: {side: 80 mm, height: 90 mm}}",
    "Pyramid": "{pyramid: {sides: 4, side: 90 mm, height: 70 mm}}",
}
BLOCK = {"Block": "{box: [80 mm, 64 mm, 40 mm]}"}  #: that is printed
KEY = "VA11-DATE-0000-0002"  #: of the labs, so that a run can be repeated
FINE_MM = 4.0  #: below this filament printers make no strokes


@dataclass(frozen=True)
class World:
    """Where a type touches."""

    touches: int  #: of a round
    options: tuple[str, ...] = ()
    shapes: Mapping[str, str] | None = None  #: of a lab of its own, which is printed

    def serves(self, name: str) -> bool:
        """Whether a type can touch here: MuJoCo has tabs, filament no fine symbols."""
        sensor = sensor_type_named(name)
        if self.shapes:
            return sensor.symbol_pitch_mm >= FINE_MM
        return not self.options or sensor.overlay.kind == "tab"


FACES = ("--kinds", "face", "--levels", "typical")
PRINTED = ("--surfaces", "printed", "--print-profile", "fdm-0.4-0.2", "--faults", "usual")
WORLDS = {
    "own": World(500),
    "mujoco": World(40, ("--engine", "mujoco", *FACES)),
    "printed": World(40, (*PRINTED, *FACES), BLOCK),
}


def make_lab(place: Path, name: str, shapes: Mapping[str, str]) -> Path:
    """Make the parts of a type and return their database."""
    database = place / "lab.db"
    if not (place / "made").exists():
        place.mkdir(parents=True, exist_ok=True)
        pitch = sensor_type_named(name).symbol_pitch_mm
        printer = "resin" if pitch < FINE_MM else "fdm-0.4"
        objects = [f"  - {{name: {key}, shape: {shape}}}" for key, shape in shapes.items()]
        lines = [f"sensor_type: {name}", f"print: {{printer: {printer}}}", "objects:"]
        spec = place / "set.yaml"
        spec.write_text("\n".join([*lines, *objects, ""]))
        runner.run("generator", spec, "-o", place / "parts", "--database", database,
                   "--format", "stl", "--lab-key", KEY)  # fmt: skip
        (place / "made").touch()
    return database


def touch(folder: Path, name: str, world: str, number: int, processes: int) -> None:
    """Do a round of a type in a world, or go on with it."""
    one = WORLDS[world]
    here, place = folder / name / f"{world}-{number}", folder / name
    if (here / "results.json").exists():
        return
    options = one.options
    if one.shapes:
        place = place / "block"
        options = (*options, "--prints", str(place / "prints"))
    database = make_lab(place, name, one.shapes or SHAPES)
    runner.run("recognizer.validation", "--database", database, "--sensor-type", name,
               "--touches", one.touches, "--seed", 100 + number, "--shard", 100, "--study", 0,
               "--resume", "-j", processes, "-o", here, *options)  # fmt: skip


def rows_of(folder: Path, name: str, world: str, what: str = "shards") -> list[runner.Row]:
    """Return all touches of a type in a world, or their times."""
    runs = sorted((folder / name).glob(f"{world}-*"))
    return [row for one in runs for row in runner.rows_of(one, what)]


def lines_of(rows: list[runner.Row]) -> Iterator[tuple[str, list[runner.Row]]]:
    """Yield the lines of the table: faces by level, other kinds, what no database knows."""
    known = [row for row in rows if row["object"]]
    for level in ("low", "typical", "hard", "mismatch"):
        faces = [row for row in known if (row["kind"], row["level"]) == ("face", level)]
        yield f"faces, {level}", faces
    for kind in ("edge", "corner", "worn"):
        yield f"{kind}, all levels", [row for row in known if row["kind"] == kind]
    yield "blank and foreign", [row for row in rows if not row["object"]]
    yield "all", rows


def table(folder: Path, names: list[str]) -> None:
    """Print what became of the touches, as Markdown."""
    counts = ("touches", "right", "wrong", "rejected")
    runner.table(("type", "world", *counts, "rms mm / degrees", "inside", "ms"))
    for name in names:
        for world in WORLDS:
            rows = rows_of(folder, name, world)
            for label, some in lines_of(rows):
                if some:
                    line, ms, errors, inside = runner.outcome(some), "", "", ""
                    if line["right"]:
                        errors = f"{line['rms_mm']:.3f} / {line['rms_deg']:.2f}"
                        inside = f"{100 * line['inside']:.0f} %"
                    if label == "all":
                        spent = [one["reading"] for one in rows_of(folder, name, world, "times")]
                        ms = f"{1e3 * np.mean(spent):.0f}"
                    count = (line[key] for key in counts)
                    runner.row(name, f"{world}, {label}", *count, errors, inside, ms)


def main() -> None:
    """Run what is asked for and print the table."""
    asked = runner.asked(__doc__, output=True, jobs=1, types=list(shipped_names()), rounds=10,
                         worlds=list(WORLDS), table=False)  # fmt: skip
    folder = asked.output.absolute()
    runs = [
        (number, world, name)
        for number in range(0 if asked.table else asked.rounds)
        for world in asked.worlds
        for name in asked.types
        if WORLDS[world].serves(name)
    ]
    for done, (number, world, name) in enumerate(runs, 1):
        print(f"run {done} of {len(runs)}: {name}, {world}, round {number + 1}", flush=True)
        touch(folder, name, world, number, asked.jobs)
    table(folder, asked.types)


if __name__ == "__main__":
    main()
