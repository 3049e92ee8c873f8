"""The settings of a spec, as people write them: names, defaults and descriptions.

These models read one object (`ObjectSettings`) or a set (`SetSettings`) and are the
source of the JSON schema. Lengths are in mm and angles in radians after reading.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from encoded_objects.base.settings import (
    Angle,
    Block,
    Density,
    Length,
    LengthOrZero,
    PathText,
    refuse,
    whole_number,
)
from generator.alphabet.known import ALPHABETS
from generator.array.lab_key import read_lab_key
from generator.errors import LabKeyError
from generator.export.formats import EXPORTERS
from generator.spec.encoding import Encoding
from generator.spec.name import ObjectName
from generator.spec.printer import PrinterChoice
from generator.spec.shape import EXAMPLES, Shape

if TYPE_CHECKING:
    AlphabetName = str
    Format = str
else:  # those that are registered
    AlphabetName = Literal[tuple(ALPHABETS)]
    Format = Literal[tuple(EXPORTERS)]

SPEC_VERSION = 1
COPIES_MAX = 1000
SCHEMES = ("sqlite", "postgresql", "postgres", "postgresql+psycopg")  #: of databases

ProfileName = Literal["one-touch", "thesis", "product", "large", "fine", "auto"]


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


def format_list(value: Any) -> Any:
    """Return a list of formats; `step, stl` is one too."""
    return [part.strip() for part in value.split(",")] if isinstance(value, str) else value


def database_url(value: Any) -> str:
    """Return the address of a database; `lab.db` is that of a file."""
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
        return f"sqlite:///{value}"
    if scheme not in SCHEMES:
        raise refuse(
            f"objects cannot be kept in '{scheme}', only in sqlite or postgresql",
            "write sqlite:///lab.db or postgresql://user@host/name",
        )
    return value


def sensor_type_name(value: Any) -> str:
    """Return the name of a sensor type, or of its file; which ones there are is told later."""
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise refuse("a sensor type is a name or a file", "write, for example, gel-24x32")
    return value


def lab_key(value: Any) -> str:
    """Return a lab's key, as it is written everywhere."""
    if not isinstance(value, str):
        raise refuse(f"a lab key is text, not {value!r}", f"put it in quotes: '{value}'")
    try:
        return read_lab_key(value)
    except LabKeyError as error:
        raise refuse(error.cause, error.fix) from None


Version = Annotated[Literal[1], BeforeValidator(version)]
Copies = Annotated[int, Field(ge=1, le=COPIES_MAX), whole_number(1, COPIES_MAX, "copies")]
FormatList = Annotated[
    list[Format],
    Field(min_length=1),
    BeforeValidator(format_list, json_schema_input_type=list[Format] | str),
]
SensorTypeName = Annotated[str, BeforeValidator(sensor_type_name)]
DatabaseUrl = Annotated[str, BeforeValidator(database_url)]
LabKey = Annotated[str, BeforeValidator(lab_key)]


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
    alphabet: AlphabetName | None = None
    """The symbols themselves."""


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
    """2: the filament is changed where the symbols begin (panels in PrusaSlicer)."""


class Robot(Block):
    """What robots and simulators are told of the object (formats mjcf, urdf, sdf, usd)."""

    density: Density | None = None
    """Of what is printed; the printer's plastic, all solid, if left out."""
    collision: Literal["body", "symbols"] = "body"
    """What other bodies hit: body, the plain shape as convex pieces; symbols, these too."""


class Output(Block):
    """Where the result goes."""

    folder: PathText | None = None
    """Folder for the files, made if it is not there; out/NAME if left out."""
    formats: FormatList | None = None
    """Files to write: step, stl, 3mf, glb, stpz, mjcf, urdf, sdf, usd; else the first three."""
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
