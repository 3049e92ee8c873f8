"""The settings of a spec, as people write them: names, defaults and descriptions.

`ObjectSettings` reads one object, `SetSettings` a set; the JSON schema is made from both. Lengths
are in mm and angles in radians after reading. An array is named by a profile, or explicitly
(`Encoding`, Thesis 5.1 to 5.5): a sequence alone (prbs, prmvs), folded on the torus (prba, prmva),
or the product of two (prpa, prmvpa). What only the mathematics can tell (primitive, coprime, unique
windows) is checked where the array is made; the keys are those of `generator.array.definition`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema

from encoded_objects.base.document import did_you_mean, suggest
from encoded_objects.base.files import name_fault
from encoded_objects.base.settings import (
    Angle,
    Block,
    Density,
    Length,
    LengthOrZero,
    PathText,
    diameter_and_height,
    length_mm,
    may_name_files,
    refuse,
    refuse_files,
    whole_number,
)
from generator.alphabet.known import ALPHABETS
from generator.array.lab_key import read_lab_key
from generator.errors import GeneratorError, LabKeyError
from generator.export.formats import EXPORTERS
from generator.polyhedron.mount import FLANGES, SCREWS
from generator.printers import MACHINES, PRINTERS, printer_named
from generator.spec.shape import EXAMPLES, Shape

if TYPE_CHECKING:
    AlphabetName = str
    Format = str
else:  # those that are registered
    AlphabetName = Literal[tuple(ALPHABETS)]
    Format = Literal[tuple(EXPORTERS)]

SPEC_VERSION = 1
COPIES_MAX = 1000
CELLS_MAX = 2**64
ORDER_MAX = 64  # larger fields have no alphabet in sight
POLYNOMIAL_LENGTH_MAX = 1000
SCHEMES = ("sqlite", "postgresql", "postgres", "postgresql+psycopg")  #: of databases
SUFFIXES = (".yaml", ".yml")  #: of the file of a printer or an alphabet

Family = Literal["prbs", "prmvs", "prba", "prmva", "prpa", "prmvpa"]
ProfileName = Literal[
    "one-touch", "thesis", "product", "large", "fine", "tactel-8", "tactel-16", "auto"
]


def version(value: Any) -> Any:
    """Return the version of the spec format; only the present one is read."""
    if type(value) is int and value > SPEC_VERSION:
        raise refuse(
            f"version {value} is newer than this tool, which reads version {SPEC_VERSION}",
            "update encoded-objects",
        )
    if type(value) is not int or value != SPEC_VERSION:
        raise refuse("the version of a spec is a number", f"write version: {SPEC_VERSION}")
    return value


def shape_block(value: Any) -> Any:
    """Refuse a shape without its size: `cube`, or `60 mm`."""
    if isinstance(value, str) and value in EXAMPLES:
        raise refuse(f"the shape '{value}' needs its size", f"write shape: {EXAMPLES[value]}")
    if not isinstance(value, dict):
        raise refuse("a shape has a name and its size", f"write shape: {EXAMPLES['cube']}")
    if not value:
        raise refuse("the shape is empty", f"write shape: {EXAMPLES['cube']}")
    return value


def name_list(value: Any) -> Any:
    """Return a list of names; `step, stl` is one too."""
    return [part.strip() for part in value.split(",")] if isinstance(value, str) else value


def face_name(value: Any) -> str:
    """Return the name of a face as it is written in lists and pictures: F4."""
    if isinstance(value, str) and re.fullmatch(r"\s*[Ff][1-9][0-9]{0,6}\s*", value):
        return value.strip().upper()
    raise refuse(f"{value!r:.60} is no name of a face", "write, for example, F4")


def down_name(value: Any) -> str:
    """Return the name of the face that is down, or none."""
    return "none" if value == "none" else face_name(value)


def flange_name(value: Any) -> str:
    """Return the designation of a flange; the standard's number may be left out."""
    name = re.sub(r"^iso[ -]?9409-1-", "", str(value).strip(), flags=re.IGNORECASE).upper()
    return _one_of(FLANGES, f"ISO 9409-1-{name}", f"'{value!s:.40}' is no flange known here")


def thread_name(value: Any) -> str:
    """Return the name of a metric thread."""
    return _one_of(SCREWS, str(value).strip().upper(), f"'{value!s:.40}' is no screw known here")


