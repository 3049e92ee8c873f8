"""`encode-object init | schema | printers`: what one needs before the making."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from encoded_objects.base import console
from encoded_objects.base.console import Action

if TYPE_CHECKING:
    from generator.printers import Printer

app = console.application()
Json = Annotated[bool, typer.Option("--json", help="One JSON object on stdout, also for errors.")]


@app.command()
def init(
    shape: Annotated[
        str, typer.Argument(help="cube, box, triangular_prism, tetrahedron, octahedron, "
                                 "dodecahedron, prism, pyramid, cylinder, cone, "
                                 "polyhedron or file."),
    ] = "cube",
    file: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", show_default=False,
                     help="File to write; stdout if left out."),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that is there.")] = False,
    as_json: Json = False,
) -> Action:  # fmt: skip
    """Write a commented spec to begin with; it can be made as it is."""

    def action() -> int:
        from encoded_objects.base import output
        from generator.spec.starter import starter_named

        kind, text = starter_named(shape, file.name if file else "")
        if file is not None:
            _write_new(file, text, force)
        if as_json:
            output.write_json({"shape": kind, "file": str(file) if file else None, "spec": text})
        elif file is None:
            output.write(text)
        else:
            output.write(f"wrote {file}; make it with: encode-object {file}")
        return 0

    return action


@app.command()
def schema(
    as_json: Annotated[  # noqa: ARG001  the schema is JSON with or without it
        bool, typer.Option("--json", help="The schema is JSON anyway.")
    ] = False,
) -> Action:
    """Print the JSON schema of specs, so that an editor completes and checks them."""

    def action() -> int:
        from encoded_objects.base import output
        from generator.spec.schema import spec_schema

        output.write_json(spec_schema())
        return 0

    return action


@app.command()
def printers(as_json: Json = False) -> Action:
    """Print the printers that specs can name, with their limits."""

    def action() -> int:
        from encoded_objects.base import output
        from generator.printers import NOZZLES_MM, known_printers

        rows = [_printer_values(printer) for printer in known_printers()]
        if as_json:
            output.write_json({"printers": rows})
            return 0
        table = output.table(
            "printer", "bed", "layer", "stroke >=", "gap >=", "height >=", "made for",
            broken=("made for",),
        )  # fmt: skip
        for row in rows:
            bed = " x ".join(f"{side:g}" for side in row["bed_mm"])
            limits = ("layer_mm", "stroke_min_mm", "gap_min_mm", "height_min_mm")
            table.add_row(
                row["name"], bed, *(f"{row[key]:g}" for key in limits), row["description"]
            )
        output.show(table)
        nozzles = ", ".join(f"{nozzle:g}" for nozzle in NOZZLES_MM)
        output.write(
            "lengths in mm; choose one with  print: {printer: NAME}, with another nozzle "
            f"({nozzles}) as ender-3-0.6,\nor describe your own:  "
            "print: {printer: {like: ender-3, bed: 300 x 300 mm, layer: 0.15 mm}}"
        )
        return 0

    return action


def _printer_values(printer: Printer) -> dict[str, Any]:
    """Return a printer's limits as plain values; angles in degrees."""
    from dataclasses import asdict

    values = asdict(printer)
    values["overhang_max_deg"] = round(math.degrees(values.pop("overhang_max_rad")), 6)
    return values


def _write_new(path: Path, text: str, force: bool) -> None:
    """Write a file whole or not at all; one that is there only with `force`."""
    from encoded_objects.base.document import Problem
    from generator.spec.problem import SpecError

    if path.exists() and not force:
        fix = "choose another name, or replace it with --force"
        raise SpecError([Problem("the file is there already", fix, file=str(path))])
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_text(text, encoding="utf-8")
        if force:
            beside.replace(path)
        else:
            os.link(beside, path)  # fails, unlike a rename, if the file has come up meanwhile
    finally:
        beside.unlink(missing_ok=True)
