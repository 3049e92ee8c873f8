"""G-code file -> Toolpath: where a nozzle goes and how much plastic leaves it.

G-code frame: mm, as the file has it, z up from the bed; z of a move is the nozzle's, which is the
top of the bead that it leaves. Reads G0-G3, G10/G11, G20/G21, G28, G90-G92, M82/M83, M200 in
absolute and relative coordinates, of Marlin, Klipper and RepRapFirmware. As in Klipper and
PrusaSlicer, G91 makes E relative too and M83 does so alone. M221, a machine's own correction of its
extruder, is left out. A `.gcode.3mf` of Bambu Studio is opened, binary G-code is refused.

Comments give features, widths and heights: of PrusaSlicer and its kin (`;TYPE:External
perimeter`, `;WIDTH:0.45`, `;HEIGHT:0.2`), Cura (`;TYPE:WALL-OUTER` alone), Bambu Studio and
OrcaSlicer for Bambu printers (`; FEATURE: Outer wall`, `; LINE_WIDTH: 0.42`,
`; LAYER_HEIGHT: 0.2`). Arcs (G2 clockwise, G3 counter-clockwise, in the plane of the bed) become
chords within `CHORD_MM` of them.
"""

from __future__ import annotations

import io
import math
import re
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from encoded_objects.base.foreign import DAMAGE, foreign_bytes, foreign_member
from generator.errors import PrintError

Floats = NDArray[np.float64]
Index = NDArray[np.int64]

#: What a move is for; slicers' own words become these. The last four leave nothing on the part.
ROLES = (
    "unknown", "outer wall", "inner wall", "overhang", "top", "solid", "infill", "bridge",
    "gap fill", "ironing", "travel", "skirt", "support", "custom",
)  # fmt: skip
_OF_PART = ROLES.index("travel")


def role_number(name: str) -> int:
    """Return the number by which `Toolpath.role` knows a role."""
    return ROLES.index(name)


@dataclass(frozen=True, slots=True, eq=False)
class Toolpath:
    """All moves of a file."""

    name: str  #: of the file
    dialect: str  #: prusaslicer, cura, bambu, orca or unknown
    start_mm: Floats  #: (n, 3)
    end_mm: Floats  #: (n, 3)
    volume_mm3: Floats  #: (n,) plastic that leaves the nozzle, 0 on travels
    height_mm: Floats  #: (n,) of the layer, or a bridge's own
    width_mm: Floats  #: (n,) as the file announces it, nan where it does not
    speed_mm_s: Floats  #: (n,)
    role: Index  #: (n,) number in `ROLES`

    def __len__(self) -> int:
        return len(self.role)

    @property
    def of_part(self) -> NDArray[np.bool_]:
        """(n,) whether a move leaves plastic that stays on the part."""
        return (self.volume_mm3 > 0) & (self.role < _OF_PART)

    @property
    def length_mm(self) -> Floats:
        """(n,) length of each move."""
        length: Floats = np.linalg.norm(self.end_mm - self.start_mm, axis=1)
        return length

    def strokes(self) -> Index:
        """Return the stroke that each move belongs to, (n,), -1 for those that leave nothing.

        A stroke is a run of moves of one role at one height, without a travel between them.
        """
        laying = self.of_part
        breaks = np.ones(len(self), np.bool_)
        same = (self.role[1:] == self.role[:-1]) & laying[:-1]
        same &= np.abs(self.end_mm[1:, 2] - self.end_mm[:-1, 2]) < LEVEL_MM
        breaks[1:] = ~same
        numbers = np.cumsum(breaks & laying) - 1
        return np.where(laying, numbers, -1)


LEVEL_MM = 1e-3  #: heights that differ by less are one layer
CHORD_MM = 0.005
_MOST = 100_000  # chords of one arc: a sound file has some hundreds
_ROUND = 0.05  # mm by which the two radii of an arc may differ: files round to 0.001

Point = tuple[float, float]


class ArcError(ValueError):
    """An arc that leads nowhere; says why."""


