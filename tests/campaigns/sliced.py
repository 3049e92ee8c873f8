"""Slice every fixture, or every shipped type's kit, as it is made: manifold, repaired, overhanging.

    python tests/campaigns/sliced.py -o sliced.jsonl [--only REGEX]
    python tests/campaigns/sliced.py -o out/kits --kits [gel-24x32]   # kits that are there stay

Every spec of `fixtures/specs` is made of panels and whole, every kit with `--verify`. Plates are
sliced by PrusaSlicer with the settings in them; plates for resin hold none and are sliced on .05 mm
pixels and layers, whose white pixels are held against the volume of the parts. The slicer's exit
code is no check (it is 0 for a mesh with holes), so its words are read. Exit code 1 when a mesh is
not manifold or needs a repair, panels overhang, a kit needs supports, a whole body gets supports
that the command does not announce or none where it does, or layers of resin hold more than 1 % of
volume too much or too little.
"""

import io
import math
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import runner

from encoded_objects.base.sensor_type_file import shipped_names
from generator.printers import printer_named

SPECS = Path(__file__).parents[2] / "fixtures" / "specs"
REPAIRS = ("Edges fixed", "Facets removed", "Facets added", "Facets reversed", "Backwards edges",
           "Degenerate facets")  # fmt: skip
SECONDS = 1800  #: for one plate
FILAMENT = "Metadata/Slic3r_PE.config"  #: in a plate that holds settings
RESIN = printer_named("resin")
OFF = 0.01  #: of the volume, that pixels and layers may be off by
#: Of a plate; `repaired` by admesh, of all STL of the object; `overhang` perimeters, `support`
#: segments, `hours` of printing; `volume` of the layers over that of the meshes, resin alone;
#: `side_down` as the command says of a whole body.
COLUMNS = ("name", "parts", "plate", "manifold", "open_edges", "repaired", "layers", "layer_mm",
           "overhang", "support", "hours", "volume", "side_down")  # fmt: skip


def say(*words: object) -> str:
    """Return what a program says."""
    done = subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True,
                          timeout=SECONDS)  # fmt: skip
    return done.stdout


def make_object(spec: Path, parts: str, folder: Path) -> str:
    """Make the objects of a spec; return what the command says of a whole body."""
    text = spec.read_text()
    if parts == "whole":
        text = text.replace("parts: panels", "parts: whole")
        text += "" if "parts: whole" in text else "\nprint: {parts: whole}\n"
    (folder / "spec.yaml").write_text(text)
    said = say(*runner.command("generator", folder / "spec.yaml", "-o", folder / "out", "--format",
                               "stl,3mf", "--database", folder / "lab.db"))  # fmt: skip
    return " ".join(line.strip() for line in said.splitlines() if " down" in line)


def repairs(folder: Path) -> int:
    """Return what admesh repairs in all STL files of a folder."""
    said = "".join(say("admesh", stl) for stl in sorted(folder.glob("**/*.stl")))
    return sum(int(n) for name in REPAIRS for n in re.findall(rf"{name}\s*:\s*(\d+)", said))


def sliced(plate: Path) -> runner.Row:
    """Return what the slicer says of a plate."""
    info = say("prusa-slicer", "--info", plate)
    row = {
        "manifold": set(re.findall(r"^manifold = (\S+)", info, re.MULTILINE)) == {"yes"},
        "open_edges": sum(map(int, re.findall(r"^open_edges = (\d+)", info, re.MULTILINE))),
    }
    with zipfile.ZipFile(plate) as package:
        return row | (filament if FILAMENT in package.namelist() else resin)(plate)


def filament(plate: Path) -> runner.Row:
    """Return what the G-code of a plate holds."""
    with tempfile.TemporaryDirectory() as name:
        gcode = Path(name) / "plate.gcode"
        say("prusa-slicer", "--export-gcode", "--dont-arrange", "-o", gcode, plate)
        text = gcode.read_text(errors="replace")
    types = re.findall(r"^;TYPE:(.*)$", text, re.MULTILINE)
    time = re.search(r"; estimated printing time \(normal mode\) = (.*)", text)
    units = {"d": 24.0, "h": 1.0, "m": 1 / 60, "s": 1 / 3600}
    spent = re.findall(r"(\d+)([dhms])", time[1]) if time else []
    height = re.search(r"^; layer_height = ([0-9.]+)", text, re.MULTILINE)
    return {
        "layers": len(re.findall(r"^;LAYER_CHANGE", text, re.MULTILINE)),
        "layer_mm": float(height[1]) if height else 0.0,
        "overhang": sum(kind == "Overhang perimeter" for kind in types),
        "support": sum(kind.startswith("Support material") for kind in types),
        "hours": round(sum(int(n) * units[unit] for n, unit in spent), 2),
    }


