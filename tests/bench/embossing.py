"""Embossing a cube: this project against booleans of CAD kernels and of meshes.

    python tests/bench/embossing.py --symbols 24 384

A cube carries 6 k^2 symbols of the alphabet dense-4, at 7 mm, their sides vertical, because not
every kernel function can taper an outline exactly. Each way makes the same solid from the same
outlines, writes STEP (manifold3d cannot), meshes it and writes STL: CPU seconds of all threads
without imports, and the peak of memory with them, in a process of its own. A way that takes longer
than `--limit` (CPU seconds) is ended. Exit code 1 when a volume is not this project's.
`benchmarks.py` puts the figures on its page.
"""

from __future__ import annotations

import json
import math
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1] / "campaigns"))
import runner

if TYPE_CHECKING:
    from generator.alphabet.outline import Tiers
    from generator.layout.placement import Layout
    from generator.polyhedron.winged import Polyhedron

PITCH_MM = 7.0
OURS = "this project"
SAME = 1e-9  #: share of the volume by which ways may differ


@dataclass(frozen=True)
class Scene:
    """The cube and the symbols on it."""

    side_mm: float
    polyhedron: Polyhedron
    layout: Layout
    tiers: tuple[Tiers, ...]

    @property
    def symbols(self) -> Iterator[tuple[Any, float, float, int]]:
        """T_object_face (4, 4), centre x and y (face frame, mm), and label of each symbol."""
        from generator.polyhedron import face_frame

        for face in self.layout.faces:
            T = face_frame(self.polyhedron, face.face)
            for (x, y), label in zip(face.centres_mm.tolist(), face.labels.tolist(), strict=True):
                yield T, x, y, label


def scene(symbols: int, draft_rad: float) -> Scene:
    """Return a cube with 6 k^2 symbols, k the root of a sixth of what is asked, rounded up."""
    import numpy as np

    from generator.alphabet.known import alphabet_named
    from generator.alphabet.outline import SymbolStyle, outlines
    from generator.array.profiles import PROFILES
    from generator.layout.placement import FaceLayout, Layout, Placement
    from generator.polyhedron.shapes import cube

    k = math.isqrt(math.ceil(symbols / 6) - 1) + 1
    array = PROFILES["large"].array()
    r, c = (index.ravel() for index in np.indices((k, k)))
    centres = np.stack([(c + 0.75) * PITCH_MM, (k - r - 0.25) * PITCH_MM], axis=1)
    faces = []
    for face in range(6):
        columns, place = c + face * k, Placement(0, face * k, 0.0, 0.0, 0.0)
        faces.append(FaceLayout(face, place, r, columns, array.symbols(r, columns), centres, 0))
    side = (k + 0.5) * PITCH_MM
    tiers = outlines(alphabet_named("dense-4"), SymbolStyle(PITCH_MM, draft_rad=draft_rad))
    return Scene(side, cube(side), Layout("faces", PITCH_MM, tuple(faces)), tiers)


# Each way takes the scene and a folder, and returns a function that tells, after the clock
# has stopped, the volume of what it made.
Made = Callable[[], float]


def cadquery_fuse(made: Scene, folder: Path) -> Made:
    """All symbols in one call."""
    import cadquery as cq

    def prism(tiers: Tiers) -> Any:
        outer, *holes = (
            cq.Wire.makePolygon([cq.Vector(x, y, 0) for x, y in ring.tolist()], close=True)
            for ring in tiers.rings[0]
        )
        return cq.Solid.extrudeLinear(outer, holes, cq.Vector(0, 0, tiers.z_mm[-1]))

    prisms = [prism(tiers) for tiers in made.tiers]
    tools = []
    for T, x, y, label in made.symbols:
        origin = (T @ [x, y, 0, 1])[:3].tolist()
        plane = cq.Plane(tuple(origin), xDir=tuple(T[:3, 0]), normal=tuple(T[:3, 2]))
        tools.append(prisms[label].moved(cq.Location(plane)))
    corner = made.polyhedron.vertices.min(axis=0).tolist()
    body = cq.Solid.makeBox(*3 * [made.side_mm], pnt=cq.Vector(*corner)).fuse(*tools)
    for name in ("cube.step", "cube.stl"):
        cq.exporters.export(cq.Workplane(body), str(folder / name))
    return body.Volume


def build123d_extrude(made: Scene, folder: Path) -> Made:
    """A sketch of all symbols on each face, extruded."""
    import build123d as bd

    glyphs = []
    for tiers in made.tiers:
        outer, *holes = (bd.Wire.make_polygon(ring.tolist(), close=True) for ring in tiers.rings[0])
        glyphs.append(bd.Face(outer, holes))
    with bd.BuildPart() as part:
        centre = (made.polyhedron.vertices.min(axis=0) + made.side_mm / 2).tolist()
        with bd.Locations(tuple(centre)):
            bd.Box(*3 * [made.side_mm])
        for face, T in zip(made.layout.faces, _frames(made), strict=True):
            plane = bd.Plane(tuple(T[:3, 3]), x_dir=tuple(T[:3, 0]), z_dir=tuple(T[:3, 2]))
            with bd.BuildSketch(plane):
                for label, glyph in enumerate(glyphs):
                    places = face.centres_mm[face.labels == label].tolist()
                    if places:
                        with bd.Locations(*map(tuple, places)):
                            bd.insert(glyph)
        bd.extrude(amount=made.tiers[0].z_mm[-1])
    bd.export_step(part.part, str(folder / "cube.step"))
    bd.export_stl(part.part, str(folder / "cube.stl"))
    return lambda: part.part.volume


