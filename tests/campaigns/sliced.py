"""Slice every fixture with PrusaSlicer as it is made: plates of panels, and bodies that are whole.

    python tests/campaigns/sliced.py -o sliced.jsonl

Every spec of `fixtures/specs` is made twice by the command, of panels and whole, and every plate
for PrusaSlicer is sliced with the settings in it. A row tells, per plate, what `prusa-slicer
--info` and `admesh` say of the meshes (manifold, open edges, anything repaired), how many layers
and how high, how many overhang perimeters and support segments the G-code holds, and the time
that printing takes. The slicer's exit code is no check (it is 0 for a mesh with holes), so its
words are read. Exit code 1 when a mesh is not manifold, needs a repair, or panels overhang. What
stands in the file of rows is not sliced again.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
REPAIRS = ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges",
           "Degenerate facets")  # fmt: skip
SECONDS = 1800  #: for one plate


@dataclass(frozen=True)
class Sliced:
    """One plate."""

    spec: str
    parts: str  #: panels or whole
    plate: str
    manifold: bool  #: every mesh on it
    open_edges: int
    repaired: int  #: by admesh, of all STL of the object
    layers: int
    layer_mm: float
    overhang: int  #: perimeters
    support: int  #: segments
    hours: float
    side_down: str  #: as the command says, of a whole body


def made(spec: Path, parts: str, folder: Path) -> str:
    """Make the objects of a spec; return what the command says of a whole body."""
    text = spec.read_text()
    if parts == "whole":
        text = text.replace("parts: panels", "parts: whole")
        if "parts: whole" not in text:
            text += "\nprint: {parts: whole}\n"
    (folder / "spec.yaml").write_text(text)
    entry = "from generator.command import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", entry, "spec.yaml", "-o", "out", "--format", "stl,3mf",
         "--database", "sqlite:///lab.db"],
        check=False, capture_output=True, text=True, cwd=folder,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{spec.name} {parts}: {done.stderr.strip().splitlines()[-1:]}")
    said = [line.strip() for line in done.stdout.splitlines() if " down" in line]
    return " ".join(said)


def repairs(folder: Path) -> int:
    """Return what admesh repairs in all STL files of a folder."""
    total = 0
    for stl in sorted(folder.glob("**/*.stl")):
        said = subprocess.run(["admesh", str(stl)], capture_output=True, text=True, check=True)
        total += sum(
            int(n) for name in REPAIRS for n in re.findall(rf"{name}\s*:\s*(\d+)", said.stdout)
        )
    return total


def sliced(plate: Path) -> dict[str, object]:
    """Return what the slicer says of a plate."""
    info = subprocess.run(
        ["prusa-slicer", "--info", str(plate)], capture_output=True, text=True, check=True
    ).stdout
    with tempfile.TemporaryDirectory() as name:
        gcode = Path(name) / "plate.gcode"
        subprocess.run(
            ["prusa-slicer", "--export-gcode", "--dont-arrange", "-o", str(gcode), str(plate)],
            capture_output=True, text=True, check=True, timeout=SECONDS,
        )  # fmt: skip
        text = gcode.read_text(errors="replace")
    types = re.findall(r"^;TYPE:(.*)$", text, re.MULTILINE)
    time = re.search(r"; estimated printing time \(normal mode\) = (.*)", text)
    units = {"d": 24.0, "h": 1.0, "m": 1 / 60, "s": 1 / 3600}
    spent = re.findall(r"(\d+)([dhms])", time[1]) if time else []
    height = re.search(r"^; layer_height = ([0-9.]+)", text, re.MULTILINE)
    return {
        "manifold": set(re.findall(r"^manifold = (\S+)", info, re.MULTILINE)) == {"yes"},
        "open_edges": sum(map(int, re.findall(r"^open_edges = (\d+)", info, re.MULTILINE))),
        "layers": len(re.findall(r"^;LAYER_CHANGE", text, re.MULTILINE)),
        "layer_mm": float(height[1]) if height else 0.0,
        "overhang": sum(kind == "Overhang perimeter" for kind in types),
        "support": sum(kind.startswith("Support material") for kind in types),
        "hours": round(sum(int(n) * units[unit] for n, unit in spent), 2),
    }


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--only", default="", metavar="REGEX", help="specs whose name matches")
    options.add_argument("-o", type=Path, metavar="FILE", help="rows, a line a plate")
    chosen = options.parse_args()
    rows: list[Sliced] = []
    if chosen.o and chosen.o.exists():
        rows = [Sliced(**json.loads(line)) for line in chosen.o.read_text().splitlines()]
    done = {(row.spec, row.parts) for row in rows}
    print(f"{'plate':44} manifold open repaired layers  mm overhang support hours", flush=True)
    for row in rows:
        print(line(row))
    for spec in sorted(SPECS.glob("*.yaml")):
        for parts in ("panels", "whole"):
            if (spec.stem, parts) in done or not re.search(chosen.only, spec.stem):
                continue
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                side = made(spec, parts, folder)
                count = repairs(folder / "out")
                new = [
                    Sliced(spec=spec.stem, parts=parts, plate=plate.stem, repaired=count,
                           side_down=side, **sliced(plate))
                    for plate in sorted((folder / "out").glob("**/*-prusaslicer.3mf"))
                ]  # fmt: skip
            for row in new:
                print(line(row), flush=True)
            rows += new
            if chosen.o:
                with chosen.o.open("a") as lines:
                    lines.writelines(json.dumps(asdict(row)) + "\n" for row in new)
    bad = [row for row in rows if not row.manifold or row.open_edges or row.repaired]
    bad += [row for row in rows if row.parts == "panels" and row.overhang]
    print(f"{len(rows)} plates, {len(bad)} at fault; of panels "
          f"{sum(row.overhang for row in rows if row.parts == 'panels')} overhang perimeters, of "
          f"whole bodies {sum(row.overhang for row in rows if row.parts == 'whole')}")  # fmt: skip
    return 1 if bad else 0


def line(row: Sliced) -> str:
    """Return one row of the table."""
    name = f"{row.parts} {row.plate.removesuffix('-prusaslicer')} ({row.spec})"
    return (
        f"{name[:44]:44} {row.manifold!s:8} {row.open_edges:4} {row.repaired:8} {row.layers:6} "
        f"{row.layer_mm:3g} {row.overhang:8} {row.support:7} {row.hours:5.2f}  {row.side_down}"
    ).rstrip()


if __name__ == "__main__":
    sys.exit(main())
