"""From settings to a resolved object: defaults by profile, and what settings mean together.

Array, alphabet and pitch of a profile stand in `generator.array.profiles`; here is what
embossing adds to them. Thesis 5.2, 5.5, 6.2.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from encoded_objects.base.document import DocumentError, Problem
from encoded_objects.base.foreign import open_regular
from encoded_objects.base.sensor_type import SENSOR_FILES, USUAL_SENSOR, SensorType
from encoded_objects.base.yaml_tree import Tree, read_tree
from generator.alphabet.known import ALPHABETS, Alphabet, alphabet_from
from generator.alphabet.outline import SymbolStyle
from generator.alphabet.printable import check_printable, is_printable, printing_fault
from generator.array.definition import array_from
from generator.array.profiles import PROFILES, SMALLEST, smallest_profile
from generator.errors import AlphabetError, ArrayError
from generator.polyhedron.mount import Mount, least_thickness_mm
from generator.polyhedron.shapes import FRAME_STEP_MM, TAG_MM
from generator.printers import Printer, printer_named, printer_of_nozzle
from generator.spec.explain import explain_errors
from generator.spec.problem import SPEC, SpecError, mark_of, spec_error
from generator.spec.resolved import AUTO, EXPLICIT, GAP_MM, ObjectSpec, ShapeSpec
from generator.spec.settings import (
    AlphabetSettings,
    Encoding,
    MountSettings,
    NamedSettings,
    ObjectSettings,
    PrinterSettings,
)
from generator.spec.shape import EXAMPLES, KINDS, Shape

HEIGHT_MM = 1.0  # of symbols: a multiple of common layer heights
DRAFTS_RAD = (0.174532925199, 0.130899693900, 0.087266462600, 0.043633231300)
"""10 degrees, and 7.5, 5, 2.5 where strokes leave no room for the ones before."""
WALL_MM = 3.0
WALL_STROKES = 2  # least wall, in narrowest strokes of the printer
FORMATS = ("step", "stl", "3mf")
DATABASE = "sqlite:///lab.db"
PRINTER = "fdm-0.4"
MOUNTS = ("flange", "screws", "magnets", "rod", "hole")
COARSER_MM = (3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 7.0, 8.0, 10.0, 12.0)
"""`auto` takes the pitch that the sensor type proposes, for `fsr-16` the 5 mm that touches are read
best at, on nozzles of 0.4 and 0.6 mm and CAD surfaces alike (docs/pitches.md); and the first of
these beyond it that prints, where a spec or a printer asks for more room."""


@dataclass(frozen=True, slots=True)
class SymbolDefaults:
    """Symbols and printer where a spec does not name them."""

    alphabet: str
    pitch_mm: float
    printer: str
    coarser_mm: tuple[float, ...] = ()  #: pitches for symbols that need more room, rising


_OF_ORDER = {
    2: SymbolDefaults("thesis-2", 12.0, PRINTER),
    4: SymbolDefaults("dense-4", 7.0, PRINTER),
    8: SymbolDefaults("dense-8", 8.0, PRINTER),
    16: SymbolDefaults("tactel-16", 8.0, PRINTER),
}


def resolve(
    settings: NamedSettings, tree: Tree, solid: ShapeSpec | None = None
) -> tuple[ObjectSpec, ...]:
    """Return the object, or its copies NAME-1, NAME-2, ..., with all settings resolved.

    Parameters
    ----------
    settings
        One object as it was read.
    tree
        Where its settings stand.
    solid
        Its shape, where the settings hold none.

    Raises
    ------
    SpecError
        With every setting that does not go with the others.
    """
    problems: list[Problem] = []
    shape, mount, named, style = solid, None, None, None
    encoding: dict[str, Any] = {}
    order: int | None = None  # of an array that cannot be made
    if isinstance(settings, ObjectSettings):
        with _collected(problems):
            shape = _shape(settings.shape, tree)
    if settings.mount is not None:
        with _collected(problems):
            mount = _mount(settings.mount, tree)
    sensor = _sensor(settings, tree, problems)
    if settings.symbols.alphabet is not None:
        with _collected(problems):
            named = _described_alphabet(settings.symbols.alphabet, tree)
    profile = _array_profile(settings, sensor, named)
    with _collected(problems):
        encoding, order = _array(settings, profile, tree, problems)
    defaults = _defaults(settings, profile, order, sensor)
    printer = printer_named(defaults.printer)
    if settings.print.printer is not None:
        with _collected(problems):
            printer = _described_printer(settings.print.printer, tree)
    alphabet = named or ALPHABETS[defaults.alphabet]

    def refuse(path: str, cause: str, fix: str) -> None:
        problems.append(Problem(cause, fix, mark_of(tree, path)))

    if 0 < printer.nozzle_mm < printer.layer_mm:
        refuse(
            "print.printer.layer, print.printer",
            f"layers of {printer.layer_mm:g} mm do not leave a nozzle of {printer.nozzle_mm:g} mm",
            f"set layer to {0.75 * printer.nozzle_mm:g} mm or less",
        )
    coarser = ""
    if order is not None:
        with _collected(problems):
            _check_order(alphabet, order, tree)
            style, coarser = _printable_style(settings, defaults, alphabet, printer, tree)
    thinnest = WALL_STROKES * printer.stroke_min_mm
    whole_mm = thinnest + 0.4999 * printer.layer_mm  # the next whole layer
    wall = settings.print.wall or printer.printed_mm(max(WALL_MM, whole_mm))
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
    if problems or shape is None or style is None:
        raise SpecError(problems)
    if shape.kind == "tag" and "thickness" not in shape.parameters:
        least = least_thickness_mm(mount)
        if least and shape.parameters.get("frame"):  # which is lower than what carries symbols
            least += FRAME_STEP_MM
        thickness = printer.printed_mm(max(TAG_MM, least + printer.layer_mm / 2))
        shape = replace(shape, parameters={**shape.parameters, "thickness": thickness})
    usual_formats = (*FORMATS, "bambu") if printer.model else FORMATS
    spec = ObjectSpec(
        name=settings.name,
        shape=shape,
        profile=EXPLICIT if settings.encoding else settings.profile or AUTO,
        encoding=encoding,
        alphabet=alphabet,
        style=style,
        layout=settings.layout,
        parts=settings.print.parts,
        wall_mm=wall,
        gap_mm=gap,
        printer=printer,
        mount=mount,
        down=settings.print.down or "",
        blank=tuple(settings.print.blank or ()),
        colours=settings.print.colours,
        formats=tuple(dict.fromkeys(settings.output.formats or usual_formats)),
        folder=Path(settings.output.folder or f"out/{folder_name(settings.name)}"),
        database=settings.output.database or DATABASE,
        lab_key=settings.output.lab_key or "",
        density_kg_m3=settings.robot.density or printer.density_kg_m3,
        collision=settings.robot.collision,
        sensor=sensor,
        source=tree,
        coarser=coarser,
    )
    if settings.copies == 1:
        return (spec,)
    return tuple(replace(spec, name=f"{spec.name}-{k + 1}") for k in range(settings.copies))


def folder_name(name: str) -> str:
    """Return the folder of an object's files: names with one folder are too alike."""
    return re.sub(r"[\s-]+", "-", name.lower())


