"""What pitch and stroke a printer and a sensor read best: the same two boxes in every world.

    python tests/campaigns/pitches.py -o out/pitches                     # an hour
    python tests/campaigns/pitches.py -o out/pitches --table             # of what is there

Each cell of the table is a run of `validate-set`, touches of faces, edges and corners in equal
shares. `auto` takes its pitches from here (docs/pitches.md). Runs that are there are kept.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import runner

BOXES = {"Box": (60, 45, 30), "Small": (38, 24, 18)}  #: mm; faces down to 24 x 18 mm
PRINTED = {"Box": (46, 38, 24)}  #: fewer and smaller panels: slicing costs more than reading
PITCHES = (5.5, 4.5, 7.0, 5.0, 6.0, 4.0, 8.0)  #: mm
STROKES = {5.5: (0.26,), 4.5: (0.26,)}  #: shares of the pitch beside the usual .2
GF8 = {"family": "prmva", "order": 8, "degree": 5, "rows": 151, "columns": 217}
KINDS = "face=1,edge=1,corner=1"


@dataclass(frozen=True)
class World:
    """How touches of a cell are made."""

    name: str
    touches: int
    options: tuple[str, ...]


def printed(name: str, touches: int, machine: str, faults: str) -> World:
    options = ("--surfaces", "printed", "--print-profile", machine, "--faults", faults)
    return World(name, touches, (*options, "--levels", "typical"))


TYPICAL = World("typical", 120, ("--levels", "typical"))
MISMATCH = World("mismatch", 75, ("--levels", "mismatch"))
USUAL = printed("usual-0.4", 60, "fdm-0.4-0.2", "usual")
BAD = printed("bad-0.4", 75, "fdm-0.4-0.2", "bad")
COARSE = printed("bad-0.6", 60, "fdm-0.6-0.3", "bad")
MUJOCO = World("mujoco", 30, ("--levels", "typical", "--engine", "mujoco"))


@dataclass(frozen=True)
class Symbols:
    """What is embossed."""

    pitch_mm: float
    share: float = 0.2
    order: int = 4

    @property
    def name(self) -> str:
        """Folder of its runs."""
        return f"q{self.order}-{self.pitch_mm:g}-{self.share:g}"

    def spec(self, objects: dict[str, tuple[int, int, int]]) -> str:
        """Return a set as YAML."""
        array = "profile: large" if self.order == 4 else f"encoding: {json.dumps(GF8)}"
        lines = [
            f"  - {{name: {name}, shape: {{box: [{x} mm, {y} mm, {z} mm]}}}}"
            for name, (x, y, z) in objects.items()
        ]
        stroke = round(self.share * self.pitch_mm, 2)
        symbols = f"symbols: {{pitch: {self.pitch_mm:g} mm, stroke: {stroke:g} mm}}"
        return "\n".join(["version: 1", array, symbols, "objects:", *lines, ""])


def cells() -> list[tuple[Symbols, World]]:
    """Return all runs, those that decide first."""
    found = [(Symbols(p), world) for world in (TYPICAL, BAD, MISMATCH) for p in PITCHES[:5]]
    found += [(Symbols(p), world) for world in (MUJOCO, COARSE) for p in PITCHES[:5]]
    wide = [Symbols(p, share) for p, shares in STROKES.items() for share in shares]
    found += [(one, world) for one in wide for world in (TYPICAL, BAD)]
    found += [(Symbols(p), w) for p in PITCHES[5:] for w in (TYPICAL, BAD)]
    found += [(Symbols(7.0, 0.18, 8), world) for world in (TYPICAL, MISMATCH)]
    return found + [(Symbols(p), USUAL) for p in PITCHES[:5]]


def run(symbols: Symbols, world: World, folder: Path) -> None:
    place = folder / symbols.name
    here = place / world.name
    if (here / "results.json").exists():
        return
    here.mkdir(parents=True, exist_ok=True)
    spec = here / "boxes.yaml"
    spec.write_text(symbols.spec(PRINTED if "printed" in world.options else BOXES))
    prints = ["--prints", place / "prints"] if "printed" in world.options else []
    runner.run("recognizer.validation", spec, "--touches", world.touches, "--kinds", KINDS,
               "--study", 0, "--seed", 5, "-o", here, *world.options, *prints)  # fmt: skip


def row_of(here: Path) -> dict[str, Any]:
    """Return what a run says: shares of right ones, wrong ones, rms, margins, sizes, time."""
    rows = runner.rows_of(here)
    line = runner.outcome(rows)
    found: dict[str, Any] = {"touches": len(rows)}
    groups = {kind: [r for r in rows if r["kind"] == kind] for kind in ("face", "edge", "corner")}
    for name, some in (groups | {"small": [r for r in rows if r["object"] == "Small"]}).items():
        right = [r["verdict"] == "right" for r in some]
        found[name] = float(np.mean(right)) if right else math.nan
    margins = [r["margin"] for r in rows if r["verdict"] == "right" and math.isfinite(r["margin"])]
    margin = float(np.median(margins)) if margins else math.nan
    errors = {name: line[name] for name in ("wrong", "rms_mm", "rms_deg")}
    return found | errors | {"margin": margin}


def table(folder: Path) -> None:
    heads = ("touches", "face", "edge", "corner", "small", "wrong", "rms_mm", "rms_deg", "margin")
    runner.table(("world", "q", "pitch mm", "stroke", *heads))
    for symbols, world in sorted(
        cells(), key=lambda c: (c[1].name, c[0].order, c[0].share, c[0].pitch_mm)
    ):
        here = folder / symbols.name / world.name
        if not (here / "results.json").exists():
            continue
        line = row_of(here)
        runner.row(world.name, symbols.order, symbols.pitch_mm, symbols.share,
                   *(line[head] for head in heads))  # fmt: skip


def main() -> None:
    asked = runner.asked(__doc__, output=True, table=False)
    for symbols, world in [] if asked.table else cells():
        print(f"{symbols.name} {world.name}", flush=True)
        run(symbols, world, asked.output)
    table(asked.output)


if __name__ == "__main__":
    main()
