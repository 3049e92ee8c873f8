"""What `encode-object` says of the objects that it made, as text and as JSON."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from encoded_objects.base import output
from generator.command.next_step import next_step
from generator.command.promise_report import face_values, promise_lines
from generator.database.open import without_password
from generator.pipeline import Encoded, MadeObject
from generator.pipeline.faces import FaceReport


def print_made(result: Encoded, *, dry_run: bool, as_json: bool) -> None:
    """Say what was made."""
    if as_json:
        output.write_json(_encoded_values(result, dry_run))
        return
    for alike in _alike(result.objects, dry_run):
        output.write(_group_text(alike, dry_run))
        for made in alike:
            for warning in made.warnings:
                output.warning(f"{made.name}: {warning}")
    share = result.used_cells / max(1, result.rows * result.columns)
    array = f"array {result.rows} x {result.columns}, {share:.0%} of its cells in use"
    if dry_run:
        output.write(f"\n{array} then; nothing was written ({result.seconds:.1f} s)")
        return
    if result.set_files:
        folder = result.set_files[0].parent
        output.write(f"set:\n  {folder}{os.sep}  {_file_list(folder, result.set_files)}")
    output.write(
        f"\n{array}; registered in {without_password(result.database)} ({result.seconds:.1f} s)"
    )
    if following := next_step(result):
        output.write(following)


def _alike(objects: Sequence[MadeObject], dry_run: bool) -> list[list[MadeObject]]:
    """Return runs of objects of which the same is to be said but for their name: copies."""
    runs: list[list[MadeObject]] = []
    said = ""
    for made in objects:
        own = _object_text(made, dry_run).replace(made.name, "")
        if runs and own == said:
            runs[-1].append(made)
        else:
            runs.append([made])
        said = own
    return runs


def _group_text(alike: Sequence[MadeObject], dry_run: bool) -> str:
    """Return a few lines on objects of which the same is to be said."""
    first, last = alike[0].name, alike[-1].name
    text = _object_text(alike[0], dry_run)
    if len(alike) == 1:
        return text
    return text.replace(f"{first}: ", f"{first} ... {last}: {len(alike)} alike, each ", 1).replace(
        f"{first}{os.sep}  ", f"{first}{os.sep} ... {last}{os.sep}  "
    )


def _object_text(made: MadeObject, dry_run: bool) -> str:
    """Return a few lines on one object."""
    verb = "made"
    if dry_run:
        verb = "would be made"
    elif made.skipped:
        verb = "registered before, its files are unchanged: nothing to do"
    elif made.reused:
        verb = "registered before, same cells"
    counts = f"{_count(made.faces, 'face')}, {_count(made.symbols, 'symbol')}"
    lines = [f"{made.name}: {verb}; {counts}, {_count(made.parts, 'part')}"]
    if made.touches > 1:
        lines.append(f"  read by a scan: about {made.touches} touches (recognize-object --scan)")
    lines += _face_lines(made.face_reports)
    lines += promise_lines(made.face_reports)
    if made.fit is not None:
        lines.append(
            f"  panels put together: {made.fit.overlap_mm3:.3f} mm3 overlap, "
            + ("none near another" if made.fit.gap_mm is None else f"gap {made.fit.gap_mm:.3f} mm")
        )
    for folder in dict.fromkeys(file.parent for file in made.files):
        lines.append(f"  {folder}{os.sep}  {_file_list(folder, made.files)}")
    return "\n".join(lines)


def _face_lines(reports: Sequence[FaceReport]) -> list[str]:
    """Return a line on each face, or one on all of which the same is to be said."""
    named: dict[str, list[str]] = {}
    for face in reports:
        if face.smallest_mm is None:
            continue
        size, least = (
            " x ".join(f"{v:.3g}" for v in each) for each in (face.size_mm, face.smallest_mm)
        )
        answered = ""
        if face.promise is not None:
            once, within = face.promise.at_once, face.promise.within_three
            later = "" if within is None else f"{within:.0%} within three, "
            answered = f"{once:.0%} answered at once, {later}"
        text = (
            f"{size} mm, {_count(face.symbols, 'symbol')}, "
            f"{answered}it could be as small as {least} mm"
        )
        named.setdefault(text, []).append(face.name)
    titles = [f"{_enumeration(names)}:" for names in named.values()]
    width = max(map(len, titles), default=0)
    return [f"  {title:{width}} {text}" for title, text in zip(titles, named, strict=True)]


def _enumeration(names: Sequence[str]) -> str:
    """Return names with commas, of many the first and the number of the others."""
    return ", ".join(names) if len(names) <= 6 else f"{names[0]} and {len(names) - 1} like it"


def _file_list(folder: Path, files: Sequence[Path]) -> str:
    """Return the files of a folder: by name, or how many where there are several of a kind."""
    kinds: dict[str, list[str]] = {}
    for file in files:
        if file.parent == folder:
            kinds.setdefault(file.suffix, []).append(file.name)
    return ", ".join(
        names[0] if len(names) == 1 else f"{len(names)} {kind.lstrip('.')} ({names[0]}, ...)"
        for kind, names in kinds.items()
    )


def _count(count: int, thing: str) -> str:
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def _encoded_values(result: Encoded, dry_run: bool) -> dict[str, Any]:
    return {
        "objects": [
            {
                "name": made.name,
                "faces": made.faces,
                "symbols": made.symbols,
                "files": [str(file) for file in made.files],
                "places": made.places,
                "touches": made.touches,
                "parts": made.parts,
                "reused": made.reused,
                "skipped": made.skipped,
                "face_reports": [face_values(face) for face in made.face_reports],
                "fit": None if made.fit is None else asdict(made.fit),
                "warnings": list(made.warnings),
            }
            for made in result.objects
        ],
        "set_files": [str(file) for file in result.set_files],
        "database": without_password(result.database),
        "array": {
            "rows": result.rows,
            "columns": result.columns,
            "used_cells": result.used_cells,
        },
        "dry_run": dry_run,
        "seconds": round(result.seconds, 3),
    }
