"""Registered objects and their lab: as text for people, as plain values for JSON."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.markup import escape

from encoded_objects.base import output
from encoded_objects.base.errors import without_password
from generator.database.read import natural_key, surfaces_of

if TYPE_CHECKING:
    from encoded_objects.base.sensor_type import SensorType
    from generator.database.lab import ArrayUse, Fullness, PitchUse
    from generator.database.part_file import PartState
    from generator.database.registered import ObjectEntry, RegisteredObject
    from generator.database.transfer import CopyReport
    from generator.layout.placement import FaceLayout, Placement
    from generator.layout.recognition_rate import PartRate, RecognitionRate


def print_list(
    entries: Sequence[ObjectEntry], fullness: Fullness, url: str, *, as_json: bool
) -> None:
    """Say which objects a database holds, and how full it is."""
    if as_json:
        values = {"objects": [_entry_values(e) for e in entries], "database": without_password(url)}
        output.write_json(values | fullness_values(fullness))
        return
    if not entries:
        output.write(
            f"no objects in {without_password(url)}; make one with: encode-object SPEC.yaml"
        )
        return
    titles = ["object", "shape", "faces", "symbols", "array", "pitch", "registered (UTC)"]
    some_retired = any(entry.retired_utc for entry in entries)
    table = output.table(*titles, *(["retired (UTC)"] if some_retired else []), broken=())
    for e in entries:
        array = f"{e.profile} {e.rows}x{e.columns}"
        counts = str(e.faces), str(e.symbols)
        row = [e.name, e.object_type, *counts, array, f"{e.pitch_mm:g} mm", _minute(e.utc)]
        table.add_row(*map(escape, row + ([_minute(e.retired_utc)] if some_retired else [])))
    output.show(table)
    output.write("\n".join(fullness_text(fullness)))


def print_object(
    held: RegisteredObject,
    files: Sequence[PartState],
    url: str,
    sensor: SensorType,
    *,
    as_json: bool,
) -> None:
    """Say all about one object, and the recognition rate of its faces for a sensor."""
    faces, part = _faces(held, sensor)
    if as_json:
        values = _object_values(held, faces, part, files)
        output.write_json(values | {"database": without_password(url)})
        return
    e, style, alphabet = held.entry, held.style, held.alphabet.get("name", "")
    lengths = f"height {style.height_mm:g}, stroke {style.stroke_mm:g}"
    lines = [
        f"{e.name}: {e.object_type}, {e.faces} faces, {e.symbols} symbols",
        f"  array        {e.profile} {e.rows}x{e.columns}, layout {held.layout.kind}",
        f"  symbols      {alphabet}, pitch {style.pitch_mm:g}, {lengths} mm",
        f"  registered   {_minute(e.utc)} UTC by version {e.tool_version}, spec {e.spec_hash[:12]}",
    ]
    if e.imported_from:
        lines.append(f"  imported     {_minute(e.imported_utc)} UTC from {e.imported_from}")
    if e.retired_utc:
        lines.append(f"  retired      {_minute(e.retired_utc)} UTC; its cells stay taken")
    lines += [f"  warning      {warning}" for warning in held.layout.warnings]
    lines += [f"  promise      {part.text}"] if part else []
    lines += [
        f"  {face.name:12} {face.promise.obstacle}"
        for face in faces
        if face.promise is not None and face.promise.meets
    ]
    output.write("\n".join(lines))
    titles = ("face", "kind", "area", "symbols", "places", "at once", "first cell")
    table = output.table(*titles, broken=())
    for face in _by_region(faces):
        on = face.layout
        first = f"({on.rows[0]}, {on.columns[0]})" if len(on.rows) else "blank"
        share = "" if face.promise is None else f"{100 * face.promise.at_once:.0f} %"
        counts = str(len(on.rows)), str(on.places), share
        row = face.name, face.kind, f"{face.area_mm2:.0f} mm2", *counts, first
        table.add_row(*map(escape, row))
    output.show(table)
    if not files:
        output.write("no files are registered")
        return
    table = output.table("part", "format", "state", "file", broken=("file",))
    for each in files:
        table.add_row(*map(escape, (each.part.name, each.part.format, each.state, str(each.path))))
    output.show(table)
    if any(each.state != "ok" for each in files):
        output.write("files that are not ok: make them again from the same spec, on the same cells")


def print_retired(entries: Sequence[ObjectEntry], done: str, url: str, *, as_json: bool) -> None:
    """Say that objects were `removed`, `restored` or `retired`."""
    if as_json:
        output.write_json(
            {done: [_entry_values(e) for e in entries], "database": without_password(url)}
        )
        return
    cells = {
        "removed": "are free again; a reader that runs now still names it: start it again",
        "restored": "were taken all the time",
        "retired": "stay taken; undo: encode-object retire --undo ",
    }
    for entry in entries:
        undo = shlex.quote(entry.name) if done == "retired" else ""
        output.write(f"{entry.name}: {done}; its {entry.symbols} cells {cells[done]}{undo}")


def warning_before(entries: Sequence[ObjectEntry]) -> str:
    """Return the warning before objects are removed."""
    lines = [
        f"{e.name}: {e.faces} faces, {e.symbols} cells, registered {_minute(e.utc)} UTC"
        for e in entries
    ]
    lines.append("Parts of them that still exist will be taken for other objects.")
    return "\n".join(lines) + "\n"


def print_export(done: CopyReport, file: Path, url: str, *, as_json: bool) -> None:
    """Say what was exported, and what the other lab does with it."""
    if as_json:
        output.write_json(
            {"exported": list(done.copied), "file": str(file), "database": without_password(url)}
        )
        return
    there = f"in the other lab, before it makes its next object: encode-object import {file.name}"
    copied = output.count_of(len(done.copied), "object")
    output.write(f"{copied} of {without_password(url)} exported to {file}; {there}")


def print_import(done: CopyReport, url: str, *, dry_run: bool, as_json: bool) -> None:
    """Say what was imported, what was there already, and what was refused."""
    if as_json:
        values = {
            "imported": list(done.copied),
            "known": list(done.known),
            "refused": [{"name": r.name, "cause": r.cause, "fix": r.fix} for r in done.refused],
        }
        output.write_json(values | {"dry_run": dry_run, "database": without_password(url)})
        return
    verb = "would be imported" if dry_run else "imported"
    copied = f"{output.count_of(len(done.copied), 'object')} {verb} into {without_password(url)}"
    output.write("\n  ".join([copied, *done.copied]))
    if done.known:
        known = output.count_of(len(done.known), "object")
        output.write(f"{known} known already, left as they are: {output.some_of(done.known)}")
    for each in done.refused:
        output.message(f"refused: '{each.name}' {each.cause}\n  fix: {each.fix}", "refused:")


@dataclass(frozen=True, slots=True)
class _Face:
    """A face as people count them: a round one is one, with the symbols of its first facet."""

    name: str
    kind: str  #: of its outline, or cylinder, cone
    area_mm2: float  #: of a round face, of all its facets
    placement: Placement | None
    layout: FaceLayout
    T_object_face: list[list[float]]  #: (4, 4), mm; of a round face, of its first facet
    promise: RecognitionRate | None = None  #: None: nothing was measured


def _faces(held: RegisteredObject, sensor: SensorType) -> tuple[list[_Face], PartRate | None]:
    """Return the faces of an object with their symbols, and the rate of all of it.

    Layouts may be in another order.
    """
    from generator.alphabet import alphabet_from
    from generator.layout.recognition_rate import face_rates, part_rate

    layouts = {layout.face: layout for layout in held.layout.faces}
    area = {face.face_id: face.area_mm2 for face in held.faces}
    surfaces = {surface.carrier: surface for surface in surfaces_of(held.spec)}
    facets = {facet for surface in surfaces.values() for facet in surface.facets[1:]}
    solid = replace(held.polyhedron, surfaces=tuple(surfaces.values()))
    array, bearing = held.array, [face for face in held.layout.faces if len(face.labels)]
    cells, letters = array.rows * array.columns, alphabet_from(held.alphabet)
    rates = face_rates(solid, bearing, array.order, cells, held.style, letters, sensor)
    names = {face.face_id: face.name for face in held.faces}
    part = part_rate(solid, bearing, {names[face]: rate for face, rate in rates.items()})
    found = []
    for face in held.faces:
        if face.face_id not in layouts or face.face_id in facets:
            continue
        surface = surfaces.get(face.face_id)
        found.append(
            _Face(
                name=face.name,
                kind=surface.kind if surface else face.face_type,
                area_mm2=sum(area[n] for n in surface.facets) if surface else face.area_mm2,
                placement=face.placement,
                layout=layouts[face.face_id],
                T_object_face=face.T_object_face.tolist(),
                promise=rates.get(face.face_id),
            )
        )
    return found, part


def _by_region(faces: Sequence[_Face]) -> list[_Face]:
    """Return faces as a person counts them: a curved region (F9, F9.2, ...) is one."""
    regions: dict[str, list[_Face]] = {}
    for face in faces:
        regions.setdefault(face.name.partition(".")[0], []).append(face)
    return [
        replace(
            some[0], name=name, kind=f"{len(some)} facets", area_mm2=sum(f.area_mm2 for f in some)
        )
        if len(some) > 1
        else some[0]
        for name, some in sorted(regions.items(), key=lambda one: natural_key(one[0]))
    ]


def _entry_values(entry: ObjectEntry) -> dict[str, Any]:
    return {
        "name": entry.name,
        "shape": entry.object_type,
        "faces": entry.faces,
        "symbols": entry.symbols,
        "profile": entry.profile,
        "array": {"rows": entry.rows, "columns": entry.columns},
        "pitch_mm": entry.pitch_mm,
        "spec_hash": entry.spec_hash,
        "tool_version": entry.tool_version,
        "utc": entry.utc,
        "retired_utc": entry.retired_utc or None,
    }


def _object_values(
    held: RegisteredObject,
    faces: Sequence[_Face],
    part: PartRate | None,
    files: Sequence[PartState],
) -> dict[str, Any]:
    entry = held.entry
    return _entry_values(entry) | {
        "surface": part.shares if part else None,
        "faces": [_face_values(face) for face in faces],
        "layout": held.layout.kind,
        "warnings": list(held.layout.warnings),
        "files": [
            {
                "part": each.part.name,
                "format": each.part.format,
                "file": str(each.path),
                "sha256": each.part.sha256,
                "state": each.state,
                "T_object_part": each.part.T_object_part.tolist(),
            }
            for each in files
        ],
        "provenance": {
            "tool_version": entry.tool_version,
            "spec_hash": entry.spec_hash,
            "utc": entry.utc,
            "spec": held.spec,
            "imported_from": entry.imported_from or None,
            "imported_utc": entry.imported_utc or None,
        },
    }


def _face_values(face: _Face) -> dict[str, Any]:
    """Return a face as plain values; each cell is row, column, label."""
    place, on = face.placement, face.layout
    cells = zip(on.rows.tolist(), on.columns.tolist(), on.labels.tolist(), strict=True)
    return {
        "name": face.name,
        "type": face.kind,
        "area_mm2": face.area_mm2,
        "T_object_face": face.T_object_face,
        "symbols": len(on.labels),
        "places": on.places,
        "promise": asdict(face.promise) if face.promise else None,
        "placement": None
        if place is None
        else {
            "row": place.row,
            "column": place.column,
            "rotation_deg": math.degrees(place.rotation_rad),
            "x_mm": place.x_mm,
            "y_mm": place.y_mm,
        },
        "cells": [list(cell) for cell in cells],
    }


def _minute(utc: str) -> str:
    return utc[:16].replace("T", " ")


def print_lab(fullness: Fullness, url: str, *, as_json: bool) -> None:
    """Say which key a lab has, and which arrays."""
    shown, key = without_password(url), fullness.lab_key
    if as_json:
        output.write_json({"lab_key": key or None, "database": shown} | fullness_values(fullness))
        return
    none = "no lab key: it was made before there were any, on the published arrays"
    output.write(f"{shown}: {f'lab key {key}' if key else none}")
    if fullness.arrays:
        table = output.table("array", "objects", "cells taken", "made from", broken=())
        for use in fullness.arrays:
            table.add_row(*map(escape, _array_row(use, key)))
        output.show(table)
    output.write("\n".join(fullness_text(fullness)))


def fullness_text(fullness: Fullness) -> list[str]:
    """Return lines on how full arrays are, and what to do before they are too full."""
    lines = [_room_text(use) for use in fullness.arrays if use.own]
    return lines + [_chance_text(use) for use in fullness.pitches]


def fullness_values(fullness: Fullness) -> dict[str, Any]:
    """Return how full arrays are as plain values."""
    return {
        "arrays": [
            {
                "profile": use.array.profile,
                "rows": use.array.rows,
                "columns": use.array.columns,
                "lab_key": use.array.lab_key or None,
                "own": use.own,
                "objects": use.objects,
                "taken": use.taken,
                "room": use.room,
            }
            for use in fullness.arrays
        ],
        "pitches": [
            {
                "pitch_mm": use.pitch_mm,
                "symbols": use.order,
                "places": use.places,
                "symbols_a_touch": round(use.symbols, 1),
                "touches": use.touches,
                "chance": use.chance,
                "most_places": use.most_places,
            }
            for use in fullness.pitches
        ],
        "advice": fullness_text(fullness),
    }


def _array_row(use: ArrayUse, key: str) -> list[str]:
    array = use.array
    origin = f"key {array.lab_key}" if array.lab_key else "published"
    return [
        f"{array.profile} {array.rows}x{array.columns}",
        str(use.objects),
        f"{use.taken} of {array.rows * array.columns}",
        "this lab's key" if array.lab_key and array.lab_key == key else origin,
    ]


def _room_text(use: ArrayUse) -> str:
    array = use.array
    size = f"{array.profile} {array.rows}x{array.columns}"
    share = f"{use.taken / (array.rows * array.columns):.0%} full"
    if use.room:
        return f"{size}: {share}, room for about {use.room:,} symbols more"
    return f"{size}: {share}; make what comes with profile large, or auto, which takes a larger one"


def _chance_text(use: PitchUse) -> str:
    at = f"{use.pitch_mm:g} mm pitch, {use.order} symbols:"
    if use.touches > 1:
        return f"{at} read by a scan of about {use.touches} touches"
    once = f"once in {_round_text(1 / use.chance)} touches" if use.chance else "never"
    text = (
        f"{at} a touch shows about {use.symbols:.0f} symbols, so a part that is not registered "
        f"here matches one of the {use.places:,} places by chance {once}"
    )
    if use.places <= use.most_places:
        return f"{text}; single touches are enough up to {_round_text(use.most_places)} places"
    return (
        f"{text}, oftener than single touches may from {use.most_places:,} places on; make what "
        "comes at a finer pitch (profile fine, or symbols: {pitch: 5 mm}), or read two touches "
        "together (--scan). A larger array does not help here"
    )


def _round_text(number: float) -> str:
    """Return a number as people say it: two digits, the large ones as powers of ten."""
    if number >= 1e7:
        return f"{number:.1e}".replace("e+0", "e").replace("e+", "e")
    return f"{float(f'{number:.2g}'):,.0f}"