def _defaults(
    settings: NamedSettings, profile: str, order: int | None, sensor: SensorType
) -> SymbolDefaults:
    """Return the profile's defaults, or those of the smallest alphabet for an explicit array."""
    alphabet = PROFILES[profile].alphabet
    if settings.encoding is None and settings.profile in (None, AUTO):
        pitch = sensor.symbol_pitch_mm
        coarser = tuple(more for more in COARSER_MM if more > pitch)
        return SymbolDefaults(alphabet, pitch, PRINTER, coarser)
    if settings.encoding is None or order is None:
        printer = "resin" if profile == "fine" else PRINTER  # `fine` is meant for resin
        return SymbolDefaults(alphabet, PROFILES[profile].pitch_mm, printer)
    return _OF_ORDER[next((enough for enough in _OF_ORDER if enough >= order), max(_OF_ORDER))]


def _sensor(settings: NamedSettings, tree: Tree, problems: list[Problem]) -> SensorType:
    """Return the sensor that will touch the object; add problems with its type."""
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


@contextmanager
def _collected(problems: list[Problem]) -> Iterator[None]:
    """Add the problems of a block, so that those of others are found as well."""
    try:
        yield
    except SpecError as error:
        problems += error.problems


def _described_alphabet(given: AlphabetSettings, tree: Tree) -> Alphabet:
    """Return the alphabet that settings name or describe; raises `SpecError`."""
    settings, tree = _from_file(given, tree)
    block = "symbols.alphabet" if given.file is None else ""
    name = settings.name or "own"
    known = ALPHABETS.get(name)
    if known is not None and settings.model_fields_set == {"name"}:
        return known
    if settings.glyphs is None:
        fix = f"add glyphs: [[[[-1, 1], [-1, -1], [1, -1]]], ...], or take {', '.join(ALPHABETS)}"
        raise spec_error(tree, block, f"no glyphs are given for alphabet {name}", fix)
    glyphs = [
        {"name": str(number), "strokes": [pair for line in lines for pair in pairwise(line)]}
        for number, lines in enumerate(settings.glyphs)
    ]
    definition = settings.model_dump(include={"reach", "stroke_ratio"})
    try:
        own = alphabet_from({"name": name, "glyphs": glyphs, **definition})
    except AlphabetError as error:
        key = "reach" if error.cause.startswith("reach") else "glyphs"
        symbols = re.findall(r"symbol '(\d+)'", error.cause)
        path = ".".join(filter(None, (block, key, *symbols[-1:])))
        raise spec_error(tree, path, error.cause, error.fix) from None
    if known is None:
        return own
    numbered = tuple(replace(glyph, name=str(k)) for k, glyph in enumerate(known.glyphs))
    if own != replace(known, glyphs=numbered):
        cause = f"alphabet {name} ships with other glyphs, reach or stroke ratio"
        path = f"{block}.name" if block else "name"
        raise spec_error(tree, path, cause, "give it a name of its own")
    return known


