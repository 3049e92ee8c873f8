"""What is said about a lab as a whole: its key, its arrays, how full they are and may get."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.markup import escape

from encoded_objects.base import output
from generator.database.open import without_password

if TYPE_CHECKING:
    from generator.database.lab import ArrayUse, Fullness, PitchUse


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
    """Return the same as plain values."""
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
    once = f"once in {_round_text(1 / use.chance)} touches"
    text = (
        f"{at} a touch tells about {use.symbols:.0f}, so a part that is not registered here "
        f"matches one of the {use.places:,} places by chance {once}"
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
