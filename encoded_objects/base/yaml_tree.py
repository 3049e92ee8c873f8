"""Read a YAML file into plain values that remember their places.

File -> Tree: mappings, lists, text, numbers and truth values, with line and column of
every key and value. No anchors, no tags, one document, at most 16 levels, so that no file can cost
more than its size. Numbers follow YAML 1.2: `1:30`, `yes` and `2026-01-01` are text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from encoded_objects.base.document import DocumentKind, Problem, SourceMark, TextSource, read_text

DEPTH_MAX = 16

Place = tuple[str | int, ...]  #: keys and list positions from the root

_HALF_LETTER = re.compile("[\ud800-\udfff]")
_INTEGER = re.compile(r"[-+]?[0-9]{1,400}\Z")
_HEXADECIMAL = re.compile(r"0x[0-9a-fA-F]{1,300}\Z")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?\Z")
_WORDS: dict[str, Any] = {
    "": None, "~": None, "null": None, "Null": None, "NULL": None,
    "true": True, "True": True, "TRUE": True, "false": False, "False": False, "FALSE": False,
}  # fmt: skip

_SYNTAX = (
    (r"'\t'", "a tab cannot be used here", "use spaces"),
    ("mapping values are not allowed", "a second ':' stands where one value is expected",
     "start a new line, or put the value in quotes"),
    ("could not find expected ':'", "this line has no ':'", "write it as  name: value"),
    ("expected <block end>", "this line is not in step with the lines above",
     "indent it like the settings of the same block"),
    ("unexpected end of stream", "this quote is not closed", "close it"),
    ("that cannot start any token", "a value cannot start with this character",
     "put the value in quotes"),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Tree:
    """A value and the places of everything in it."""

    value: Any
    values: Mapping[Place, SourceMark] = field(repr=False)  #: where each value stands
    keys: Mapping[Place, SourceMark] = field(repr=False)  #: where each key stands
    folder: Path  #: that file names in it are relative to
    problems: tuple[Problem, ...] = ()  #: what is wrong with the file, though it could be read

    def value_mark(self, place: Place) -> SourceMark:
        """Return where the value at `place` stands, or the nearest thing that holds it."""
        while place and place not in self.values:
            place = place[:-1]
        return self.values[place]

    def key_mark(self, place: Place) -> SourceMark:
        """Return where the key at `place` stands, or the nearest thing that holds it."""
        return self.keys.get(place) or self.value_mark(place)

    def without(self, key: str) -> Tree:
        """Return the tree without the setting `key` of its root."""
        return Tree(
            {name: value for name, value in self.value.items() if name != key},
            {place: mark for place, mark in self.values.items() if place[:1] != (key,)},
            {place: mark for place, mark in self.keys.items() if place[:1] != (key,)},
            self.folder,
        )

    def parts(self) -> dict[str | int, Tree]:
        """Return the tree under each key, or under each position of a list."""
        keys = range(len(self.value)) if isinstance(self.value, list) else self.value
        values: dict[str | int, dict[Place, SourceMark]] = {key: {} for key in keys}
        names: dict[str | int, dict[Place, SourceMark]] = {key: {} for key in keys}
        for found, marks in ((values, self.values), (names, self.keys)):
            for place, mark in marks.items():
                if place and place[0] in found:
                    found[place[0]][place[1:]] = mark
        return {key: Tree(self.value[key], values[key], names[key], self.folder) for key in keys}


def read_tree(path: Path, kind: DocumentKind) -> Tree:
    """Read a YAML file; its name appears in messages as it is given here.

    The tree says what is wrong but does not stop reading: keys given twice, anchors, tags.

    Raises DocumentError: the file is missing, too large, too deep, not UTF-8, not YAML, or empty.
    """
    return tree_of(read_text(path, kind), str(path), path.parent, kind)


def tree_of(text: str, name: str, folder: Path, kind: DocumentKind) -> Tree:
    """Read YAML text as `read_tree` does; `name` stands in messages."""
    source = TextSource.of(name, text)
    reader = _Reader(source, folder, kind)
    try:
        return reader.tree(yaml.parse(text, Loader=yaml.SafeLoader))
    except yaml.YAMLError as error:
        raise kind.error([*reader.problems, explain_syntax(error, source, text, kind)]) from None


def explain_syntax(
    error: yaml.YAMLError, source: TextSource, text: str, kind: DocumentKind
) -> Problem:
    """Return the problem behind an error of the YAML parser, in plain words."""
    if isinstance(error, yaml.reader.ReaderError):
        at = SourceMark.at(source, text[: error.position])
        cause = f"control character U+{ord(text[error.position]):04X} in the text"
        return Problem(cause, "delete it", at)
    if not isinstance(error, yaml.MarkedYAMLError):
        return Problem(f"not YAML: {error}", file=source.name)
    said = error.problem or error.context or "not YAML"
    opened = error.context_mark
    where = opened if "end of stream" in said else error.problem_mark or opened
    mark = SourceMark(source, where.line + 1, where.column + 1) if where else None
    for bracket, other in (("{", "}"), ("[", "]")):
        if f"expected ',' or '{other}'" in said and opened:
            cause = (
                f"the '{bracket}' in line {opened.line + 1} is not closed, or a comma is missing"
            )
            return Problem(cause, f"close it with {other}", mark, source.name)
    if "mapping values" in said and where and (deeper := _too_deep(text, where.line, where.column)):
        return Problem(*deeper, SourceMark(source, where.line + 1, 1), source.name)
    for pattern, cause, fix in _SYNTAX:
        if pattern in said:
            return Problem(cause, fix, mark, source.name)
    return Problem(f"not YAML: {said}", f"compare with: {kind.example}", mark, source.name)


def _too_deep(text: str, line: int, column: int) -> tuple[str, str] | None:
    """Return cause and fix of a setting that stands deeper than one with a value above it."""
    lines = text.splitlines()
    above = [one for one in lines[:line] if one.strip() and not one.lstrip().startswith("#")]
    if not above or ":" in lines[line][:column]:
        return None
    name, indent = above[-1].partition(":")[0].strip(), len(above[-1]) - len(above[-1].lstrip())
    return (
        f"this line is indented, but '{name}' above it has a value already",
        f"begin it in column {indent + 1}, as the line above; or give '{name}' no value of its own",
    )


class _Reader:
    """Turns the events of the YAML parser into values and marks."""

    def __init__(self, source: TextSource, folder: Path, kind: DocumentKind) -> None:
        self.kind = kind
        self.source = source
        self.folder = folder
        self.problems: list[Problem] = []
        self.values: dict[Place, SourceMark] = {}
        self.keys: dict[Place, SourceMark] = {}

    def tree(self, events: Iterator[Any]) -> Tree:
        """Read one document; raises `DocumentError` with all that is wrong."""
        value: Any = None
        documents = 0
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                documents += 1
                if documents == 2:
                    self._refuse(event, "a second document starts here", self.kind.several)
                    break
                value = self._node(next(events), events, ())
        if value is None:
            if not self.problems:
                self.problems.append(
                    Problem("the file is empty", self.kind.empty, file=self.source.name)
                )
            raise self.kind.error(self.problems)
        return Tree(value, self.values, self.keys, self.folder, tuple(self.problems))

    def _node(self, event: Any, events: Iterator[Any], place: Place) -> Any:
        """Return the value that starts with `event`."""
        self.values[place] = self._mark(event)
        if isinstance(event, yaml.AliasEvent):
            self._refuse(
                event,
                f"'*{event.anchor}' repeats another value, which is not read here",
                self.kind.repeat,
            )
            return None
        if event.anchor is not None:
            self._refuse(
                event,
                f"'&{event.anchor}' names a value, which is not read here",
                "write the value without a name",
            )
        if event.tag is not None:
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            self._refuse(event, f"the tag '{tag}' is not read here", "leave the tag out")
        if isinstance(event, yaml.ScalarEvent):
            return self._scalar(event)
        if len(place) >= DEPTH_MAX:
            self._refuse(event, f"more than {DEPTH_MAX} levels of nesting", "flatten the file")
            raise self.kind.error(self.problems)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(events, place)
        return self._mapping(events, place)

    def _sequence(self, events: Iterator[Any], place: Place) -> list[Any]:
        values: list[Any] = []
        while not isinstance(event := next(events), yaml.SequenceEndEvent):
            values.append(self._node(event, events, (*place, len(values))))
        return values

    def _mapping(self, events: Iterator[Any], place: Place) -> dict[str, Any]:
        values: dict[str, Any] = {}
        while not isinstance(event := next(events), yaml.MappingEndEvent):
            key = self._key(event, events)
            if key is None:
                _discard(next(events), events)
                continue
            inner = (*place, key)
            if key in values:
                first = self.keys[inner]
                self._refuse(
                    event,
                    f"'{key}' is given twice, first in line {first.line}",
                    "leave one of them out",
                )
                _discard(next(events), events)
                continue
            self.keys[inner] = self._mark(event)
            values[key] = self._node(next(events), events, inner)
        return values

    def _key(self, event: Any, events: Iterator[Any]) -> str | None:
        if isinstance(event, yaml.ScalarEvent) and event.anchor is None and event.tag is None:
            return self._text(event)
        self._refuse(event, "a setting must have a plain name", "write it as  name: value")
        _discard(event, events)
        return None

    def _scalar(self, event: Any) -> Any:
        """Return a scalar's value by the rules of YAML 1.2; quoted text stays text."""
        text = self._text(event)
        if not event.implicit[0]:
            return text
        if text in _WORDS:
            return _WORDS[text]
        if _INTEGER.match(text):
            return int(text)
        if _HEXADECIMAL.match(text):
            return int(text, 16)
        return float(text) if _FLOAT.match(text) else text

    def _text(self, event: Any) -> str:
        """Return the text of a scalar; refuse halves of letters, which escapes can write."""
        text: str = event.value
        whole = _HALF_LETTER.sub("\N{REPLACEMENT CHARACTER}", text)
        if whole != text:
            self._refuse(event, "half a letter in the text", "write the letter itself")
        return whole

    def _mark(self, event: Any) -> SourceMark:
        return SourceMark(self.source, event.start_mark.line + 1, event.start_mark.column + 1)

    def _refuse(self, event: Any, cause: str, fix: str) -> None:
        self.problems.append(Problem(cause, fix, self._mark(event)))


def _discard(event: Any, events: Iterator[Any]) -> None:
    """Pass over the value that starts with `event`."""
    depth = 0
    while True:
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth == 0:
            return
        event = next(events)
