"""`encode-object init | schema | printers`: what one needs before the making."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from encoded_objects.base.options import Application, Argument, Json, Option, command

app = Application()


@command(app)
def init(
    shape: Annotated[
        str,
        Argument("cube, box, triangular_prism, tetrahedron, octahedron, dodecahedron, prism, "
                 "pyramid, cylinder, cone, tag, polyhedron or file; or a model, as part.step."),
    ] = "cube",
    file: Annotated[
        Path | None,
        Option("File to write; stdout if left out.", "FILE", names=("-o", "--output")),
    ] = None,
    force: Annotated[bool, Option("Replace a file that is there.")] = False,
    as_json: Json = False,
) -> int:  # fmt: skip
    """Write a commented spec to begin with; it can be made as it is."""
    from encoded_objects.base import output
    from generator.spec.starter import starter_named

    kind, text = starter_named(shape, file)
    if file is not None:
        _write_new(file, text, force)
    if as_json:
        output.write_json({"shape": kind, "file": str(file) if file else None, "spec": text})
    elif file is None:
        output.write(text)
    else:
        output.write(f"wrote {file}; make it with: encode-object {file}")
    return 0


@command(app)
def schema(
    as_json: Annotated[  # noqa: ARG001  the schema is JSON with or without it
        bool, Option("The schema is JSON anyway.", names=("--json",))
    ] = False,
) -> int:
    """Print the JSON schema of specs, so that an editor completes and checks them."""
    from encoded_objects.base import output
    from generator.spec.schema import spec_schema

    output.write_json(spec_schema())
    return 0


@command(app)
def printers(as_json: Json = False) -> int:
    """Print the printers that specs can name, with their limits."""
    from dataclasses import asdict

    from encoded_objects.base import output
    from generator.printers import NOZZLES_MM, known_printers

    known = known_printers()
    if as_json:
        rows = [asdict(printer) for printer in known]
        for row in rows:
            row["overhang_max_deg"] = round(math.degrees(row.pop("overhang_max_rad")), 6)
        output.write_json({"printers": rows})
        return 0
    table = output.table(
        "printer", "bed", "layer", "stroke >=", "gap >=", "height >=", "made for",
        broken=("made for",),
    )  # fmt: skip
    for one in known:
        bed = " x ".join(f"{side:g}" for side in one.bed_mm)
        limits = (one.layer_mm, one.stroke_min_mm, one.gap_min_mm, one.height_min_mm)
        table.add_row(one.name, bed, *(f"{limit:g}" for limit in limits), one.description)
    output.show(table)
    nozzles = ", ".join(f"{nozzle:g}" for nozzle in NOZZLES_MM)
    output.write(
        "lengths in mm; choose one with  print: {printer: NAME}, with another nozzle "
        f"({nozzles}) as ender-3-0.6,\nor describe your own:  "
        "print: {printer: {like: ender-3, bed: 300 x 300 mm, layer: 0.15 mm}}"
    )
    return 0


def _write_new(path: Path, text: str, force: bool) -> None:
    """Write a file whole or not at all; one that is there only with `force`."""
    from encoded_objects.base.document import Problem
    from encoded_objects.base.files import staged_file
    from generator.spec.problem import SpecError

    if path.exists() and not force:
        fix = "choose another name, or replace it with --force"
        raise SpecError([Problem("the file is there already", fix, file=str(path))])
    with staged_file(path, replace=force) as draft:
        draft.write_text(text, encoding="utf-8")
