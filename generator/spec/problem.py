"""What is wrong with a spec, and at which setting an error lies."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from encoded_objects.base.document import DocumentError, DocumentKind, Problem, SourceMark
from encoded_objects.base.yaml_tree import Place, Tree
from generator.errors import GeneratorError

INPUT_ERROR = 2  # exit code of errors that a spec can cause


class SpecError(DocumentError, GeneratorError):
    """A spec that cannot be used; holds every problem found, in file order."""


SPEC = DocumentKind(
    error=SpecError,
    name="a spec",
    empty="write  name: Cube  and, in the next line,  shape: {cube: 60 mm}",
    example="encode-object init cube",
    first="write a first one with: encode-object init cube -o cube.yaml",
    several="list several objects under objects:, in one document",
    repeat="write the value out; a set shares what stands beside objects:",
    large="give a large polyhedron as a file, for example shape: {file: part.stl}",
)


@contextmanager
def error_location(source: Tree, path: str) -> Iterator[None]:
    """Turn a `GeneratorError` of a stage into a `SpecError` at the setting of `path` (`mark_of`).

    Errors that no spec can cause (a database that does not open) and errors that have places
    already pass as they are. The error's own place (a face, say) stands before its cause.
    """
    try:
        yield
    except GeneratorError as error:
        if error.exit_code != INPUT_ERROR or isinstance(error, SpecError):
            raise
        cause = f"{error.place}: {error.cause}" if error.place else error.cause
        raise spec_error(source, path, cause, error.fix) from error


def spec_error(tree: Tree, path: str, cause: str, fix: str) -> SpecError:
    """Return the error of one problem, at the setting of `path` (`mark_of`)."""
    return SpecError([Problem(cause, fix, mark_of(tree, path))])


def mark_of(tree: Tree, path: str) -> SourceMark:
    """Return where a setting stands.

    `path` has points between names, "symbols.pitch"; of several paths, with commas between, the
    first that is written in the file counts. Where none is, the nearest block around the first one.
    """
    places = [_place(part.strip()) for part in path.split(",")]
    for place in places:
        if place in tree.values:
            return _value_or_key(tree, place)
    place = places[0]
    while place and place not in tree.values:
        place = place[:-1]
    return tree.key_mark(place)


def _place(path: str) -> Place:
    return tuple(int(part) if part.isdecimal() else part for part in path.split(".") if part)


def _value_or_key(tree: Tree, place: Place) -> SourceMark:
    value = tree.value
    for part in place:
        value = value[part]
    return tree.key_mark(place) if isinstance(value, dict | list) else tree.value_mark(place)