def _one_of(known: Iterable[str], name: str, cause: str) -> str:
    if name not in known:
        raise refuse(cause, f"choose one of {', '.join(known)}")
    return name


def hole_mm(value: Any) -> float:
    """Return the diameter of a hole; of a thread the hole that it passes through."""
    if isinstance(value, str) and value.strip().upper().startswith("M"):
        return SCREWS[thread_name(value)].clear_mm
    return length_mm(value)


def mount_block(value: Any) -> Any:
    """Return the block that a text stands for: `screws M3`, or a flange by its name alone."""
    if not isinstance(value, str):
        return value
    kind = "|".join(MountSettings.model_fields)
    found = re.fullmatch(rf"\s*{{?\s*({kind})\s*:?\s+(.*?)\s*}}?\s*", value)
    return {found[1]: found[2]} if found else {"flange": value}


def database_url(value: Any) -> str:
    """Return the address of a database: `lab.db` is `sqlite:///lab.db`.

    A path with `?`, `%` or `#` stays a path, since these mean other things in an address.
    """
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise refuse("a database is a file name or an address", "write, for example, lab.db")
    scheme, separator, _ = value.partition("://")
    if not separator:
        start, colon, _ = value.partition(":")
        if colon and start in SCHEMES:
            raise refuse(
                f"'{value}' is half an address",
                "write sqlite:///lab.db or postgresql://user@host/name",
            )
        return value if re.search("[?%#]", value) else f"sqlite:///{value}"
    if scheme not in SCHEMES:
        raise refuse(
            f"objects cannot be kept in '{scheme}', only in sqlite or postgresql",
            "write sqlite:///lab.db or postgresql://user@host/name",
        )
    return value


def sensor_type_name(value: Any, info: ValidationInfo) -> str:
    """Return the name of a sensor type, or of its file; unknown names are refused later."""
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise refuse("a sensor type is a name or a file", "write, for example, gel-24x32")
    if not may_name_files(info):
        from encoded_objects.base.sensor_type_file import shipped_names  # costs start-up

        if value not in shipped_names():
            raise refuse(f"'{value}' is no sensor type", f"take {', '.join(shipped_names())}")
    return value


def lab_key(value: Any) -> str:
    """Return a lab's key in its one written form."""
    if not isinstance(value, str):
        raise refuse(f"a lab key is text, not {value!r}", f"put it in quotes: '{value}'")
    try:
        return read_lab_key(value)
    except LabKeyError as error:
        raise refuse(error.cause, error.fix) from None


def object_name(value: Any) -> str:
    """Return the name of an object: it names files and rows of the database too."""
    if not isinstance(value, str):
        raise refuse(f"a name must be text, not {value!r}", f"put it in quotes: '{value}'")
    if fault := name_fault(value):
        raise refuse(*fault)
    return value


def polynomial(value: Any) -> str | tuple[int, ...]:
    """Return labels, x^0 first, from a list; text and `0x1099` as text."""
    if type(value) is int and 1 < value < 2**65:
        return hex(value)
    if isinstance(value, str) and 0 < len(value) <= POLYNOMIAL_LENGTH_MAX:
        return value
    listed = isinstance(value, list) and 2 <= len(value) <= 65
    if listed and all(type(label) is int and 0 <= label < ORDER_MAX for label in value):
        return tuple(value)
    raise refuse(
        "a polynomial is text, a list of coefficients (x^0 first), or a hexadecimal number",
        "write, for example, x^6+x^2+x+A, [2, 1, 1] or 0x1099",
    )


def window(value: Any) -> Any:
    """Return `[3, 2]` for `3x2`; lists stay as they are."""
    if isinstance(value, str):
        match = re.fullmatch(r"\s*([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})\s*", value)
        if match:
            return [int(match[1]), int(match[2])]
    if not isinstance(value, list) or len(value) != 2:
        raise refuse("a window is rows and columns", "write, for example, [3, 2]")
    return value


def printer_block(value: Any) -> Any:
    """Return the block that a name or a file stands for."""
    if isinstance(value, str):
        return {"file": value} if value.endswith(SUFFIXES) else {"like": value}
    if not isinstance(value, dict):
        fix = "write printer: ender-3, the name of a .yaml file, or {bed: 300 x 300 mm, ...}"
        raise refuse("a printer is a name, a file or a block of settings", fix)
    return value


