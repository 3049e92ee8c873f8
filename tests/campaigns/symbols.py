"""Find the symbols of written STL panels again by slices: missing, extra, of another shape.

    python tests/campaigns/symbols.py --shapes 30 --seed 7

Panels of random shapes at the default profile are written as STL, read back as plain triangles
and cut by manifold3d at half the height of their symbols; nothing of what embossed them takes
part. The layout says where which symbol should stand. An outline there is held against others of
the same label by area, length and centroid in its own axes. Exit code 1 where one differs.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from manifold3d import Manifold, Mesh
from verified import random_spec

from generator.errors import GeneratorError
from generator.export.meshes import stl_chunks
from generator.pipeline.files import parts_of
from generator.pipeline.place import NO_CELLS, lay_out_object
from generator.pipeline.plan import plan_object
from generator.solid import triangles
from generator.spec import read_specs

SAME = 0.02  #: mm, mm2: outlines of one label differ by less
APART = 0.05  #: outlines of two labels differ by more
NEAR = 0.45  #: of the pitch: from where it should stand


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


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--shapes", type=int, default=30)
    options.add_argument("--seed", type=int, default=7)
    chosen = options.parse_args()
    counts: Counter[str] = Counter(missing=0, extra=0, wrong=0)
    number = 0
    with tempfile.TemporaryDirectory() as folder:
        while counts["shapes"] < chosen.shapes:
            kind = "other" if number % 3 == 2 else "convex"
            spec = random_spec(kind, chosen.seed, number, Path(folder))
            spec.write_text(spec.read_text().replace("profile: large\n", ""))
            number += 1
            try:
                count_symbols(spec, counts)
            except GeneratorError:
                counts["refused"] += 1
                continue
            counts["shapes"] += 1
            print(dict(counts), file=sys.stderr, flush=True)
    print(", ".join(f"{counts[name]} {name}" for name in counts))
    return 1 if counts["missing"] or counts["extra"] or counts["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