def chords(start: Point, end: Point, words: dict[str, float], *, clockwise: bool) -> list[Point]:
    """Return the points (mm) after `start` on an arc, `end` the last; a full circle if equal.

    `words`: I and J, from the start to the centre, or R, the radius, negative for the longer arc;
    P further full turns. Raises `ArcError` if these do not lead from start to end.

    >>> chords((1, 0), (0, 1), {"I": -1.0}, clockwise=False)[-1]
    (0, 1)
    """
    centre = _centre(start, end, words, clockwise)
    radius = math.dist(start, centre)
    if radius <= 0 or abs(math.dist(end, centre) - radius) > _ROUND:
        raise ArcError("the arc's centre is not as far from its end as from its start")
    first = math.atan2(start[1] - centre[1], start[0] - centre[0])
    last = math.atan2(end[1] - centre[1], end[0] - centre[0])
    sweep = (first - last if clockwise else last - first) % (2 * math.pi)
    if math.dist(start, end) < 1e-6:
        sweep = 2 * math.pi
    sweep += 2 * math.pi * max(0, int(words.get("P", 1)) - 1)
    step = 2 * math.acos(max(0.0, 1 - CHORD_MM / radius))
    count = max(1, math.ceil(sweep / max(step, 1e-9)))
    if count > _MOST:
        raise ArcError(f"an arc of radius {radius:g} mm with {count} chords")
    sign = -1 if clockwise else 1
    angles = (first + sign * sweep * k / count for k in range(1, count))
    points = [(centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in angles]
    return [*points, end]


def _centre(start: Point, end: Point, words: dict[str, float], clockwise: bool) -> Point:
    if "I" in words or "J" in words:
        return start[0] + words.get("I", 0.0), start[1] + words.get("J", 0.0)
    if "R" not in words:
        raise ArcError("an arc needs its centre (I, J) or its radius (R)")
    radius, chord = words["R"], math.dist(start, end)
    if not 0 < chord <= 2 * abs(radius) + _ROUND:
        raise ArcError(f"an arc of radius {abs(radius):g} mm does not reach {chord:g} mm")
    height = math.sqrt(max(0.0, radius * radius - chord * chord / 4))
    side = height if (radius > 0) != clockwise else -height
    x, y = (end[0] - start[0]) / chord, (end[1] - start[1]) / chord
    return (start[0] + end[0]) / 2 - side * y, (start[1] + end[1]) / 2 + side * x


#: A comment that says something of the moves after it, and what it says.
NOTE = re.compile(
    r";\s*(TYPE|FEATURE|WIDTH|LINE_WIDTH|HEIGHT|LAYER_HEIGHT|filament_diameter)\s*[:=]\s*(.+)"
)
ROLE_NOTES = ("TYPE", "FEATURE")
WIDTH_NOTES = ("WIDTH", "LINE_WIDTH")
HEIGHT_NOTES = ("HEIGHT", "LAYER_HEIGHT")

#: Comments by which Cura says that E is a volume.
VOLUMETRIC = (";FLAVOR:Marlin(Volumetric)", ";FLAVOR:UltiGCode")

#: Marks in comments by which a slicer is known.
_DIALECTS = {
    "prusaslicer": "prusaslicer", "superslicer": "prusaslicer", "slic3r": "prusaslicer",
    "bambustudio": "bambu", "orcaslicer": "orca", "cura_steamengine": "cura", "flavor:": "cura",
}  # fmt: skip
#: The first of these words that stands in a feature's name names its role.
_FEATURES = {
    "skirt": "skirt", "brim": "skirt", "support": "support", "tower": "support", "wipe": "support",
    "prime": "support", "custom": "custom", "ironing": "ironing", "overhang": "overhang",
    "bridge": "bridge", "gap": "gap fill", "thin wall": "gap fill",
    "external perimeter": "outer wall", "outer": "outer wall", "perimeter": "inner wall",
    "inner": "inner wall", "top": "top", "solid": "solid", "bottom": "solid", "skin": "solid",
    "fill": "infill", "sparse": "infill",
}  # fmt: skip


def dialect_of(comment: str) -> str:
    """Return the dialect that a comment names, or nothing."""
    text = comment.lower()
    return next((dialect for mark, dialect in _DIALECTS.items() if mark in text), "")


def role_of(feature: str) -> int:
    """Return the role of a feature by its name in any of the dialects.

    >>> ROLES[role_of("External perimeter")], ROLES[role_of("WALL-OUTER")]
    ('outer wall', 'outer wall')
    """
    text = feature.strip().lower()
    return ROLES.index(next((role for word, role in _FEATURES.items() if word in text), "unknown"))


_INCH_MM = 25.4
_AXES = "XYZ"
_JOINED = re.compile(r"^[GgNn][\d.]+[A-Za-z]|^[Gg]\d.*[\d.][A-Za-z]")  # G1X10Y5: no spaces
_BRACKETS = re.compile(r"\([^)]*\)")  # comments of another kind
_SETTINGS = ("G18", "G19", "G20", "G21", "G28", "G90", "G91", "G92", "M82", "M83", "M200")

#: What a row holds: start x, y, z; end x, y, z; filament fed, mm or mm3; height and width of the
#: bead as announced, nan where they are not; speed mm/s; role; whether fed is a volume; whether
#: a feature had been announced before.
COLUMNS = 13


class Machine:
    """The state of a machine while it follows a file."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.line_number = 0
        self.at = [0.0, 0.0, 0.0]  # mm, machine
        self.offset = [0.0, 0.0, 0.0]  # mm, machine less what the file calls it
        self.e = 0.0
        self.unit = 1.0
        self.relative = self.relative_e = False
        self.volumetric = False
        self.speed = 0.0
        self.role, self.width, self.height = 0, math.nan, math.nan
        self.filament = math.nan
        self.features = False
        self.rows: list[tuple[float, ...]] = []

    def line(self, line: str) -> None:
        """Follow one line."""
        code, mark, comment = line.partition(";")
        if mark:
            self._note(mark + comment.rstrip())
        if "(" in code:
            code = _BRACKETS.sub("", code)
        words = _split_words(code) if _JOINED.search(code) else code.split()
        if not words:
            return
        if words[0][0] in "Nn":
            words = words[1:]
        command = words[0].upper() if words else ""
        if command[:1] not in ("G", "M"):
            return
        if command in ("G0", "G1", "G00", "G01"):
            self._move(self._values(words[1:]), "")
        elif command in ("G2", "G3", "G02", "G03"):
            self._move(self._values(words[1:]), command[-1])
        elif command in _SETTINGS:
            self._set(command, words[1:])

    def _note(self, comment: str) -> None:
        match = NOTE.match(comment)
        if match is None:
            self.volumetric |= comment.startswith(VOLUMETRIC)
            return
        key, value = match.groups()
        if key in ROLE_NOTES:
            self.features = True
            self.role = role_of(value)
            return
        try:
            number = float(value.split(",")[0])
        except ValueError:
            raise self._error(f"'{value}' is no number in '{comment.strip()}'") from None
        if key in WIDTH_NOTES:
            self.width = number
        elif key in HEIGHT_NOTES:
            self.height = number
        elif number > 0:
            self.filament = number

    def _values(self, words: list[str]) -> dict[str, float]:
        values = {}
        for word in words:
            if word[0] == "*":  # checksum
                break
            try:
                value = float(word[1:].partition("*")[0])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise self._error(f"'{word}' is no number")
            values[word[0].upper()] = value
        return values

    def _set(self, command: str, words: list[str]) -> None:
        if command in ("G20", "G21"):
            self.unit = _INCH_MM if command == "G20" else 1.0
        elif command in ("G90", "G91"):
            self.relative = command == "G91"
        elif command in ("M82", "M83"):
            self.relative_e = command == "M83"
        elif command == "M200":
            self.volumetric = self._values(words).get("D", 0.0) > 0
        elif command in ("G18", "G19"):
            raise self._error(f"{command}: arcs upright on the bed are not read")
        elif command == "G28":
            axes = [k for k in range(3) if any(word[0].upper() == _AXES[k] for word in words)]
            for axis in axes or range(3):
                self.at[axis] = self.offset[axis] = 0.0
        elif command == "G92":
            for letter, value in self._values(words).items():
                if letter == "E":
                    self.e = value * self.unit
                elif letter in _AXES:
                    k = _AXES.index(letter)
                    self.offset[k] = self.at[k] - value * self.unit

    def _move(self, words: dict[str, float], arc: str) -> None:
        if "F" in words:
            self.speed = words["F"] * self.unit / 60
        target = list(self.at)
        for k, axis in enumerate("XYZ"):
            if axis in words:
                base = self.at[k] if self.relative else self.offset[k]
                target[k] = base + words[axis] * self.unit
        fed = 0.0
        if "E" in words:
            fed = words["E"] * self.unit - (0.0 if self.relative or self.relative_e else self.e)
            self.e += fed
        start, end = (self.at[0], self.at[1]), (target[0], target[1])
        points = [end]
        if arc:
            units = {key: words[key] * self.unit for key in "IJR" if key in words}
            units |= {"P": words["P"]} if "P" in words else {}
            try:
                points = chords(start, end, units, clockwise=arc == "2")
            except ArcError as error:
                raise self._error(str(error)) from None
        rise = (target[2] - self.at[2]) / len(points)
        before, z = start, self.at[2]
        total = sum(math.dist(a, b) for a, b in zip([start, *points], points, strict=False))
        for k, point in enumerate(points):
            after = target[2] if k + 1 == len(points) else z + rise
            share = math.dist(before, point) / total if total > 0 else 0.0
            # Plastic without a way is a retraction taken back.
            volume = max(0.0, fed * share) if total > 0 else 0.0
            self.rows.append(
                (*before, z, *point, after, volume, self.height, self.width, self.speed,
                 self.role, self.volumetric, self.features)
            )  # fmt: skip
            before, z = point, after
        self.at = target

    def _error(self, cause: str) -> PrintError:
        place = f"{self.name}:{self.line_number}"
        return PrintError(cause, fix="export the G-code again", place=place)


def _split_words(code: str) -> list[str]:
    text = "".join(f" {c}" if c.isalpha() else c for c in code.upper().replace(" ", ""))
    return text.split()


FILAMENT_MM = 1.75  #: diameter where a file does not tell
_HEAD = 4096  # characters of a file in which its slicer gives its name
# Announced widths are kept to a few percent; filament of 2.85 mm read as 1.75 is out by 2.65.
_WIDTHS_AGREE = (0.7, 1.5)


_MOST_BYTES = 1 << 28  # of G-code: 8 million moves, whose lines are read in minutes


def read_gcode(path: Path | str) -> Toolpath:
    """Read `.gcode`, `.gco`, `.g`, or the first plate of Bambu Studio's `.gcode.3mf`.

    The filament is as thick as the file says, else 1.75 mm. Raises `PrintError` (with file:line)
    for a file that cannot be read, a word that is no number, an arc that leads nowhere, nothing
    extruded, or volumes that contradict the widths announced.
    """
    path = Path(path)
    content = foreign_bytes(path, PrintError, most=_MOST_BYTES, fix="check the name")
    return toolpath_of(_text(content, str(path)), str(path))


def toolpath_of(text: str, name: str = "G-code") -> Toolpath:
    """Return the moves of G-code that was read; `name` stands in errors. See `read_gcode`."""
    machine = Machine(name)
    for number, line in enumerate(io.StringIO(text), 1):
        machine.line_number = number
        machine.line(line)
    head = next((found for line in text[:_HEAD].splitlines() if (found := dialect_of(line))), "")
    return _toolpath(machine, head or "unknown")


def _text(content: bytes, name: str) -> str:
    if content[:4] == b"GCDE":
        raise PrintError(
            "this is binary G-code", fix="switch 'binary G-code' off and export again", place=name
        )
    if content[:4] == b"PK\x03\x04":
        try:
            with zipfile.ZipFile(io.BytesIO(content)) as archive:
                plates = sorted(n for n in archive.namelist() if n.endswith(".gcode"))
                content = foreign_member(archive, plates[0], _MOST_BYTES) if plates else b""
        except (*DAMAGE, zipfile.BadZipFile):
            content = b""
        if not content:
            raise PrintError(
                "no plate in it is sliced", fix="slice, then export the G-code", place=name
            )
    return content.decode("utf-8", errors="replace")


def _toolpath(machine: Machine, dialect: str) -> Toolpath:
    rows = np.array(machine.rows, np.float64).reshape(-1, COLUMNS)
    diameter = machine.filament if machine.filament > 0 else FILAMENT_MM
    area = math.pi * diameter**2 / 4
    volume = rows[:, 6] * np.where(rows[:, 11] > 0, 1.0, area)
    role = rows[:, 10].astype(np.int64)
    if machine.features:  # what comes before the first feature is the machine's own beginning
        role[rows[:, 12] == 0] = role_number("custom")
    role[volume == 0] = role_number("travel")
    path = Toolpath(
        name=machine.name,
        dialect=dialect,
        start_mm=rows[:, :3],
        end_mm=rows[:, 3:6],
        volume_mm3=volume,
        height_mm=rows[:, 7],
        width_mm=rows[:, 8],
        speed_mm_s=rows[:, 9],
        role=role,
    )
    laid = path.of_part
    if not laid.any():
        raise PrintError(
            f"nothing is printed in {machine.line_number} lines",
            fix="give G-code as a slicer writes it, with E",
            place=machine.name,
        )
    path.height_mm[:] = np.where(path.height_mm > 0, path.height_mm, _heights(path))
    _check_widths(path, diameter)
    return path


def _heights(path: Toolpath) -> Floats:
    """Return the height of each move's layer: its z less that of the layer below."""
    laid = path.of_part
    levels = np.unique(np.round(path.end_mm[laid, 2] / LEVEL_MM)) * LEVEL_MM
    layer = np.searchsorted(levels, path.end_mm[:, 2] + LEVEL_MM / 2, "right") - 1
    below = np.concatenate([[0.0], levels])
    heights: Floats = path.end_mm[:, 2] - below[layer.clip(0)]
    np.maximum(heights, LEVEL_MM, out=heights)
    return heights


def _check_widths(path: Toolpath, diameter: float) -> None:
    """Refuse volumes that contradict the widths announced: another filament was meant."""
    announced = path.of_part & (path.width_mm > 0) & (path.length_mm > 1.0)
    if np.count_nonzero(announced) < 10:
        return
    h = path.height_mm[announced]
    width = path.volume_mm3[announced] / path.length_mm[announced] / h + h * (1 - math.pi / 4)
    ratio = float(np.median(width / path.width_mm[announced]))
    if not _WIDTHS_AGREE[0] <= ratio <= _WIDTHS_AGREE[1]:
        raise PrintError(
            f"beads of {ratio:.2f} times the widths announced, with filament of {diameter:g} mm",
            fix="give the diameter of the filament, 1.75 or 2.85 mm",
            place=path.name,
        )
