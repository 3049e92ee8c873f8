"""From settings to a resolved object: defaults by profile, and what settings mean together.

ObjectSettings + Tree -> ObjectSpec for each copy, or every problem with its place.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from encoded_objects.base.document import DocumentError, Problem
from encoded_objects.base.sensor_type import SENSOR_FILES, USUAL_SENSOR, SensorType
from encoded_objects.base.yaml_tree import Tree
from generator.alphabet.known import ALPHABETS, Alphabet
from generator.alphabet.outline import SymbolStyle
from generator.alphabet.printable import check_printable
from generator.array.definition import array_from
from generator.array.profiles import PROFILES
from generator.errors import AlphabetError, ArrayError
from generator.printers import Printer, printer_named
from generator.spec.encoding import Encoding
from generator.spec.located import mark_of
from generator.spec.printer import resolved_printer
from generator.spec.problem import SpecError
from generator.spec.profile import (
    AUTO,
    DATABASE,
    DRAFTS_RAD,
    EXPLICIT,
    FORMATS,
    GAP_MM,
    HEIGHT_MM,
    SMALLEST,
    WALL_MM,
    SymbolDefaults,
    auto_defaults,
    defaults_of_order,
    defaults_of_profile,
)
from generator.spec.resolve_shape import Refuse, resolved_shape
from generator.spec.resolved import ObjectSpec, ShapeSpec
from generator.spec.settings import NamedSettings, ObjectSettings

WALL_STROKES = 2  # least wall, in narrowest strokes of the printer


def resolve(
    settings: NamedSettings, tree: Tree, solid: ShapeSpec | None = None
) -> tuple[ObjectSpec, ...]:
    """Return the object, or its copies, with all settings resolved.

    Parameters
    ----------
    settings
        One object as it was read.
    tree
        Where its settings stand.
    solid
        Its shape, where the settings hold none.

    Returns
    -------
    tuple of ObjectSpec
        One, or `copies` of them called NAME-1, NAME-2, ...

    Raises
    ------
    SpecError
        With every setting that does not go with the others.
    """
    problems: list[Problem] = []

    def refuse(path: str, cause: str, fix: str) -> None:
        problems.append(Problem(cause, fix, mark_of(tree, path)))

    shape = solid
    if isinstance(settings, ObjectSettings):
        shape = resolved_shape(settings.shape, tree, refuse)
    sensor = _sensor(settings, tree, problems)
    encoding, order = _array(settings, refuse)
    if settings.encoding is None and _profile(settings) == AUTO:
        defaults = auto_defaults(sensor.symbol_pitch_mm)
    elif settings.encoding is None or order is None:
        defaults = defaults_of_profile(_array_profile(settings))
    else:
        defaults = defaults_of_order(order)
    printer = _printer(settings, defaults, tree, problems)
    style = _style(settings, defaults, printer)
    alphabet = ALPHABETS[settings.symbols.alphabet or defaults.alphabet]
    if order is not None and alphabet.order < order:
        _refuse_order(alphabet, order, refuse)
    elif order is not None:
        found = _printable(alphabet, style, printer, settings.symbols.draft is None)
        if isinstance(found, AlphabetError) and settings.symbols.pitch is None:
            found = _coarser(settings, defaults, alphabet, printer) or found
        if isinstance(found, AlphabetError):
            _refuse_style(found, refuse)
        else:
            style = found
    wall = settings.print.wall or printer.printed_mm(WALL_MM)
    thinnest = WALL_STROKES * printer.stroke_min_mm
    if wall < thinnest:
        refuse(
            "print.wall",
            f"a wall of {wall:g} mm is thinner than {printer.name} prints solid",
            f"set wall to {thinnest:g} mm or more",
        )
    gap = settings.print.gap or GAP_MM
    if gap > wall:
        refuse(
            "print.gap",
            f"a gap of {gap:g} mm is wider than the wall of {wall:g} mm",
            f"set gap to {GAP_MM:g} mm, or more for much glue",
        )
    if problems or shape is None:
        raise SpecError(problems)
    spec = ObjectSpec(
        name=settings.name,
        shape=shape,
        profile=EXPLICIT if settings.encoding else _profile(settings),
        encoding=encoding,
        alphabet=alphabet.name,
        style=style,
        layout=settings.layout,
        parts=settings.print.parts,
        wall_mm=wall,
        gap_mm=gap,
        printer=printer,
        colours=settings.print.colours,
        formats=tuple(dict.fromkeys(settings.output.formats or FORMATS)),
        folder=Path(settings.output.folder or f"out/{folder_name(settings.name)}"),
        database=settings.output.database or DATABASE,
        lab_key=settings.output.lab_key or "",
        density_kg_m3=settings.robot.density or printer.density_kg_m3,
        collision=settings.robot.collision,
        sensor=sensor,
    )
    if settings.copies == 1:
        return (spec,)
    return tuple(replace(spec, name=f"{spec.name}-{k + 1}") for k in range(settings.copies))


def folder_name(name: str) -> str:
    """Return the folder of an object's files: names that give the same one are told apart badly."""
    return re.sub(r"[\s-]+", "-", name.lower())


