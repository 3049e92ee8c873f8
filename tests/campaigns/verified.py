"""Read back, by independent programs, what is made of fixtures and random polyhedra.

    pip install lib3mf
    python tests/campaigns/verified.py --convex 300 --other 50 --seed 1 -j 2 -o verified.jsonl
    python tests/campaigns/verified.py --symbols 30 --seed 7 -o symbols   # by slices

Random shapes are made as panels, every second one as a whole body too. STEP is read by the CAD
kernel (one valid solid, volume against the closed form), STL by pymeshlab (closed, two-manifold, no
triangle cuts another), both 3MF of each plate by the library of the 3MF Consortium in strict mode;
a GLB is welded by equal coordinates (no edge open or shared by more than two triangles); panels are
put together by `T_object_part` and may neither overlap nor come nearer than the gap. Refused shapes
are counted with their reason. With `--symbols` written STL panels of so many shapes are cut at half
the height of their symbols: an outline stands where the layout says, and is held against others of
the same label by area, length and centroid in its own axes. Exit code 1 when a file fails.
"""

from __future__ import annotations

import json
import struct
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import runner
from manifold3d import Manifold, Mesh

from generator.errors import GeneratorError
from generator.export.bambu import project_3mf
from generator.export.check import PanelFile, verify_fit, verify_step, verify_stl
from generator.export.meshes import glb_bytes, stl_chunks
from generator.export.step import step_chunks
from generator.export.threemf import print_files
from generator.pipeline.files import parts_of, settings_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.solid import prove_closed, triangles
from generator.spec import ObjectSpec, read_specs

sys.path.insert(0, str(Path(__file__).parents[1]))
from random_shapes import random_convex, random_nonconvex

FIXTURES = Path(__file__).parents[2] / "fixtures"
SAME = 0.02  #: mm, mm2: outlines of one label differ by less
APART = 0.05  #: outlines of two labels differ by more
NEAR = 0.45  #: of the pitch: from where it should stand


def random_spec(kind: str, seed: int, number: int, folder: Path, parts: str = "panels") -> Path:
    """Write the spec of one random shape, made of panels or whole."""
    rng = np.random.default_rng([seed, number, kind == "convex"])
    shape = random_convex(rng) if kind == "convex" else random_nonconvex(rng)
    path = folder / f"{kind}-{number:03d}-{parts}.yaml"
    faces = [[list(loop) for loop in face.loops] for face in shape.faces]
    faces = [loops[0] if len(loops) == 1 else loops for loops in faces]
    path.write_text(
        f"name: {path.stem}\nprofile: large\nprint: {{parts: {parts}}}\n"
        f"shape:\n  polyhedron:\n    vertices: {shape.vertices.tolist()}\n    faces: {faces}\n"
    )
    return path


def checked(path: Path) -> runner.Row:
    """Return what became of every object of a spec file."""
    try:
        return {"objects": [outcome(spec) for spec in read_specs([path])]}
    except GeneratorError as error:
        return {"objects": [{"name": path.stem, "refused": error.cause}]}


