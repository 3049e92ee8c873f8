"""Blocks of settings (pydantic): their base, lengths and angles, and errors in plain words.

`40`, `40 mm`, `4 cm`, `1.6 in`, `2 1/2 in` -> mm; `10`, `10 deg`, `0.17 rad` -> radians (a bare
angle is in degrees); `1.24 g/cm3`, `1240` -> kg/m3. Values are rounded to 1e-9 mm and 1e-12 rad,
so that the same length in two units is the same number.
"""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from encoded_objects.base.document import Problem, SourceMark, did_you_mean, suggest
from encoded_objects.base.number import LENGTH_MAX_MM
from encoded_objects.base.yaml_tree import Place, Tree

MILLIMETRES = {
    "mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "µm": 0.001, "μm": 0.001,
    "in": 25.4, "inch": 25.4, "inches": 25.4, '"': 25.4,
}  # fmt: skip
RADIANS = {
    "deg": math.pi / 180, "degree": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180,
    "rad": 1.0,
}  # fmt: skip
KG_M3 = {"kg/m3": 1.0, "kg/m^3": 1.0, "g/cm3": 1000.0, "g/cm^3": 1000.0, "g/cc": 1000.0}
DENSITY_MAX_KG_M3 = 25_000.0
SHOWN_UNITS = {
    "a length": "mm, cm, m, um, in", "an angle": "deg, rad", "a density": "kg/m3, g/cm3",
}  # fmt: skip
NO_FILES = MappingProxyType({"files": False})  #: context of settings that a stranger wrote
FILES_REFUSED = (
    "names of files and folders are not taken here",
    "leave it out, or make it with encode-object",
)  #: cause and fix
_QUANTITY = re.compile(
    r"\s*(?P<number>[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,4})?)\s*"
    r"(?P<unit>[^\s0-9.,+-][^\s]{0,40})?\s*\Z"
)
_FRACTION = re.compile(
    r"\s*(?:(?P<whole>[0-9]{1,6})[\s-]+)?(?P<over>[0-9]{1,6})/(?P<under>[1-9][0-9]{0,5})"
)
_COMMA = re.compile(r"\s*[-+]?[0-9]+,[0-9]+(?![0-9,])")
_SIDES = re.compile(r"\s*(?:x|×|by)\s*")