def _sensor(settings: NamedSettings, tree: Tree, problems: list[Problem]) -> SensorType:
    """Return what will touch the object; problems with its type are added."""
    name = settings.sensor_type
    if name is None:
        return USUAL_SENSOR
    from encoded_objects.base.sensor_type_file import sensor_type_named  # costs start-up

    file = Path(name).suffix in SENSOR_FILES
    try:
        return sensor_type_named(str(tree.folder / name) if file else name)
    except DocumentError as error:
        mark = mark_of(tree, "sensor_type")
        problems += [
            replace(problem, mark=mark, file="") if problem.mark is None else problem
            for problem in error.problems
        ]
        return USUAL_SENSOR


def _printer(
    settings: NamedSettings, defaults: SymbolDefaults, tree: Tree, problems: list[Problem]
) -> Printer:
    """Return what prints; problems of its file are added."""
    if settings.print.printer is not None:
        try:
            return resolved_printer(settings.print.printer, tree)
        except SpecError as error:
            problems += error.problems
    return printer_named(defaults.printer)


def _whole_layers_mm(height_mm: float, printer: Printer) -> float:
    """Return the height of whole layers nearest to a height, and no less than the printer's."""
    layers = max(round(height_mm / printer.layer_mm), 1)
    while layers * printer.layer_mm < printer.height_min_mm - 1e-9:
        layers += 1
    return round(layers * printer.layer_mm, 6)


def _coarser(
    settings: NamedSettings, defaults: SymbolDefaults, alphabet: Alphabet, printer: Printer
) -> SymbolStyle | None:
    """Return the finest style that prints of those which the defaults allow beside their own."""
    for pitch in defaults.coarser_mm:
        style = _style(settings, replace(defaults, pitch_mm=pitch), printer)
        found = _printable(alphabet, style, printer, settings.symbols.draft is None)
        if isinstance(found, SymbolStyle):
            return found
    return None


def _style(settings: NamedSettings, defaults: SymbolDefaults, printer: Printer) -> SymbolStyle:
    """Return how symbols are embossed; the stroke follows the pitch and the alphabet."""
    symbols = settings.symbols
    pitch = symbols.pitch or defaults.pitch_mm
    ratio = ALPHABETS[symbols.alphabet or defaults.alphabet].stroke_ratio
    return SymbolStyle(
        pitch_mm=pitch,
        height_mm=symbols.height or _whole_layers_mm(HEIGHT_MM, printer),
        stroke_mm=symbols.stroke or round(ratio * pitch, 2),
        draft_rad=DRAFTS_RAD[0] if symbols.draft is None else symbols.draft,
        chamfer_mm=symbols.chamfer or 0.0,
    )


def _printable(
    alphabet: Alphabet, style: SymbolStyle, printer: Printer, steeper: bool
) -> SymbolStyle | AlphabetError:
    """Return the style, with less draft where `steeper` allows it and strokes need the room.

    The error is that of the steepest sides, where no style prints.
    """
    trials = [replace(style, draft_rad=draft) for draft in DRAFTS_RAD] if steeper else [style]
    refused = None
    for trial in trials:
        try:
            check_printable(alphabet, trial, printer)
            return trial
        except AlphabetError as error:
            refused = error
    assert refused is not None
    return refused


def _refuse_style(error: AlphabetError, refuse: Refuse) -> None:
    """Point at the number that the message starts with, or at what is written of the others."""
    names = ("stroke", "pitch", "height", "draft", "chamfer")
    first = [name for name in names if re.match(rf"(a )?{name}\b", error.cause)]
    written = [f"symbols.{name}" for name in (*first, *names)]
    rest = ["symbols.alphabet", "print.printer", "symbols", "profile", "encoding", "shape"]
    refuse(", ".join(written + rest), error.cause, error.fix)


def _refuse_order(alphabet: Alphabet, order: int, refuse: Refuse) -> None:
    """Refuse an alphabet with too few symbols."""
    enough = [name for name, other in ALPHABETS.items() if other.order >= order]
    most = max(other.order for other in ALPHABETS.values())
    fix = f"set alphabet to {' or '.join(enough)}" if enough else f"take an order of {most} or less"
    cause = f"the array has {order} symbols, but the alphabet {alphabet.name} has {alphabet.order}"
    refuse("symbols.alphabet, encoding, profile", cause, fix)


def _profile(settings: NamedSettings) -> str:
    """Return the profile of a spec that writes no encoding."""
    return settings.profile or AUTO


def _array_profile(settings: NamedSettings) -> str:
    """Return the profile whose array is taken as long as none is chosen for `auto`."""
    return SMALLEST if _profile(settings) == AUTO else _profile(settings)


def _array(settings: NamedSettings, refuse: Refuse) -> tuple[dict[str, Any], int | None]:
    """Return the complete definition of the array, and its number of symbols."""
    if settings.encoding is None:
        return _profile_definition(_array_profile(settings))
    if settings.profile is not None:
        refuse(
            "encoding",
            f"the array is given twice: profile {settings.profile} and encoding",
            "leave one of them out",
        )
    try:
        array = array_from(settings.encoding.model_dump(exclude_none=True))
    except ArrayError as error:
        mentioned = [key for key in Encoding.model_fields if re.search(rf"\b{key}\b", error.cause)]
        if error.cause.startswith("'"):
            mentioned = ["polynomial", *mentioned]
        paths = [f"encoding.{key}" for key in mentioned]
        refuse(", ".join([*paths, "encoding"]), error.cause, error.fix)
        return {}, None
    return array.definition(), array.order


@cache
def _profile_definition(name: str) -> tuple[dict[str, Any], int]:
    array = PROFILES[name].array()
    return array.definition(), array.order