def alphabet_block(value: Any) -> Any:
    """Return the block that a name or a file stands for."""
    if isinstance(value, str) and value.endswith(SUFFIXES):
        return {"file": value}
    if isinstance(value, str) and value not in ALPHABETS:
        fix = suggest(value, ALPHABETS, f"choose one of {', '.join(ALPHABETS)}")
        raise refuse(f"unknown alphabet '{value[:60]}'", fix)
    if not isinstance(value, str | dict):
        fix = "write alphabet: dense-4, the name of a .yaml file, or {name: own, glyphs: [...]}"
        raise refuse("an alphabet is a name, a file or a block of settings", fix)
    return {"name": value} if isinstance(value, str) else value


def broken_line(value: Any) -> Any:
    """Return the nodes of a broken line; refuse one that is none, or leaves the lattice."""
    nodes = value if isinstance(value, list) else []
    if len(nodes) < 2 or not all(isinstance(node, list) and len(node) == 2 for node in nodes):
        fix = "write, for example, [[-1, 1], [-1, -1], [1, -1]]"
        raise refuse("a line of a glyph has two nodes or more, each x and y", fix)
    for node in nodes:
        if not all(type(x) is int and -1 <= x <= 1 for x in node):
            cause = f"node [{node[0]}, {node[1]}] is off the lattice of 3 x 3 nodes"
            raise refuse(cause, "write -1, 0 or 1 for x and for y")
    return nodes


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


def _integer(least: int, most: int | None = None) -> dict[str, Any]:
    """Return the JSON schema of a whole number."""
    return {"type": "integer", "minimum": least} | ({} if most is None else {"maximum": most})


def _list_of(items: dict[str, Any], least: int, most: int | None = None) -> dict[str, Any]:
    """Return the JSON schema of a list."""
    schema = {"type": "array", "items": items, "minItems": least}
    return schema | ({} if most is None else {"maxItems": most})


