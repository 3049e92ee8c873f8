"""Every shipped sensor type on symbols of the pitch that it proposes: right, wrong, refused.

    python tests/campaigns/sensor_types.py -o out/types -j 2  # an hour; goes on where it was
    python tests/campaigns/sensor_types.py -o out/types --rounds 1 fsr-8x8  # 500 touches of a type
    python tests/campaigns/sensor_types.py -o out/types --table             # of what is there

Rounds of 500 touches a type, each with its own seed, so that all types have about as many whenever
it is stopped: the usual kinds (faces, edges, corners, worn, blank and foreign surfaces) and levels
of `validate-set` on written files; 40 of faces in MuJoCo, where the type has tabs; and 40 of faces
of a block as filament printers leave it with the usual faults, where its symbols are not too fine
(needs PrusaSlicer; each block is printed once). 5,000 touches each are ten rounds. Interrupted by
Ctrl-C it goes on with the touches that are there.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names
from recognizer.validation.statistics import chi2_quantile

SHAPES = {
    "Cube": "{cube: 80 mm}",
    "Box": "{box: [90 mm, 70 mm, 60 mm]}",
    "Prism": "{triangular_prism: {side: 80 mm, height: 90 mm}}",
    "Pyramid": "{pyramid: {sides: 4, side: 90 mm, height: 70 mm}}",
}
BLOCK = {"Block": "{box: [80 mm, 64 mm, 40 mm]}"}  #: that is printed
KEY = "VA11-DATE-0000-0002"  #: of the labs, so that a run can be repeated
FINE_MM = 4.0  #: below this filament printers make no strokes
INSIDE = chi2_quantile(0.95)  #: chi square of three numbers at 95 %


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
        _run("generator", str(spec), "-o", str(place / "parts"), "--database", str(database),
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
    _run("recognizer.validation", "--database", str(database), "--sensor-type", name, "--touches",
         str(one.touches), "--seed", str(100 + number), "--shard", "100", "--study", "0",
         "--resume", "-j", str(processes), "-o", str(here), *options)  # fmt: skip


def _run(package: str, *arguments: str) -> None:
    code = f"from {package}.command import main; main()"
    subprocess.run([sys.executable, "-c", code, *arguments], check=True, stdout=subprocess.DEVNULL)


def rows_of(folder: Path, name: str, world: str) -> tuple[pa.Table, float] | None:
    """Return all touches of a type in a world, and the mean CPU time of reading one, ms."""
    found = []
    for what in ("shards", "times"):
        files = sorted((folder / name).glob(f"{world}-*/{what}/touches/*.parquet"))
        found.append([pq.read_table(file) for file in files])
    rows, times = found
    if not rows:
        return None
    return pa.concat_tables(rows), 1e3 * float(pc.mean(pa.concat_tables(times)["reading"]).as_py())


def lines_of(rows: pa.Table) -> Iterator[tuple[str, pa.Table]]:
    """Yield what is told apart: faces by level, other kinds, what no database knows."""
    known = pc.not_equal(rows["object"], "")
    face = pc.and_(known, pc.equal(rows["kind"], "face"))
    for level in dict.fromkeys(("low", "typical", "hard", "mismatch")):
        yield f"faces, {level}", rows.filter(pc.and_(face, pc.equal(rows["level"], level)))
    for kind in ("edge", "corner", "worn"):
        yield f"{kind}, all levels", rows.filter(pc.and_(known, pc.equal(rows["kind"], kind)))
    yield "blank and foreign", rows.filter(pc.invert(known))


def table(folder: Path, names: list[str]) -> None:
    """Print what became of the touches, as Markdown."""
    print("| type | world | touches | right | wrong | refused | rms mm / degrees | inside | ms |")
    print("| --- " * 9 + "|")
    for name in names:
        for world in WORLDS:
            found = rows_of(folder, name, world)
            if found is None:
                continue
            rows, ms = found
            for label, some in [*lines_of(rows), ("all", rows)]:
                if len(some):
                    _line(name, f"{world}, {label}", some, f"{ms:.0f}" if label == "all" else "")


def _line(name: str, label: str, rows: pa.Table, ms: str) -> None:
    verdicts = rows["verdict"].to_pylist()
    counts = " | ".join(str(verdicts.count(one)) for one in ("right", "wrong", "rejected"))
    right = rows.filter(pc.equal(rows["verdict"], "right"))
    errors = inside = ""
    if len(right):
        mm, deg, chi2 = (right[key].to_numpy() for key in ("error_mm", "error_deg", "chi2"))
        errors = f"{np.sqrt(np.mean(mm**2)):.3f} / {np.sqrt(np.mean(deg**2)):.2f}"
        inside = f"{100 * np.mean(chi2 < INSIDE):.0f} %"
    print(f"| {name} | {label} | {len(rows)} | {counts} | {errors} | {inside} | {ms} |")


def main() -> None:
    """Run what is asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("types", nargs="*", default=list(shipped_names()))
    parser.add_argument("-o", "--output", type=Path, required=True)
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("-j", "--processes", type=int, default=1)
    parser.add_argument("--worlds", default=",".join(WORLDS), help="own,mujoco,printed")
    parser.add_argument("--table", action="store_true", help="of the runs that are there")
    asked = parser.parse_args()
    folder = asked.output.absolute()
    runs = [
        (number, world, name)
        for number in range(0 if asked.table else asked.rounds)
        for world in asked.worlds.split(",")
        for name in asked.types
        if WORLDS[world].serves(name)
    ]
    for done, (number, world, name) in enumerate(runs, 1):
        print(f"run {done} of {len(runs)}: {name}, {world}, round {number + 1}", flush=True)
        touch(folder, name, world, number, asked.processes)
    table(folder, asked.types)


if __name__ == "__main__":
    main()
