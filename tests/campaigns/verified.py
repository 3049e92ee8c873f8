"""Read back, by independent programs, what is made of fixtures and random polyhedra.

    python tests/campaigns/verified.py --convex 300 --other 50 --seed 1 -j 2 -o verified.jsonl

Random shapes are made as panels, every second one as a whole body too. Every part is written as
STEP and STL and read back: STEP by the CAD kernel (one valid solid, volume against the closed
form), STL by pymeshlab (closed, two-manifold, no triangle cuts another);
panels are put together by `T_object_part` and may neither overlap nor come nearer than the gap.
Shapes that the tool refuses (too small for the wall, say) are counted with their reason. Exit
code 1 when a written part fails. What stands in the file of outcomes is not made again.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from generator.errors import GeneratorError
from generator.export.check import PanelFile, verify_fit, verify_step, verify_stl
from generator.export.meshes import stl_chunks
from generator.export.step import step_chunks
from generator.pipeline.files import parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.polyhedron import Polyhedron
from generator.solid import prove_closed, triangles
from generator.spec import ObjectSpec, read_specs

sys.path.insert(0, str(Path(__file__).parents[1]))
from random_shapes import random_convex, random_nonconvex

FIXTURES = Path(__file__).parents[2] / "fixtures"


@dataclass(frozen=True)
class Outcome:
    """What became of one shape, as one kind of parts."""

    name: str
    parts: int
    symbols: int
    step_error: float  #: largest relative volume error of a part, by the kernel
    mesh_error: float
    refused: str
    failed: str
    panels: int = 0  #: of an object made of panels
    overlap_mm3: float = 0.0  #: that two of its panels both fill
    gap_mm: float | None = None  #: smallest distance of two of its panels, where any are near


def random_spec(kind: str, seed: int, number: int, folder: Path, parts: str = "panels") -> Path:
    """Write the spec of one random shape, made of panels or whole."""
    rng = np.random.default_rng([seed, number, kind == "convex"])
    shape = random_convex(rng) if kind == "convex" else random_nonconvex(rng)
    path = folder / f"{kind}-{number:03d}-{parts}.yaml"
    path.write_text(spec_text(path.stem, shape, parts))
    return path


def spec_text(name: str, shape: Polyhedron, parts: str) -> str:
    vertices = [[float(x) for x in vertex] for vertex in shape.vertices]
    faces = [[list(loop) for loop in face.loops] for face in shape.faces]
    faces = [loops[0] if len(loops) == 1 else loops for loops in faces]
    return (
        f"name: {name}\nprofile: large\nprint: {{parts: {parts}}}\n"
        f"shape:\n  polyhedron:\n    vertices: {vertices}\n    faces: {faces}\n"
    )


def checked(path: Path) -> list[Outcome]:
    """Make and read back every object of a spec file."""
    try:
        return [outcome(located) for located in read_specs([path])]
    except GeneratorError as error:
        return [Outcome(path.stem, 0, 0, 0.0, 0.0, error.cause, "")]


def outcome(located: ObjectSpec) -> Outcome:
    name = located.name
    try:
        plan = plan_object(located)
        layout = lay_out_object(plan, NO_CELLS)
        parts, _ = parts_of(plan, layout)
    except GeneratorError as error:
        return Outcome(name, 0, 0, 0.0, 0.0, error.cause, "")
    symbols = sum(len(face.labels) for face in layout.faces)
    step_error = mesh_error = 0.0
    fit = None
    with tempfile.TemporaryDirectory() as folder:
        panels = []
        for part in parts:
            step, stl = Path(folder) / "part.step", Path(folder) / f"{part.name}.stl"
            panels.append(PanelFile(part.name, stl, part.T_object_part))
            try:
                prove_closed(part)
                step.write_bytes(b"".join(step_chunks(part)))
                stl.write_bytes(b"".join(stl_chunks(triangles(part))))
                step_read, stl_read = verify_step(part, step), verify_stl(part, stl)
            except GeneratorError as error:
                return Outcome(name, len(parts), symbols, step_error, mesh_error, "", str(error))
            step_error = max(step_error, abs(step_read.volume_error))
            mesh_error = max(mesh_error, abs(stl_read.volume_error))
        try:
            fit = verify_fit(panels, located.gap_mm) if len(panels) > 1 else None
        except GeneratorError as error:
            return Outcome(name, len(parts), symbols, step_error, mesh_error, "", str(error))
    if fit is None:
        return Outcome(name, len(parts), symbols, step_error, mesh_error, "", "")
    return Outcome(
        name, len(parts), symbols, step_error, mesh_error, "", "",
        len(parts), fit.overlap_mm3, fit.gap_mm,
    )  # fmt: skip


def outcomes_of(
    paths: list[Path], workers: int, kept: Path | None
) -> Iterable[tuple[str, list[Outcome]]]:
    """Give name and outcomes of every spec file, first those that stand in `kept`."""
    known: set[str] = set()
    if kept and kept.exists():
        for line in kept.read_text().splitlines():
            name, some = json.loads(line)
            known.add(name)
            yield name, [Outcome(**fields) for fields in some]
    left = [path for path in paths if path.stem not in known]
    with ProcessPoolExecutor(workers) as pool:
        for path, some in zip(left, pool.map(checked, left), strict=True):
            if kept:
                with kept.open("a") as lines:
                    lines.write(json.dumps([path.stem, [asdict(each) for each in some]]) + "\n")
            yield path.stem, some


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--convex", type=int, default=300)
    options.add_argument("--other", type=int, default=50)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("-j", type=int, default=2)
    options.add_argument("--no-fixtures", action="store_true")
    options.add_argument("-o", type=Path, metavar="FILE", help="outcomes, a line a spec file")
    chosen = options.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        paths = [] if chosen.no_fixtures else sorted((FIXTURES / "specs").glob("*.yaml"))
        for kind, count in (("other", chosen.other), ("convex", chosen.convex)):
            for number in range(count):
                paths.append(random_spec(kind, chosen.seed, number, folder))
                if number % 2:
                    paths.append(random_spec(kind, chosen.seed, number, folder, "whole"))
        outcomes: list[Outcome] = []
        for done, (_, some) in enumerate(outcomes_of(paths, chosen.j, chosen.o), 1):
            outcomes += some
            if sys.stderr.isatty() or done % 50 == 0:
                print(f"{done}/{len(paths)} {time.monotonic() - began:.0f} s", file=sys.stderr)
    made = [o for o in outcomes if o.parts and not o.failed]
    failed = [o for o in outcomes if o.failed]
    refused = Counter(" ".join(o.refused.split()[:7]) for o in outcomes if o.refused)
    print(f"{len(outcomes)} objects: {len(made)} made and verified "
          f"({sum(o.parts for o in made)} parts, {sum(o.symbols for o in made)} symbols), "
          f"{len(failed)} failed, {sum(refused.values())} refused")  # fmt: skip
    step = max((o.step_error for o in made), default=0.0)
    mesh = max((o.mesh_error for o in made), default=0.0)
    print(f"largest relative volume error: STEP {step:.1e}, STL {mesh:.1e}")
    fitted = [o for o in made if o.panels]
    gaps = [o.gap_mm for o in fitted if o.gap_mm is not None]
    print(f"{len(fitted)} objects of {sum(o.panels for o in fitted)} panels put together: overlap "
          f"{sum(o.overlap_mm3 for o in fitted):.6f} mm3, smallest gap "
          f"{min(gaps, default=np.inf):.6f} mm")  # fmt: skip
    for reason, count in refused.most_common():
        print(f"  refused {count}: {reason} ...")
    for o in failed:
        print(f"  FAILED {o.name}: {o.failed}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
