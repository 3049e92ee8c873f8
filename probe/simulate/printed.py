"""Printed parts as surfaces: what PrusaSlicer's G-code leaves of a registered part is touched.

Database + print profile + faults + seed -> a folder of prints and a listing of them -> Scene in
the frame of a face. Printing is done once, part by part (`PartToPrint`), by whoever has
PrusaSlicer; touching needs the listing and the folder alone. A part is printed and touched
alone, in the frame of its own bed: scale and skew act about the middle of its box, and places
on its face are counted from the middle of its printed symbols.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from generator.database.registered import RegisteredFace, RegisteredObject, RegisteredPart
from generator.printed.prints import (
    PrintJob,
    PrintPlan,
    left_to_print,
    print_job,
    print_part,
    print_plan,
    surface_keys,
    surface_path,
)
from generator.printed.slicer import DEFAULT, find_slicer, slicer_version
from generator.printed.surface import is_written, read_surface
from probe.errors import SurfaceError
from probe.simulate.registered import face_of, face_scene, registered_object
from probe.simulate.scene import Scene

PROFILE = DEFAULT  #: of prints where none is named


@dataclass(frozen=True, slots=True)
class PrintOptions:
    """How a set is printed, by the names that a person gives."""

    profile: str = PROFILE  #: name, or a file that PrusaSlicer exported
    faults: str = "none"  #: none, usual, bad, k=v,...
    seed: int = 1  #: of what faults leave to chance

    def plan(self) -> PrintPlan:
        """Return these options as values.

        Raises `PrintError` for an unknown profile or fault, or without PrusaSlicer.
        """
        plan = print_plan(self.profile, self.faults, self.seed)
        find_slicer()
        return plan


@dataclass(frozen=True, slots=True, eq=False)
class PartToPrint:
    """A part of an object, with its faces that bear symbols."""

    object_name: str
    job: PrintJob
    unseen: tuple[str, ...]  #: faces that are not simulated: they lean, look down or are round

    def left(self, options: PrintOptions, folder: Path) -> bool:
        """Whether something of it is not in the folder of prints yet."""
        return left_to_print(self.job, options.plan(), folder)

    def print(self, options: PrintOptions, folder: Path) -> None:
        """Print it into the folder; raises `PrintError` where PrusaSlicer refuses it."""
        print_part(self.job, options.plan(), folder)


def part_to_print(
    held: RegisteredObject, part: RegisteredPart, file: Path, faces: list[RegisteredFace]
) -> PartToPrint:
    """Return a part of an object, its STL file, and those of its faces that bear symbols."""
    return PartToPrint(held.entry.name, *print_job(held, part, file, faces))


def listing_of(parts: list[PartToPrint], options: PrintOptions, folder: Path, base: Path) -> str:
    """Return the text of a listing: which surface of a folder is which face.

    The folder of the prints is named from `base`, the folder of the listing.
    """
    plan = options.plan()
    faces: dict[str, dict[str, str]] = {}
    for part in parts:
        faces.setdefault(part.object_name, {}).update(surface_keys(part.job, plan))
    values = {
        "folder": Path(os.path.relpath(folder.absolute(), base.absolute())).as_posix(),
        "profile": plan.profile.name,
        "faults": options.faults,
        "seed": options.seed,
        "slicer": f"PrusaSlicer {slicer_version()}",
        "faces": faces,
        "not simulated": [f"{face} of {p.object_name}" for p in parts for face in p.unseen],
    }
    return json.dumps(values, indent=1) + "\n"


@dataclass(frozen=True, slots=True)
class PrintListing:
    """The prints of a set."""

    folder: Path
    keys: dict[tuple[str, str], str]  #: of object and face
    unseen: tuple[str, ...]  #: "F6 of Cube"
    slicer: str

    def complete(self) -> bool:
        """Whether all surfaces are there."""
        return all(is_written(surface_path(self.folder, key)) for key in self.keys.values())

    def moved_mm(self) -> list[tuple[float, float]]:
        """Return by how much each print stood aside of its part's frame, which is taken out."""
        return [read_surface(surface_path(self.folder, k)).moved_mm for k in self.keys.values()]


@lru_cache(maxsize=4)
def read_listing(file: str) -> PrintListing:
    """Return what a listing says; raises `SurfaceError` if it is not there, or is none."""
    try:
        values = json.loads(Path(file).read_bytes())
        return PrintListing(
            Path(os.path.normpath(Path(file).absolute().parent / values["folder"])),
            {(one, face): key for one, keys in values["faces"].items()
             for face, key in keys.items()},
            tuple(values["not simulated"]),
            values["slicer"],
        )  # fmt: skip
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise SurfaceError(
            "the listing of the prints is not there or cannot be read",
            fix="let all machines share the folder of the run, go on with --resume",
            place=file,
        ) from error


def printed_scene(listing: str, database: str, object_name: str, face: str) -> Scene:
    """Return a face as it was printed.

    Raises `SurfaceError` if the listing or the database cannot be read, or this face was not
    printed; `PrintError` if the print is not where the listing says.
    """
    prints = read_listing(listing)
    key = prints.keys.get((object_name, face))
    if key is None:
        raise SurfaceError(
            f"{face} of '{object_name}' was not printed",
            fix="faces that lean, look down on the bed or are round are not simulated",
            place=listing,
        )
    held = registered_object(database, object_name)
    surface = read_surface(surface_path(prints.folder, key))
    return face_scene(held, face_of(held, face), surface, f"{object_name}/{face}, printed")