class Block(BaseModel):
    """A block of settings."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _without_empty_lines(cls, value: Any) -> Any:
        """Take a known setting without a value (`symbols:`) as not given."""
        if not isinstance(value, dict):
            return value
        return {k: v for k, v in value.items() if v is not None or k not in cls.model_fields}


@dataclass(frozen=True, slots=True)
class SettingWords:
    """The words of messages about settings of one kind of file."""

    whole: str  #: as "a spec is made of settings"
    start: str  #: the first line of a right one
    see: str  #: where all settings are described
    missing: Mapping[str, str] = field(default_factory=dict)  #: setting: how it is written
    blocks: Mapping[str, str] = field(default_factory=dict)  #: block: how it is written
    #: what is wrong with an unknown name; None: as any other
    unknown: Callable[[Place, SourceMark, type[BaseModel]], Problem] | None = None


def refuse(cause: str, fix: str) -> PydanticCustomError:
    """Return the error that a validator raises: what is wrong, and the way out."""
    return PydanticCustomError("refused", "{cause}", {"cause": cause, "fix": fix})


def length_mm(value: Any) -> float:
    """Return a length above zero, mm."""
    length = coordinate_mm(value)
    if length <= 0:
        raise refuse(f"a length must be above 0, not {length:g} mm", "write, for example, 40 mm")
    return length


def length_or_zero_mm(value: Any) -> float:
    """Return a length of zero or more, mm."""
    length = coordinate_mm(value)
    if length < 0:
        raise refuse(f"a length must not be below 0, but is {length:g} mm", "write 0 for none")
    return length


def coordinate_mm(value: Any) -> float:
    """Return a length of either sign, mm."""
    number = _number(value, MILLIMETRES, "mm", "a length", "40, 40 mm, 4 cm or 1.6 in")
    if abs(number) > LENGTH_MAX_MM:
        raise refuse(f"{number:g} mm is more than {LENGTH_MAX_MM / 1000:g} m", "check the unit")
    return round(number, 9) + 0.0


def angle_rad(value: Any) -> float:
    """Return an angle, radians."""
    return round(_number(value, RADIANS, "deg", "an angle", "10, 10 deg or 0.17 rad"), 12) + 0.0


def density_kg_m3(value: Any) -> float:
    """Return a density above zero, kg/m3."""
    density = round(_number(value, KG_M3, "kg/m3", "a density", "1240 or 1.24 g/cm3"), 6)
    if not 0 < density <= DENSITY_MAX_KG_M3:
        raise refuse(
            f"a density must be above 0 and at most {DENSITY_MAX_KG_M3:g} kg/m3, "
            f"not {density:g} kg/m3",
            "write, for example, 1.24 g/cm3",
        )
    return density


def sides(value: Any) -> Any:
    """Return the three sides of a box as a list; `80 x 80 x 120 mm` is one too."""
    return _sides(value, 3, "a box has three sides", "write box: [80 mm, 80 mm, 120 mm]")


def two_sides(value: Any) -> Any:
    """Return the two sides of a tag as a list; `40 x 40 mm` is one too."""
    return _sides(value, 2, "a tag has two sides", "write tag: [40 mm, 40 mm]")


def diameter_and_height(value: Any) -> Any:
    """Return both lengths of a round magnet as a list; `8 x 2 mm` is one too."""
    return _sides(value, 2, "a magnet has a diameter and a height", "write magnets: 8 x 2 mm")


def _sides(value: Any, count: int, cause: str, fix: str) -> Any:
    parts = value
    if isinstance(value, str):
        parts = _SIDES.split(value)
        unit = re.sub(r"[-+0-9.eE\s]*", "", parts[-1], count=1)
        parts = [part if re.search(r"[^-+0-9.eE\s]", part) else f"{part} {unit}" for part in parts]
    if not isinstance(parts, list) or len(parts) != count:
        had = f", not {len(parts)}" if isinstance(parts, list) else ""
        raise refuse(f"{cause}{had}", fix)
    return parts


def coordinates(value: Any) -> Any:
    """Return the three coordinates of a corner as they are."""
    if not isinstance(value, list) or len(value) != 3:
        had = f", not {len(value)}" if isinstance(value, list) else ""
        raise refuse(f"a corner has three coordinates{had}", "write [x, y, z]")
    return value


def path_text(value: Any) -> str:
    """Return the name of a file or folder."""
    if not isinstance(value, str):
        raise refuse(f"a path must be text, not {value!r}", f"put it in quotes: '{value}'")
    if not value.isprintable() or not value.strip():
        raise refuse(f"{value!r} is no path", "leave control characters out")
    return value


def refuse_files(value: Any, info: ValidationInfo) -> Any:
    """Refuse a setting that names a file or a folder, where settings are a stranger's."""
    if may_name_files(info):
        return value
    raise refuse(*FILES_REFUSED)


def may_name_files(info: ValidationInfo) -> bool:
    """Whether what is read may lead to files: not with the context `NO_FILES`."""
    return info.context is not NO_FILES


def whole_number(low: int, high: int, what: str) -> BeforeValidator:
    """Return a validator of whole numbers from `low` to `high`."""

    def check(value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int):
            raise refuse(f"{what} must be a whole number", f"write a number from {low} to {high}")
        if not low <= value <= high:
            shown = str(value) if abs(value) < 10**12 else "the number given"
            raise refuse(
                f"{what} must be {low} to {high}, not {shown}",
                f"write a number from {low} to {high}",
            )
        return value

    return BeforeValidator(check)


