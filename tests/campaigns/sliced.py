"""Slice every fixture with PrusaSlicer as it is made: plates of panels, and bodies that are whole.

    python tests/campaigns/sliced.py -o sliced.jsonl

Every spec of `fixtures/specs` is made twice by the command, of panels and whole, and every plate
for PrusaSlicer is sliced with the settings in it. A row tells, per plate, what `prusa-slicer
--info` and `admesh` say of the meshes (manifold, open edges, anything repaired), how many layers
and how high, how many overhang perimeters and support segments the G-code holds, and the time
that printing takes. The slicer's exit code is no check (it is 0 for a mesh with holes), so its
words are read. Exit code 1 when a mesh is not manifold, needs a repair, or panels overhang.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import runner

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
REPAIRS = ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges",
           "Degenerate facets")  # fmt: skip
SECONDS = 1800  #: for one plate


#: Of a plate; `repaired` by admesh, of all STL of the object; `overhang` perimeters, `support`
#: segments, `hours` of printing; `side_down` as the command says of a whole body.
COLUMNS = ("spec", "parts", "plate", "manifold", "open_edges", "repaired", "layers", "layer_mm",
           "overhang", "support", "hours", "side_down")  # fmt: skip


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


def row_of(job: tuple[Path, str]) -> runner.Row:
    """Make a spec and slice its plates."""
    spec, parts = job
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        common = {"spec": spec.stem, "parts": parts, "side_down": made(spec, parts, folder)}
        common["repaired"] = repairs(folder / "out")
        plates = sorted((folder / "out").glob("**/*-prusaslicer.3mf"))
        return {"plates": [common | {"plate": one.stem} | sliced(one) for one in plates]}


def main() -> int:
    """Slice what is asked for and print the table."""
    parser = runner.arguments(__doc__, output=True)
    parser.add_argument("--only", default="", metavar="REGEX", help="specs whose name matches")
    asked = runner.parse(parser)
    specs = [one for one in sorted(SPECS.glob("*.yaml")) if re.search(asked.only, one.stem)]
    jobs = [(spec, parts) for spec in specs for parts in ("panels", "whole")]
    rows = [plate for row in runner.resume(asked.output, jobs, row_of) for plate in row["plates"]]
    runner.table(COLUMNS, ([row[name] for name in COLUMNS] for row in rows))
    bad = [row for row in rows if not row["manifold"] or row["open_edges"] or row["repaired"]]
    bad += [row for row in rows if row["parts"] == "panels" and row["overhang"]]
    print(f"{len(rows)} plates, {len(bad)} at fault")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
