"""Files of sensor types: name or YAML file -> `SensorType`, and the JSON schema of such files.

A name without a folder or a suffix is that of a shipped type (`sensor_types/NAME.yaml`);
everything else is a file. Lengths in mm.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationError

from encoded_objects.base.document import DocumentKind, Problem, suggest
from encoded_objects.base.number import needed_number
from encoded_objects.base.sensor_type import (
    BOUNDS,
    SENSOR_FILES,
    Overlay,
    OverlayKind,
    SensorType,
    SensorTypeError,
    Value,
    Wiring,
    misfits,
    missing_fault,
    name_fault,
)
from encoded_objects.base.settings import (
    Block,
    Length,
    LengthOrZero,
    SettingWords,
    explain_settings,
    refuse,
    whole_number,
)
from encoded_objects.base.yaml_tree import Place, Tree, read_tree, tree_of

_LINES = re.compile(r"\s*([0-9]{1,4})\s*(?:-\s*([0-9]{1,4})\s*)?\Z")
_PLAIN, _USUAL = SensorType(), Overlay()


def _type_name(value: Any) -> str:
    if fault := name_fault(value):
        raise refuse(*fault)
    return str(value)


def _range_of_lines(value: Any) -> tuple[int, int]:
    """Return the first and the last line of `3` or `0-5`."""
    match = _LINES.match(str(value)) if isinstance(value, str | int) else None
    if match is None or isinstance(value, bool):
        raise refuse(f"{value!r} is no line or range of lines", "write 3, or 0-5 for a range")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise refuse(f"the range {value} runs backwards", f"write {last}-{first}")
    return first, last


def _number(name: str, what: str) -> BeforeValidator:
    low, high, _, above = BOUNDS[name]
    floor = f"above {low:g}" if above else f"{low:g} or more"

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise refuse(f"{what} must be a number", f"write a number {floor}")
        if needed_number(value, least=low, most=high, above=above):
            raise refuse(
                f"{what} must be {floor} and at most {high:g}, not {value:g}",
                "write a number within these bounds",
            )
        return float(value)

    return BeforeValidator(check)


def _whole(name: str, what: str) -> BeforeValidator:
    low, high, *_ = BOUNDS[name]
    return whole_number(int(low), int(high), what)


_Lines = Annotated[int, _whole("rows", "rows and columns")]
_Range = Annotated[
    tuple[int, int],
    BeforeValidator(_range_of_lines),
    Field(json_schema_extra={"type": "string", "pattern": r"^[0-9]+(-[0-9]+)?$"}),
]


class OverlaySettings(Block):
    """What stands between the sensor and the object."""

    kind: OverlayKind = _USUAL.kind
    """Separate tabs, one pad, or a gel behind a membrane."""
    height: Length = _USUAL.height_mm
    """Of a tab; thickness of pad or gel. mm."""
    tip: Length = _USUAL.tab_diameter_mm
    """Diameter of a tab's tip, mm."""
    young: Annotated[float, _number("young_mpa", "young")] = _USUAL.young_mpa
    """Young's modulus at small strain, MPa."""
    poisson: Annotated[float, _number("poisson", "poisson")] = _USUAL.poisson
    """Poisson's ratio."""
    membrane: LengthOrZero = _USUAL.membrane_mm
    """Of a gel: way over which the membrane bridges beside a stroke, mm."""
    blur: LengthOrZero = _USUAL.blur_mm
    """Of a gel: standard deviation of the blur of optics and matching, mm."""

    def overlay(self) -> Overlay:
        """Return the overlay."""
        return Overlay(
            self.kind, self.height, self.tip, self.young, self.poisson, self.membrane, self.blur
        )


class MissingSettings(Block):
    """Places without a tactel: where these rows and columns cross."""

    rows: _Range
    """A row, or a range as 0-5; from 0, top row first."""
    columns: _Range
    """A column, or a range; from 0, left column first."""


