"""Report of the objects that `encode-object` made, as text and as JSON."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Any

from encoded_objects.base import output
from encoded_objects.base.errors import without_password
from generator.layout.recognition_rate import (
    LOW,
    NOT_READABLE,
    PartRate,
    RecognitionRate,
    percent,
)
from generator.pipeline import Encoded, MadeObject
from generator.pipeline.faces import FaceReport

NAMED_KINDS = 3  #: kinds of faces that are named one by one
BLOCKED = 0.1  #: share of places where the sensor meets another face, from which that is said


def print_made(result: Encoded, *, dry_run: bool, as_json: bool, verified: bool) -> None:
    """Say what was made, and whether its files were read back."""
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
    array += f"; registered in {without_password(result.database)}"
    proven = "; every model was read back: no fault" if verified else ""
    output.write(f"\n{array} ({result.seconds:.1f} s){proven}")
    if following := next_step(result):
        output.write(following)


def _alike(objects: Sequence[MadeObject], dry_run: bool) -> list[list[MadeObject]]:
    """Return runs of objects whose text differs in their name alone: copies."""
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
    first, last = alike[0].name, alike[-1].name
    text = _object_text(alike[0], dry_run)
    if len(alike) == 1:
        return text
    return text.replace(f"{first}: ", f"{first} ... {last}: {len(alike)} alike, each ", 1).replace(
        f"{first}{os.sep}  ", f"{first}{os.sep} ... {last}{os.sep}  "
    )


def _object_text(made: MadeObject, dry_run: bool) -> str:
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
    lines += rate_lines(made.face_reports, made.promise)
    if made.fit is not None:
        lines.append(
            f"  panels put together: {made.fit.overlap_mm3:.3f} mm3 overlap, "
            + ("none near another" if made.fit.gap_mm is None else f"gap {made.fit.gap_mm:.3f} mm")
        )
    for folder in dict.fromkeys(file.parent for file in made.files):
        lines.append(f"  {folder}{os.sep}  {_file_list(folder, made.files)}")
    return "\n".join(lines)


def _face_lines(reports: Sequence[FaceReport]) -> list[str]:
    """Return a line on each face; faces with equal text share one."""
    named: dict[str, list[str]] = {}
    for face in reports:
        if face.smallest_mm is None:
            continue
        size, least = (
            " x ".join(map(output.three_digits, each)) for each in (face.size_mm, face.smallest_mm)
        )
        answered = ""
        if face.promise is not None:
            once, within = face.promise.at_once, face.promise.within_three
            later = "" if within is None else f"{within:.0%} within three, "
            answered = f"{once:.0%} answered at once, {later}"
            if face.promise.meets:
                answered += f"{face.promise.obstacle}, "
        if face.symbols:
            count = _count(face.symbols, "symbol")
            shown = f"{count}, {answered}places can be told down to {least} mm"
        elif math.isfinite(face.smallest_mm[0]):
            shown = f"blank: places could be told from {least} mm"
        else:
            shown = "blank"
        text = f"{size} mm, {shown}"
        named.setdefault(text, []).append(face.name)
    titles = [f"{output.some_of(names)}:" for names in named.values()]
    width = max(map(len, titles), default=0)
    return [f"  {title:{width}} {text}" for title, text in zip(titles, named, strict=True)]


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
                "surface": None if made.promise is None else made.promise.shares,
                "promise": [line.strip() for line in rate_lines(made.face_reports, made.promise)],
                "face_reports": [asdict(face) for face in made.face_reports],
                "fit": None if made.fit is None else asdict(made.fit),
                "warnings": list(made.warnings),
            }
            for made in result.objects
        ],
        "set_files": [str(file) for file in result.set_files],
        "database": without_password(result.database),
        "array": {"rows": result.rows, "columns": result.columns, "used_cells": result.used_cells},
        "dry_run": dry_run,
        "seconds": round(result.seconds, 3),
    }


def rate_lines(faces: Sequence[FaceReport], part: PartRate | None) -> list[str]:
    """Return a line on an object, and one on each kind of face that answers too little."""
    if part is None:
        return []
    rated = [(face, face.promise) for face in faces if face.promise is not None]
    lines = [f"  {part.text}"]
    alike: dict[tuple[str, ...], list[FaceReport]] = {}
    for face, promise in sorted(rated, key=lambda one: one[1].at_once):
        if promise.at_once < LOW or promise.blocked >= BLOCKED:
            key = f"{min(face.size_mm):.3g}", _why(face, promise), promise.remedy
            alike.setdefault(key, []).append(face)
    lines += [_low_text(key[1], key[2], some) for key, some in list(alike.items())[:NAMED_KINDS]]
    if rest := [face.name for some in list(alike.values())[NAMED_KINDS:] for face in some]:
        lines.append(f"  fewer of the touches on {', '.join(rest)} too")
    return lines


def _why(face: FaceReport, promise: RecognitionRate) -> str:
    """Return why a face answers few of its touches."""
    if not face.symbols:
        return "not readable: it is blank"
    if promise.one_row:
        return "not readable by single touches: one row of symbols"
    if promise.at_once < NOT_READABLE * (1 - promise.blocked):
        return "not readable by single touches"
    return promise.obstacle if promise.blocked >= BLOCKED else ""


def _low_text(why: str, remedy: str, faces: Sequence[FaceReport]) -> str:
    """Return a line on faces as narrow as the first of them."""
    promises = [face.promise for face in faces if face.promise is not None]
    shares = [promise.at_once for promise in promises]
    share = f"{_range(shares)} of touches are answered at once"
    later = [one.within_three for one in promises if one.within_three is not None]
    share += f", {_range(later)} within three" if later else ""
    names = output.some_of([face.name for face in faces[1:]])
    others = f" (and {names}, as narrow)" if names else ""
    said = why if not max(shares) else f"{why}; {share}" if why else share
    help_ = f"; would help: {remedy}" if remedy else ""
    return f"  {faces[0].name}, {faces[0].place}{others}: {said}{help_}"


def _range(shares: Sequence[float]) -> str:
    low, high = percent(min(shares)), percent(max(shares))
    return high if low == high else f"{low} to {high}"


def next_step(result: Encoded) -> str:
    """Return what to open, print and put together; empty where nothing was written."""
    if result.set_files:
        return _of_set(result)
    steps: list[str] = []
    for made in result.objects:
        steps += _of_object(made)
    return f"next: {', then '.join(steps)}" if steps else ""


def _of_set(result: Encoded) -> str:
    files = result.to_print
    sheet = _build_sheet(result.set_files)
    steps = []
    if files:
        lies = "as it lies" if len(files) == 1 else "as they lie"
        if all(made.lying is None for made in result.objects):
            lies += ", backs down, symbols up, no supports, 100 % scale"
        kinds = [list(some) for _, some in groupby(files, _is_project)]
        where = " and ".join(
            f"{' ... '.join(dict.fromkeys((some[0].name, some[-1].name)))} in {some[0].parent} "
            f"({_opened_by(some[0])})"
            for some in kinds
        )
        steps.append(f"print {where} {lies}")
    if sheet:
        steps.append(f"put the objects together by {sheet}")
    elif not steps:
        return ""
    whole = [made for made in result.objects if made.lying is not None]
    if whole:
        steps.append("; ".join(f"{made.name}: {made.lying}" for made in whole))
    return "next: " + ", then ".join(steps)


def _build_sheet(files: Sequence[Path]) -> Path | None:
    return next((file for file in files if file.name.endswith("-build.html")), None)


def _of_object(made: MadeObject) -> list[str]:
    sheet = _build_sheet(made.files)
    steps = [f"open {sheet}"] if sheet else []
    models = [f for f in made.files if f.suffix == ".3mf" and "-prusaslicer" not in f.stem]
    plates = [file for file in models if _is_project(file)] or models
    chosen = plates or [file for file in made.files if file.suffix == ".stl"][: made.parts]
    if chosen:
        name = str(chosen[0]) if len(chosen) == 1 else f"{chosen[0]} ... {chosen[-1].name}"
        name += f" ({_opened_by(chosen[0])})" if plates else ""
        lies = made.lying or "backs down, symbols up, no supports"
        steps.append(f"print {name} as it lies, {lies}, 100 % scale")
    return steps


def _is_project(file: Path) -> bool:
    return re.search(r"-bambu(-\d+)?\.3mf$", file.name) is not None


def _opened_by(plate: Path) -> str:
    if _is_project(plate):
        return "in Bambu Studio or OrcaSlicer"
    return f"in PrusaSlicer {plate.stem}-prusaslicer.3mf"