_Block = TypeVar("_Block", PrinterSettings, AlphabetSettings)


def _from_file(settings: _Block, tree: Tree) -> tuple[_Block, Tree]:
    """Return the block that stands in a file, and its places there; raises `SpecError`."""
    if settings.file is None:
        return settings, tree
    own = read_tree(tree.folder / settings.file, SPEC)
    if own.problems:
        raise SpecError(own.problems)
    try:
        block = type(settings).model_validate(own.value)
    except ValidationError as error:
        raise SpecError(explain_errors(error, own, type(settings))) from None
    if block.file is not None:  # it may name itself
        cause = f"this file names another one, '{block.file}'"
        raise spec_error(own, "file", cause, "write the settings here")
    return block, own


def _described_printer(settings: PrinterSettings, tree: Tree) -> Printer:
    """Return the printer that settings name or describe; raises `SpecError` for its file."""
    settings, _ = _from_file(settings, tree)
    base = printer_named(settings.like)
    own_limits: dict[str, Any] = {
        "bed_mm": settings.bed, "layer_mm": settings.layer, "stroke_min_mm": settings.stroke,
        "gap_min_mm": settings.gap, "height_min_mm": settings.height,
        "edge_min_mm": settings.edge, "overhang_max_rad": settings.overhang,
    }  # fmt: skip
    given = {name: value for name, value in own_limits.items() if value is not None}
    if settings.nozzle is not None:
        limits = printer_of_nozzle(settings.nozzle)
        base = replace(
            limits, name=base.name, description=base.description, bed_mm=base.bed_mm,
            model=base.model, blocked_mm=base.blocked_mm,
        )  # fmt: skip
    if settings.bed not in (None, base.bed_mm):
        given |= {"model": "", "blocked_mm": (0.0, 0.0)}  # a machine of its own
    if settings.gap is not None:
        given["gap_inside_mm"] = settings.gap * base.gap_inside_mm / base.gap_min_mm
    if not given and settings.nozzle is None and settings.name is None:
        return base
    name = settings.name or f"own (like {settings.like})"
    return replace(base, name=name, description=f"as the spec says, like {settings.like}", **given)


def _whole_layers_mm(height_mm: float, printer: Printer) -> float:
    """Return the height of whole layers nearest to a height, and no less than the printer's."""
    layers = max(round(height_mm / printer.layer_mm), 1)
    while layers * printer.layer_mm < printer.height_min_mm - 1e-9:
        layers += 1
    return round(layers * printer.layer_mm, 6)


