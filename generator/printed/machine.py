"""A machine that follows G-code: line by line -> one row for each straight move.

Absolute and relative coordinates, offsets, inches, arcs as chords, and what comments say of
features, widths and heights. `gcode` makes a Toolpath of the rows. mm, machine frame.
"""

from __future__ import annotations

import math
import re

from generator.errors import PrintError
from generator.printed.arc import ArcError, chords
from generator.printed.dialect import (
    HEIGHT_NOTES,
    NOTE,
    ROLE_NOTES,
    VOLUMETRIC,
    WIDTH_NOTES,
    role_of,
)

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
        if command == "G20":
            self.unit = _INCH_MM
        elif command == "G21":
            self.unit = 1.0
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
    """Return the words of a line without spaces."""
    text = "".join(f" {c}" if c.isalpha() else c for c in code.upper().replace(" ", ""))
    return text.split()
