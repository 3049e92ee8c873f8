"""Print one panel of each profile on several printers in simulation; how symbols come out.

    python tests/campaigns/printed.py [--pictures docs/printed] [--size 60]
    python tests/campaigns/printed.py --size 40 --pitches 4,4.5,5,5.5,6    # of profile large

Prints a table (docs/printed.md holds it) and writes one picture for each combination. Needs
PrusaSlicer. All are planned for resin, so that nothing is refused for filament, and printed on
filament all the same.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import runner

from generator.export.meshes import stl_chunks
from generator.pipeline.files import parts_of
from generator.pipeline.place import place_object
from generator.pipeline.plan import ObjectPlan, plan_object
from generator.printed.check import check_png
from generator.printed.deposit import deposit
from generator.printed.faults import print_faults
from generator.printed.slicer import PROFILES, slice_part
from generator.printed.survey import LOST, SURVIVES, survey_face
from generator.printed.view import face_surface
from generator.solid.part import Part
from generator.solid.triangulate import triangles
from generator.spec.read import read_specs

SPECS = [(profile, "") for profile in ("one-touch", "large", "fine", "thesis", "product")]
PRINTS = ("fdm-0.4-0.2", "fdm-0.4-0.3", "fdm-0.6-0.3")
FAULTS = ("none", "usual", "bad")


def panel(profile: str, pitch: str, size_mm: float, folder: Path) -> tuple[ObjectPlan, Part]:
    spec = folder / f"{profile}.yaml"
    symbols = f"symbols: {{pitch: {pitch} mm}}\n" if pitch else ""
    spec.write_text(
        f"name: {profile}\nshape: {{cube: {size_mm:g} mm}}\nprofile: {profile}\n"
        f"print: {{printer: resin}}\n{symbols}"
    )
    plan = plan_object(read_specs([spec], database=None)[0])
    layout = place_object(None, plan, False).layout
    parts = [part for part in parts_of(plan, layout)[0] if part.symbols]
    return plan, max(parts, key=lambda part: part.symbols)


def main() -> None:
    asked = runner.asked(__doc__, pictures=Path, size=60.0, pitches="")
    panels = [("large", pitch) for pitch in asked.pitches.split(",")] if asked.pitches else SPECS
    runner.table(("profile", "print", "faults", "symbols", "overlap", "worst", "lost %",
                  "widened %", "height mm", "moved mm", "survive", "lost"))  # fmt: skip
    with tempfile.TemporaryDirectory() as name:
        for profile, pitch in panels:
            plan, part = panel(profile, pitch, asked.size, Path(name))
            stl = Path(name) / f"{profile}.stl"
            stl.write_bytes(b"".join(stl_chunks(triangles(part))))
            embossing = next(e for e in part.embossings if e.face is not None)
            for machine in PRINTS:
                sliced = slice_part(stl, PROFILES[machine])
                for faults in FAULTS:
                    made = deposit(sliced, print_faults(faults), np.random.default_rng(1))
                    surface = face_surface(made, embossing.T_part_facet)
                    tiles = survey_face(surface, embossing, part=part.name, face=part.name)
                    checks = [tile.check for tile in tiles]
                    area = np.mean([c.area_mm2 for c in checks])
                    runner.row(
                        f"{profile} {pitch}", machine, faults, len(checks),
                        float(np.mean([c.overlap for c in checks])),
                        min(c.overlap for c in checks),
                        100 * float(np.mean([c.lost_mm2 for c in checks]) / area),
                        100 * float(np.mean([c.widened_mm2 for c in checks]) / area),
                        float(np.mean([c.height_mm for c in checks])),
                        float(max(np.hypot(*c.moved_mm) for c in checks)),
                        sum(c.verdict == SURVIVES for c in checks),
                        sum(c.verdict == LOST for c in checks),
                    )  # fmt: skip
                    if asked.pictures:
                        asked.pictures.mkdir(parents=True, exist_ok=True)
                        picture = asked.pictures / f"{profile}-{machine}-{faults}.png"
                        names = [glyph.name for glyph in plan.alphabet.glyphs]
                        title = f"{profile} on {machine}, faults {faults}"
                        picture.write_bytes(check_png(title, tiles, names))


if __name__ == "__main__":
    main()
