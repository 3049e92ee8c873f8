"""Make fixtures and random polyhedra with `--verify`, and read them back by more programs.

    python tests/campaigns/verified.py --convex 300 --other 50 --seed 1 -j 2 -o verified.jsonl
    python tests/campaigns/verified.py --symbols 30 --seed 7 -o symbols   # by slices

Random shapes are made as panels, every second one as a whole body too. `--verify` reads STEP by the
CAD kernel and STL by pymeshlab, and puts panels together. All 3MF are read by the library of the
3MF Consortium in strict mode (`pip install lib3mf`); a GLB is welded by equal coordinates (no edge
open or shared by more than two triangles). Refused shapes are counted with their reason. With
`--symbols` written STL panels of so many shapes are cut at half the height of their symbols: an
outline stands where the layout says, and is held against others of the same label by area, length
and centroid in its own axes. Exit code 1 when a file fails, or a refusal lacks place, cause or way
out.
"""

import json
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import runner
from manifold3d import Manifold, Mesh

from generator.errors import GeneratorError
from generator.export.meshes import stl_chunks
from generator.pipeline.files import parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.solid import triangles
from generator.spec import read_specs

sys.path.insert(0, str(Path(__file__).parents[1]))
from random_shapes import random_convex, random_nonconvex

FIXTURES = Path(__file__).parents[2] / "fixtures"
LIMIT_S = 600  #: of processor time, for one spec
PATIENCE = 10  #: times that by the clock: for a busy machine
UNVERIFIED = "do not print it"  #: in the way out of a part that failed verification
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


def made(spec: Path) -> runner.Row:
    """Make the objects of a spec, verify them, and read their files again."""
    with tempfile.TemporaryDirectory() as name:
        command = runner.command("generator", spec, "-o", "out", "--database", "lab.db", "--json",
                                 "--verify", "--format", "step,stl,3mf,glb")  # fmt: skip
        try:
            done = subprocess.run(command, cwd=name, capture_output=True, text=True,
                                  preexec_fn=limited, timeout=PATIENCE * LIMIT_S)  # fmt: skip
        except subprocess.TimeoutExpired:
            return {"name": spec.stem, "failed": f"not done in {PATIENCE * LIMIT_S} s"}
        if done.returncode not in (0, 2):
            said = (done.stderr.strip().splitlines() or ["killed"])[-1]
            return {"name": spec.stem, "failed": f"exit code {done.returncode}: {said}"}
        answer = json.loads(done.stdout)
        if done.returncode:
            return {"name": spec.stem} | refusal(answer["error"])
        faults = [fault for file in sorted(Path(name).rglob("*.*"))
                  for fault in faults_of(file)]  # fmt: skip
    made = answer["objects"]
    row = {"name": spec.stem, "objects": len(made)}
    row |= {key: sum(one[key] for one in made) for key in ("parts", "symbols", "places")}
    row["fits"] = [one["fit"] for one in made if one["fit"]]
    return row | ({"failed": "; ".join(faults)} if faults else {})


def limited() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT_S, LIMIT_S))


def refusal(error: runner.Row) -> runner.Row:
    """Return the cause of a refusal, a failure where it lacks something."""
    problems = error.get("problems") or [error]
    unsaid = not all(one["place"] and one["cause"] and one["fix"] for one in problems)
    faulty = unsaid or UNVERIFIED in problems[0]["fix"]
    return {"failed" if faulty else "refused": problems[0]["cause"]}


def faults_of(file: Path) -> list[str]:
    """Return what lib3mf says against a 3MF in strict mode, or what is open in a welded GLB."""
    if file.suffix == ".glb":
        import trimesh

        whole = trimesh.load(file).to_mesh()
        whole.merge_vertices(merge_tex=True, merge_norm=True)
        edges = Counter(map(tuple, whole.edges.tolist()))
        odd = sum(count > 1 or (b, a) not in edges for (a, b), count in edges.items())
        return [f"{file.name}: {odd} edges open or doubled"] if odd else []
    if file.suffix != ".3mf":
        return []
    import lib3mf

    reader = lib3mf.get_wrapper().CreateModel().QueryReader("3mf")
    reader.SetStrictModeActive(True)
    try:
        reader.ReadFromFile(str(file))
    except lib3mf.ELib3MFException as error:
        return [f"{file.name}: {error}"]
    return [f"{file.name}: {reader.GetWarning(k)}" for k in range(reader.GetWarningCount())]


def summarise(rows: list[runner.Row]) -> int:
    """Print what became of the specs; 1 where one failed."""
    made = [row for row in rows if "objects" in row and "failed" not in row]
    failed = [row for row in rows if "failed" in row]
    causes = ("".join(c for c in row["refused"] if not c.isdigit()) for row in rows
              if "refused" in row)  # fmt: skip
    refused = Counter(" ".join(cause.split()[:7]) for cause in causes)
    count = {key: sum(row[key] for row in made) for key in ("objects", "parts", "symbols")}
    print(f"{len(rows)} specs: {len(made)} made and verified ({count['objects']} objects, "
          f"{count['parts']} parts, {count['symbols']} symbols), {len(failed)} failed, "
          f"{sum(refused.values())} refused")  # fmt: skip
    fits = [fit for row in made for fit in row["fits"]]
    gaps = [fit["gap_mm"] for fit in fits if fit["gap_mm"] is not None]
    print(f"{len(fits)} objects of panels put together: overlap "
          f"{sum(fit['overlap_mm3'] for fit in fits):.6f} mm3, smallest gap "
          f"{min(gaps, default=np.inf):.6f} mm")  # fmt: skip
    for reason, number in refused.most_common():
        print(f"  refused {number}: {reason} ...")
    for row in failed:
        print(f"  FAILED {row['name']}: {row['failed']}")
    return int(bool(failed))


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
            free = [k for k in range(len(outlines)) if k not in used]
            near = [k for k in free if np.hypot(*(outlines[k][1] - place)) < reach]
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
        return summarise(runner.resume(asked.output, paths, made, asked.jobs))


if __name__ == "__main__":
    sys.exit(main())
