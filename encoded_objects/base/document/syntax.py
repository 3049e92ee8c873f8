"""Errors of the YAML parser in plain words."""

from __future__ import annotations

import yaml

from encoded_objects.base.document.problem import DocumentKind, Problem, SourceMark, TextSource

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
    for pattern, cause, fix in _SYNTAX:
        if pattern in said:
            return Problem(cause, fix, mark, source.name)
    return Problem(f"not YAML: {said}", f"compare with: {kind.example}", mark, source.name)
