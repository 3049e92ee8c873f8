"""What `validate-set` says besides a result: comparisons, worlds and single touches."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from encoded_objects.base import output


def comparison(found: dict[str, Any], page: Path | None, *, as_json: bool) -> None:
    """Say what became of what."""
    if as_json:
        output.write_json(found)
        return
    wide = max(len(line["name"]) for line in found["lines"])
    output.write(f"{'':{wide}}  {'A':>12}  {'B':>12}")
    for line in found["lines"]:
        a, b = (("-" if v is None else f"{v:.6g}") for v in (line["a"], line["b"]))
        output.write(f"{line['name']:{wide}}  {a:>12}  {b:>12}  {line['word']}")
    next_step(page)


def worlds(found: dict[str, Any], page: Path | None, *, as_json: bool) -> None:
    """Say what became of the touches of every world."""
    if as_json:
        output.write_json(found)
        return
    names = [f"{w['run']}: {w['engine']}, {w['surface']}, {w['sensor']}" for w in found["worlds"]]
    wide = max(map(len, names), default=0)
    heads = ("touches", "right", "wrong", "refused", "mm rms", "deg rms", "inside")
    output.write(f"{'':{wide}}" + "".join(f"{head:>9}" for head in heads))
    for name, line in zip(names, found["worlds"], strict=True):
        counts = (line["touches"], line["right"], line["wrong"], line["rejected"])
        sizes = (
            ("-" if line[key] is None else f"{line[key]:.3f}") for key in ("rms_mm", "rms_deg")
        )
        inside = line["inside_95"]["share"]
        cells = [f"{n:,}" for n in counts] + [*sizes, "-" if inside is None else f"{inside:.1%}"]
        output.write(f"{name:{wide}}" + "".join(f"{cell:>9}" for cell in cells))
    next_step(page)


def repetition(row: dict[str, Any], plot: Path | None, *, as_json: bool) -> None:
    """Say what became of one touch."""
    if as_json:
        output.write_json(row)
        return
    output.pairs({name: "-" if value is None else str(value) for name, value in row.items()})
    next_step(plot)


def next_step(page: Path | None) -> None:
    """Say what to look at now, if there is anything."""
    if page:
        output.write(f"next: open {page}")
