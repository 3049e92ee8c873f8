"""Sensor type: matrix, overlay, and the meaning of its values. Thesis 3.3, 4.2.

Sensor frame: seen through its back, from outside the object; origin at the centre of
the matrix in the plane of the undeformed overlay's tips; x right along columns, y up
against rows, z away from the object; tactel (0, 0) top left. mm, N, MPa.

`sensor_type_file` reads and ships types as YAML; it loads pydantic, this module does not.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.document import DocumentError, Problem
from encoded_objects.base.number import LENGTH_MAX_MM, needed_number

SENSOR_FILES = (".yaml", ".yml")  #: suffixes of files of types; other words are names
USUAL_FORCE_N = 80.0  #: on `fsr-16`, as the thesis pressed its washer
#: Mean imprint of a gel. Of 300 touches of all kinds 206 are answered at .2 and at .3 mm, 189 at
#: 1.2 mm, where the share of the area leads; at edges 35, 32 and 17 of 40, of mismatched gels amid
#: faces 35, 38 and 42 of 42: noise hides weak imprints. Of 100 at edges and corners that follow
#: `next` 93 are answered by the second at .2 mm, 84 at .3 mm.
GEL_IMPRINT_MM = 0.3
#: Tactels to a pitch of symbols. 5 mm of `fsr-16` (docs/pitches.md). Of 30 touches each of
#: `flexitac-12x32`, typical and mismatch: at 6 mm 30 and 29 right amid faces, 17 and 12 at edges;
#: at 8.5 mm, 4.2 tactels, 30 and 30, 10 and 11.
TACTELS = 3.15
PAD_TACTELS = 4.41  #: under a pad; 7 mm of `fsr-16`: at 5 mm 18 of 30 are right, at 7 mm 28
LEAST_TACTELS = 2.0  #: to a symbol: few touches of finer ones are answered
CELLS = 11.7  #: symbols on the matrix's area: about eight of them are seen whole
PITCH_GRID_MM = 0.5  #: proposed pitches are multiples of this
LEAST_PITCH_MM = 3.0  #: finer strokes do not print

OverlayKind = Literal["tab", "pad", "gel"]
Value = Literal["counts", "conductance", "force", "depth"]
Wiring = Literal["grounded", "floating", "virtual"]
_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,59}\Z")


class Bounds(NamedTuple):
    """Allowed values of a setting."""

    least: float
    most: float
    whole: bool = False
    above: bool = False  #: `least` itself is not allowed


_LENGTH, _LENGTH_OR_ZERO = Bounds(0, LENGTH_MAX_MM, above=True), Bounds(0, LENGTH_MAX_MM)
#: Of the numbers of a type and its overlay, in a file as in Python. A packet holds rows and columns
#: in a byte each.
BOUNDS = {
    "rows": Bounds(2, 255, whole=True),
    "columns": Bounds(2, 255, whole=True),
    "pitch_mm": _LENGTH,
    "row_pitch_mm": _LENGTH_OR_ZERO,
    "unit": Bounds(0, 1e6, above=True),
    "bits": Bounds(4, 16, whole=True),
    "exponent": Bounds(0.2, 3.0, above=True),
    "noise": Bounds(0, 1e4, above=True),
    "height_mm": _LENGTH,
    "tab_diameter_mm": _LENGTH,
    "young_mpa": Bounds(0, 1e4, above=True),
    "poisson": Bounds(0, 0.5),
    "membrane_mm": _LENGTH_OR_ZERO,
    "blur_mm": _LENGTH_OR_ZERO,
}


class SensorTypeError(DocumentError):
    """A sensor type that is not known, or a file of one that cannot be used."""


def _check_values(given: Any, choices: dict[str, Any]) -> None:
    """Refuse values that no file of a type may have; numbers of NumPy become plain ones."""
    problems = []
    for name, bounds in BOUNDS.items():
        if name not in given.__slots__:
            continue
        value = getattr(given, name)
        if fix := needed_number(value, **bounds._asdict()):
            problems.append(Problem(f"{name} {value!r}", fix))
        else:
            object.__setattr__(given, name, int(value) if bounds.whole else float(value))
    for name, kind in choices.items():
        value, allowed = getattr(given, name), get_args(kind)
        if value not in allowed:
            problems.append(Problem(f"{name} {value!r}", f"give {' or '.join(allowed)}"))
    if problems:
        raise SensorTypeError(problems)


def name_fault(name: object) -> tuple[str, str] | None:
    """Return what is wrong with a type's name, and the way out."""
    if isinstance(name, str) and _NAME.match(name):
        return None
    fix = "use small letters, digits and - _ . as in flexitac-12x32"
    return f"{name!r} is no name for a sensor type", fix


