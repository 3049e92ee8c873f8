"""Slice every part of every shipped type's kit: filament as it is, resin by an SLA profile.

    python tests/campaigns/kits_sliced.py -o out/kits   # minutes; kits that are there stay
    python tests/campaigns/kits_sliced.py -o out/kits gel-24x32

Kits are made with `--verify`. Plates for filament are sliced with the settings in them, those for
resin (they hold none) on a screen of .05 mm pixels (140 x 85 mm, more where the sheet says so) with
.05 mm layers, and the white pixels of all layers are held against the volume of the parts. A row
tells what `prusa-slicer --info` and `admesh` say of the meshes. Exit code 1 when one is not
manifold, needs a repair or supports, or when its layers hold more than 1 % of volume too much or
too little. Overhanging perimeters are told.
"""

from __future__ import annotations

import io
import math
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import runner
import trimesh
from PIL import Image
from sliced import repairs, sliced

from encoded_objects.base.sensor_type_file import shipped_names
from generator.printers import printer_named

FILAMENT = "Metadata/Slic3r_PE.config"  #: in a plate that holds settings
RESIN = printer_named("resin")
OFF = 0.01  #: of the volume, that pixels and layers may be off by


@dataclass(frozen=True)
class Plate:
    """What is said of one plate."""

    name: str
    manifold: bool
    open_edges: int
    layers: int
    overhang: int  #: perimeters, of filament
    support: int  #: segments
    volume: float  #: of the layers over that of the meshes; resin alone

    @property
    def good(self) -> bool:
        """Whether it prints as it was drawn."""
        right = self.manifold and not (self.open_edges or self.support) and self.layers > 0
        return right and abs(self.volume - 1) < OFF


def make_kit(name: str, folder: Path) -> None:
    """Make a type's kit, verified, unless it is there."""
    if not (folder / "sheet.html").exists():
        runner.run("probe.kit", name, "-o", folder, "--verify")


def plate_of(file: Path) -> Plate:
    """Slice a plate."""
    with zipfile.ZipFile(file) as package:
        filament = FILAMENT in package.namelist()
    if filament:
        said = sliced(file)
        return Plate(file.stem, bool(said["manifold"]), int(str(said["open_edges"])),
                     int(str(said["layers"])), int(str(said["overhang"])),
                     int(str(said["support"])), 1.0)  # fmt: skip
    info = subprocess.run(
        ["prusa-slicer", "--info", str(file)], capture_output=True, text=True, check=True
    ).stdout
    layers, volume = resin_layers(file)
    edges = sum(int(line.split("=")[1]) for line in info.splitlines() if "open_edges" in line)
    return Plate(file.stem, "manifold = no" not in info, edges, layers, 0, 0, volume)


def resin_layers(file: Path) -> tuple[int, float]:
    """Return the layers of a plate and what they hold over the volume of its meshes."""
    drawn = trimesh.load_scene(file, file_type="3mf")
    far, step = drawn.bounds[1], RESIN.layer_mm
    wide, deep = (max(bed, math.ceil(x)) for bed, x in zip(RESIN.bed_mm, far[:2], strict=True))
    across, down = round(wide / step), round(deep / step)
    profile = {
        "printer_technology": "SLA", "bed_shape": f"0x0,{wide}x0,{wide}x{deep},0x{deep}",
        "display_width": wide, "display_height": deep, "display_pixels_x": across,
        "display_pixels_y": down, "layer_height": step, "initial_layer_height": step,
        "supports_enable": 0, "pad_enable": 0, "elefant_foot_compensation": 0,
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        ini, archive = Path(name) / "sla.ini", Path(name) / "plate.sl1"
        ini.write_text("".join(f"{key} = {value}\n" for key, value in profile.items()))
        subprocess.run(
            ["prusa-slicer", "--load", str(ini), "--export-sla", "--dont-arrange", "-o",
             str(archive), str(file)], check=True, capture_output=True,
        )  # fmt: skip
        with zipfile.ZipFile(archive) as held:
            images = [n for n in held.namelist() if n.endswith(".png") and "/" not in n]
            white = sum(
                float(np.asarray(Image.open(io.BytesIO(held.read(n))).convert("L")).sum()) / 255
                for n in images
            )
    return len(images), white * step**3 / float(drawn.to_mesh().volume)


def main() -> int:
    """Slice what is asked for and print the table."""
    parser = runner.arguments(__doc__, output=True)
    parser.add_argument("types", nargs="*", default=list(shipped_names()))
    asked = runner.parse(parser)
    runner.table(("type", "plate", "manifold", "open edges", "repaired", "layers", "overhang",
                  "support", "volume"))  # fmt: skip
    bad = 0
    for name in asked.types:
        folder = asked.output / name
        make_kit(name, folder)
        repaired = repairs(folder)
        bad += repaired > 0
        for file in sorted(folder.glob("*.3mf")):
            plate = plate_of(file)
            bad += not plate.good
            runner.row(name, plate.name, plate.manifold, plate.open_edges, repaired, plate.layers,
                       plate.overhang, plate.support, plate.volume)  # fmt: skip
    print(f"{bad} at fault")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
