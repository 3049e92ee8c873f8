"""Files that people write: their text, and what is wrong with it at which line and column, from 1.

A `DocumentKind` holds the words of messages about one kind of file, and the error that its package
raises. A problem prints as `file:line:column: error: cause`, the line, a caret and a `fix:`.
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from encoded_objects.base.errors import EncodedObjectsError, printable
from encoded_objects.base.foreign import open_regular

_LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
BYTES_MAX = 256 * 1024  #: of a file
LINE_SHOWN = 100  # characters of a source line that are printed


@dataclass(frozen=True, slots=True)
class TextSource:
    """A file as it was read."""

    name: str  #: as the person named it
    lines: tuple[str, ...] = field(repr=False)

    @classmethod
    def of(cls, name: str, text: str) -> TextSource:
        """Return a file by its name and its text; lines end where YAML ends them."""
        return cls(name, tuple(_LINE_END.split(text)))


@dataclass(frozen=True, slots=True)
class SourceMark:
    """A place in a file."""

    source: TextSource
    line: int  #: from 1
    column: int  #: from 1

    @classmethod
    def at(cls, source: TextSource, before: str) -> SourceMark:
        """Return the place that follows the text `before`."""
        lines = _LINE_END.split(before)
        return cls(source, len(lines), len(lines[-1]) + 1)

    def __str__(self) -> str:
        return f"{self.source.name}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong, where, and the way out."""

    cause: str
    fix: str = ""
    mark: SourceMark | None = None
    file: str = ""  #: where there is no line to show

    @property
    def place(self) -> str:
        """`file:line:column`, or the file alone."""
        return str(self.mark) if self.mark else self.file

    def as_json(self) -> dict[str, Any]:
        """Return the problem as plain values."""
        return {
            "place": self.place,
            "file": self.mark.source.name if self.mark else None,
            "line": self.mark.line if self.mark else None,
            "column": self.mark.column if self.mark else None,
            "cause": self.cause,
            "fix": self.fix,
        }

    def __str__(self) -> str:
        """Return the problem as it is printed."""
        place = printable(self.place)
        head = f"{place}: error: " if place else "error: "
        text = [head + "\n".join(printable(line) for line in self.cause.split("\n"))]
        if self.mark:
            text += _excerpt(self.mark)
        if self.fix:
            text.append(f"  fix: {printable(self.fix)}")
        return "\n".join(text)


class DocumentError(EncodedObjectsError):
    """A file that cannot be used; holds every problem that was found, in file order."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        first = self.problems[0]
        more = len(self.problems) - 1
        cause = first.cause + (f" (and {more} more)" if more else "")
        super().__init__(cause, fix=first.fix, place=first.place)

    def __reduce__(self) -> tuple[type[DocumentError], tuple[tuple[Problem, ...]]]:
        """Return how another process sends the error here."""
        return type(self), (self.problems,)

    def __str__(self) -> str:
        """Return all problems as they are printed."""
        return "\n\n".join(str(problem) for problem in self.problems)

    def as_text(self) -> str:
        """Return all problems as they are printed."""
        return str(self)

    def as_json(self) -> dict[str, Any]:
        """Return the first problem as every error, and all of them under `problems`."""
        return super().as_json() | {"problems": [problem.as_json() for problem in self.problems]}


@dataclass(frozen=True, slots=True)
class DocumentKind:
    """The words of messages about one kind of file."""

    error: type[DocumentError]  #: what is raised when it cannot be used
    name: str  #: as "a spec"
    empty: str  #: the way out where the file holds nothing
    example: str  #: the command or the page that shows a right one
    first: str  #: the way out where there is no such file, nor a similar one
    several: str = "write one document"  #: where a second document starts
    repeat: str = "write the value out"  #: where a value is named to be repeated
    large: str = "make it smaller"


def read_text(path: Path, kind: DocumentKind) -> str:
    """Return the text of a file: UTF-8, at most 256 KiB.

    Raises DocumentError: the file is missing (the fix names similar ones), too large, or not UTF-8.
    """

    def refusal(cause: str, fix: str) -> DocumentError:
        return kind.error([Problem(cause, fix, file=str(path))])

    try:
        with open_regular(path) as file:
            data = file.read(BYTES_MAX + 1)
    except FileNotFoundError:
        raise refusal("there is no such file", _suggest_similar(path, kind)) from None
    except OSError as error:
        if os.path.isdir(path):
            fix = f"name the files in it, for example {path / '*.yaml'}"
            raise refusal(f"this is a folder, not {kind.name}", fix) from None
        fix = "check the name and the rights of the file"
        raise refusal(f"cannot read: {error.strerror}", fix) from None
    if len(data) > BYTES_MAX:
        raise refusal(f"the file is larger than {BYTES_MAX // 1024} KiB", kind.large)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        source = TextSource.of(str(path), data.decode("utf-8", errors="replace"))
        mark = SourceMark.at(source, data[: error.start].decode("utf-8"))
        cause = f"byte 0x{data[error.start]:02x} is not UTF-8 text"
        raise kind.error([Problem(cause, "save the file as UTF-8", mark)]) from None


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the known word nearest to `word`, or an empty string where none is near."""
    lowered = {name.lower(): name for name in known}
    near = get_close_matches(word.lower()[:80], lowered, n=1, cutoff=0.6)
    return lowered[near[0]] if near else ""


def suggest(word: str, known: Iterable[str], otherwise: str) -> str:
    """Return a fix that names the known word nearest to `word`, or `otherwise`."""
    near = did_you_mean(word, known)
    return f"did you mean '{near}'?" if near else otherwise


def _suggest_similar(path: Path, kind: DocumentKind) -> str:
    """Return a fix that names similar files of the same folder."""
    try:
        siblings = sorted(entry.name for entry in path.parent.iterdir())
    except (OSError, ValueError):
        return f"check the folder '{path.parent}'"
    near = get_close_matches(path.name, siblings, n=3, cutoff=0.6)
    if near:
        return "did you mean " + " or ".join(f"'{path.parent / name}'" for name in near) + "?"
    return kind.first


def _excerpt(mark: SourceMark) -> list[str]:
    """Return the source line and the caret under the place; empty past the last line."""
    if not 1 <= mark.line <= len(mark.source.lines):
        return []
    line = mark.source.lines[mark.line - 1].replace("\t", " ")
    at = min(mark.column - 1, len(line))
    start = max(0, min(at - LINE_SHOWN // 2, len(line) - LINE_SHOWN))
    shown = printable(line[start : start + LINE_SHOWN]).rstrip()
    width = sum(_cells(c) for c in line[start:at])
    return [f"{mark.line:5d} | {shown}", f"      | {' ' * width}^"]


def _cells(character: str) -> int:
    """Return how many terminal cells a character takes."""
    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in "FW" else 1