def _number(value: Any, units: dict[str, float], bare: str, what: str, example: str) -> float:
    """Return a number with a unit in the base unit; raises the error that `refuse` makes."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise refuse(f"this must be {what}", f"write, for example, {example}")
    if isinstance(value, str):
        match = _QUANTITY.match(_with_point(value))
        if match is None:
            raise _unreadable_error(value, what, example)
        number, unit = float(match["number"]), match["unit"] or bare
        if unit not in units:
            raise _unknown_unit(unit, units, what)
    else:
        try:
            number, unit = float(value), bare
        except OverflowError:
            number, unit = math.inf, bare
    if not math.isfinite(number * units[unit]):
        raise refuse(f"{what} must be a finite number", f"write, for example, {example}")
    return number * units[unit]


def _with_point(text: str) -> str:
    """Return a text in which a fraction, as in 2 1/2 in, is a decimal number."""
    match = _FRACTION.match(text)
    if match is None:
        return text
    value = int(match["whole"] or 0) + int(match["over"]) / int(match["under"])
    return f"{value:.12f}{text[match.end() :]}"


def _unreadable_error(value: str, what: str, example: str) -> PydanticCustomError:
    if _COMMA.match(value):
        fix = f"write a point: {value.strip().replace(',', '.', 1)}"
        return refuse(f"'{value}' has a decimal comma", fix)
    return refuse(f"'{_shorten(value)}' is not {what}", f"write, for example, {example}")


def _unknown_unit(unit: str, units: dict[str, float], what: str) -> PydanticCustomError:
    near = unit.lower() if unit.lower() in units else ""
    if len(unit) > 4:
        near = near or did_you_mean(unit, (name for name in units if len(name) > 2))
    fix = f"did you mean '{near}'?" if near else f"use one of {SHOWN_UNITS[what]}"
    return refuse(f"unknown unit '{_shorten(unit)}' for {what}", fix)


def _shorten(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


_LENGTH_TEXT = r"^\s*[0-9.]+([eE][-+]?[0-9]+)?\s*(mm|cm|m|um|in|inch|inches)?\s*$"
_COORDINATE_TEXT = r"^\s*[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*(mm|cm|m|um|in|inch|inches)?\s*$"
_DENSITY_TEXT = r"^\s*[0-9.]+([eE][-+]?[0-9]+)?\s*(kg/m\^?3|g/cm\^?3|g/cc)?\s*$"
_ANGLE_TEXT = r"^\s*[-+]?[0-9.]+([eE][-+]?[0-9]+)?\s*(deg|degree|degrees|°|rad)?\s*$"


def _schema(number: dict[str, Any], pattern: str) -> WithJsonSchema:
    return WithJsonSchema(
        {"anyOf": [{"type": "number", **number}, {"type": "string", "pattern": pattern}]}
    )


Length = Annotated[
    float, BeforeValidator(length_mm), _schema({"exclusiveMinimum": 0}, _LENGTH_TEXT)
]
LengthOrZero = Annotated[
    float, BeforeValidator(length_or_zero_mm), _schema({"minimum": 0}, _LENGTH_TEXT)
]
Coordinate = Annotated[float, BeforeValidator(coordinate_mm), _schema({}, _COORDINATE_TEXT)]
Angle = Annotated[float, BeforeValidator(angle_rad), _schema({}, _ANGLE_TEXT)]
Density = Annotated[
    float, BeforeValidator(density_kg_m3), _schema({"exclusiveMinimum": 0}, _DENSITY_TEXT)
]
PathText = Annotated[
    str,
    BeforeValidator(path_text),
    BeforeValidator(refuse_files),
    WithJsonSchema({"type": "string", "format": "path"}),
]


def explain_settings(
    error: ValidationError, tree: Tree, model: type[BaseModel], words: SettingWords
) -> list[Problem]:
    """Return the problems behind a validation error of `tree.value` as `model`."""
    items = error.errors(include_url=False)
    meant = {
        _likely_place(item["loc"], model) for item in items if item["type"] == "extra_forbidden"
    }
    unread = {problem.mark for problem in tree.problems}
    return [
        _problem(item, tree, model, words)
        for item in items
        if item["type"] != "missing"
        or not (item["loc"] in meant or tree.values.get(item["loc"]) in unread)
    ]


def unknown_name(place: Place, mark: SourceMark, model: type[BaseModel]) -> Problem:
    """Explain a name that is not known where it stands."""
    word, block = str(place[-1]), place[:-1]
    known = list(model_at(model, block).model_fields)
    inside = f" in '{block[-1]}'" if block else ""
    fix = suggest(word, known, f"use {'one of ' if len(known) > 1 else ''}{', '.join(known)}")
    return Problem(f"unknown setting '{word[:60]}'{inside}", fix, mark)


def model_at(model: type[BaseModel], place: Place) -> type[BaseModel]:
    """Return the model of the block at `place`, or the nearest one around it."""
    for part in place:
        if isinstance(part, str) and part in model.model_fields:
            model = next(_models(model.model_fields[part].annotation), model)
    return model


def _likely_place(place: Place, model: type[BaseModel]) -> Place:
    """Return the place of the setting that an unknown name was probably meant to be."""
    known = model_at(model, place[:-1]).model_fields
    return (*place[:-1], did_you_mean(str(place[-1]), known))


def _problem(
    error: Mapping[str, Any], tree: Tree, model: type[BaseModel], words: SettingWords
) -> Problem:
    place: Place = error["loc"]
    kind: str = error["type"]
    if kind == "refused":
        return Problem(error["ctx"]["cause"], error["ctx"]["fix"], tree.value_mark(place))
    if kind == "extra_forbidden":
        return (words.unknown or unknown_name)(place, tree.key_mark(place), model)
    if kind == "missing":
        return _missing_setting(place, tree, words)
    cause, fix = _wrong_value(error, place, model, words)
    return Problem(cause, fix, tree.value_mark(place))


def _missing_setting(place: Place, tree: Tree, words: SettingWords) -> Problem:
    key, block = str(place[-1]), place[:-1]
    inside = f" in '{block[-1]}'" if block else ""
    fix = "add " + words.missing.get(key, f"{key}: ...")
    if place in tree.keys:
        return Problem(
            f"'{key}'{inside} has no value", fix.replace("add ", "write ", 1), tree.key_mark(place)
        )
    return Problem(f"'{key}' is missing{inside}", fix, tree.key_mark(block))


def _wrong_value(
    error: Mapping[str, Any], place: Place, model: type[BaseModel], words: SettingWords
) -> tuple[str, str]:
    """Return cause and fix for a value of the wrong kind."""
    key = next((part for part in reversed(place) if isinstance(part, str)), "the file")
    value, kind = error["input"], error["type"]
    if kind == "literal_error":
        known = re.findall(r"'([^']*)'", error["ctx"]["expected"])
        fix = f"choose one of {', '.join(known)}"
        single = key.removesuffix("s") if isinstance(place[-1], int) else key
        if not isinstance(value, str):
            return f"'{single}' cannot be {_value_text(value)}", fix
        return f"unknown {single} {_value_text(value)}", suggest(value, known, fix)
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        if not place:
            return f"{words.whole}, not {_value_text(value)}", f"start with: {words.start}"
        first = next(iter(model_at(model, place).model_fields))
        written = words.blocks.get(key, f"{key}: {{{first}: ...}}")
        example = written.removeprefix("{").removesuffix("}") if key in words.blocks else written
        return f"'{key}' takes settings, not {_value_text(value)}", f"write {example}"
    if kind in ("list_type", "tuple_type"):
        return f"'{key}' takes a list, not {_value_text(value)}", "write it in brackets: [..., ...]"
    if kind in ("too_short", "too_long"):
        context = error["ctx"]
        limit = context.get("min_length", context.get("max_length"))
        few = kind == "too_short"
        cause = f"'{key}' has {context['actual_length']} values, {limit} or "
        cause += f"{'more' if few else 'fewer'} are needed"
        return cause, "add the others" if few else "leave the others out"
    if kind == "string_type":
        return f"'{key}' takes text, not {_value_text(value)}", "put it in quotes"
    return f"'{key}': {error['msg']}", f"see {words.see}"


def _value_text(value: Any) -> str:
    """Return a value as it may stand in a sentence."""
    if isinstance(value, str):
        return f"'{_shorten(value)}'"
    if isinstance(value, dict):
        return "a block of settings"
    if isinstance(value, list):
        return "a list"
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)[:40]


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from _models(part)
