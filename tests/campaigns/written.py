"""Read 3MF and GLB of shapes by programs of others: lib3mf in strict mode, and a welded mesh.

    pip install lib3mf
    python tests/campaigns/written.py --random 20 --seed 1

Named shapes and random polyhedra are made as panels and whole. Every 3MF, of components and of
volumes for PrusaSlicer, is read by the reference library of the 3MF Consortium, which checks it
against the core specification, warnings included. Every GLB is welded by equal coordinates: no
edge may be open or shared by more than two triangles, none may be flat. Exit code 1 otherwise.
"""

from __future__ import annotations

import argparse
import json
import struct
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from verified import random_spec

from generator.errors import GeneratorError
from generator.export.meshes import glb_bytes
from generator.export.threemf import print_files
from generator.pipeline.files import parts_of, settings_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.solid import triangles
from generator.spec import read_specs

NAMED = (
    "{cube: 50 mm}", "{box: 40 x 50 x 60 mm}", "{tetrahedron: 80 mm}", "{octahedron: 60 mm}",
    "{dodecahedron: 40 mm}", "{triangular_prism: {side: 60 mm, height: 60 mm}}",
    "{cylinder: {diameter: 50 mm, height: 50 mm}}", "{cone: {diameter: 60 mm, height: 60 mm}}",
    "{cone: {diameter: 60 mm, height: 50 mm, top_diameter: 40 mm}}",
)  # fmt: skip


def mesh_faults(glb: bytes) -> tuple[int, int, int]:
    """Return flat triangles, edges used twice in one direction, and open edges of a GLB."""
    (length,) = struct.unpack_from("<I", glb, 12)
    described, data = json.loads(glb[20 : 20 + length]), glb[28 + length :]

    def values(number: int) -> np.ndarray:
        accessor = described["accessors"][number]
        begin = described["bufferViews"][accessor["bufferView"]]["byteOffset"]
        kind = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        width = {"VEC3": 3, "SCALAR": 1}[accessor["type"]]
        return np.frombuffer(data, kind, accessor["count"] * width, begin).reshape(-1, width)

    points, corners, first = [], [], 0
    for mesh in described["meshes"]:
        for primitive in mesh["primitives"]:
            own = values(primitive["attributes"]["POSITION"])
            corners.append(values(primitive["indices"]).reshape(-1, 3) + first)
        points.append(own)
        first += len(own)
    unique, number = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    faces = number.ravel()[np.concatenate(corners)].astype(np.int64)
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    start = faces[~flat].ravel()
    end = np.roll(faces[~flat], -1, axis=1).ravel()
    there, back = start * len(unique) + end, end * len(unique) + start
    return int(flat.sum()), len(there) - len(np.unique(there)), int((~np.isin(there, back)).sum())


def model_faults(content: bytes, folder: Path) -> list[str]:
    """Return what lib3mf says against a 3MF in strict mode."""
    import lib3mf

    path = folder / "plate.3mf"
    path.write_bytes(content)
    reader = lib3mf.get_wrapper().CreateModel().QueryReader("3mf")
    reader.SetStrictModeActive(True)
    try:
        reader.ReadFromFile(str(path))
    except lib3mf.ELib3MFException as error:
        return [str(error)]
    return [str(reader.GetWarning(k)) for k in range(reader.GetWarningCount())]


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--random", type=int, default=20)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args()
    counts: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        specs = []
        for number, shape in enumerate(NAMED):
            for parts in ("panels", "whole"):
                path = folder / f"named-{number}-{parts}.yaml"
                path.write_text(f"name: {path.stem}\nshape: {shape}\nprint: {{parts: {parts}}}\n")
                specs.append(path)
        for number in range(chosen.random):
            for parts in ("panels", "whole"):
                for kind in ("convex", "other"):
                    specs.append(random_spec(kind, chosen.seed, number, folder, parts))
        for path in specs:
            try:
                plan = plan_object(read_specs([path])[0])
                layout = lay_out_object(plan, NO_CELLS)
                made, _ = parts_of(plan, layout)
            except GeneratorError as error:
                counts["refused"] += 1
                print(f"  {path.stem}: refused: {' '.join(error.cause.split())[:90]}")
                continue
            faults = mesh_faults(glb_bytes(path.stem, made, [triangles(part) for part in made]))
            counts["objects"] += 1
            counts["GLB at fault"] += any(faults)
            if any(faults):
                print(f"  {path.stem}: GLB: flat, doubled, open: {faults}", flush=True)
            for plate in print_files(path.stem, made, plan.printer.bed_mm, settings_of(plan)):
                for content in (plate.content, plate.prusaslicer):
                    counts["3MF"] += 1
                    said = model_faults(content, folder)
                    counts["3MF at fault"] += bool(said)
                    for line in said[:3]:
                        print(f"  {path.stem}: 3MF: {line}", flush=True)
    print(", ".join(f"{value} {name}" for name, value in counts.items()))
    return 1 if counts["GLB at fault"] or counts["3MF at fault"] else 0


if __name__ == "__main__":
    sys.exit(main())