def missing_fault(row: int, column: int, rows: int, columns: int) -> tuple[str, str] | None:
    """Return what is wrong with the place of a missing tactel, and the way out."""
    if row in range(rows) and column in range(columns):
        return None
    cause = (
        f"a missing tactel in row {row}, column {column}; the matrix has rows "
        f"0 ... {rows - 1} and columns 0 ... {columns - 1}"
    )
    return cause, "count rows and columns from 0"


def misfits(
    value: str, kind: str, pitch_mm: float, row_pitch_mm: float
) -> Iterator[tuple[tuple[str, ...], str, str]]:
    """Yield what does not fit together: the setting in a file, the cause, the way out."""
    depth = value == "depth"
    if depth != (kind == "gel"):
        fix = (
            "a gel shows depth, tabs and pads do not: write both or neither of "
            "value: depth and overlay: {kind: gel}"
        )
        where = ("value",) if depth else ("overlay", "kind")
        yield where, f"value {value} with a {kind} overlay", fix
    if row_pitch_mm and kind != "tab":
        cause = f"rows {row_pitch_mm:g} mm and columns {pitch_mm:g} mm apart under a {kind}"
        yield ("row_pitch",), cause, "take tabs, or one pitch for both"


@dataclass(frozen=True, slots=True)
class Overlay:
    """The elastomer between the sensor and the object: separate tabs, one pad, or a gel.

    Young's modulus and Poisson's ratio are those at small strain. A tab is a round column bonded
    to the sensor; a pad is one layer bonded to it; a gel is a soft layer behind a membrane, whose
    height is seen, not its force.
    """

    kind: OverlayKind = "tab"
    height_mm: float = 2.0  #: of a tab, or thickness of pad or gel
    tab_diameter_mm: float = 1.2666  #: half of a cell's area; no meaning for pad and gel
    young_mpa: float = 1.0
    poisson: float = 0.4999
    membrane_mm: float = 0.0  #: of a gel: way over which its membrane bridges next to a stroke
    blur_mm: float = 0.0  #: of a gel: standard deviation of what optics and matching blur

    def __post_init__(self) -> None:
        """Refuse what a file of a type would not say either."""
        _check_values(self, {"kind": OverlayKind})


