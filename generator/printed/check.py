"""Parts -> what becomes of every symbol on one printer: slice, print, compare.

The whole of `encode-object SPEC --printed-check`. Each part is sliced by PrusaSlicer from the
mesh that its STL holds; faces that look down on the bed or lean are named, not judged.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from generator.export.meshes import stl_chunks
from generator.printed.deposit import deposit
from generator.printed.faults import PrintFaults
from generator.printed.profiles import PrintProfile
from generator.printed.slicer import find_slicer, slice_part, slicer_version
from generator.printed.survey import SymbolTile, survey_face
from generator.printed.view import face_surface, is_seen
from generator.solid.part import Part
from generator.solid.triangulate import triangles

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, eq=False)
class PrintedCheck:
    """Every symbol of some parts as one printer makes it."""

    profile: str
    tiles: tuple[SymbolTile, ...]
    unseen: tuple[str, ...]  #: faces with symbols that are not judged: "F6 of Cube"
    plain: tuple[str, ...]  #: parts without symbols


def check_parts(
    parts: Sequence[Part],
    profile: PrintProfile,
    *,
    faults: PrintFaults | None = None,
    seed: int = 0,
    progress: Progress = lambda _text, _share: None,
) -> PrintedCheck:
    """Print all parts in simulation and compare every symbol with its design.

    Parameters
    ----------
    parts
        As they are printed.
    profile
        Machine, nozzle, layers.
    faults
        Of the machine; none if left out.
    seed
        Of what faults leave to chance, the same for the same parts.

    Raises
    ------
    PrintError
        PrusaSlicer is missing or refuses a part.
    """
    find_slicer()
    slicer_version()
    marked = [part for part in parts if _faces(part)]
    done = 0

    def one(job: tuple[int, Part]) -> tuple[list[SymbolTile], list[str]]:
        nonlocal done
        number, part = job
        found = _check_part(part, profile, faults, np.random.default_rng([seed, number]))
        done += 1
        progress(f"printing {part.name}", done / len(marked))
        return found

    with ThreadPoolExecutor(min(len(marked) or 1, os.cpu_count() or 1)) as pool:
        results = list(pool.map(one, enumerate(marked)))
    return PrintedCheck(
        profile.name,
        tuple(tile for tiles, _ in results for tile in tiles),
        tuple(face for _, faces in results for face in faces),
        tuple(part.name for part in parts if not _faces(part)),
    )


def _check_part(
    part: Part, profile: PrintProfile, faults: PrintFaults | None, rng: np.random.Generator
) -> tuple[list[SymbolTile], list[str]]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{part.name}.stl"
        file.write_bytes(b"".join(stl_chunks(triangles(part))))
        whole = len(_faces(part)) + len(part.wrapped) > 1
        sliced = slice_part(file, profile, supports=whole)
    printed = deposit(sliced, faults, rng)
    tiles: list[SymbolTile] = []
    unseen = [part.facets[w.facets[0]].name for w in part.wrapped if w.facets]
    for number in _faces(part):
        embossing = part.embossings[number]
        facet = part.facets[embossing.facet]
        if not is_seen(embossing.T_part_facet):
            unseen.append(facet.name)
            continue
        T = embossing.T_part_facet
        corners = part.vertices[[corner for loop in facet.loops for corner in loop]]
        outline = ((corners - T[:3, 3]) @ T[:3, :3])[:, :2]
        surface = face_surface(printed, T, outline_mm=outline)
        tiles += survey_face(surface, embossing, part=part.name, face=facet.name)
    return tiles, [f"{face} of {part.name}" for face in unseen]


def _faces(part: Part) -> list[int]:
    """Return the numbers of the embossings that carry symbols of faces."""
    return [k for k, e in enumerate(part.embossings) if e.face is not None and len(e.labels)]
