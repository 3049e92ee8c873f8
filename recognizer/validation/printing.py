"""The parts of a set, printed in simulation before they are touched. Resumable.

Work + folder -> `printed.json`: which surface is which face. The surfaces lie in
`printed/` of the run, or in a folder that runs share; what is there is not printed again.
"""

from __future__ import annotations

from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np

from generator.database.open import normal_url, part_path
from generator.database.registered import RegisteredFace, RegisteredPart
from probe.simulate.printed import (
    PROFILE,
    PartToPrint,
    PrintOptions,
    listing_of,
    part_to_print,
    read_listing,
)
from probe.simulate.registered import registered_object, registered_objects
from recognizer.validation.campaign import Campaign, Work
from recognizer.validation.errors import ValidationError, WorkersError
from recognizer.validation.files import write_text
from recognizer.validation.run import PRINTS, TouchProgress
from recognizer.validation.touch_plan import check_file, stl_part
from recognizer.validation.workers import run_pool

FOLDER = "printed"  #: of the run, for surfaces and G-code


def print_options(campaign: Campaign) -> PrintOptions:
    """Return how a campaign's set is printed."""
    return PrintOptions(campaign.print_profile or PROFILE, campaign.faults or "none", campaign.seed)


def print_set(
    work: Work, folder: Path, shared: Path | None, processes: int, progress: TouchProgress
) -> None:
    """Print what is not printed yet, and write the listing when all of it is there.

    `shared` is a folder of prints that runs share; the run's own if None.

    Raises
    ------
    PrintError
        PrusaSlicer is missing, or refuses a part.
    SetError
        A part's file is not the one that is registered.
    ValidationError
        No face of the set can be simulated.
    """
    listing = folder / PRINTS
    if listing.exists() and read_listing(str(listing)).complete():
        return
    options, prints = print_options(work.campaign), shared or folder / FOLDER
    parts = find_parts(work.database)
    left = [part for part in parts if part.left(options, prints)]
    progress.begin("printing", len(parts), len(parts) - len(left))
    if processes == 1:
        for part in left:
            part.print(options, prints)
            progress.step("parts")
    else:
        calls = [(part, options, prints) for part in left]
        try:
            for _ in run_pool(processes, PartToPrint.print, calls):
                progress.step("parts")
        except BrokenProcessPool as error:
            raise WorkersError(
                "a process that prints was lost",
                fix="see whether the memory suffices, take a smaller -j, go on with --resume",
            ) from error
    write_text(listing, listing_of(parts, options, prints, folder))
    read_listing.cache_clear()


def find_parts(database: str) -> list[PartToPrint]:
    """Return the parts of a set that bear symbols, their files checked; errors as `print_set`."""
    url = normal_url(database)
    parts: list[PartToPrint] = []
    for name in registered_objects(database):
        held = registered_object(database, name)
        bearers: dict[str, tuple[RegisteredPart, list[RegisteredFace]]] = {}
        for face in held.faces:
            if face.placement is not None:
                part = stl_part(held, face.name)
                bearers.setdefault(part.name, (part, []))[1].append(face)
        for part, faces in bearers.values():
            path = part_path(url, part.file)
            check_file(path, part)
            parts.append(part_to_print(held, part, path, faces))
    if not any(part.job.faces for part in parts):
        raise ValidationError(
            "no face of this set is simulated as printed: all lean, look down or are round",
            fix="make panels (print: {parts: panels}), or touch --surfaces files",
            place=database,
        )
    return [part for part in parts if part.job.faces or part.unseen]


def prints_as_results(folder: Path, campaign: Campaign) -> dict[str, Any]:
    """Return what was printed and how, for the results."""
    listing, options = read_listing(str(folder / PRINTS)), print_options(campaign)
    moved = np.array(listing.moved_mm())
    return {
        "profile": Path(options.profile).name,
        "faults": options.faults,
        "seed": options.seed,
        "slicer": listing.slicer,
        "faces": len(listing.keys),
        "not_simulated": list(listing.unseen),
        "place": "counted from the middle of a face's printed symbols",
        "moved_rms_mm": round(float(np.sqrt((moved**2).sum(axis=1).mean())), 4),
        "scale": "about the middle of each part's box on the bed",
    }