Version = Annotated[Literal[1], BeforeValidator(version)]
Copies = Annotated[int, Field(ge=1, le=COPIES_MAX), whole_number(1, COPIES_MAX, "copies")]
FormatList = Annotated[
    list[Format],
    Field(min_length=1),
    BeforeValidator(name_list, json_schema_input_type=list[Format] | str),
]
FaceName = Annotated[str, BeforeValidator(face_name)]
FaceList = Annotated[
    list[FaceName], BeforeValidator(name_list, json_schema_input_type=list[FaceName] | str)
]
BedSides = Annotated[
    tuple[Length, Length], BeforeValidator(bed_sides, json_schema_input_type=list[Any] | str)
]
MagnetSizes = Annotated[
    tuple[Length, Length],
    BeforeValidator(diameter_and_height, json_schema_input_type=list[Any] | str),
]
HoleSize = Annotated[float, BeforeValidator(hole_mm, json_schema_input_type=float | str)]
SensorTypeName = Annotated[str, BeforeValidator(sensor_type_name)]
DatabaseUrl = Annotated[
    str,
    BeforeValidator(database_url),
    BeforeValidator(refuse_files),
    WithJsonSchema({"type": "string", "format": "path"}),
]
LabKey = Annotated[str, BeforeValidator(lab_key)]
ObjectName = Annotated[str, BeforeValidator(object_name)]
Order = Annotated[int, Field(ge=2, le=ORDER_MAX), whole_number(2, ORDER_MAX, "order")]
Degree = Annotated[int, Field(ge=1, le=64), whole_number(1, 64, "degree")]
Extent = Annotated[int, Field(ge=1), whole_number(1, CELLS_MAX, "a size")]
Label = Annotated[int, Field(ge=0, le=ORDER_MAX), whole_number(0, ORDER_MAX, "a label")]
Side = Annotated[int, Field(ge=1, le=64), whole_number(1, 64, "a side of the window")]
Polynomial = Annotated[
    str | tuple[int, ...],
    BeforeValidator(polynomial),
    WithJsonSchema({"anyOf": [{"type": ["integer", "string"]}, _list_of(_integer(0), 2)]}),
]
Window = Annotated[
    tuple[Side, Side], BeforeValidator(window, json_schema_input_type=tuple[Side, Side] | str)
]
BrokenLine = Annotated[
    list[tuple[int, int]],
    BeforeValidator(broken_line),
    WithJsonSchema(_list_of(_list_of(_integer(-1, 1), 2, 2), 2)),
]
Share = Annotated[
    float, WithJsonSchema({"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1})
]


class SequenceBlock(Block):
    """One sequence over GF(q)."""

    order: Order | None = None
    """Number of different terms: a prime power q; 2 if left out."""
    degree: Degree | None = None
    """Degree n of the primitive polynomial; the sequence has q^n - 1 terms."""
    polynomial: Polynomial | None = None
    """x^2+x+A, its coefficients from x^0 upwards [2, 1, 1], or 0x13; one on file if left out."""
    field: list[Label] | None = None
    """Minimal polynomial of A, from A^0 upwards; the usual one if left out."""
    initial: list[Label] | None = None
    """The first n terms; 0 ... 0 1 if left out."""


class Factors(Block):
    """The two sequences of a product array."""

    rows: SequenceBlock
    """The sequence that runs down the rows."""
    columns: SequenceBlock
    """The sequence that runs along the columns."""


class Encoding(SequenceBlock):
    """An array, named explicitly."""

    family: Family
    """prbs, prmvs: a sequence; prba, prmva: a folded one; prpa, prmvpa: the product of two."""
    rows: Extent | None = None
    """Rows of the array; the squarest fold if left out."""
    columns: Extent | None = None
    """Columns of the array; rows x columns = q^n - 1, without a common factor."""
    window: Window | None = None
    """Rows and columns of the window that is unique: [6, 2] or 6x2; the smallest if left out."""
    factors: Factors | None = None
    """The two sequences of a product array."""
    law: list[list[Label]] | None = None
    """Product law: the symbol for each pair of terms [row][column]; q row + column if left out."""


class PrinterSettings(Block):
    """A printer of one's own; what is left out is as of the printer that it is like."""

    like: Annotated[str, BeforeValidator(known_name)] = "fdm-0.4"
    """A known printer: encode-object printers lists them."""
    file: PathText | None = None
    """A YAML file with such a block."""
    name: ObjectName | None = None
    """What it is called in lists and messages."""
    bed: BedSides | None = None
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
    PrinterSettings, BeforeValidator(printer_block, json_schema_input_type=PrinterSettings | str)
]


class AlphabetSettings(Block):
    """An alphabet of one's own, or a known one by its name."""

    name: ObjectName | None = None
    """What it is called in lists and messages; own if left out."""
    file: PathText | None = None
    """A YAML file with such a block."""
    reach: Share = 0.30
    """Distance of neighbouring nodes over the pitch."""
    stroke_ratio: Share = 0.20
    """Width of the strokes over the pitch, where stroke is left out."""
    glyphs: list[list[BrokenLine]] | None = None
    """The symbols 0, 1, ... of the array: broken lines through nodes [x, y] of a lattice of 3 x 3,
    x to the right and y up, each -1, 0 or 1: [[[-1, 1], [-1, -1], [1, -1]]] is an L."""


AlphabetChoice = Annotated[
    AlphabetSettings,
    BeforeValidator(alphabet_block, json_schema_input_type=AlphabetSettings | AlphabetName | str),
]


class Symbols(Block):
    """How the symbols are embossed; what is left out follows from the profile."""

    pitch: Length | None = None
    """Distance between neighbouring symbols; auto takes what reads best on the printer."""
    height: Length | None = None
    """How far symbols stand out; 1 mm."""
    stroke: Length | None = None
    """Width of the strokes at their top; a fifth of the pitch for most alphabets."""
    draft: Angle | None = None
    """Slope of the strokes' sides from the vertical; 10 deg, or less where there is no room."""
    chamfer: LengthOrZero | None = None
    """Chamfer of the strokes' top edges; 0 for none."""
    alphabet: AlphabetChoice | None = None
    """The symbols themselves: a name, a YAML file, or a block of one's own."""


class MountSettings(Block):
    """Holes by which a part is held: exactly one of these; symbols keep clear of them."""

    flange: Annotated[str, BeforeValidator(flange_name)] | None = None
    """Flange of a robot: ISO 9409-1-50-4-M6, or 50-4-M6. Holes with sunk heads, and a pin."""
    screws: Annotated[str, BeforeValidator(thread_name)] | None = None
    """A through hole in each corner for such a screw, M3, its head sunk."""
    magnets: MagnetSizes | None = None
    """A pocket in each corner for a round magnet: 8 x 2 mm, diameter and height."""
    rod: Length | None = None
    """A socket in the middle for a rod of this diameter, two diameters deep where there is room."""
    hole: HoleSize | None = None
    """A hole through the middle: its diameter, or the thread of a bolt that passes, M8."""
    face: FaceName | None = None
    """Face that is mounted, F1; it stays blank. The face that is down if left out."""


MountChoice = Annotated[
    MountSettings, BeforeValidator(mount_block, json_schema_input_type=MountSettings | str)
]


class Print(Block):
    """How the object is printed."""

    parts: Literal["panels", "whole"] = "panels"
    """panels: one mitred plate for each face, without overhang; whole: one solid body."""
    wall: Length | None = None
    """Thickness of the panels; 3 mm."""
    gap: Length | None = None
    """Between panels where they meet in the finished object; 0.14 mm."""
    printer: PrinterChoice | None = None
    """What prints: its limits hold for strokes, gaps and the bed. A name, a YAML file, or a block
    of one's own: {like: ender-3, layer: 0.3 mm}."""
    colours: Literal[1, 2] = 1
    """2: the filament is changed where the symbols begin (panels in PrusaSlicer). Bambu Studio's
    projects print symbols of panels in another filament anyhow, with 2 those of one body too."""
    down: Annotated[str, BeforeValidator(down_name)] | None = None
    """Face that one body stands on, F4; it stays blank. Chosen if left out: the model's own way
    up, or a large face under which little hangs over. none: no face is blank for the bed."""
    blank: FaceList | None = None
    """Faces without symbols: [F4, F7]."""


class Robot(Block):
    """What robots and simulators are told of the object (formats mjcf, urdf, sdf, usd)."""

    density: Density | None = None
    """Of what is printed; the printer's plastic, all solid, if left out."""
    collision: Literal["touch", "body"] = "touch"
    """What collides: touch, all parts with their symbols as one closed mesh, which simulators
    feel; body, a few convex pieces to the tops of the symbols: fast, and nothing to read."""


class Output(Block):
    """Where the result goes."""

    folder: PathText | None = None
    """Folder for the files, made if it is not there; out/NAME if left out."""
    formats: FormatList | None = None
    """Files to write: step, stl, 3mf, bambu (a project for Bambu Studio and OrcaSlicer), glb, stpz,
    mjcf, urdf, sdf, usd; else the first three, for a printer of Bambu Lab the first four."""
    database: DatabaseUrl | None = None
    """Database that registers the cells: sqlite:///lab.db, postgresql://host/name."""
    lab_key: LabKey | None = None
    """Key of the lab, for a database that is new: the same key, the same arrays and bytes; drawn
    at random if left out. encode-object lab prints a database's."""


class Defaults(Block):
    """What an object can set, and a set for all of its objects."""

    version: Version = 1
    """Version of this file format."""
    profile: ProfileName | None = None
    """The array, its alphabet and its pitch by name; auto if left out: the smallest array with
    room for the objects and more, at the pitch that the printer's prints are read best at."""
    encoding: Encoding | None = None
    """The array, named explicitly, in place of a profile."""
    sensor_type: SensorTypeName | None = None
    """What will touch it: a name that probe-sensor types lists, or a YAML file; fsr-16. Its size
    and its tactels decide the pitch that auto takes and what faces promise."""
    layout: Literal["auto", "net", "faces"] = "auto"
    """net: one lattice runs through the unfolded object; faces: each face alone; auto: what
    shows more places."""
    symbols: Symbols = Symbols()
    mount: MountChoice | None = None
    """Holes by which it is held: {flange: ISO 9409-1-50-4-M6}, {screws: M3}, {magnets: 8 x 2 mm},
    {rod: 12 mm}, {hole: M8}; none if left out."""
    print: Print = Print()
    robot: Robot = Robot()
    copies: Copies = 1
    """Copies with cells of their own, so that two of them are told apart."""
    output: Output = Output()


class NamedSettings(Defaults):
    """An object whose shape is given otherwise."""

    name: ObjectName
    """Name in the database and of the files."""


class ObjectSettings(NamedSettings):
    """An object to emboss."""

    shape: Annotated[Shape, BeforeValidator(shape_block)]


class SharedSettings(Defaults):
    """What stands beside the objects of a set."""

    name: ObjectName | None = None
    """What the files of the set are called: as the spec file if left out."""


class SetSettings(SharedSettings):
    """Objects that share one array, and what holds for all of them."""

    objects: Annotated[list[ObjectSettings | str], Field(min_length=1)]
    """Objects written out, or names of their files, relative to this one."""