@dataclass(frozen=True, slots=True)
class SensorType:
    """A matrix of tactels, its overlay and its readings; the default is `fsr-16`, the thesis's own.

    Examples
    --------
    >>> sensor = SensorType()
    >>> sensor.name, sensor.rows, sensor.columns, sensor.pitch_mm
    ('fsr-16', 16, 16, 1.5875)
    >>> sensor.half_mm
    (12.7, 12.7)
    """

    rows: int = 16
    columns: int = 16
    pitch_mm: float = 1.5875  #: from column to column, and from row to row
    overlay: Overlay = field(default_factory=Overlay)
    name: str = "fsr-16"
    value: Value = "counts"  #: what a reading is
    unit: float = 1.0  #: of one count: S of conductance, N of force, mm of depth
    bits: int = 10  #: of a reading
    exponent: float = 1.0  #: law: a reading grows with force (depth) to this power
    wiring: Wiring = "grounded"  #: of the rows that are not read
    noise: float = 0.3  #: counts, standard deviation of a tactel at rest
    missing: tuple[tuple[int, int], ...] = ()  #: (row, column) of places without a tactel
    row_pitch_mm: float = 0.0  #: from row to row where it is another; 0: the same

    def __post_init__(self) -> None:
        """Refuse what a file of a type would not say either."""
        if not isinstance(self.overlay, Overlay):
            fix = 'give an Overlay: Overlay(kind="pad")'
            raise SensorTypeError([Problem(f"overlay {self.overlay!r}", fix)])
        _check_values(self, {"value": Value, "wiring": Wiring})
        faults = [name_fault(self.name)]
        faults += [
            fault[1:]
            for fault in misfits(self.value, self.overlay.kind, self.pitch_mm, self.row_pitch_mm)
        ]
        try:
            faults += [missing_fault(row, column, *self.shape) for row, column in self.missing]
            hash(self.missing)
        except (TypeError, ValueError):
            faults.append((f"missing {self.missing!r}", "give a tuple of pairs: ((row, column),)"))
        if problems := [Problem(*fault) for fault in faults if fault]:
            raise SensorTypeError(problems)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns

    @property
    def full(self) -> int:
        """Highest reading, counts."""
        return (1 << self.bits) - 1

    @property
    def step_mm(self) -> tuple[float, float]:
        """From column to column (x) and from row to row (y), mm."""
        return self.pitch_mm, self.row_pitch_mm or self.pitch_mm

    @property
    def half_mm(self) -> tuple[float, float]:
        """Half the width (x) and half the height (y) of the matrix, mm."""
        return self.columns * self.step_mm[0] / 2, self.rows * self.step_mm[1] / 2

    @property
    def reach_mm(self) -> float:
        """Radius of the circle about the centre that holds the whole matrix, mm."""
        return math.hypot(*self.half_mm)

    @property
    def across_mm(self) -> float:
        """Side of the square of the matrix's area, mm."""
        return 2 * math.sqrt(self.half_mm[0] * self.half_mm[1])

    @property
    def symbol_pitch_mm(self) -> float:
        """Pitch of symbols that the type reads best, mm; `encode-object --sensor-type` takes it.

        The largest that shows `CELLS` symbols on the matrix's area, but at most `TACTELS` tactels
        to a symbol (`PAD_TACTELS` under a pad, which blurs): finer sampling gains nothing. Not
        under `LEAST_TACTELS` tactels to a symbol, of which few touches are answered.

        Examples
        --------
        >>> SensorType().symbol_pitch_mm
        5.0
        """
        tactels = PAD_TACTELS if self.overlay.kind == "pad" else TACTELS
        area = float(self.present().sum()) * math.prod(self.step_mm)
        most = min(tactels * max(self.step_mm), math.sqrt(area / CELLS))
        grid = math.floor(most / PITCH_GRID_MM + 1e-9) * PITCH_GRID_MM
        return max(LEAST_PITCH_MM, grid, LEAST_TACTELS * max(self.step_mm))

    @property
    def coarseness(self) -> float:
        """How many times larger its symbols are than those of `fsr-16`."""
        return self.symbol_pitch_mm / USUAL_SENSOR.symbol_pitch_mm

    def centres_mm(self) -> NDArray[np.float64]:
        """Return the tactels' centres, (rows, columns, 2), sensor frame."""
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.step_mm[0]
        y = ((self.rows - 1) / 2 - np.arange(self.rows)) * self.step_mm[1]
        centres = np.empty((self.rows, self.columns, 2))
        centres[..., 0] = x
        centres[..., 1] = y[:, None]
        return centres

    def with_overlay(self, kind: str) -> SensorType:
        """Return the sensor under usual tabs or a usual pad; unchanged where `kind` is its own."""
        if kind in ("", self.overlay.kind):
            return self
        if kind == "tab":
            usual = Overlay()
            share = self.pitch_mm / SensorType().pitch_mm
            overlay = replace(usual, tab_diameter_mm=usual.tab_diameter_mm * share)
            return replace(self, overlay=overlay)
        return replace(self, overlay=Overlay(kind="pad")) if kind == "pad" else self

    def present(self) -> NDArray[np.bool_]:
        """Return where there are tactels, (rows, columns)."""
        there = np.ones(self.shape, np.bool_)
        for row, column in self.missing:
            there[row, column] = False
        return there


USUAL_SENSOR = SensorType()


def force_share(sensor: SensorType) -> float:
    """Return the share of forces on `fsr-16` that a type is pressed with.

    Pressure is equal, or for a gel the imprint: it is far softer than tabs, and the forces of
    `fsr-16` on its area would press symbols and bare face alike into it.
    """
    area_mm2 = 4 * math.prod(sensor.half_mm)
    if sensor.overlay.kind == "gel":
        bed_n_mm3 = sensor.overlay.young_mpa / sensor.overlay.height_mm
        return GEL_IMPRINT_MM * bed_n_mm3 * area_mm2 / USUAL_FORCE_N
    return area_mm2 / (4 * math.prod(USUAL_SENSOR.half_mm))