def outcome(spec: ObjectSpec) -> runner.Row:
    """Make one object and read it back."""
    row: runner.Row = {"name": spec.name}
    try:
        plan = plan_object(spec)
        layout = lay_out_object(plan, NO_CELLS)
        parts, _ = parts_of(plan, layout)
    except GeneratorError as error:
        return row | {"refused": error.cause}
    row |= {"parts": len(parts), "symbols": sum(len(face.labels) for face in layout.faces)}
    errors, panels = [(0.0, 0.0)], []
    meshes = [triangles(part) for part in parts]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            for part, mesh in zip(parts, meshes, strict=True):
                step, stl = folder / "part.step", folder / f"{part.name}.stl"
                panels.append(PanelFile(part.name, stl, part.T_object_part))
                prove_closed(part)
                step.write_bytes(b"".join(step_chunks(part)))
                stl.write_bytes(b"".join(stl_chunks(mesh)))
                read = verify_step(part, step), verify_stl(part, stl)
                errors.append((abs(read[0].volume_error), abs(read[1].volume_error)))
            fit = verify_fit(panels, spec.gap_mm) if len(panels) > 1 else None
        except GeneratorError as error:
            return row | {"failed": str(error)}
        faults = mesh_faults(glb_bytes(spec.name, parts, meshes))
        if any(faults):
            return row | {"failed": f"GLB: flat, doubled, open: {faults}"}
        settings = settings_of(plan, layout)
        plates = print_files(spec.name, parts, plan.printer.bed_mm, settings)
        contents = [one for plate in plates for one in (plate.content, plate.prusaslicer)]
        contents += [project_3mf(spec.name, plates)] if settings else []
        for content in contents:
            if said := model_faults(content, folder):
                return row | {"failed": f"3MF: {said[0]}"}
    row["step_error"], row["mesh_error"] = map(max, zip(*errors, strict=True))
    if fit is not None:
        row |= {"panels": len(parts), "overlap_mm3": fit.overlap_mm3, "gap_mm": fit.gap_mm}
    return row


def mesh_faults(glb: bytes) -> tuple[int, int, int]:
    """Return flat triangles, edges used twice in one direction, and open edges of a GLB."""
    (length,) = struct.unpack_from("<I", glb, 12)
    described, data = json.loads(glb[20 : 20 + length]), glb[28 + length :]

    def values(number: int, kind: str) -> np.ndarray:
        accessor = described["accessors"][number]
        begin = described["bufferViews"][accessor["bufferView"]]["byteOffset"]
        return np.frombuffer(data, kind, accessor["count"] * (3 if kind == "<f4" else 1), begin)

    points, corners, first = [], [], 0
    for mesh in described["meshes"]:
        for primitive in mesh["primitives"]:
            own = values(primitive["attributes"]["POSITION"], "<f4").reshape(-1, 3)
            corners.append(values(primitive["indices"], "<u4").reshape(-1, 3) + first)
        points.append(own)
        first += len(own)
    unique, number = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    faces = number.ravel()[np.concatenate(corners)].astype(np.int64)
    flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    start, end = faces[~flat].ravel(), np.roll(faces[~flat], -1, axis=1).ravel()
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


def solid_of(stl: bytes) -> Manifold:
    """Return binary STL as a solid."""
    count = int.from_bytes(stl[80:84], "little")
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    corners = np.frombuffer(stl, record, count, 84)["corners"].reshape(-1, 3)
    points, numbers = np.unique(corners, axis=0, return_inverse=True)
    return Manifold(Mesh(points.astype(np.float32), numbers.reshape(-1, 3).astype(np.uint32)))


def outline_of(loop: np.ndarray) -> tuple[float, np.ndarray, float]:
    """Return signed area, centroid and length of a closed line."""
    x, y = loop.T
    ahead_x, ahead_y = np.roll(x, -1), np.roll(y, -1)
    cross = x * ahead_y - ahead_x * y
    area = cross.sum() / 2
    centre = np.array([((x + ahead_x) * cross).sum(), ((y + ahead_y) * cross).sum()]) / 6 / area
    return float(area), centre, float(np.hypot(ahead_x - x, ahead_y - y).sum())


