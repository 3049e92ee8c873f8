"""A resolved spec together with the places of its settings, for errors of later stages.

In a later stage, with `located` at hand:

    except ShapeError as error:
        raise error_at(located, error, "shape") from error
"""

from __future__ import annotations

from dataclasses import dataclass, field

from encoded_objects.base.document import Problem, SourceMark
from encoded_objects.base.yaml_tree import Place, Tree
from generator.errors import GeneratorError
from generator.spec.problem import SpecError
from generator.spec.resolved import ObjectSpec

INPUT_ERROR = 2  # exit code of errors that a spec can cause


@dataclass(frozen=True, slots=True)
class LocatedSpec:
    """An object to make, and where its settings stand."""

    spec: ObjectSpec
    tree: Tree = field(repr=False)
    origin: str = ""  #: name of the file that was given, without its suffix; files of a set bear it


def locate(located: LocatedSpec, path: str = "") -> str:
    """Return `file:line:column` of a setting.

    Parameters
    ----------
    located
        A spec with its places.
    path
        Names with points between them, "symbols.pitch"; several with commas between them,
        of which the first one that is written in the file counts. Where none is, the place
        is that of the nearest block around the first, at last that of the object.
    """
    return str(mark_of(located.tree, path))


def error_at(located: LocatedSpec, error: GeneratorError, path: str) -> GeneratorError:
    """Return `error` with the place of the setting that it comes from.

    Parameters
    ----------
    located
        The spec at work when the error came up.
    error
        An error of a later stage. Errors that no spec can cause (a database that does not
        open) and errors that have places already come back as they are.
    path
        As for `locate`.

    Returns
    -------
    GeneratorError
        A `SpecError` with the cause and fix of `error`; its own place (a face, say) stands
        before the cause.
    """
    if error.exit_code != INPUT_ERROR or isinstance(error, SpecError):
        return error
    cause = f"{error.place}: {error.cause}" if error.place else error.cause
    return SpecError([Problem(cause, error.fix, mark_of(located.tree, path))])


def mark_of(tree: Tree, path: str) -> SourceMark:
    """Return where a setting stands; see `locate`."""
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
    """Return the mark of a plain value, or of the key of a block."""
    value = tree.value
    for part in place:
        value = value[part]
    return tree.key_mark(place) if isinstance(value, dict | list) else tree.value_mark(place)
