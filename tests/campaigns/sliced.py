"""Slice every panel of the thesis's four objects, and each object whole, with PrusaSlicer.

    python tests/campaigns/sliced.py
    python tests/campaigns/sliced.py kit/*.stl       # files of probe-kit, or others

Prints, per part, what `prusa-slicer --info` and `admesh` say of the mesh (manifold, open
edges, anything repaired) and how many overhang and support segments the G-code holds.
The slicer's exit code is no check (it is 0 for a mesh with holes), so its words are read.
Exit code 1 when a mesh is not manifold, needs a repair, or a panel has an overhang.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
FOUR = ("cube", "box", "prism", "tetrahedron")
REPAIRS = ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges",
           "Degenerate facets")  # fmt: skip


@dataclass(frozen=True)
class Sliced:
    manifold: bool
    open_edges: int
    repaired: int
    overhang: int
    support: int


def sliced(stl: Path) -> Sliced:
    info = subprocess.run(
        ["prusa-slicer", "--info", str(stl)], capture_output=True, text=True, check=True
    ).stdout
    fields = dict(re.findall(r"^(\w+) = (\S+)$", info, re.MULTILINE))
    mesh = subprocess.run(["admesh", str(stl)], capture_output=True, text=True, check=True).stdout
    repaired = sum(int(n) for name in REPAIRS for n in re.findall(rf"{name}\s*:\s*(\d+)", mesh))
    with tempfile.TemporaryDirectory() as folder:
        gcode = Path(folder) / "part.gcode"
        subprocess.run(
            ["prusa-slicer", "--export-gcode", "--support-material", "--support-material-auto",
             "--layer-height", "0.2", "--bed-shape", "0x0,300x0,300x300,0x300",
             "-o", str(gcode), str(stl)],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        types = re.findall(r"^;TYPE:(.*)$", gcode.read_text(errors="replace"), re.MULTILINE)
    return Sliced(
        manifold=fields.get("manifold") == "yes",
        open_edges=int(fields.get("open_edges", 0)),
        repaired=repaired,
        overhang=sum(kind == "Overhang perimeter" for kind in types),
        support=sum(kind.startswith("Support material") for kind in types),
    )


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--profile", default="one-touch")
    options.add_argument("files", nargs="*", type=Path, help="STL files in place of the objects")
    options.add_argument("--whole", action="store_true", help="slice the whole bodies too")
    chosen = options.parse_args()
    bad = 0
    print(f"{'part':32s} manifold open repaired overhang support")
    for stl in chosen.files:
        part = sliced(stl)
        bad += not part.manifold or part.open_edges > 0 or part.repaired > 0
        print(f"{stl.stem:32s} {part.manifold!s:8} {part.open_edges:4} {part.repaired:8} "
              f"{part.overhang:8} {part.support:7}", flush=True)  # fmt: skip
    if chosen.files:
        return int(bad > 0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        kinds = ("panels", "whole") if chosen.whole else ("panels",)
        for parts in kinds:
            for shape in FOUR:
                text = (SPECS / f"{chosen.profile}-{shape}.yaml").read_text()
                spec = folder / f"{shape}-{parts}.yaml"
                spec.write_text(text + (f"print: {{parts: {parts}}}\n" if parts == "whole" else ""))
                out = folder / f"{shape}-{parts}"
                entry = "from generator.command import main; main()"
                database = f"sqlite:///{folder / shape}-{parts}.db"
                subprocess.run(
                    [sys.executable, "-c", entry, str(spec), "-o", str(out), "--format", "stl",
                     "--database", database],
                    check=True, capture_output=True,
                )  # fmt: skip
                for stl in sorted(out.glob("**/*.stl")):
                    s = sliced(stl)
                    faulty = not s.manifold or s.open_edges or s.repaired
                    bad += bool(faulty or (parts == "panels" and s.overhang))
                    label = f"{parts} {stl.stem}"
                    print(f"{label:32s} {s.manifold!s:8s} {s.open_edges:4d} {s.repaired:8d} "
                          f"{s.overhang:8d} {s.support:7d}", flush=True)  # fmt: skip
    print(f"{bad} parts at fault")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
