"""Errors of pydantic in plain words, each at its place in the file."""

from __future__ import annotations

import re
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from pydantic import BaseModel, ValidationError

from encoded_objects.base.document.problem import Problem, SourceMark, did_you_mean
from encoded_objects.base.document.tree import Place, Tree

Error = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class SettingWords:
    """What messages about settings say of one kind of file."""

    whole: str  #: as "a spec is made of settings"
    start: str  #: the first line of a right one
    see: str  #: where all settings are described
    missing: Mapping[str, str] = field(default_factory=dict)  #: setting: how it is written
    blocks: Mapping[str, str] = field(default_factory=dict)  #: block: how it is written
    #: what is wrong with an unknown name; None: as any other
    unknown: Callable[[Place, SourceMark, type[BaseModel]], Problem] | None = None


def explain_settings(
    error: ValidationError, tree: Tree, model: type[BaseModel], words: SettingWords
) -> list[Problem]:
    """Return the problems behind a validation error.

    Parameters
    ----------
    error
        What pydantic found in `tree.value`.
    tree
        The values with their places.
    model
        The model that was to be read.
    words
        Of messages about this kind of file.
    """
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
    near = did_you_mean(word, known)
    listed = f"use {'one of ' if len(known) > 1 else ''}{', '.join(known)}"
    fix = f"did you mean '{near}'?" if near else listed
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


def _problem(error: Error, tree: Tree, model: type[BaseModel], words: SettingWords) -> Problem:
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
    """Explain a setting that must be there."""
    key, block = str(place[-1]), place[:-1]
    inside = f" in '{block[-1]}'" if block else ""
    fix = "add " + words.missing.get(key, f"{key}: ...")
    if place in tree.keys:
        return Problem(
            f"'{key}'{inside} has no value", fix.replace("add ", "write ", 1), tree.key_mark(place)
        )
    return Problem(f"'{key}' is missing{inside}", fix, tree.key_mark(block))


def _wrong_value(
    error: Error, place: Place, model: type[BaseModel], words: SettingWords
) -> tuple[str, str]:
    """Return cause and fix for a value of the wrong kind."""
    key = next((part for part in reversed(place) if isinstance(part, str)), "the file")
    value, kind = error["input"], error["type"]
    if kind == "literal_error":
        known = re.findall(r"'([^']*)'", error["ctx"]["expected"])
        near = did_you_mean(value, known) if isinstance(value, str) else ""
        fix = f"did you mean '{near}'?" if near else f"choose one of {', '.join(known)}"
        single = key.removesuffix("s") if isinstance(place[-1], int) else key
        if not isinstance(value, str):
            return f"'{single}' cannot be {_value_text(value)}", fix
        return f"unknown {single} {_value_text(value)}", fix
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        known = list(model_at(model, place).model_fields)
        example = (
            words.blocks[key].removeprefix("{").removesuffix("}")
            if key in words.blocks
            else (f"{key}: {{{known[0]}: ...}}")
        )
        if not place:
            return f"{words.whole}, not {_value_text(value)}", f"start with: {words.start}"
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
        return f"'{value if len(value) <= 40 else value[:37] + '...'}'"
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
    """Yield the models that a type mentions."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in typing.get_args(annotation):
        yield from _models(part)
