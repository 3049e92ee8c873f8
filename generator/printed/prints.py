"""Registered parts, printed in simulation and kept as files of surfaces.

A folder of prints is shared by many runs; names follow from content::

    gcode/      NAME-KEY.gcode, by the part's bytes, all settings, the slicer's version
    surfaces/   KEY.npy and KEY.json (`surface_file`), by the part's bytes, settings, version,
                faults, seed, and the face's place in the part

A part is printed once for all its faces, in the frame of its own bed; scale and skew act about
the middle of its box. Backlash and the play of layers move a whole panel by some hundredths of a
mm against its own edges, which no touch of its symbols can know: each surface is moved so that the
middle of its symbols stands where it was designed. mm, face frame.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from generator.alphabet.known import alphabet_from
from generator.alphabet.outline import outlines
from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
from generator.printed.deposit import deposit
from generator.printed.faults import PrintFaults, print_faults
from generator.printed.slicer import (
    PrintProfile,
    print_profile,
    settings_of,
    slice_part,
    slicer_version,
)
from generator.printed.surface import (
    DEPTH_MM,
    FORMAT,
    MARGIN_MM,
    STEP_MM,
    Floats,
    PrintedSurface,
    is_written,
    write_surface,
)
from generator.printed.survey import (
    footprint_shift,
    over_face,
    symbol_designs,
)
from generator.printed.view import face_surface, is_seen
from generator.solid.part import Embossing, embossing_of, turn

#: A footprint of 10 mm2 has a thousand places then: its middle is known to some um.
_STEP_MM = 0.1


def symbols_shift(surface: PrintedSurface, embossing: Embossing) -> Floats:
    """Return how far symbols stand from where they were designed, (2,) mm, on average.

    Symbols of which nothing was printed do not count; without any symbol it is 0.
    """
    points, designs = symbol_designs(embossing, _STEP_MM)
    R = turn(embossing.rotation_rad)
    shifts = []
    for centre, label in zip(embossing.centres_mm, embossing.labels.tolist(), strict=True):
        design = designs[label]
        found = surface.heights_mm(centre + points @ R.T).reshape(design.footprint.shape)
        over, base = over_face(found, design)
        if np.isfinite(base) and (over[~design.around] > design.height_mm / 2).any():
            shifts.append(R @ footprint_shift(over, design, points))
    return np.mean(shifts, axis=0) if shifts else np.zeros(2)


GCODE, SURFACES = "gcode", "surfaces"


@dataclass(frozen=True, slots=True)
class PrintPlan:
    """How parts are printed."""

    profile: PrintProfile
    faults: PrintFaults
    seed: int  #: of what faults leave to chance


@dataclass(frozen=True, slots=True, eq=False)
class FaceOnPart:
    """A face whose print is looked at."""

    name: str
    outline_mm: Floats  #: (k, 2) face frame
    embossing: Embossing  #: its symbols; its T_part_facet is where the face lies in the part


@dataclass(frozen=True, slots=True, eq=False)
class PrintJob:
    """A written part and those of its faces that the beads show."""

    name: str
    file: Path  #: binary STL, as it is printed
    sha256: str  #: of its bytes
    supports: bool  #: more than one face bears symbols: some stand on nothing
    faces: tuple[FaceOnPart, ...]


def print_plan(profile: str, faults: str, seed: int) -> PrintPlan:
    """Return how parts are printed; raises `PrintError` for an unknown profile or fault."""
    return PrintPlan(print_profile(profile), print_faults(faults), seed)


def print_job(
    held: RegisteredObject, part: RegisteredPart, file: Path, faces: Sequence[RegisteredFace]
) -> tuple[PrintJob, tuple[str, ...]]:
    """Return the print of a registered part, and the names of the faces that it cannot show."""
    tiers = outlines(alphabet_from(held.alphabet), held.style)
    shown, unseen = [], []
    for face in faces:
        T_part_face = np.linalg.inv(part.T_object_part) @ face.T_object_face
        if face.round is not None or not is_seen(T_part_face):
            unseen.append(face.name)
            continue
        layout = held.layout.faces[face.face_id]
        embossing = embossing_of(layout, tiers, 0, T_part_face, held.style.pitch_mm)
        shown.append(FaceOnPart(face.name, np.concatenate(face.polygon_mm), embossing))
    job = PrintJob(part.name, file, part.sha256, len(faces) > 1, tuple(shown))
    return job, tuple(unseen)


def surface_keys(job: PrintJob, plan: PrintPlan) -> dict[str, str]:
    """Return under which names the surfaces of a part's faces are kept."""
    common = [
        FORMAT,
        job.sha256,
        job.supports,
        _settings(plan.profile),
        slicer_version(),
        asdict(plan.faults),
        plan.seed,
        [STEP_MM, DEPTH_MM, MARGIN_MM],
    ]
    keys = {}
    for face in job.faces:
        place = np.round(face.embossing.T_part_facet, 9) + 0.0
        values = [*common, place.tolist(), np.round(face.outline_mm, 9).tolist()]
        keys[face.name] = hashlib.sha256(json.dumps(values).encode()).hexdigest()[:32]
    return keys


@lru_cache(maxsize=4)
def _settings(profile: PrintProfile) -> list[tuple[str, str]]:
    return sorted(settings_of(profile).items())


def surface_path(folder: Path, key: str) -> Path:
    """Return where a surface is kept in a folder of prints, without suffix."""
    return folder / SURFACES / key


def left_to_print(job: PrintJob, plan: PrintPlan, folder: Path) -> bool:
    """Whether a face of a part is not in the folder yet."""
    keys = surface_keys(job, plan).values()
    return not all(is_written(surface_path(folder, key)) for key in keys)


def print_part(job: PrintJob, plan: PrintPlan, folder: Path) -> None:
    """Slice and deposit a part, and keep the surfaces of its faces.

    Raises `PrintError` if PrusaSlicer is missing or refuses the part.
    """
    sliced = slice_part(job.file, plan.profile, supports=job.supports, cache=folder / GCODE)
    rng = np.random.default_rng([plan.seed, int(job.sha256[:16], 16)])
    printed = deposit(sliced, plan.faults, rng)
    keys = surface_keys(job, plan)
    for face in job.faces:
        embossing = face.embossing
        surface = face_surface(printed, embossing.T_part_facet, outline_mm=face.outline_mm)
        x, y = symbols_shift(surface, embossing)
        path = surface_path(folder, keys[face.name])
        write_surface(surface, path, moved_mm=(float(x), float(y)))