class SensorTypeSettings(Block):
    """A sensor type."""

    version: Literal[1] = 1
    """Of this format."""
    name: Annotated[str, BeforeValidator(_type_name)]
    """As messages and recordings call it."""
    rows: _Lines
    """Rows of the matrix, the top one first."""
    columns: _Lines
    """Columns, the left one first, seen through the sensor's back."""
    pitch: Length
    """From column to column, and from row to row, mm."""
    row_pitch: Length | None = None
    """From row to row where it is another than `pitch`, mm; under tabs alone."""
    overlay: OverlaySettings = OverlaySettings()
    """What stands between the sensor and the object."""
    value: Value = _PLAIN.value
    """What a reading is: ADC counts, conductance, force, or depth of the imprint."""
    unit: Annotated[float, _number("unit", "unit")] = _PLAIN.unit
    """Of one count: S of conductance, N of force, mm of depth."""
    bits: Annotated[int, _whole("bits", "bits")] = _PLAIN.bits
    """Of a reading."""
    exponent: Annotated[float, _number("exponent", "exponent")] = _PLAIN.exponent
    """Law: a reading grows with force (depth) to this power."""
    wiring: Wiring = _PLAIN.wiring
    """Of the rows that are not read: at ground, floating, or columns held at 0 V."""
    noise: Annotated[float, _number("noise", "noise")] = _PLAIN.noise
    """Standard deviation of a tactel at rest, counts."""
    missing: list[MissingSettings] = Field(default_factory=list)
    """Places without a tactel."""

    def faults(self) -> Iterator[tuple[Place, str, str]]:
        """Yield what does not fit together: the place of the setting, the cause, the way out."""
        for number, place in enumerate(self.missing):
            row, column = place.rows[1], place.columns[1]
            if fault := missing_fault(row, column, self.rows, self.columns):
                yield ("missing", number), *fault
        yield from misfits(self.value, self.overlay.kind, self.pitch, self._row_pitch())

    def _row_pitch(self) -> float:
        """Return the pitch of rows where it is another, else 0."""
        return 0.0 if self.row_pitch in (None, self.pitch) else float(self.row_pitch or 0.0)

    def sensor_type(self) -> SensorType:
        """Return the type."""
        missing = {
            (row, column)
            for place in self.missing
            for row in range(place.rows[0], place.rows[1] + 1)
            for column in range(place.columns[0], place.columns[1] + 1)
        }
        return SensorType(
            rows=self.rows,
            columns=self.columns,
            pitch_mm=self.pitch,
            overlay=self.overlay.overlay(),
            name=self.name,
            value=self.value,
            unit=self.unit,
            bits=self.bits,
            exponent=self.exponent,
            wiring=self.wiring,
            noise=self.noise,
            missing=tuple(sorted(missing)),
            row_pitch_mm=self._row_pitch(),
        )


_KIND = DocumentKind(
    error=SensorTypeError,
    name="a sensor type",
    empty="write name:, rows:, columns: and pitch:, as probe-sensor types fsr-16 shows",
    example="probe-sensor types fsr-16",
    first="see those that are shipped with: probe-sensor types",
)
_WORDS = SettingWords(
    whole="a sensor type is made of settings",
    start="name: my-sensor",
    see="probe-sensor types --schema",
    missing={
        "name": "name: my-sensor",
        "rows": "rows: 16",
        "columns": "columns: 16",
        "pitch": "pitch: 1.5875 mm",
    },
    blocks={"overlay": "overlay: {kind: tab, height: 2 mm}", "missing": "missing: [...]"},
)
_FOLDER = resources.files("encoded_objects.base").joinpath("sensor_types")


@lru_cache(maxsize=1)
def shipped_names() -> tuple[str, ...]:
    """Return the names of the shipped types, the usual one first."""
    names = (item.name.removesuffix(".yaml") for item in _FOLDER.iterdir())
    usual = SensorType().name
    return (usual, *sorted(name for name in names if name != usual))


@lru_cache(maxsize=64)
def sensor_type_named(name: str) -> SensorType:
    """Return a shipped type by its name, or that of a YAML file.

    Raises SensorTypeError: no such type or file, or one that cannot be used.

    Examples
    --------
    >>> sensor_type_named("flexitac-12x32").shape
    (12, 32)
    """
    if name in shipped_names():
        return parse_sensor_type(shipped_text(name), f"{name}.yaml")
    path = Path(name)
    if path.suffix in SENSOR_FILES or path.parent != Path() or os.path.exists(path):
        return _sensor_type(read_tree(path, _KIND))
    fix = suggest(name, shipped_names(), f"take {', '.join(shipped_names())}, or a file")
    raise SensorTypeError([Problem(f"there is no sensor type '{name}'", fix, file="--sensor-type")])


def shipped_text(name: str) -> str:
    """Return the file of a shipped type."""
    return _FOLDER.joinpath(f"{name}.yaml").read_text("utf-8")


def parse_sensor_type(text: str, place: str) -> SensorType:
    """Return the type that a text describes; `place` stands in messages of `SensorTypeError`."""
    return _sensor_type(tree_of(text, place, Path(), _KIND))


def _sensor_type(tree: Tree) -> SensorType:
    problems = list(tree.problems)
    try:
        settings = SensorTypeSettings.model_validate(tree.value)
    except ValidationError as error:
        problems += explain_settings(error, tree, SensorTypeSettings, _WORDS)
    else:
        problems += [
            Problem(cause, fix, tree.value_mark(place)) for place, cause, fix in settings.faults()
        ]
    if problems:
        raise SensorTypeError(problems)
    return settings.sensor_type()


def sensor_type_schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of a file of a sensor type."""
    from encoded_objects.base.json_schema import DescribedSchema

    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "sensor type",
        **SensorTypeSettings.model_json_schema(schema_generator=DescribedSchema),
    }