def _printable_style(
    settings: NamedSettings,
    defaults: SymbolDefaults,
    alphabet: Alphabet,
    printer: Printer,
    tree: Tree,
) -> tuple[SymbolStyle, str]:
    """Return how symbols are embossed, and why not at the usual pitch where they do not print so.

    The stroke follows the pitch and the alphabet. Where settings say neither, sides are steeper
    where strokes need the room, and then the pitch is the next one that prints. Raises `SpecError`
    where no style prints: that of the steepest sides, at the setting that the message starts with,
    or at another written one.
    """
    symbols = settings.symbols
    drafts = DRAFTS_RAD if symbols.draft is None else (symbols.draft,)
    usual = symbols.pitch or defaults.pitch_mm
    refused: SymbolStyle | None = None
    fault: AlphabetError | None = None
    for pitch in (usual,) if symbols.pitch else (usual, *defaults.coarser_mm):
        for draft in drafts:
            style = SymbolStyle(
                pitch_mm=pitch,
                height_mm=symbols.height or _whole_layers_mm(HEIGHT_MM, printer),
                stroke_mm=symbols.stroke or round(alphabet.stroke_ratio * pitch, 2),
                draft_rad=draft,
                chamfer_mm=symbols.chamfer or 0.0,
            )
            if is_printable(alphabet, style, printer):
                return style, fault.cause if fault else ""
        if refused is None:
            refused, fault = style, printing_fault(alphabet, style, printer)
    try:
        check_printable(alphabet, refused or style, printer)
    except AlphabetError as error:  # the same, with what mends it
        fault = error
    assert fault is not None
    names = ("stroke", "pitch", "height", "draft", "chamfer")
    first = [name for name in names if re.match(rf"(a )?{name}\b", fault.cause)]
    written = [f"symbols.{name}" for name in (*first, *names)]
    rest = ["symbols.alphabet", "print.printer", "symbols", "profile", "encoding", "shape"]
    raise spec_error(tree, ", ".join(written + rest), fault.cause, fault.fix)


def _check_order(alphabet: Alphabet, order: int, tree: Tree) -> None:
    """Refuse an alphabet of fewer symbols than the array has."""
    if alphabet.order >= order:
        return
    enough = [name for name, other in ALPHABETS.items() if other.order >= order]
    most = max(other.order for other in ALPHABETS.values())
    fix = f"set alphabet to {' or '.join(enough)}"
    if not enough:
        fix = f"take an order of {most} or less, or an alphabet of your own with {order} glyphs"
    elif alphabet.name not in ALPHABETS:
        fix = f"add {order - alphabet.order} glyphs, or {fix}"
    cause = f"the array has {order} symbols, but the alphabet {alphabet.name} has {alphabet.order}"
    raise spec_error(tree, "symbols.alphabet, encoding, profile", cause, fix)


def _array_profile(settings: NamedSettings, sensor: SensorType, named: Alphabet | None) -> str:
    """Return the profile whose array is taken as long as none is chosen for `auto`.

    Letters made for tactels are for a sensor type that tells them apart, and for an alphabet that
    has as many.
    """
    if settings.profile not in (None, AUTO):
        return settings.profile
    smallest = smallest_profile(sensor)
    enough = named is None or named.order >= PROFILES[smallest].encoding["order"]
    return smallest if enough else SMALLEST[-1]


def _array(
    settings: NamedSettings, profile: str, tree: Tree, problems: list[Problem]
) -> tuple[dict[str, Any], int]:
    if settings.encoding is None:
        return _profile_definition(profile)
    if settings.profile is not None:
        cause = f"the array is given twice: profile {settings.profile} and encoding"
        problems.append(Problem(cause, "leave one of them out", mark_of(tree, "encoding")))
    try:
        array = array_from(settings.encoding.model_dump(exclude_none=True))
    except ArrayError as error:
        mentioned = [key for key in Encoding.model_fields if re.search(rf"\b{key}\b", error.cause)]
        if error.cause.startswith("'"):
            mentioned = ["polynomial", *mentioned]
        paths = [f"encoding.{key}" for key in mentioned]
        raise spec_error(tree, ", ".join([*paths, "encoding"]), error.cause, error.fix) from None
    return array.definition(), array.order