def count_symbols(spec: Path, counts: Counter[str]) -> None:
    """Check all panels of a spec."""
    plan = plan_object(read_specs([spec])[0])
    layout = lay_out_object(plan, NO_CELLS)
    parts, _ = parts_of(plan, layout)
    style = plan.spec.style
    shown: dict[int, np.ndarray] = {}
    for part, face in zip(parts, layout.faces, strict=True):
        solid = solid_of(b"".join(stl_chunks(triangles(part))))
        cut = solid.slice(plan.spec.wall_mm + 0.5 * style.height_mm).to_polygons()
        outlines = [outline_of(np.asarray(loop)) for loop in cut]
        outlines = [outline for outline in outlines if outline[0] > 0]
        counts["panels"] += 1
        counts["symbols"] += len(face.labels)
        used: set[int] = set()
        own = [embossing for embossing in part.embossings if embossing.face is not None]
        for at, label in zip(face.centres_mm, face.labels.tolist(), strict=True):
            place = at + own[0].T_part_facet[:2, 3]
            reach = NEAR * style.pitch_mm
            near = [
                k
                for k, (_, centre, _) in enumerate(outlines)
                if k not in used and np.hypot(*(centre - place)) < reach
            ]
            if len(near) != 1:
                counts["missing"] += 1
                continue
            used.add(near[0])
            area, centre, length = outlines[near[0]]
            turn = own[0].rotation_rad
            c, s = np.cos(turn), np.sin(turn)
            x, y = centre - place
            found = np.array([area, length, c * x + s * y, c * y - s * x])
            counts["wrong"] += bool(label in shown and np.abs(shown[label] - found).max() > SAME)
            shown.setdefault(label, found)
        counts["extra"] += len(outlines) - len(used)
    for one in shown:
        for other in shown:
            alike = one < other and np.abs(shown[one] - shown[other]).max() < APART
            counts["labels that look alike"] += bool(alike)


def find_symbols(shapes: int, seed: int) -> int:
    """Slice panels of so many random shapes of the default profile and print what was found."""
    counts: Counter[str] = Counter(missing=0, extra=0, wrong=0)
    number = 0
    with tempfile.TemporaryDirectory() as folder:
        while counts["shapes"] < shapes:
            kind = "other" if number % 3 == 2 else "convex"
            spec = random_spec(kind, seed, number, Path(folder))
            spec.write_text(spec.read_text().replace("profile: large\n", ""))
            number += 1
            try:
                count_symbols(spec, counts)
                counts["shapes"] += 1
            except GeneratorError:
                counts["refused"] += 1
    print(", ".join(f"{counts[name]} {name}" for name in counts))
    return 1 if counts["missing"] or counts["extra"] or counts["wrong"] else 0


def main() -> int:
    """Make what is asked for and print the figures."""
    asked = runner.asked(__doc__, output=True, seed=1, jobs=2, convex=300, other=50, symbols=0)
    if asked.symbols:
        return find_symbols(asked.symbols, asked.seed)
    with tempfile.TemporaryDirectory() as name:
        paths = sorted((FIXTURES / "specs").glob("*.yaml"))
        for kind, count in (("other", asked.other), ("convex", asked.convex)):
            for number in range(count):
                paths.append(random_spec(kind, asked.seed, number, Path(name)))
                if number % 2:
                    paths.append(random_spec(kind, asked.seed, number, Path(name), "whole"))
        rows = runner.resume(asked.output, paths, checked, asked.jobs)
    objects = [one for row in rows for one in row["objects"]]
    made = [one for one in objects if "step_error" in one]
    failed = [one for one in objects if "failed" in one]
    refused = Counter(" ".join(o["refused"].split()[:7]) for o in objects if "refused" in o)
    print(f"{len(objects)} objects: {len(made)} made and verified "
          f"({sum(o['parts'] for o in made)} parts, {sum(o['symbols'] for o in made)} symbols), "
          f"{len(failed)} failed, {sum(refused.values())} refused")  # fmt: skip
    step, mesh = (max((o[key] for o in made), default=0) for key in ("step_error", "mesh_error"))
    print(f"largest relative volume error: STEP {step:.1e}, STL {mesh:.1e}")
    fitted = [o for o in made if "panels" in o]
    gaps = [o["gap_mm"] for o in fitted if o["gap_mm"] is not None]
    print(f"{len(fitted)} objects of {sum(o['panels'] for o in fitted)} panels put together: "
          f"overlap {sum(o['overlap_mm3'] for o in fitted):.6f} mm3, smallest gap "
          f"{min(gaps, default=np.inf):.6f} mm")  # fmt: skip
    for reason, count in refused.most_common():
        print(f"  refused {count}: {reason} ...")
    for one in failed:
        print(f"  FAILED {one['name']}: {one['failed']}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