def manifold_union(made: Scene, folder: Path) -> Made:
    """All symbols in one boolean of meshes; writes STL alone."""
    import manifold3d as m3
    import numpy as np

    corner = made.polyhedron.vertices.min(axis=0).tolist()
    prisms = []
    for tiers in made.tiers:
        outline = m3.CrossSection([ring.tolist() for ring in tiers.rings[0]], m3.FillRule.EvenOdd)
        prisms.append(m3.Manifold.extrude(outline, tiers.z_mm[-1]))
    solids = [m3.Manifold.cube(3 * [made.side_mm]).translate(corner)]
    for T, x, y, label in made.symbols:
        place = np.column_stack([T[:3, :3], (T @ [x, y, 0.0, 1.0])[:3]])
        solids.append(prisms[label].transform(place))
    whole = m3.Manifold.batch_boolean(solids, m3.OpType.Add)
    mesh = whole.to_mesh()
    corners = mesh.vert_properties[mesh.tri_verts].astype("<f4")
    records = np.zeros(len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)),
                                      ("more", "<u2")])  # fmt: skip
    records["corners"] = corners
    records["normal"] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    (folder / "cube.stl").write_bytes(bytes(80) + len(corners).to_bytes(4, "little")
                                      + records.tobytes())  # fmt: skip
    return whole.volume


def _frames(made: Scene) -> list[Any]:
    from generator.polyhedron import face_frame

    return [face_frame(made.polyhedron, face.face) for face in made.layout.faces]


def this_project(made: Scene, folder: Path) -> Made:
    """Faces with loops, proved closed, written without a kernel."""
    from generator.export.meshes import stl_chunks
    from generator.export.step import step_chunks
    from generator.solid import emboss_whole, prove_closed, triangles

    part = emboss_whole(made.polyhedron, made.layout, made.tiers, "cube")
    prove_closed(part)
    with (folder / "cube.step").open("wb") as file:
        file.writelines(step_chunks(part))
    mesh = triangles(part)
    (folder / "cube.stl").write_bytes(b"".join(stl_chunks(mesh)))

    def volume() -> float:
        import numpy as np

        a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
        return math.fsum((np.einsum("ij,ij->i", a, np.cross(b, c)) / 6).tolist())

    return volume


WAYS: dict[str, Callable[[Scene, Path], Made]] = {
    OURS: this_project,
    "cadquery fuse(*tools)": cadquery_fuse,
    "build123d sketch + extrude": build123d_extrude,
    "manifold3d union of meshes": manifold_union,
}


class Run(NamedTuple):
    """What one way cost on one number of symbols."""

    cpu_s: float
    peak_mb: float
    volume_mm3: float


def measure(way: str, symbols: int) -> None:
    """Run one way in this process; print one line of JSON."""
    for module in ("cadquery", "build123d", "manifold3d", "generator.export.step"):
        if way.startswith(module) or module.startswith("generator"):
            import_module(module)  # before the clock starts
    made = scene(symbols, 0.0)
    with tempfile.TemporaryDirectory() as folder:
        ask, ms = runner.clocked(WAYS[way], made, Path(folder))
        peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps([ms / 1e3, peak_mb, ask()]))


def run(way: str, symbols: int, limit_s: float) -> Run | None:
    """Run one way in a process of its own; None where it takes longer than the limit."""
    command = [sys.executable, __file__, "--measure", way, "--symbols", str(symbols)]
    limit = math.ceil(limit_s + 10)  # imports of a kernel are not the limit's business

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))

    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=limited)
    if done.returncode < 0:  # ended by the signal of the limit
        return None
    if done.returncode:
        raise RuntimeError(f"{way} on {symbols} symbols failed:\n{done.stderr}")
    made = Run(*json.loads(done.stdout.splitlines()[-1]))
    return made if made.cpu_s <= limit_s else None


def actual(symbols: int) -> int:
    """Return the number of symbols of the scene."""
    return 6 * (math.isqrt(math.ceil(symbols / 6) - 1) + 1) ** 2


def main() -> int:
    """Print a line for every way and count; 1 where a volume is wrong."""
    asked = runner.asked(__doc__, symbols=[384], limit=120.0, measure="")
    if asked.measure:
        measure(asked.measure, asked.symbols[0])
        return 0
    wrong = 0
    runner.table(("way", "symbols", "CPU s", "peak MB", "volume mm3"))
    for count in asked.symbols:
        volumes = []
        for way in WAYS:
            made = run(way, count, asked.limit)
            runner.row(way, actual(count), *(made or (f"over {asked.limit:g} s", "", "")))
            volumes += [made.volume_mm3] if made else []
        wrong += max(volumes) - min(volumes) > SAME * max(volumes)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