def resin(plate: Path) -> runner.Row:
    """Return the layers of a plate and what they hold over the volume of its meshes."""
    import trimesh
    from PIL import Image

    drawn = trimesh.load_scene(plate, file_type="3mf")
    far, step = drawn.bounds[1], RESIN.layer_mm
    wide, deep = (max(bed, math.ceil(x)) for bed, x in zip(RESIN.bed_mm, far[:2], strict=True))
    profile = {
        "printer_technology": "SLA", "bed_shape": f"0x0,{wide}x0,{wide}x{deep},0x{deep}",
        "display_width": wide, "display_height": deep, "display_pixels_x": round(wide / step),
        "display_pixels_y": round(deep / step), "layer_height": step, "initial_layer_height": step,
        "supports_enable": 0, "pad_enable": 0, "elefant_foot_compensation": 0,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        ini, archive = Path(name) / "sla.ini", Path(name) / "plate.sl1"
        ini.write_text("".join(f"{key} = {value}\n" for key, value in profile.items()))
        say("prusa-slicer", "--load", ini, "--export-sla", "--dont-arrange", "-o", archive, plate)
        with zipfile.ZipFile(archive) as held:
            images = [n for n in held.namelist() if n.endswith(".png") and "/" not in n]
            white = sum(
                float(np.asarray(Image.open(io.BytesIO(held.read(n))).convert("L")).sum()) / 255
                for n in images
            )
    volume = white * step**3 / float(drawn.to_mesh().volume)
    return {"layers": len(images), "layer_mm": step, "overhang": 0, "support": 0, "volume": volume}


def slice_spec(job: tuple[Path, str]) -> runner.Row:
    """Make a spec and slice its plates."""
    spec, parts = job
    with tempfile.TemporaryDirectory() as name:
        common = {"name": spec.stem, "parts": parts,
                  "side_down": make_object(spec, parts, Path(name))}  # fmt: skip
        common["repaired"] = repairs(Path(name, "out"))
        plates = sorted(Path(name, "out").glob("**/*-prusaslicer.3mf"))
        return {"plates": [common | {"plate": one.stem} | sliced(one) for one in plates]}


def slice_kit(name: str, folder: Path) -> list[runner.Row]:
    """Make a type's kit unless it is there, and slice its plates."""
    if not (folder / "sheet.html").exists():
        runner.run("probe.kit", name, "-o", folder, "--verify")
    common = {"name": name, "parts": "kit", "repaired": repairs(folder)}
    plates = sorted(folder.glob("*.3mf"))
    return [common | {"plate": one.stem} | sliced(one) for one in plates]


def at_fault(row: runner.Row) -> bool:
    """Whether a plate does not print as it was drawn."""
    hangs = row[{"panels": "overhang", "kit": "support"}.get(row["parts"], "repaired")]
    if row["parts"] == "whole":
        hangs = ("supports needed under" in row["side_down"]) != bool(row["support"])
    off = abs(row.get("volume", 1.0) - 1) > OFF
    faulty = not row["manifold"] or row["open_edges"] or row["repaired"] or not row["layers"]
    return bool(faulty or hangs or off)


def main() -> int:
    """Slice what is asked for and print the table."""
    asked = runner.asked(__doc__, output=True, only="", kits=[""])
    if asked.kits != [""]:
        names = asked.kits or list(shipped_names())
        rows = [row for name in names for row in slice_kit(name, asked.output / name)]
    else:
        specs = [one for one in sorted(SPECS.glob("*.yaml")) if re.search(asked.only, one.stem)]
        jobs = [(spec, parts) for spec in specs for parts in ("panels", "whole")]
        done = runner.resume(asked.output, jobs, slice_spec)
        rows = [plate for row in done for plate in row["plates"]]
    runner.table(COLUMNS, ([row.get(name, "") for name in COLUMNS] for row in rows))
    bad = sum(map(at_fault, rows))
    print(f"{len(rows)} plates, {bad} at fault")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
