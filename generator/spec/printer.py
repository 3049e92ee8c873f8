"""A printer as specs name or describe it: `printer: ender-3`, a file, or a block of its own.

The block takes what it leaves out from the printer that it is `like`; a nozzle of its own brings
the limits of that nozzle. Lengths are in mm and angles in radians after reading.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationError

from encoded_objects.base.document import did_you_mean
from encoded_objects.base.settings import Angle, Block, Length, PathText, refuse
from encoded_objects.base.yaml_tree import Tree, read_tree
from generator.errors import GeneratorError
from generator.printers import MACHINES, PRINTERS, Printer, printer_named, printer_of_nozzle
from generator.spec.name import ObjectName
from generator.spec.problem import SPEC, SpecError

SUFFIXES = (".yaml", ".yml")


def printer_block(value: Any) -> Any:
    """Return the block that a name or a file stands for."""
    if isinstance(value, str):
        return {"file": value} if value.endswith(SUFFIXES) else {"like": value}
    if not isinstance(value, dict):
        fix = "write printer: ender-3, the name of a .yaml file, or {bed: 300 x 300 mm, ...}"
        raise refuse("a printer is a name, a file or a block of settings", fix)
    return value


def known_name(value: Any) -> str:
    """Return the name of a known printer."""
    try:
        return printer_named(str(value)).name
    except GeneratorError as error:
        names = [*PRINTERS, *MACHINES]
        begun = [name for name in names if name.startswith(f"{value}-")]
        near = begun[0] if begun else did_you_mean(str(value), names)
        raise refuse(error.cause, f"did you mean '{near}'?" if near else error.fix) from None


def bed_sides(value: Any) -> Any:
    """Return both sides of a bed as a list; `300 x 300 mm` is one too."""
    parts = [part.strip() for part in value.lower().split("x")] if isinstance(value, str) else value
    if not isinstance(parts, list) or len(parts) != 2:
        raise refuse("a bed has two sides", "write bed: 250 x 210 mm")
    if isinstance(value, str) and parts[0].replace(".", "").isdecimal():
        parts[0] += parts[1].lstrip("0123456789. ")
    return parts


class PrinterSettings(Block):
    """A printer of one's own; what is left out is as of the printer that it is like."""

    like: Annotated[str, BeforeValidator(known_name)] = "fdm-0.4"
    """A known printer: encode-object printers lists them."""
    file: PathText | None = None
    """A YAML file with such a block."""
    name: ObjectName | None = None
    """What it is called in lists and messages."""
    bed: (
        Annotated[
            tuple[Length, Length],
            BeforeValidator(bed_sides, json_schema_input_type=list[Any] | str),
        ]
        | None
    ) = None
    """Usable width and depth of the bed: 250 x 210 mm."""
    nozzle: Length | None = None
    """Diameter of the nozzle; brings its limits with it."""
    layer: Length | None = None
    """Layer height."""
    stroke: Length | None = None
    """Narrowest stroke that prints at its full volume."""
    gap: Length | None = None
    """Narrowest gap between two symbols that stays open; inside a symbol, that share of it which
    the printer keeps that it is like."""
    height: Length | None = None
    """Lowest symbol that can be felt after printing."""
    edge: Length | None = None
    """Least distance from a symbol's foot to the edge of a face."""
    overhang: Angle | None = None
    """Steepest overhang, from the vertical, that needs no support."""


PrinterChoice = Annotated[
    PrinterSettings,
    BeforeValidator(printer_block, json_schema_input_type=PrinterSettings | str),
]


def resolved_printer(settings: PrinterSettings, tree: Tree) -> Printer:
    """Return the printer that settings name or describe; `tree` says where files are relative to.

    Raises
    ------
    SpecError
        For its file.
    """
    if settings.file is not None:
        from generator.spec.explain import explain_errors

        own = read_tree(tree.folder / settings.file, SPEC)
        if own.problems:
            raise SpecError(own.problems)
        try:
            return resolved_printer(PrinterSettings.model_validate(own.value), own)
        except ValidationError as error:
            raise SpecError(explain_errors(error, own, PrinterSettings)) from None
    base = printer_named(settings.like)
    own_limits: dict[str, Any] = {
        "bed_mm": settings.bed, "layer_mm": settings.layer, "stroke_min_mm": settings.stroke,
        "gap_min_mm": settings.gap, "height_min_mm": settings.height,
        "edge_min_mm": settings.edge, "overhang_max_rad": settings.overhang,
    }  # fmt: skip
    given = {name: value for name, value in own_limits.items() if value is not None}
    if settings.nozzle is not None:
        limits = printer_of_nozzle(settings.nozzle)
        base = replace(limits, name=base.name, description=base.description, bed_mm=base.bed_mm)
    if settings.gap is not None:
        given["gap_inside_mm"] = settings.gap * base.gap_inside_mm / base.gap_min_mm
    if not given and settings.nozzle is None and settings.name is None:
        return base
    name = settings.name or f"own (like {settings.like})"
    return replace(base, name=name, description=f"as the spec says, like {settings.like}", **given)
