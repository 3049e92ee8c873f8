"""What `encode-object --printed-check` says: a table of symbols, as text and as JSON."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from encoded_objects.base import output
from generator.pipeline.printed_check import PrintedObject
from generator.printed.survey import DOUBTFUL, LOST, SURVIVES, SymbolCheck

_OFF = 0.1  # share of the height from which a wrong height is reported


@dataclass(frozen=True, slots=True)
class _Row:
    face: str
    symbol: str
    checks: tuple[SymbolCheck, ...]

    def mean(self, name: str) -> float:
        return float(np.mean([getattr(check, name) for check in self.checks]))

    @property
    def worst(self) -> SymbolCheck:
        return min(self.checks, key=lambda check: check.overlap)

    @property
    def verdicts(self) -> dict[str, int]:
        counts = Counter(check.verdict for check in self.checks)
        return {verdict: counts[verdict] for verdict in (SURVIVES, DOUBTFUL, LOST)}


def print_printed(objects: Sequence[PrintedObject], *, as_json: bool) -> None:
    """Say what became of every symbol."""
    if as_json:
        output.write_json({"objects": [_values(one) for one in objects]})
        return
    for one in objects:
        _print_object(one)


def _print_object(one: PrintedObject) -> None:
    rows = _rows(one)
    table = output.table("face", "symbol", "of them", "overlap", "worst", "lost mm2",
                         "widened mm2", "height mm", "survive", "doubtful", "lost")  # fmt: skip
    for row in rows:
        table.add_row(
            row.face, row.symbol, str(len(row.checks)), f"{row.mean('overlap'):.3f}",
            f"{row.worst.overlap:.3f}", f"{row.mean('lost_mm2'):.2f}",
            f"{row.mean('widened_mm2'):.2f}",
            f"{row.mean('height_mm'):.2f} of {row.worst.designed_mm:.2f}",
            *(str(count or "") for count in row.verdicts.values()),
        )  # fmt: skip
    output.write(f"{one.name} on {one.check.profile}:")
    if rows:
        output.show(table)
    counts = Counter(check.verdict for row in rows for check in row.checks)
    output.write(
        f"{counts[SURVIVES]} of {output.count_of(counts.total(), 'symbol')} survive, "
        f"{counts[DOUBTFUL]} doubtful, {counts[LOST]} lost"
    )
    if note := _height_note(rows):
        output.warning(note)
    if one.check.unseen:
        output.warning(f"not judged, they lean or face the bed: {', '.join(one.check.unseen)}")
    if one.picture:
        output.write(f"picture: {one.picture}")


def _height_note(rows: Sequence[_Row]) -> str:
    """Return what to do where symbols become higher or lower than designed."""
    off = [row for row in rows if abs(row.mean("height_mm") / row.worst.designed_mm - 1) > _OFF]
    if not off:
        return ""
    worst = max(off, key=lambda row: abs(row.mean("height_mm") - row.worst.designed_mm))
    return (
        f"symbols print {worst.mean('height_mm'):.2f} mm high, {worst.worst.designed_mm:g} mm was "
        "designed; let wall and height be whole layers of this print profile"
    )


def _rows(one: PrintedObject) -> list[_Row]:
    by_face: dict[str, dict[int, list[SymbolCheck]]] = {}
    for tile in one.check.tiles:
        check = tile.check
        by_face.setdefault(check.face, {}).setdefault(check.label, []).append(check)
    return [
        _Row(face, one.symbols[label], tuple(checks))
        for face, by_label in by_face.items()
        for label, checks in sorted(by_label.items())
    ]


def _values(one: PrintedObject) -> dict[str, Any]:
    return {
        "name": one.name,
        "print_profile": one.check.profile,
        "kinds": [
            {
                "face": row.face,
                "symbol": row.symbol,
                "count": len(row.checks),
                "overlap": row.mean("overlap"),
                "worst_overlap": row.worst.overlap,
                "worst": row.worst.name,
                "area_mm2": row.worst.area_mm2,
                "lost_mm2": row.mean("lost_mm2"),
                "widened_mm2": row.mean("widened_mm2"),
                "height_mm": row.mean("height_mm"),
                "designed_mm": row.worst.designed_mm,
                **row.verdicts,
            }
            for row in _rows(one)
        ],
        "unseen_faces": list(one.check.unseen),
        "picture": str(one.picture) if one.picture else None,
    }