def usual_force_n(sensor: SensorType) -> float:
    """Return the force that a type is pressed with by default, N; 80 for `fsr-16`."""
    return USUAL_FORCE_N * force_share(sensor)


def sensor_type_text(sensor: SensorType) -> str:
    """Return a type as YAML, as recordings and runs carry it; equal types give equal text.

    Examples
    --------
    >>> from encoded_objects.base.sensor_type_file import parse_sensor_type
    >>> parse_sensor_type(sensor_type_text(SensorType()), "text") == SensorType()
    True
    """
    overlay = sensor.overlay
    lines = [
        "version: 1",
        f"name: {sensor.name}",
        f"rows: {sensor.rows}",
        f"columns: {sensor.columns}",
        f"pitch: {sensor.pitch_mm!r} mm",
        *([f"row_pitch: {sensor.row_pitch_mm!r} mm"] if sensor.row_pitch_mm else []),
        "overlay:",
        f"  kind: {overlay.kind}",
        f"  height: {overlay.height_mm!r} mm",
        f"  tip: {overlay.tab_diameter_mm!r} mm",
        f"  young: {overlay.young_mpa!r}",
        f"  poisson: {overlay.poisson!r}",
        f"  membrane: {overlay.membrane_mm!r} mm",
        f"  blur: {overlay.blur_mm!r} mm",
        f"value: {sensor.value}",
        f"unit: {sensor.unit!r}",
        f"bits: {sensor.bits}",
        f"exponent: {sensor.exponent!r}",
        f"wiring: {sensor.wiring}",
        f"noise: {sensor.noise!r}",
        *(["missing:"] if sensor.missing else []),
        *(f"  - {{rows: {row}, columns: {column}}}" for row, column in sensor.missing),
    ]
    return "\n".join(lines) + "\n"


def choose_sensor_type(
    asked: str | Path | SensorType | None, stored: str, shape: tuple[int, int] | None, place: str
) -> SensorType:
    """Return the type of images: the one asked for, else the stored one, else `fsr-16`.

    Parameters
    ----------
    asked
        A type, its name or file, as a person gave it; None or empty: not given.
    stored
        YAML of a type, as a recording carries it; empty: none.
    shape
        Rows and columns of the images; None: not known yet.
    place
        File or URL, for messages.

    Raises
    ------
    SensorTypeError
        No sensor type, or images of another shape than the type.
    """
    unknown = False
    if isinstance(asked, SensorType):
        found = asked
    elif asked:
        from encoded_objects.base.sensor_type_file import sensor_type_named

        if not isinstance(asked, str | Path):
            fix = "give a SensorType, or the name or the file of one"
            raise SensorTypeError([Problem(f"{asked!r} is no sensor type", fix)])
        found = sensor_type_named(str(asked))
    elif stored and stored != sensor_type_text(USUAL_SENSOR):
        from encoded_objects.base.sensor_type_file import parse_sensor_type

        found = parse_sensor_type(stored, f"{place}, attribute sensor_type")
    else:
        found = USUAL_SENSOR
        unknown = True
    if shape is None or shape == found.shape:
        return found
    cause = f"images of {shape[0]} x {shape[1]} readings, "
    if unknown:
        cause += "and nothing tells their sensor type"
    else:
        cause += f"{found.name} has {found.rows} x {found.columns}"
    fix = fix_of_type(lambda kind: kind.shape == shape)
    raise SensorTypeError([Problem(cause, fix, file=place)])


def fix_of_type(suits: Callable[[SensorType], bool]) -> str:
    """Return the way out of images of another type: the shipped ones that suit, or a file."""
    alike = shipped_like(suits)
    named = f"{alike}, or " if alike else ""
    return f"give --sensor-type {named}a file; probe-sensor types shows how one is written"


def shipped_like(suits: Callable[[SensorType], bool]) -> str:
    """Return the names of the shipped types that suit, in words; empty of none."""
    from encoded_objects.base.sensor_type_file import sensor_type_named, shipped_names

    return " or ".join(name for name in shipped_names() if suits(sensor_type_named(name)))