@cache
def _profile_definition(name: str) -> tuple[dict[str, Any], int]:
    array = PROFILES[name].array()
    return array.definition(), array.order


def _shape(shape: Shape, tree: Tree) -> ShapeSpec:
    """Return the one shape that is given; raises `SpecError`."""
    given = [kind for kind in KINDS if getattr(shape, kind) is not None]
    if not given:
        raise spec_error(tree, "shape", "the shape has no size", f"write shape: {EXAMPLES['cube']}")
    if len(given) > 1:
        written = [key for key in tree.value["shape"] if key in given]
        cause = f"an object has one shape, not {' and '.join(written)}"
        fix = "leave one out; several objects stand in a list under objects:"
        raise spec_error(tree, f"shape.{written[1]}", cause, fix)
    kind = given[0]
    value = getattr(shape, kind)
    if shape.scale is not None and kind != "file":
        fix = "leave it out, and write the size"
        raise spec_error(tree, "shape.scale", f"a {kind} has a size, no scale", fix)
    if kind == "box":
        return ShapeSpec(kind, {"size": list(value)})
    if kind == "polyhedron":
        _check_faces(value.faces, len(value.vertices), tree)
        faces = [[list(loop) for loop in face] for face in value.faces]
        return ShapeSpec(kind, {"vertices": [list(v) for v in value.vertices], "faces": faces})
    if kind == "file":
        return _model_file(value, shape.scale or 1.0, tree)
    if isinstance(value, float):
        return ShapeSpec(kind, {"side": value})
    sizes = value.model_dump(exclude_none=True)
    if kind in ("prism", "pyramid") and ("side" in sizes) == ("radius" in sizes):
        given_sizes = "both side and radius" if "side" in sizes else "neither side nor radius"
        cause, fix = f"'{kind}' has {given_sizes}", f"write shape: {EXAMPLES[kind]}"
        raise spec_error(tree, f"shape.{kind}", cause, fix)
    return ShapeSpec(kind, sizes)


def _mount(settings: MountSettings, tree: Tree) -> Mount:
    given = [kind for kind in MOUNTS if getattr(settings, kind) is not None]
    if len(given) != 1:
        cause = f"a part is held in one way, not by {' and '.join(given) or 'none'}"
        raise spec_error(tree, "mount", cause, "write mount: {screws: M3}, or leave it out")
    return Mount(given[0], getattr(settings, given[0]), settings.face or "")


def _check_faces(faces: list[tuple[tuple[int, ...], ...]], vertices: int, tree: Tree) -> None:
    problems = []
    for number, loops in enumerate(faces):
        wrong = [vertex for loop in loops for vertex in loop if not 0 <= vertex < vertices]
        if wrong:
            cause = f"face {number} names vertex {wrong[0]}, but there are {vertices}"
            mark = mark_of(tree, f"shape.polyhedron.faces.{number}")
            problems.append(Problem(cause, f"use vertices 0 to {vertices - 1}", mark))
    if problems:
        raise SpecError(problems)


def _model_file(name: str, scale: float, tree: Tree) -> ShapeSpec:
    """Return a shape that is read from a model file; raises `SpecError` if it is not there."""
    from generator.polyhedron.read import MESHES, STEP

    path = tree.folder / name
    if path.suffix.lower() not in (*STEP, *MESHES):
        fix = f"give a file that ends in {', '.join((*STEP, *MESHES))}"
        raise spec_error(tree, "shape.file", f"'{name}' is no model that is read here", fix)
    try:
        with open_regular(path) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        cause = f"cannot read '{path}': {error.strerror}"
        raise spec_error(tree, "shape.file", cause, _similar_model(path)) from None
    scaled = {} if scale == 1.0 else {"scale": scale}  # as if it had been left out
    return ShapeSpec("file", {"sha256": digest, **scaled}, path)


def _similar_model(path: Path) -> str:
    from generator.polyhedron.read import MESHES, STEP

    try:
        models = [f.name for f in path.parent.iterdir() if f.suffix.lower() in (*STEP, *MESHES)]
    except (OSError, ValueError):
        return f"check the folder '{path.parent}'; file names are relative to the spec"
    near = get_close_matches(path.name, sorted(models), n=1, cutoff=0.5)
    return f"did you mean '{near[0]}'?" if near else "file names are relative to the spec"
